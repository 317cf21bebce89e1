"""Compare a season of runs with one signature: does the machine drift from it, over the whole stroke or locally?

Conventions: deviations are in spreads of the signature, place by place, pooled over its window, since a single sample
is noise. With one watched side they are positive towards its limit; with two they have the signal's sign.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge_alone
from cdtool.base.arrays import FloatArray
from cdtool.base.errors import SignatureError
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.results.curves.sweep import critical_factor
from cdtool.statistics.trends import ChangeOverRuns, change_over_runs, may_change
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature_curve import Curve

Axis = Literal["travel", "time"]
# A place counts where this share of its window holds valid samples.
_VALID_SHARE = 0.5
# A location has a change of its own if it exceeds this share of the change of the whole stroke: a smaller one may be
# the shape of the friction along the track, which grows with the friction.
_OWN_SHARE = 0.25


@dataclass(frozen=True)
class AuditedRun:
    """One run and one joint: see `Deviations` for what is in spreads, and its signs.

    `overall`: shift of the whole stroke. `local`: the largest one beyond it, at the place `local_at`; NaN where none is
    valid. `critical_factor`: the safety factor at which this joint would alarm; `margin_used` is its share of the one
    in use, 1 at an alarm. `alarm`: whether this joint does.
    """

    name: str
    overall: float
    local: float
    local_at: float
    critical_factor: float
    margin_used: float
    alarm: bool


@dataclass(frozen=True)
class Shown:
    """A change that is shown: its trend over the runs, and its location (None: the whole stroke).

    `outward`: it goes towards a limit.
    """

    course: ChangeOverRuns
    place: float | None
    outward: bool


@dataclass(frozen=True)
class JointDrift:
    """One joint over the season: runs, and changes of the whole stroke and of a location along `axis`, in its `unit`.

    `course` is the change of the runs' `overall`; `overall` and `local` are None if no change is shown.
    """

    joint: str
    two_sided: bool
    axis: Axis
    unit: str
    runs: tuple[AuditedRun, ...]
    course: ChangeOverRuns
    overall: Shown | None
    local: Shown | None

    @property
    def shown(self) -> tuple[Shown, ...]:
        """The changes shown, a location first: it must be inspected before anything is learned."""
        return tuple(item for item in (self.local, self.overall) if item is not None)


@dataclass(frozen=True)
class DriftAudit:
    """Runs of one class of motion in order of time, compared with one signature, which does not change meanwhile.

    Locations are along `axis`, in its `unit`: m or rad of travel, or s since the motion began. `not_assessable`: runs
    that were nowhere assessable, and why; they are in no row.
    """

    motion: MotionClass
    safety_factor: float
    axis: Axis
    unit: str
    joints: tuple[JointDrift, ...]
    not_assessable: tuple[tuple[str, str], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The runs that were assessed."""
        return tuple(item.name for item in self.joints[0].runs)

    @property
    def alarms(self) -> tuple[int, ...]:
        """The runs in which any joint alarms, by their index in `names`."""
        return tuple(i for i in range(len(self.names)) if any(joint.runs[i].alarm for joint in self.joints))

    @property
    def drifts(self) -> bool:
        """Whether a change of any joint is shown."""
        return any(item.shown for item in self.joints)


def audit_drift(
    signature: FittedSignature, pairs: Sequence[tuple[Operation, Signal]], activation: Activation
) -> DriftAudit:
    """Compare runs in order of time with a signature, and test for changes from run to run.

    Parameters
    ----------
    signature : FittedSignature
        The signature; it does not change meanwhile.
    pairs : sequence of (Operation, Signal)
        Impact-free runs of its class in order of time, with the detector's signals.
    activation : Activation
        What raises an alarm.

    Returns
    -------
    DriftAudit
        The runs, and the changes that are shown.

    Raises
    ------
    SignatureError
        No run is assessable.

    Notes
    -----
    Drift: Mann-Kendall test with the Theil-Sen slope; step: Pettitt's test (see `change_over_runs`). The whole stroke
    and its locations are tested separately, each at 1 % for all joints (and locations) together: at most 2 % of steady
    seasons show a change. A location is reported only if it changes by more than a quarter of the change of the whole
    stroke. With one monitored side, a location that moves away from the limit is not reported. Runs are assumed
    independent: a temperature that varies within a day looks like a drift.

    Examples
    --------
    `cdtool.check_signature` returns it for each class.
    """
    detections: list[Detection] = []
    refused: list[tuple[str, str]] = []
    for operation, signal in pairs:
        detection = judge_alone(operation, "", signal, (signature,), activation)
        if detection.verdict.outcome == "not_assessable":
            refused.append((operation.name, detection.verdict.reason))
        else:
            detections.append(detection)
    if not detections:
        reason = f"; first reason: {refused[0][1]}" if refused else ""
        raise SignatureError(f"no run to compare with the signature{reason}", "give runs of the learned class")
    found = deviations_of(signature, detections)
    unit = "s" if found.axis == "time" else detections[0].operation.recording["position"].unit
    audited = [_JointAudit(signature, detections, activation, found, unit, j) for j in range(len(signature.joints))]
    return DriftAudit(
        signature.motion.without_course,
        signature.safety_factor,
        found.axis,
        unit,
        tuple(item.drift() for item in audited),
        tuple(refused),
    )


@dataclass(frozen=True)
class _JointAudit:
    """One joint's part of an audit in the making."""

    signature: FittedSignature
    detections: Sequence[Detection]
    activation: Activation
    found: Deviations
    unit: str
    joint: int

    def drift(self) -> JointDrift:
        course = change_over_runs(self.found.overall[:, self.joint], len(self.signature.joints))
        return JointDrift(
            joint=self.signature.joints[self.joint],
            two_sided=not self.signature.side,
            axis=self.found.axis,
            unit=self.unit,
            runs=tuple(self._run(i) for i in range(len(self.detections))),
            course=course,
            overall=self._shown(course, None) if course.kind != "steady" else None,
            local=self._local(course),
        )

    def _run(self, index: int) -> AuditedRun:
        detection, factor = self.detections[index], self.signature.safety_factor
        beyond = self.found.beyond[index, :, self.joint]
        size = beyond if self.signature.side else np.abs(beyond)
        known = np.isfinite(size)
        at = int(np.argmax(np.where(known, size, -np.inf))) if known.any() else -1
        critical = critical_of(detection, self.activation, self.joint)
        return AuditedRun(
            name=detection.operation.name,
            overall=float(self.found.overall[index, self.joint]),
            local=float(beyond[at]) if at >= 0 else math.nan,
            local_at=float(self.found.places[at]) if at >= 0 else math.nan,
            critical_factor=critical,
            margin_used=critical / factor,
            alarm=any(alarm.column == self.joint for alarm in detection.verdict.alarms),
        )

    def _local(self, overall: ChangeOverRuns) -> Shown | None:
        """Of the places whose change is shown and their own, the one with the largest change."""
        beyond = self.found.beyond[:, :, self.joint]
        comparisons = max(len(self.found.places), 1) * len(self.signature.joints)
        best: tuple[float, float, ChangeOverRuns] | None = None
        for place, values in zip(self.found.places.tolist(), beyond.T, strict=True):
            if not may_change(values, comparisons):
                continue
            course = change_over_runs(values, comparisons)
            size = course.change if self.signature.side else abs(course.change)
            own = size > _OWN_SHARE * abs(overall.change)
            if course.kind != "steady" and own and size > (best[0] if best else 0.0):
                best = (size, place, course)
        return self._shown(best[2], best[1]) if best else None

    def _shown(self, course: ChangeOverRuns, place: float | None) -> Shown:
        outward = course.change > 0.0
        if not self.signature.side:
            # Of two limits the one counts towards which the signal goes, if it is not on its way back to the middle.
            values = self.found.overall[:, self.joint]
            if place is not None:
                values = self.found.pooled[:, int(np.argmin(np.abs(self.found.places - place))), self.joint]
            last = values[np.isfinite(values)][-max(course.n // 4, 1) :]
            outward = course.change * float(np.median(last)) > 0.0
        return Shown(course, place, outward)


@dataclass(frozen=True)
class Deviations:
    """Of runs (r) and joints (J): `overall` (r, J) and, at the places (m,) along `axis`, `pooled` (r, m, J).

    `overall` is the median shift of the run over the stroke, in the stroke's median spread; `beyond` (r, m, J) is what
    a place's shift has more than that. NaN where a run is not valid. `window`: places are pooled over as much to either
    side.
    """

    axis: Axis
    places: FloatArray
    window: float
    overall: FloatArray
    pooled: FloatArray
    beyond: FloatArray


def axis_of(signature: FittedSignature) -> Axis:
    """Along what the audit looks for places: travel, or time where the signature knows nothing else."""
    return "time" if signature.alignment == "time" else "travel"


def deviations_of(signature: FittedSignature, detections: Sequence[Detection]) -> Deviations:
    """Return deviations of runs from the signature: z = (i - mean) / s, with its mean and spread s.

    Travel counts along the whole stroke here, while accelerating too.
    """
    axis = axis_of(signature)
    curve = signature.by_time if axis == "time" else signature.by_travel
    mean, spread = curve.band(signature.pooled)
    sign = float(signature.side or 1)
    samples = [_sample(signature, item, axis) for item in detections]
    shift = sign * (np.array(samples).reshape(len(samples), *mean.shape) - mean)
    typical = _median(shift, axis=1)  # (r, J) in the signal's unit
    places, pooled = _pooled(shift / spread, curve)
    beyond = _pooled((shift - typical[:, np.newaxis, :]) / spread, curve)[1]
    return Deviations(axis, places, curve.window, typical / _median(spread, axis=0), pooled, beyond)


def critical_of(detection: Detection, activation: Activation, joint: int) -> float:
    """Return the critical factor of one joint; -inf if it is nowhere assessable. See `critical_factor`."""
    status = detection.statistic.status
    hidden = (np.arange(status.shape[1]) != joint) & (status == Status.VALID)
    status = np.where(hidden, np.uint8(Status.NO_LIMIT), status)
    return critical_factor(replace(detection, statistic=replace(detection.statistic, status=status)), activation)


def _sample(signature: FittedSignature, detection: Detection, axis: Axis) -> FloatArray:
    """Return a run's values (g, J) on the grid of that axis, where it is assessable."""
    by_time, by_travel = signature.samples(detection.operation.recording.without_ground_truth(), detection.statistic)
    return by_time if axis == "time" else by_travel


def _pooled(values: FloatArray, curve: Curve) -> tuple[FloatArray, FloatArray]:
    """Places a window apart (m,), and values (r, g, J) averaged over the window to either side of each (r, m, J)."""
    reach = max(round(curve.window / curve.step), 1)
    centres = np.arange(reach, values.shape[1], reach)
    pooled: FloatArray = np.full((len(values), len(centres), values.shape[2]), np.nan)
    for i, centre in enumerate(centres):
        part = values[:, centre - reach : centre + reach + 1]
        valid = np.isfinite(part)
        number = valid.sum(axis=1)
        total = np.where(valid, part, 0.0).sum(axis=1)
        enough = number >= _VALID_SHARE * (2 * reach + 1)
        pooled[:, i] = np.where(enough, total / np.maximum(number, 1), np.nan)
    return np.asarray(centres * curve.step, dtype=np.float64), pooled


def _median(values: FloatArray, axis: int) -> FloatArray:
    """Median of what is not NaN; NaN where all is."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "All-NaN slice", RuntimeWarning)
        middle: FloatArray = np.nanmedian(values, axis=axis)
    return middle
