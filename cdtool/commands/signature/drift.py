"""Compare a season of runs with one signature: does the machine drift from it, over the whole stroke or locally?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge
from cdtool.base.errors import SignatureError
from cdtool.commands.signature.audit import AuditedRun, DriftAudit, JointDrift, Shown
from cdtool.commands.signature.deviation import Deviations, critical_of, deviations_of
from cdtool.detectors.detection import Signal
from cdtool.recordings.operations import Operation
from cdtool.statistics.trends import ChangeOverRuns, change_over_runs, may_change
from cdtool.thresholds.fitted_signature import FittedSignature

__all__ = ["DriftAudit", "audit_drift"]

# A location has a change of its own if it exceeds this share of the change of the whole stroke: a smaller one may be
# the shape of the friction along the track, which grows with the friction.
_OWN_SHARE = 0.25


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
        detection = judge(operation, "", signal, (signature,), activation)
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
            two_sided=not self.signature.watched,
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
        size = beyond if self.signature.watched else np.abs(beyond)
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
            size = course.change if self.signature.watched else abs(course.change)
            own = size > _OWN_SHARE * abs(overall.change)
            if course.kind != "steady" and own and size > (best[0] if best else 0.0):
                best = (size, place, course)
        return self._shown(best[2], best[1]) if best else None

    def _shown(self, course: ChangeOverRuns, place: float | None) -> Shown:
        outward = course.change > 0.0
        if not self.signature.watched:
            # Of two limits the one counts towards which the signal goes, if it is not on its way back to the middle.
            values = self.found.overall[:, self.joint]
            if place is not None:
                values = self.found.pooled[:, int(np.argmin(np.abs(self.found.places - place))), self.joint]
            last = values[np.isfinite(values)][-max(course.n // 4, 1) :]
            outward = course.change * float(np.median(last)) > 0.0
        return Shown(course, place, outward)
