"""From a joint residual to the force at a known contact point (thesis 2.2-2.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.detectors import DETECTORS
from cdtool.machines.dynamics import Machine, has_links
from cdtool.recordings.clock import previous_value
from cdtool.recordings.recording import Series


@dataclass(frozen=True)
class ContactPoint:
    """A point fixed to a link, in the link's frame [m]."""

    link: str
    point: tuple[float, float, float]

    @classmethod
    def parse(cls, text: str) -> ContactPoint:
        """Return the point given as LINK:X,Y,Z; raises UsageError."""
        link, _, numbers = text.rpartition(":")
        try:
            x, y, z = (float(part) for part in numbers.split(","))
        except ValueError:
            x = y = z = np.nan
        if not link or not np.isfinite([x, y, z]).all():
            raise UsageError(f"contact point is '{text}'", "give LINK:X,Y,Z in m in the link's frame: link4:0,0.1,0.3")
        return cls(link, (x, y, z))

    def __str__(self) -> str:
        return f"{self.link} ({', '.join(f'{x:g}' for x in self.point)}) m"


def contact_force(detection: Detection, machine: Machine, contact: ContactPoint) -> Series:
    """Return the force (n, 3) [N], in base axes, that the machine exerts at the point, on the signal's clock.

    Least-squares solution of J_c' F = residual. NaN where the signal is not assessable or the pose is missing. The
    force is 0 in a direction in which the point cannot move, or moves only with a joint that is not monitored. Raises
    UsageError if the signal is not the contact torque of all joints, ConfigurationError for an unknown link.
    """
    signal, recording = detection.statistic, detection.operation.recording
    if not has_links(machine):
        raise UsageError(f"machine '{machine.name}' has no links", "use a planar_arm or urdf_robot")
    if signal.joints != recording.joints or signal.unit != machine.force_unit or not _estimates(detection.detector):
        able = [name for name in DETECTORS.names() if _estimates(name)]
        raise UsageError(
            f"{detection.detector} of {', '.join(signal.joints)} is not the contact torque of all joints",
            f"use {', '.join(able[:-1])} or {able[-1]} of all joints",
        )
    position = previous_value(recording["position"], signal.time)
    known = np.isfinite(position).all(axis=1) & signal.valid.all(axis=1)
    force: FloatArray = np.full((len(signal.time), 3), np.nan)
    force[known] = machine.contact_force(position[known], signal.values[known], contact.link, contact.point)
    return Series(signal.time, force, "N")


def _estimates(detector: str) -> bool:
    """Whether a detector's signal is the contact torque; assumed for a plug-in whose class does not state it."""
    return bool(getattr(DETECTORS.load(detector), "contact_torque", True))


@dataclass(frozen=True)
class ForceSummary:
    """Magnitude of the estimated force [N]: at the first alarm (NaN without one), and its maximum with the time [s]."""

    contact: ContactPoint
    operation: str
    at_alarm: float
    largest: float
    largest_at: float


def summarise_force(detection: Detection, machine: Machine, contact: ContactPoint) -> ForceSummary:
    """Return the magnitude of the estimated force at the first alarm and its maximum; raises as `contact_force`."""
    force = contact_force(detection, machine, contact)
    size = np.linalg.norm(force.values, axis=1)
    alarms = detection.verdict.alarms
    at_alarm = float(size[np.searchsorted(force.time, alarms[0].time, side="right") - 1]) if alarms else float("nan")
    if not np.isfinite(size).any():
        return ForceSummary(contact, detection.operation.name, at_alarm, float("nan"), float("nan"))
    peak = int(np.nanargmax(size))
    return ForceSummary(contact, detection.operation.name, at_alarm, float(size[peak]), float(force.time[peak]))
