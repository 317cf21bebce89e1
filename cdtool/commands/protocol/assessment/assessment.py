"""From measured contacts to the verdict of a test protocol.

Conventions: the repetitions of a point are its recordings' contacts, in the order in which they are given. Pure
functions: nothing is read here.

Why a repetition was not run as planned: its speed before the contact differs, or is missing in a logged channel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice
from typing import Literal

from cdtool.commands.protocol.assessment.plan import Instrument, MeasuringPoint, TestPlan, empty_entries
from cdtool.commands.protocol.assessment.pressure import PressureAssessment, PressureRecord
from cdtool.commands.protocol.assessment.pressure_reasons import pressure_reasons
from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict, Reason, Value
from cdtool.commands.protocol.assessment.same_measurement import hold_same_measurement
from cdtool.commands.protocol.assessment.sampling import above_between_samples, equal_readings_at_peak, sample_rate
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import ForceProfile
from cdtool.truth.force.quantities import dynamic_time
from cdtool.truth.force.verdict import ForceVerdict, PointStep, PointVerdict, StepVerdict, assess_force, averaged


def speed_reasons(point: MeasuringPoint, speeds: Sequence[tuple[str, float | None]]) -> Iterator[Reason]:
    """Yield the repetitions whose speed is not the planned one.

    Parameters
    ----------
    point : MeasuringPoint
        The point of the plan, with its speed [m/s] and tolerance; without a planned speed nothing is compared.
    speeds : sequence of (str, float or None)
        The recording of each repetition and the speed just before the contact [m/s]; NaN: its samples are missing,
        None: it was not measured, which the plan does not require.

    Yields
    ------
    Reason
        With the point, the repetition, and both speeds.

    Examples
    --------
    >>> point = MeasuringPoint(name="edge", speed_m_per_s=0.2)
    >>> speeds = [("1.csv", 0.21), ("2.csv", 0.1), ("3.csv", None)]
    >>> [reason.values["measured"] for reason in speed_reasons(point, speeds)]
    [0.1]
    """
    planned = point.speed_m_per_s
    if not planned:
        return
    for number, (recording, speed) in enumerate(speeds, 1):
        if speed is None:
            continue
        about: dict[str, Value] = {"repetition": number, "recording": recording, "planned": planned}
        if math.isnan(speed):
            yield Reason.of_point("speed_missing", point, **about)
        elif abs(speed - planned) > point.speed_tolerance * planned * (1.0 + 1e-9):
            tolerance = 100.0 * point.speed_tolerance
            yield Reason.of_point("speed_differs", point, **about, measured=speed, tolerance=tolerance)


# So much of its last step is required [s] if a profile states no length of the record.
LAST_STEP_S = 0.5


@dataclass(frozen=True)
class Repetition:
    """One measured contact at a point.

    `rest` [N]: the load cell's reading before the contact, which is subtracted; `drift` [N/s]: its drift, 0 unless
    beyond doubt; `rest_error` [N]: how far the rest may be wrong because the record begins shortly before the contact.
    `losses`: what the reader of the recording could not keep, in words. `latencies_ms`: of each detector, None for a
    contact that it missed or could not assess, and how fine it is. `pressure`: the recorded one, if any; `speed` [m/s]:
    just before the contact, NaN if the samples there are missing, None if no speed was logged.
    """

    recording: str
    sha256: str
    contact: int
    curve: ForceTimeCurve
    verdict: ForceVerdict
    rest: float
    drift: float = 0.0
    dynamic_time: float = math.nan
    latencies_ms: Mapping[str, tuple[float | None, float | None]] = field(default_factory=dict)
    rest_error: float = 0.0
    losses: tuple[str, ...] = ()
    pressure: PressureRecord | None = None
    speed: float | None = None

    @classmethod
    def of(
        cls,
        recording: tuple[str, str],
        contact: int,
        curve: ForceTimeCurve,
        profile: ForceProfile,
        rest: tuple[float, float] = (0.0, 0.0),
    ) -> Repetition:
        """Return a contact of a `recording` (name and SHA-256) with its quantities; `rest` is its level and drift."""
        verdict = assess_force(curve, profile)
        return cls(*recording, contact, curve, verdict, *rest, dynamic_time(curve, profile))

    @property
    def sample_rate(self) -> float:
        """Return the load cell's measured sample rate [Hz]; NaN below two samples."""
        return sample_rate(self.curve)

    @property
    def largest_reading(self) -> float:
        """Return the largest magnitude that the load cell had to show [N]: the peak and the level at rest."""
        return self.curve.peak + abs(self.rest)


@dataclass(frozen=True)
class Unmeasured:
    """A recording or contact of a point that does not count as a repetition, and why; `message`: that of an error."""

    recording: str
    kind: Literal["unreadable", "no_force", "in_progress"]
    message: str = ""


@dataclass(frozen=True)
class PointAssessment:
    """A measuring point with its repetitions; `verdict` is None without a profile. `pressures`: one per repetition."""

    point: MeasuringPoint
    profile: ForceProfile | None
    repetitions: tuple[Repetition, ...]
    verdict: PointVerdict | None
    reasons: tuple[Reason, ...]
    pressures: tuple[PressureAssessment, ...] = ()

    @property
    def outcome(self) -> str:
        """Return pass, fail or incomplete."""
        return ProtocolVerdict(self.reasons).outcome


def required_record(profile: ForceProfile) -> float:
    """Return how long a record must continue after the contact [s]: as the profile states, or into its last step.

    Parameters
    ----------
    profile : ForceProfile
        The profile; most state no length of the record.

    Returns
    -------
    float
        The stated length, or else 0.5 s more than the beginning of the last step.

    Examples
    --------
    >>> from cdtool.truth.force.limits import read_force_limits
    >>> profiles = read_force_limits()
    >>> required_record(profiles["en_12453_reducing_gap"]), required_record(profiles["iso_ts_15066_chest"])
    (5.0, 1.0)
    """
    return profile.record_at_least_s or profile.steps[-1].from_s + LAST_STEP_S


def assess_point(
    point: MeasuringPoint,
    profile: ForceProfile | None,
    repetitions: Sequence[Repetition],
    unmeasured: Sequence[Unmeasured] = (),
    instrument: Instrument | None = None,
    pressure_instrument: Instrument | None = None,
    contacts: int = 0,
) -> PointAssessment:
    """Assess the repetitions at a measuring point.

    Parameters
    ----------
    point : MeasuringPoint
        The point of the plan.
    profile : ForceProfile or None
        Its force limits; None: it cannot be assessed.
    repetitions : sequence of Repetition
        The contacts, all compared with this profile.
    unmeasured : sequence of Unmeasured
        Recordings of the point that do not count.
    instrument : Instrument or None
        The instrument that measured the force.
    pressure_instrument : Instrument or None
        The instrument that measured the pressure.
    contacts : int
        Without a profile, the number of contacts in the recordings of the point.

    Returns
    -------
    PointAssessment
        With every reason for which it does not pass; it passes without any.

    Examples
    --------
    A point of which nothing was measured is incomplete.

    >>> from cdtool.truth.force.limits import read_force_limits
    >>> profile = read_force_limits()["en_12453_reducing_gap"]
    >>> point = MeasuringPoint(name="edge", repetitions=3, obstacle_stiffness_n_per_mm=500.0)
    >>> found = assess_point(point, profile, [])
    >>> found.outcome, [reason.kind for reason in found.reasons]
    ('incomplete', ['not_measured'])
    """
    verdict = averaged([item.verdict for item in repetitions], profile) if profile else None
    reasons = [
        *_of_plan(point, profile, len(repetitions) if profile else contacts, has_others=bool(unmeasured)),
        *(Reason.of_point(item.kind, point, recording=item.recording, message=item.message) for item in unmeasured),
        *_repeated(point, repetitions),
    ]
    if profile and verdict and repetitions:
        reasons += _exceeded(point, verdict, profile)
        for number, item in enumerate(repetitions, 1):
            reasons += _of_repetition(point, number, item, profile, verdict)
            reasons += _of_instrument(point, number, item, instrument) if instrument else []
        reasons += _of_resolution(point, repetitions, verdict, profile)
        reasons += _lost(point, repetitions)
        reasons += speed_reasons(point, [(item.recording, item.speed) for item in repetitions])
    pressures = _pressures(point, profile, repetitions) if profile else ()
    if profile and pressures:
        names = [item.recording for item in repetitions]
        reasons += pressure_reasons(point, profile, names, pressures, pressure_instrument)
    return PointAssessment(point, profile, tuple(repetitions), verdict, tuple(reasons), pressures)


def _pressures(
    point: MeasuringPoint, profile: ForceProfile, repetitions: Sequence[Repetition]
) -> tuple[PressureAssessment, ...]:
    entered: list[float | None] = [*point.peak_pressures_n_per_cm2]
    entered += [None] * (len(repetitions) - len(entered))
    return tuple(
        PressureAssessment.of(profile, point.body_area, item.pressure, value)
        for item, value in zip(repetitions, entered, strict=False)
    )


def check_point(
    point: MeasuringPoint, profile: ForceProfile | None, recordings: int, *, logs_pressure: bool = True
) -> PointAssessment:
    """Check the plan of a point against its profile, before its recordings are read.

    Parameters
    ----------
    point : MeasuringPoint
        The point of the plan.
    profile : ForceProfile or None
        Its force limits, if it has any.
    recordings : int
        The number of its recordings.
    logs_pressure : bool, optional
        The recordings may contain a pressure: the machine file maps one, or is not known.

    Returns
    -------
    PointAssessment
        Without repetitions; with every reason that is known already.

    Examples
    --------
    >>> found = check_point(MeasuringPoint(name="edge", repetitions=3), None, recordings=3)
    >>> [reason.kind for reason in found.reasons]
    ['no_profile']
    """
    reasons, needed = [*_of_plan(point, profile, recordings)], _needed(point, profile)
    if profile and profile.pressures and not (logs_pressure or point.no_pressure_reason):
        missing = needed - sum(value > 0.0 for value in point.peak_pressures_n_per_cm2)
        if missing > 0:
            kind = "pressure_not_measured"
            reasons.append(Reason.of_point(kind, point, missing=missing, count=needed, profile=profile.name))
    return PointAssessment(point, profile, (), None, tuple(reasons))


def judge(plan: TestPlan, points: Sequence[PointAssessment], file: str, more: Sequence[Reason] = ()) -> ProtocolVerdict:
    """Return the verdict of a whole protocol.

    Parameters
    ----------
    plan : TestPlan
        The plan.
    points : sequence of PointAssessment
        Its assessed points.
    file : str
        Name of the file with the plan, for the reasons.
    more : sequence of Reason
        Other reasons, for example a benchmark file that cannot be read.

    Returns
    -------
    ProtocolVerdict
        Fail if a point fails; otherwise incomplete if anything is missing; otherwise pass. All reasons are listed.

    Examples
    --------
    >>> judge(TestPlan(), [], "protocol.toml").outcome
    'incomplete'
    """
    reasons = [
        *chain.from_iterable(point.reasons for point in points),
        *_at_two_points(points),
        *more,
        *_of_instruments(plan, [point.profile for point in points if point.profile]),
        *_of_pressure_instrument(plan, points),
        *([] if plan.points else [Reason("no_point", {"file": file})]),
        *(Reason("no_value", {"key": item.key, "file": file}, due=item.due) for item in empty_entries(plan)),
    ]
    return ProtocolVerdict(tuple(sorted(reasons, key=lambda reason: reason.outcome != "fail")))


def _needed(point: MeasuringPoint, profile: ForceProfile | None) -> int:
    """Return how many repetitions a point needs: as planned, and at least as many as the profile averages."""
    return max(point.repetitions, profile.average_of if profile else 1)


def _of_plan(
    point: MeasuringPoint, profile: ForceProfile | None, present: int, *, has_others: bool = False
) -> Iterator[Reason]:
    """Yield how a point contradicts its profile, and what is wrong with the number of its contacts."""
    yield from _of_profile(point, profile) if profile else [Reason.of_point("no_profile", point)]
    if present < (needed := _needed(point, profile)):
        # With recordings that do not count, these are the reason; the count is stated in any case.
        kind = "too_few_repetitions" if present or has_others else "not_measured"
        yield Reason.of_point(kind, point, present=present, needed=needed)
    if point.peak_pressures_n_per_cm2 and len(point.peak_pressures_n_per_cm2) != present:
        stated = len(point.peak_pressures_n_per_cm2)
        yield Reason.of_point("pressures_missing", point, present=stated, needed=present)
    # A touch between the tests lowers the mean.
    if profile and profile.average_of > 1 and 0 < point.repetitions < present:
        yield Reason.of_point("too_many_repetitions", point, present=present, planned=point.repetitions)


def _of_profile(point: MeasuringPoint, profile: ForceProfile) -> Iterator[Reason]:
    """Yield how the plan of a point contradicts its profile, or that nothing may touch this region of the body."""
    if not profile.permissible:
        yield Reason.of_point("not_permissible", point, profile=profile.name)
    if 0 < point.repetitions < profile.average_of:
        planned, needed = point.repetitions, profile.average_of
        yield Reason.of_point("too_few_planned", point, planned=planned, needed=needed, profile=profile.name)
    stiffness, required = point.obstacle_stiffness_n_per_mm, profile.obstacle_stiffness_n_per_mm
    if stiffness and required and abs(stiffness - required) > 0.02 * required:  # another spring, not its tolerance
        yield Reason.of_point("wrong_stiffness", point, stiffness=stiffness, needed=required, profile=profile.name)


def _repeated(point: MeasuringPoint, repetitions: Sequence[Repetition]) -> Iterator[Reason]:
    """Yield each contact that is counted twice: it is one measurement."""
    for number, item in enumerate(repetitions):
        yield from islice(_copies(point, item, repetitions[:number]), 1)


def _at_two_points(points: Sequence[PointAssessment]) -> Iterator[Reason]:
    """Yield each contact that is counted at a second point, too: it was measured at one."""
    for number, item in enumerate(points):
        earlier = [one for other in points[:number] for one in other.repetitions]
        for one in item.repetitions:
            yield from islice(_copies(item.point, one, earlier), 1)


def _copies(point: MeasuringPoint, item: Repetition, earlier: Sequence[Repetition]) -> Iterator[Reason]:
    """Yield which earlier repetitions hold the same measurement: identical files first, then equal curves."""
    for other in earlier:
        if (other.sha256, other.contact) == (item.sha256, item.contact) and other.recording != item.recording:
            yield Reason.of_point("same_recording", point, recording=item.recording, other=other.recording)
    for other in earlier:
        if hold_same_measurement(other.curve, item.curve):
            of = {"contact": item.contact, "other_contact": other.contact}
            yield Reason.of_point("same_measurement", point, recording=item.recording, other=other.recording, **of)


def _exceeded(point: MeasuringPoint, verdict: PointVerdict, profile: ForceProfile) -> Iterator[Reason]:
    for step in verdict.steps:
        if step.outcome == "fail" and step.force > step.step.at_most_n:
            yield Reason.of_point("point_exceeds", point, **_compared(step, verdict, profile))


def _of_resolution(
    point: MeasuringPoint, repetitions: Sequence[Repetition], verdict: PointVerdict, profile: ForceProfile
) -> Iterator[Reason]:
    """Yield the steps that pass only if no reading of a coarse cell was rounded down."""
    cell = max(item.curve.resolution for item in repetitions)
    for step in verdict.steps:
        limit = step.step.at_most_n
        # Below 0.5 % of a limit, the resolution of the cell is none that matters.
        if step.outcome == "pass" and cell > 0.005 * limit and step.force + 0.5 * cell > limit:
            yield Reason.of_point("resolution_decides", point, **_compared(step, verdict, profile), cell=cell)


def _compared(step: PointStep, verdict: PointVerdict, profile: ForceProfile) -> dict[str, Value]:
    """Return which force of a point is compared with which limit."""
    return {
        "step": step.step.name,
        "force": step.force,
        "limit": step.step.at_most_n,
        "count": verdict.tests,
        "averaged": "mean" if profile.average_of > 1 else "highest",
    }


def _about(number: int, item: Repetition) -> dict[str, Value]:
    return {"repetition": number, "recording": item.recording}


def _of_repetition(
    point: MeasuringPoint, number: int, item: Repetition, profile: ForceProfile, verdict: PointVerdict
) -> Iterator[Reason]:
    """Yield what is wrong with the data of a repetition."""
    about = _about(number, item)
    rate, least = item.sample_rate, profile.sample_rate_at_least_hz
    # Sample rates are alike within 2 %: a clock is not exact, and stamps jitter.
    if rate < 0.98 * least:
        yield Reason.of_point("rate_too_low", point, **about, rate=rate, needed=least, profile=profile.name)
    end, needed = item.curve.end, required_record(profile)
    is_short = end < needed
    if is_short:
        kind = "record_too_short" if profile.record_at_least_s else "last_step_too_short"
        yield Reason.of_point(kind, point, **about, end=end, needed=needed, profile=profile.name)
    for step in item.verdict.steps:
        if step.outcome == "not_assessable" and step.cause:
            if is_short and step.cause.kind in ("ends_before", "ends_inside"):
                continue
            yield Reason.of_point("not_assessable", point, step.cause, **about, step=step.step.name)
    if item.curve.saturated and not any(_is_saturated(step.cause) for step in item.verdict.steps):
        yield Reason.of_point("saturated", point, **about, peak=item.curve.peak)
    yield from _of_steps(point, item, profile, verdict, about)


def _lost(point: MeasuringPoint, repetitions: Sequence[Repetition]) -> Iterator[Reason]:
    """Yield each loss of a recording once: what was dropped may hold a force, or a whole contact."""
    for recording, losses in {item.recording: item.losses for item in repetitions}.items():
        for loss in losses:
            yield Reason.of_point("data_lost", point, recording=recording, message=loss)


def _is_saturated(cause: object) -> bool:
    return getattr(cause, "kind", "") == "saturated"


def _of_steps(
    point: MeasuringPoint,
    item: Repetition,
    profile: ForceProfile,
    verdict: PointVerdict,
    about: Mapping[str, Value],
) -> Iterator[Reason]:
    """Yield the steps that pass only if nothing was between samples, and the level at rest is exact and stays."""
    for number, step in enumerate(item.verdict.steps):
        moved = abs(item.drift) * min(profile.ends(number), item.curve.end)
        values = {**about, "step": step.step.name, "peak": step.peak, "limit": step.step.at_most_n}
        of_all = verdict.steps[number]
        if _decides(item.rest_error, step, of_all, verdict.tests):
            yield Reason.of_point("rest_decides", point, **values, error=item.rest_error)
        if _decides(moved, step, of_all, verdict.tests):
            yield Reason.of_point("drift_decides", point, **values, drift=item.drift)
        if not profile.sample_rate_at_least_hz and step.outcome != "not_assessable":
            # Beside a single high reading of the force, a spike may be ten times as high.
            between = above_between_samples(item.curve, step, 10.0)
            if _decides(between, step, of_all, verdict.tests):
                most, rate = step.peak + between, item.sample_rate
                kind = "peak_between_samples"
                yield Reason.of_point(kind, point, **values, rate=rate, most=most, profile=profile.name)


def _decides(error: float, step: StepVerdict, of_all: PointStep, tests: int) -> bool:
    """Return whether a limit is met only without an error of the force [N]: by a repetition, or by the mean."""
    if step.outcome == "pass":
        return step.peak + error > step.step.at_most_n
    return step.outcome == "fail" and of_all.outcome == "pass" and of_all.force + error / tests > step.step.at_most_n


def _of_instrument(point: MeasuringPoint, number: int, item: Repetition, instrument: Instrument) -> Iterator[Reason]:
    about, reading = _about(number, item), item.largest_reading
    if instrument.range_n and reading >= instrument.range_n:
        yield Reason.of_point("beyond_range", point, **about, reading=reading, range=instrument.range_n)
    # Equal readings near the end of the range may be those of an amplifier at its stop.
    elif instrument.range_n and reading >= 0.95 * instrument.range_n:
        equal = equal_readings_at_peak(item.curve)
        if equal > 1 and not item.curve.saturated:
            values = {"reading": reading, "range": instrument.range_n, "equal": equal}
            yield Reason.of_point("near_range", point, **about, **values)
    stated, rate = instrument.sample_rate_hz, item.sample_rate
    if stated and math.isfinite(rate) and abs(rate - stated) > 0.1 * stated:  # that of another instrument
        yield Reason.of_point("rate_differs", point, **about, rate=rate, stated=stated)


def _of_instruments(plan: TestPlan, profiles: Sequence[ForceProfile]) -> Iterator[Reason]:
    """Yield what is wrong with the instruments: calibrations on the test day, and the stated sample rate."""
    if plan.force_instrument is None:
        yield Reason("no_force_instrument")
    day = plan.test.date
    for item in plan.instruments:
        name = " ".join(filter(None, (item.model or item.quantity, item.serial_number)))
        if day and item.calibration_valid_until and item.calibration_valid_until < day:
            values: dict[str, Value] = {"instrument": name, "valid_until": item.calibration_valid_until, "day": day}
            yield Reason("calibration_expired", values)
        if day and item.calibrated_on and item.calibrated_on > day:
            yield Reason("calibrated_later", {"instrument": name, "calibrated": item.calibrated_on, "day": day})
    force = plan.force_instrument
    least = max((profile.sample_rate_at_least_hz for profile in profiles), default=0.0)
    if force and force.sample_rate_hz and force.sample_rate_hz < least:
        yield Reason("stated_rate_too_low", {"rate": force.sample_rate_hz, "needed": least})


def _of_pressure_instrument(plan: TestPlan, points: Sequence[PointAssessment]) -> Iterator[Reason]:
    """Yield that no instrument is named for the pressures that are compared with a limit."""
    is_needed = any(p.profile and p.profile.pressures and not p.point.no_pressure_reason for p in points)
    if plan.pressure_instrument is None and (is_needed or any(item.is_judged for p in points for item in p.pressures)):
        yield Reason("no_pressure_instrument")
