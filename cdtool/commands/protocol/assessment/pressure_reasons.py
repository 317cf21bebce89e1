"""Why the pressures of a measuring point do not pass: above a limit, not measured, or not known well enough."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cdtool.commands.protocol.assessment.plan import Instrument, MeasuringPoint
from cdtool.commands.protocol.assessment.pressure import PressureAssessment, PressureRecord
from cdtool.commands.protocol.assessment.reasons import Reason, ReasonKind, Value
from cdtool.commands.protocol.assessment.sampling import above_between_samples
from cdtool.truth.force.limits import ForceProfile

# Beside a single high reading the pressure may have been higher by so many times as much: tissue and films are soft,
# and have no spikes as a force has.
_ALONE = 1.0


def pressure_reasons(
    point: MeasuringPoint,
    profile: ForceProfile,
    recordings: Sequence[str],
    pressures: Sequence[PressureAssessment],
    instrument: Instrument | None = None,
) -> Iterator[Reason]:
    """Yield why the pressures of a point do not pass.

    Parameters
    ----------
    point : MeasuringPoint
        The point of the plan. If it states why no pressure is measured, only one above a limit remains a reason.
    profile : ForceProfile
        Its profile; without pressure limits nothing is compared.
    recordings : sequence of str
        The recording of each repetition.
    pressures : sequence of PressureAssessment
        The pressure of each repetition.
    instrument : Instrument or None
        The instrument that measured the pressure.

    Yields
    ------
    Reason
        First the limits that are exceeded. Pressures are never averaged: each repetition counts.

    Examples
    --------
    >>> from cdtool.truth.force.limits import read_force_limits
    >>> profile = read_force_limits()["iso_ts_15066_chest"]
    >>> unknown = PressureAssessment.of(profile, "", None, None)
    >>> [reason.kind.value for reason in pressure_reasons(MeasuringPoint(name="chest"), profile, ["a.csv"], [unknown])]
    ['pressure_not_measured']
    """
    if not profile.pressures:
        return
    yield from _exceeded(point, profile, pressures)
    if point.no_pressure_reason:
        return
    missing = sum(not item.is_known for item in pressures)
    if missing:
        counts: dict[str, Value] = {"missing": missing, "count": len(pressures), "profile": profile.name}
        yield _reason(ReasonKind.PRESSURE_NOT_MEASURED, point, counts)
    for number, (recording, item) in enumerate(zip(recordings, pressures, strict=True), 1):
        about: dict[str, Value] = {"repetition": number, "recording": recording}
        yield from _open(point, item, about)
        yield from _beyond_range(point, item, instrument, about)


def _reason(kind: ReasonKind, point: MeasuringPoint, values: dict[str, Value]) -> Reason:
    return Reason(kind, {"point": point.name, **values}, due="test_day")


def _exceeded(
    point: MeasuringPoint, profile: ForceProfile, pressures: Sequence[PressureAssessment]
) -> Iterator[Reason]:
    """Yield each limit that a pressure exceeds, with the number of repetitions and the highest pressure."""
    for number, step in enumerate(profile.steps[:2]):
        peaks = [peak for item in pressures if (peak := _above(item, number)) is not None]
        limit = pressures[0].limit
        if peaks and limit is not None:
            yield _reason(
                ReasonKind.PRESSURE_EXCEEDS,
                point,
                {
                    "step": step.name,
                    "above": len(peaks),
                    "count": len(pressures),
                    "pressure": max(peaks),
                    "limit": limit.quasi_static if number else limit.first,
                    "area": limit.area,
                },
            )


def _above(item: PressureAssessment, number: int) -> float | None:
    """Return the pressure of a repetition that exceeds the limit of a step [N/cm2]; None if none does.

    An entered peak counts in the first step.
    """
    assert item.limit is not None, "only a limit can be exceeded"
    peaks = [item.entered] if number == 0 and item.entered and item.entered > item.limit.first else []
    if item.verdict and number < len(item.verdict.steps) and item.verdict.steps[number].outcome == "fail":
        peaks.append(item.verdict.steps[number].peak)
    return max(peaks, default=None)


def _open(point: MeasuringPoint, item: PressureAssessment, about: dict[str, Value]) -> Iterator[Reason]:
    """Yield what is not known of the pressure of a repetition."""
    if item.time_is_unknown and item.entered is not None and item.limit is not None:
        known: dict[str, Value] = {"entered": item.entered, "limit": item.limit.quasi_static}
        yield _reason(ReasonKind.PRESSURE_TIME_UNKNOWN, point, {**about, **known})
    if item.record is None or item.verdict is None:
        return
    if not item.record.rises:
        yield _reason(ReasonKind.PRESSURE_DOES_NOT_RISE, point, {**about, "peak": item.record.peak})
    for step in item.verdict.steps:
        if step.outcome == "not_assessable" and step.cause:
            reason = _reason(ReasonKind.PRESSURE_NOT_ASSESSABLE, point, {**about, "step": step.step.name})
            yield Reason(reason.kind, reason.values, step.cause, reason.due)
    yield from _rest_decides(point, item, item.record, about)
    yield from _between_samples(point, item, item.record, about)


def _rest_decides(
    point: MeasuringPoint, item: PressureAssessment, record: PressureRecord, about: dict[str, Value]
) -> Iterator[Reason]:
    """Yield the steps that pass only because of the reading at rest, which may be wrong or held from before."""
    assert item.verdict is not None
    steps = item.verdict.steps
    for number, step in enumerate(steps):
        until = min(steps[number + 1].step.from_s if number + 1 < len(steps) else record.curve.end, record.curve.end)
        may_be_more = max(record.rest, 0.0) + record.rest_error + abs(record.drift) * until
        if step.outcome == "pass" and step.peak + may_be_more > step.step.at_most_n:
            values: dict[str, Value] = {"peak": step.peak, "limit": step.step.at_most_n, "error": may_be_more}
            yield _reason(ReasonKind.PRESSURE_REST_DECIDES, point, {**about, "step": step.step.name, **values})


def _between_samples(
    point: MeasuringPoint, item: PressureAssessment, record: PressureRecord, about: dict[str, Value]
) -> Iterator[Reason]:
    """Yield the steps whose limit the pressure may have exceeded between two samples: no profile states a rate."""
    assert item.verdict is not None
    for step in item.verdict.steps:
        most = step.peak + above_between_samples(record.curve, step, _ALONE)
        limit = step.step.at_most_n
        if step.outcome == "pass" and most > limit:
            values: dict[str, Value] = {"peak": step.peak, "limit": limit, "rate": record.sample_rate, "most": most}
            yield _reason(ReasonKind.PRESSURE_BETWEEN_SAMPLES, point, {**about, "step": step.step.name, **values})


def _beyond_range(
    point: MeasuringPoint, item: PressureAssessment, instrument: Instrument | None, about: dict[str, Value]
) -> Iterator[Reason]:
    most = instrument.range_n_per_cm2 if instrument else None
    reading = max(item.record.largest_reading if item.record else 0.0, item.entered or 0.0)
    if most and reading > most:
        yield _reason(ReasonKind.PRESSURE_BEYOND_RANGE, point, {**about, "reading": reading, "range": most})
