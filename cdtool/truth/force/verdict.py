"""Force against its limits: pass, fail or not assessable, for a test and for the mean of several tests at one point.

Conventions: a step whose limit is exceeded fails, whatever else is missing. It passes only if the force was recorded
without interruption and never at the load cell's stop, for every possible onset; otherwise it is not assessable, with
the reason. If a contact began where samples are missing, its steps count from its first sample, the latest possible
onset. A verdict is evidence about recordings, not a certificate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted, digits_beside
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import ForceProfile, ForceStep

Outcome = Literal["pass", "fail", "not_assessable"]


CauseKind = Literal[
    "above_limit",
    "above_limit_onset_unseen",
    "no_sample",
    "ends_before",
    "ends_inside",
    "onset_missing",
    "samples_missing",
    "may_exceed",
    "onset_earlier",
    "saturated",
]
_SENTENCES: Mapping[CauseKind, str] = {
    "above_limit": "{peak} N where {limit:g} N are allowed, exceeded {after_ms:.1f} ms after the onset",
    "above_limit_onset_unseen": (
        "{peak} N where {limit:g} N are allowed, exceeded {after_ms:.1f} ms after it was first seen"
    ),
    "no_sample": "no load-cell sample while the limit holds",
    "ends_before": "the record ends {end} s after the onset, before {begin:g} s",
    "ends_inside": "the record ends {end} s after the onset, the limit holds until {until:g} s",
    "onset_missing": "load-cell samples are missing for {missing_ms:.0f} ms where the contact may have begun",
    "samples_missing": "load-cell samples are missing for {missing_ms:.0f} ms",
    "may_exceed": (
        "load-cell samples are missing for {missing_ms:.0f} ms, in which the force may have reached {most} N"
    ),
    "onset_earlier": "the onset may be up to {earlier_ms:.0f} ms earlier, and {largest} N are then too high",
    "saturated": "the load cell was at its stop, {peak} N, below the limit of {limit:g} N",
}


# Which number of a sentence is compared with which, and its least significant digits.
_BESIDE = (
    ("peak", "limit", 4),
    ("most", "limit", 4),
    ("largest", "limit", 4),
    ("end", "begin", 3),
    ("end", "until", 3),
)


@dataclass(frozen=True)
class StepCause:
    """Why a step of a profile does not pass, with the numbers of its sentence."""

    kind: CauseKind
    numbers: Mapping[str, float] = field(default_factory=dict)

    def sentence(self) -> str:
        """Return the cause in words; no number is rounded across its limit."""
        numbers: dict[str, object] = dict(self.numbers)
        for value, limit, least in _BESIDE:
            if value in self.numbers and limit in self.numbers:
                number = self.numbers[value]
                numbers[value] = f"{number:.{digits_beside(number, self.numbers[limit], least)}g}"
        return _SENTENCES[self.kind].format(**numbers)


@dataclass(frozen=True)
class StepVerdict:
    """One step of a profile and one test.

    `peak` [N] at `peak_at` [s after the onset]: the largest force while the step applies; both NaN without a sample.
    `time_budget` [s after the onset]: when the force first exceeded the limit while the step applied, between samples
    by linear interpolation; infinite if never. An alarm that meets the limit must be raised, and take effect, earlier.
    `cause`: why it does not pass, as `reason` states in words; None if it passes, or if only the words are stored.
    """

    step: ForceStep
    outcome: Outcome
    peak: float
    peak_at: float
    time_budget: float
    reason: str = ""
    cause: StepCause | None = None


class _OfSteps:
    """The outcome of a profile, derived from those of its steps."""

    steps: tuple[StepVerdict, ...] | tuple[PointStep, ...]

    @property
    def outcome(self) -> Outcome:
        """Return fail if a step fails, otherwise not assessable if one is not, otherwise pass."""
        return _worst([item.outcome for item in self.steps])

    @property
    def reason(self) -> str:
        """Return why it does not pass: the reason of the first step with that outcome."""
        return _first_reason(self.steps, self.outcome)


@dataclass(frozen=True)
class ForceVerdict(_OfSteps):
    """One test against a profile; `end`: how long the record continues after the onset [s]."""

    profile: str
    steps: tuple[StepVerdict, ...]
    end: float

    @property
    def time_budget(self) -> float:
        """Return when the first limit was exceeded [s after the onset]; infinite if none was."""
        return min(item.time_budget for item in self.steps)

    @property
    def utilisation(self) -> float:
        """Return the largest share of a limit that the force reached; above 1 the test fails."""
        return max((item.peak / item.step.at_most_n for item in self.steps if math.isfinite(item.peak)), default=0.0)


@dataclass(frozen=True)
class PointStep:
    """One step of a profile over the tests at a point.

    `force` [N] is the mean of the tests' peaks, NaN if a test has none; if the profile does not average, their highest
    peak. `above`: the number of tests that exceed the limit on their own.
    """

    step: ForceStep
    outcome: Outcome
    force: float
    above: int
    reason: str = ""


@dataclass(frozen=True)
class PointVerdict(_OfSteps):
    """The tests at one point against a profile; `note` states how many were averaged."""

    profile: str
    tests: int
    steps: tuple[PointStep, ...]
    note: str


def assess_force(curve: ForceTimeCurve, profile: ForceProfile) -> ForceVerdict:
    """Compare a force-time curve with every step of a profile.

    Parameters
    ----------
    curve : ForceTimeCurve
        Force (n,) [N] over the time after the onset (n,) [s].
    profile : ForceProfile
        The limits.

    Returns
    -------
    ForceVerdict
        One verdict per step: fail if a sample is above the limit, whatever else is missing. Otherwise not assessable if
        the record ends before or inside the step, if samples are missing in which the force may have been above the
        limit, if the contact may have begun earlier and the force is then too high, or if the load cell saturated below
        the limit. The last step is assessed up to the end of the record. No step of a profile that is not `permissible`
        passes: it fails.

    Notes
    -----
    The time budget [s after the onset] is the time at which the straight line between two samples crosses the limit.
    A verdict is evidence about a recording, not a certificate.

    Examples
    --------
    450 N in the first half second exceed the limit of 400 N at once; the 20 N after that are within all limits.

    >>> from cdtool.truth.force.limits import read_force_limits
    >>> time = np.arange(6000) * 1e-3
    >>> curve = ForceTimeCurve(time, np.where(time < 0.5, 450.0, 20.0), np.zeros(6000, dtype=bool), end=6.0)
    >>> verdict = assess_force(curve, read_force_limits()["en_12453_reducing_gap"])
    >>> [(item.step.name, item.outcome) for item in verdict.steps], verdict.utilisation, verdict.time_budget
    ([('dynamic', 'fail'), ('static', 'pass'), ('residual', 'pass')], 1.125, 0.0)
    """
    steps = tuple(_judge_step(curve, step, profile.ends(i)) for i, step in enumerate(profile.steps))
    if not profile.permissible:
        reason = "contact with this region of the body is not permissible, whatever its force"
        steps = tuple(
            replace(item, outcome="fail", time_budget=0.0, reason=reason) if item.outcome == "pass" else item
            for item in steps
        )
    return ForceVerdict(profile.name, steps, curve.end)


def averaged(verdicts: Sequence[ForceVerdict], profile: ForceProfile) -> PointVerdict:
    """Compare the mean of several tests' peaks with every step; if the profile does not average, the highest peak.

    Parameters
    ----------
    verdicts : sequence of ForceVerdict
        The tests at one point, compared with the same profile.
    profile : ForceProfile
        The profile; its `average_of` tests are averaged, and with more tests all of them.

    Returns
    -------
    PointVerdict
        Not assessable: a step with fewer tests than the profile averages, or one that does not fail and that a test
        could not assess.

    Raises
    ------
    UsageError
        A verdict is on another profile.

    Examples
    --------
    >>> from cdtool.truth.force.limits import read_force_limits
    >>> profile = read_force_limits()["en_12453_reducing_gap"]
    >>> steps = tuple(StepVerdict(step, "pass", 20.0, step.from_s, float("inf")) for step in profile.steps)
    >>> averaged([ForceVerdict(profile.name, steps, 6.0)] * 3, profile).outcome
    'pass'
    """
    for verdict in verdicts:
        if verdict.profile != profile.name:
            raise UsageError(
                f"a verdict on '{verdict.profile}' is not a test of '{profile.name}'", "use one profile for all"
            )
    steps = tuple(
        _judge_point(step, [verdict.steps[i] for verdict in verdicts], profile.average_of)
        for i, step in enumerate(profile.steps)
    )
    return PointVerdict(profile.name, len(verdicts), steps, _counted(len(verdicts), profile.average_of))


def _judge_step(curve: ForceTimeCurve, step: ForceStep, ends: float) -> StepVerdict:
    inside = np.flatnonzero((curve.time >= step.from_s) & (curve.time < ends))
    if not len(inside):
        nan = float("nan")
        return _unassessable(step, nan, nan, _unseen(curve, step, ends) or StepCause("no_sample"))
    highest = inside[int(np.argmax(curve.force[inside]))]
    peak, peak_at = float(curve.force[highest]), float(curve.time[highest])
    above = inside[curve.force[inside] > step.at_most_n]
    if len(above):
        budget = _crossing(curve, int(above[0]), step)
        kind: CauseKind = "above_limit_onset_unseen" if curve.hole else "above_limit"
        cause = StepCause(kind, {"peak": peak, "limit": step.at_most_n, "after_ms": 1e3 * budget})
        return StepVerdict(step, "fail", peak, peak_at, budget, cause.sentence(), cause)
    unknown = _unseen(curve, step, ends) or _may_exceed(curve, step, ends)
    if not unknown and curve.at_stop[inside].any():
        unknown = StepCause("saturated", {"peak": peak, "limit": step.at_most_n})
    if unknown:
        return _unassessable(step, peak, peak_at, unknown)
    return StepVerdict(step, "pass", peak, peak_at, float("inf"))


def _unassessable(step: ForceStep, peak: float, peak_at: float, cause: StepCause) -> StepVerdict:
    return StepVerdict(step, "not_assessable", peak, peak_at, float("inf"), cause.sentence(), cause)


def _unseen(curve: ForceTimeCurve, step: ForceStep, ends: float) -> StepCause | None:
    """Return which part of a step is not recorded; None if all of it is."""
    if curve.end < step.from_s:
        return StepCause("ends_before", {"end": curve.end, "begin": step.from_s})
    if math.isfinite(ends) and ends - curve.end > curve.longest_step:
        return StepCause("ends_inside", {"end": curve.end, "until": ends})
    if curve.hole and step.from_s == 0.0:
        return StepCause("onset_missing", {"missing_ms": 1e3 * curve.hole})
    begins, stops = curve.holes()
    missing = float(np.sum(np.maximum(np.minimum(stops, ends) - np.maximum(begins, step.from_s), 0.0)))
    return StepCause("samples_missing", {"missing_ms": 1e3 * missing}) if missing > 0.0 else None


def _may_exceed(curve: ForceTimeCurve, step: ForceStep, ends: float) -> StepCause | None:
    """Return how the limit may have been exceeded between two samples, or if the contact began earlier; or None."""
    most, hole = curve.could_reach(step.from_s, ends)
    if most > step.at_most_n:
        return StepCause("may_exceed", {"missing_ms": 1e3 * hole, "most": most, "limit": step.at_most_n})
    earlier = (curve.time >= step.from_s - curve.uncertainty) & (curve.time < step.from_s)
    largest = float(np.max(curve.force[earlier], initial=0.0))
    if step.from_s > 0.0 and largest > step.at_most_n:
        numbers = {"earlier_ms": 1e3 * curve.uncertainty, "largest": largest, "limit": step.at_most_n}
        return StepCause("onset_earlier", numbers)
    return None


def _crossing(curve: ForceTimeCurve, first: int, step: ForceStep) -> float:
    """Return when the straight line to the first sample above the limit crosses it [s], not before the step applies.

    If samples are missing before that sample, their beginning counts: the force may have risen at once.
    """
    time, force = float(curve.time[first]), float(curve.force[first])
    if first == 0:
        return time
    before, below = float(curve.time[first - 1]), float(curve.force[first - 1])
    if below > step.at_most_n or time - before > curve.longest_step:
        return max(before, step.from_s)
    crossed = before + (time - before) * (step.at_most_n - below) / (force - below)
    return max(crossed, step.from_s)


def _judge_point(step: ForceStep, tests: Sequence[StepVerdict], average_of: int) -> PointStep:
    peaks = [test.peak for test in tests]
    if average_of == 1:
        force = max((peak for peak in peaks if math.isfinite(peak)), default=float("nan"))
    else:
        force = sum(peaks) / len(peaks) if peaks else float("nan")
    above = sum(test.outcome == "fail" for test in tests)
    if len(tests) < average_of:
        reason = f"{len(tests)} of the {average_of} tests that are averaged" if tests else "no test"
        return PointStep(step, "not_assessable", force, above, reason)
    if force > step.at_most_n:
        word = "mean" if average_of > 1 else "highest"
        shown = f"{force:.{digits_beside(force, step.at_most_n)}g}"
        reason = f"{word} of {len(tests)} peaks {shown} N where {step.at_most_n:g} N are allowed"
        return PointStep(step, "fail", force, above, reason)
    forbidden = next((test for test in tests if test.outcome == "fail" and not test.peak > step.at_most_n), None)
    if forbidden:
        return PointStep(step, "fail", force, above, forbidden.reason)
    unassessable = next((test for test in tests if test.outcome == "not_assessable"), None)
    if unassessable:
        return PointStep(step, "not_assessable", force, above, unassessable.reason)
    return PointStep(step, "pass", force, above)


def _counted(tests: int, average_of: int) -> str:
    present = counted(tests, "test")
    if average_of == 1:
        return f"highest of {present}"
    needed = "" if tests == average_of else f" where the profile averages {average_of}"
    return f"mean of {present}{needed}"


def _worst(outcomes: Sequence[Outcome]) -> Outcome:
    order: tuple[Outcome, ...] = ("fail", "not_assessable", "pass")
    return min(outcomes, key=order.index)


def _first_reason(steps: Sequence[StepVerdict] | Sequence[PointStep], outcome: Outcome) -> str:
    if outcome == "pass":
        return ""
    return next(f"{item.step.name}: {item.reason}" for item in steps if item.outcome == outcome)
