"""Why the pressures of a measuring point do not pass: above a limit, not measured, or not known well enough."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from cdtool.commands.protocol.assessment.plan import Instrument, MeasuringPoint
from cdtool.commands.protocol.assessment.pressure import PressureAssessment, PressureRecord
from cdtool.commands.protocol.assessment.reasons import Reason, Value
from cdtool.commands.protocol.assessment.sampling import above_between_samples
from cdtool.truth.force.limits import ForceProfile
from cdtool.truth.force.verdict import StepVerdict


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
    >>> [reason.kind for reason in pressure_reasons(MeasuringPoint(name="chest"), profile, ["a.csv"], [unknown])]
    ['pressure_not_measured']
    """
    if not profile.pressures:
        return
    yield from _exceeded(point, profile, pressures)
    if point.no_pressure_reason:
        return
    missing = sum(not item.is_known for item in pressures)
    if missing:
        count, name = len(pressures), profile.name
        yield Reason.of_point("pressure_not_measured", point, missing=missing, count=count, profile=name)
    for number, (recording, item) in enumerate(zip(recordings, pressures, strict=True), 1):
        about: dict[str, Value] = {"repetition": number, "recording": recording}
        yield from _open(point, item, about)
        yield from _beyond_range(point, item, instrument, about)


def _exceeded(
    point: MeasuringPoint, profile: ForceProfile, pressures: Sequence[PressureAssessment]
) -> Iterator[Reason]:
    """Yield each limit that a pressure exceeds, with the number of repetitions and the highest pressure."""
    for number, step in enumerate(profile.steps[:2]):
        peaks = [peak for item in pressures if (peak := _above(item, number)) is not None]
        limit = pressures[0].limit
        if peaks and limit is not None:
            values = {"pressure": max(peaks), "limit": limit.quasi_static if number else limit.first}
            counts = {"above": len(peaks), "count": len(pressures)}
            yield Reason.of_point("pressure_exceeds", point, step=step.name, area=limit.area, **counts, **values)


def _above(item: PressureAssessment, number: int) -> float | None:
    """Return the pressure of a repetition that exceeds the limit of a step [N/cm2]; None if none does.

    An entered peak counts in the first step.
    """
    assert item.limit is not None, "only a limit can be exceeded"
    peaks = [item.entered] if number == 0 and item.entered and item.entered > item.limit.first else []
    if item.verdict and number < len(item.verdict.steps) and item.verdict.steps[number].outcome == "fail":
        peaks.append(item.verdict.steps[number].peak)
    return max(peaks, default=None)


def _open(point: MeasuringPoint, item: PressureAssessment, about: Mapping[str, Value]) -> Iterator[Reason]:
    """Yield what is not known of the pressure of a repetition."""
    if item.time_is_unknown and item.entered is not None and item.limit is not None:
        known = {"entered": item.entered, "limit": item.limit.quasi_static}
        yield Reason.of_point("pressure_time_unknown", point, **about, **known)
    if item.record is None or item.verdict is None:
        return
    if not item.record.rises:
        yield Reason.of_point("pressure_does_not_rise", point, **about, peak=item.record.peak)
    steps = item.verdict.steps
    for step, end in zip(steps, [*(later.step.from_s for later in steps[1:]), math.inf], strict=True):
        if step.outcome == "not_assessable" and step.cause:
            yield Reason.of_point("pressure_not_assessable", point, step.cause, **about, step=step.step.name)
        elif step.outcome == "pass":
            yield from _may_exceed(point, item.record, step, end, about)


def _may_exceed(
    point: MeasuringPoint, record: PressureRecord, step: StepVerdict, end: float, about: Mapping[str, Value]
) -> Iterator[Reason]:
    """Yield that a step passes only because of the reading at rest, or between samples: no profile states a rate."""
    values = {"peak": step.peak, "limit": step.step.at_most_n}
    # The reading at rest may be wrong, or held from before.
    error = max(record.rest, 0.0) + record.rest_error + abs(record.drift) * min(end, record.curve.end)
    if step.peak + error > step.step.at_most_n:
        yield Reason.of_point("pressure_rest_decides", point, **about, step=step.step.name, **values, error=error)
    # Beside a single high reading the pressure may have been twice as high: tissue and films are soft, and have no
    # spikes as a force has.
    most = step.peak + above_between_samples(record.curve, step, 1.0)
    if most > step.step.at_most_n:
        values |= {"rate": record.sample_rate, "most": most}
        yield Reason.of_point("pressure_between_samples", point, **about, step=step.step.name, **values)


def _beyond_range(
    point: MeasuringPoint, item: PressureAssessment, instrument: Instrument | None, about: dict[str, Value]
) -> Iterator[Reason]:
    most = instrument.range_n_per_cm2 if instrument else None
    reading = max(item.record.largest_reading if item.record else 0.0, item.entered or 0.0)
    if most and reading > most:
        yield Reason.of_point("pressure_beyond_range", point, **about, reading=reading, range=most)
