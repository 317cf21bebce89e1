"""Are there enough runs? Each is assessed with the signature of all the others; together they predict the next one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge_alone
from cdtool.base.errors import SignatureError, UsageError
from cdtool.base.plain_text import counted, digits
from cdtool.commands.signature.drift import Axis
from cdtool.detectors.detection import Signal
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.speed_course import COVERAGE
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Recording
from cdtool.results.curves.sweep import critical_factor
from cdtool.statistics.prediction import LEAST_VALUES, Prediction, prediction_of
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature import Signature


@dataclass(frozen=True)
class LeftOutRun:
    """One run, assessed with the signature of all the others: the factor below which it alarms, and whether it does."""

    name: str
    critical_factor: float
    alarm: bool


@dataclass(frozen=True)
class SignatureCoverage:
    """What the runs of one class of motion show about the signature that is learned from them.

    `chance`: predicted, that the next impact-free operation alarms; `target`: the required one. `runs_needed`: the
    total number of runs with which it would be met, None if no number would do; `factor_needed`: the safety factor that
    meets it with these runs. The last three are NaN (None) if fewer than 3 runs were assessable. `gaps`: parts of the
    stroke without a limit.
    """

    motion: MotionClass
    safety_factor: float
    target: float
    runs: tuple[LeftOutRun, ...]
    not_assessable: tuple[str, ...]
    chance: float
    runs_needed: int | None
    factor_needed: float
    gaps: tuple[NoLimit, ...]

    @property
    def alarms(self) -> int:
        """The number of runs that alarm with the signature of all the others."""
        return sum(run.alarm for run in self.runs)

    @property
    def enough(self) -> bool:
        """Whether the target is met with the present runs."""
        return self.chance <= self.target

    @property
    def more_runs(self) -> int | None:
        """The number of further runs that meet the target: 0 if these do, None if no number would."""
        if self.enough:
            return 0
        return None if self.runs_needed is None else max(self.runs_needed - len(self.runs), 1)

    @property
    def verdict(self) -> str:
        """The answer in a line."""
        if math.isnan(self.chance):
            return f"{counted(len(self.runs), 'assessable run')}: too few to predict from; {LEAST_VALUES} are required"
        allowed = f"at most {_chance(self.target)} is allowed"
        expected = f"the chance of a false alarm in the next operation is {_chance(self.chance)}; {allowed}"
        if self.enough:
            return f"enough runs: {expected}"
        raised = f"raise the safety factor to {_raised(self.factor_needed)}"
        if self.more_runs is None:
            more = "more runs like these would not suffice"
            return f"{more}: {expected}; {raised}, or add runs and check again"
        return f"needs {counted(self.more_runs, 'more run')}, or {raised}: {expected}"


def check_coverage(
    pairs: Sequence[tuple[Operation, Signal]], rule: Signature, activation: Activation, target: float = 1e-3
) -> SignatureCoverage:
    """Assess each impact-free run of a class of motion with the signature of all the others, and predict the next run.

    Parameters
    ----------
    pairs : sequence of (Operation, Signal)
        Impact-free runs of one class, with the detector's signals.
    rule : Signature
        How the signature is learned; `rule.sides` must be given.
    activation : Activation
        What raises an alarm.
    target : float
        The chance of a false alarm per operation that the runs have to show.

    Returns
    -------
    SignatureCoverage
        The alarms, the predicted chance, and what would meet the target.

    Raises
    ------
    SignatureError
        The runs are too few or differ.
    UsageError
        The target is not a probability.

    Notes
    -----
    The critical factors of the n runs, each a run's maximum in spreads, are treated as a sample; the chance that the
    next one is above the safety factor is predicted with the uncertainty of so small a sample (see `Prediction`). A
    signature of n - 1 runs is less certain than one of all n: its critical factors are up to 3 % larger at 14 runs.
    That is not corrected, so that the predicted chance is too large rather than too small. "Needs more runs" assumes
    that the critical factors stay as they are and only become better known. Measured on simulated runs by
    `benchmarks/signature_coverage.py` at commit def748d0; runs of one day do not represent other days.

    Examples
    --------
    `cdtool.check_signature` returns it for each class.
    """
    if not 0.0 < target < 1.0:
        raise UsageError(f"target is {target:g}", "give a probability between 0 and 1, such as 0.001")
    if len(pairs) < LEAST_VALUES:
        raise SignatureError(
            f"{counted(len(pairs), 'run')} to check against the others", f"at least {LEAST_VALUES} are required"
        )
    bare = [(operation.recording.without_ground_truth(), signal) for operation, signal in pairs]
    fitted = rule.fit(bare)
    left_out: list[LeftOutRun] = []
    refused: list[str] = []
    for (operation, signal), (recording, _) in zip(pairs, bare, strict=True):
        detection = judge_alone(operation, "", signal, (fitted.without_run(recording, signal),), activation)
        critical = critical_factor(detection, activation)
        if math.isfinite(critical):
            left_out.append(LeftOutRun(operation.name, critical, detection.verdict.outcome == "alarm"))
        else:
            refused.append(operation.name)
    prediction = _prediction(left_out)
    return SignatureCoverage(
        motion=fitted.motion.without_course,
        safety_factor=fitted.safety_factor,
        target=target,
        runs=tuple(left_out),
        not_assessable=tuple(refused),
        chance=prediction.chance_above(fitted.safety_factor) if prediction else math.nan,
        runs_needed=prediction.runs_for(fitted.safety_factor, target) if prediction else None,
        factor_needed=prediction.limit_for(target) if prediction else math.nan,
        gaps=gaps_of(fitted, _changeover(fitted, bare)),
    )


def _prediction(runs: Sequence[LeftOutRun]) -> Prediction | None:
    return prediction_of([run.critical_factor for run in runs]) if len(runs) >= LEAST_VALUES else None


def _chance(share: float) -> str:
    """Return a chance as one in a number."""
    if share >= 0.1:
        return f"{100.0 * share:.0f} %"
    if share < 1e-6:
        return "less than 1 in a million"
    return f"1 in {digits(float(f'{1.0 / share:.2g}'))}"


def _raised(factor: float) -> str:
    """Round up to a tenth: rounded down it would not meet the target."""
    return f"at least {np.ceil(10.0 * factor - 1e-9) / 10.0:.1f}"


@dataclass(frozen=True)
class NoLimit:
    """A part of the stroke without a limit for a joint, from `start` to `end` in m or rad (`unit`) of travel, or s.

    `share`: no location in it was reached with a valid signal by more of the runs; 80 % are needed.
    """

    joint: str
    axis: Axis
    start: float
    end: float
    share: float
    unit: str = ""

    @property
    def described(self) -> str:
        """The location and the reason."""
        at = self.start == self.end
        where = f"at {self.start:.3f}" if at else f"from {self.start:.3f} to {self.end:.3f}"
        unit = f" {self.unit}" if self.unit else ""
        place = f"{where}{unit} of travel" if self.axis == "travel" else f"{where} s after the motion began"
        return (
            f"{place}: valid in at most {100.0 * self.share:.0f} % of the runs; {100.0 * COVERAGE:.0f} % are required"
        )


def _changeover(signature: FittedSignature, runs: Sequence[tuple[Recording, Signal]]) -> tuple[float, float]:
    """Return the latest time and the nearest travel at which travel counts instead of time; all of both if one does."""
    changes = []
    for recording, signal in runs if signature.alignment == "time_then_position" else ():
        at = signature.progress(recording, signal.time)
        changes += [(at.elapsed[k], at.travel[k]) for k in np.flatnonzero(at.running)[:1]]
    return (
        (float(max(time for time, _ in changes)), float(min(way for _, way in changes))) if changes else (np.inf, 0.0)
    )


def gaps_of(signature: FittedSignature, change: tuple[float, float] = (np.inf, 0.0)) -> tuple[NoLimit, ...]:
    """Return the parts without a limit, joint by joint, up to a time and from a travel on."""
    found: list[NoLimit] = []
    for joint in range(len(signature.joints)):
        if signature.alignment != "position":
            found += _gaps(signature, "time", joint, (0.0, change[0]))
        if signature.alignment != "time":
            found += _gaps(signature, "travel", joint, (change[1], np.inf))
    return tuple(found)


def _gaps(signature: FittedSignature, axis: Axis, joint: int, span: tuple[float, float]) -> list[NoLimit]:
    curve = signature.by_time if axis == "time" else signature.by_travel
    count, grid = curve.count[:, joint], curve.grid
    lacking = (count < curve.enough) & (grid >= span[0]) & (grid <= span[1])
    edges = np.flatnonzero(np.diff(np.concatenate(([False], lacking, [False]))))
    most = max(float(curve.count.max(initial=0.0)), 1.0)
    unit = signature.motion.unit.removesuffix("/s") if axis == "travel" else "s"
    return [
        NoLimit(signature.joints[joint], axis, float(grid[a]), float(grid[b - 1]), float(count[a:b].max()) / most, unit)
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    ]
