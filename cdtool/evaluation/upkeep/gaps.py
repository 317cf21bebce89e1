"""The parts of a stroke in which a signature has no limit, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.detection import Signal
from cdtool.evaluation.upkeep.deviation import Axis
from cdtool.recording import Recording
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature_curve import COVERAGE


@dataclass(frozen=True)
class NoLimit:
    """A part of the stroke without a limit for a joint, from `start` to `end` in m or rad (`unit`) of travel, or s.

    `share`: no place in it was reached with a valid signal by more of the runs; 80 % are needed.
    """

    joint: str
    axis: Axis
    start: float
    end: float
    share: float
    unit: str = ""

    @property
    def described(self) -> str:
        """Where and why."""
        at = self.start == self.end
        where = f"at {self.start:.3f}" if at else f"from {self.start:.3f} to {self.end:.3f}"
        unit = f" {self.unit}" if self.unit else ""
        place = f"{where}{unit} of travel" if self.axis == "travel" else f"{where} s after the motion began"
        return f"{place}: valid in at most {100.0 * self.share:.0f} % of the runs; {100.0 * COVERAGE:.0f} % are needed"


@dataclass(frozen=True)
class Changeover:
    """The change from time to travel: at most this time after the start of motion [s], at least this travel."""

    time: float = np.inf
    travel: float = 0.0


def changeover(signature: FittedSignature, runs: Sequence[tuple[Recording, Signal]]) -> Changeover:
    """The latest and nearest end of acceleration in some runs; without one where only time or only travel counts."""
    if signature.alignment != "time_then_position":
        return Changeover()
    times, travels = [], []
    for recording, signal in runs:
        where = signature.progress(recording, signal.time)
        running = np.flatnonzero(where.running)
        if len(running):
            times.append(float(where.elapsed[running[0]]))
            travels.append(float(where.travel[running[0]]))
    return Changeover(max(times, default=np.inf), min(travels, default=0.0))


def gaps_of(signature: FittedSignature, change: Changeover | None = None) -> tuple[NoLimit, ...]:
    """The parts without a limit, joint after joint; without a `change`, all of both curves is looked at."""
    at = change or Changeover()
    found: list[NoLimit] = []
    for joint in range(len(signature.joints)):
        if signature.alignment != "position":
            found += _gaps(signature, "time", joint, (0.0, at.time))
        if signature.alignment != "time":
            found += _gaps(signature, "travel", joint, (at.travel, np.inf))
    return tuple(found)


def _gaps(signature: FittedSignature, axis: Axis, joint: int, span: tuple[float, float]) -> list[NoLimit]:
    curve = signature.by_time if axis == "time" else signature.by_position
    count, grid = curve.count[:, joint], curve.grid
    lacking = (count < curve.enough) & (grid >= span[0]) & (grid <= span[1])
    edges = np.flatnonzero(np.diff(np.concatenate(([False], lacking, [False]))))
    most = max(float(curve.count.max(initial=0.0)), 1.0)
    unit = signature.motion.unit.removesuffix("/s") if axis == "travel" else "s"
    return [
        NoLimit(signature.joints[joint], axis, float(grid[a]), float(grid[b - 1]), float(count[a:b].max()) / most, unit)
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    ]
