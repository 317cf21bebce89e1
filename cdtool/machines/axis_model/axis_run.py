"""One joint's channels of one recording on a single uniform clock, for identification.

Identification is offline: a channel is interpolated between its own samples. Nothing here is used by a detector.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.recordings.recording import Recording, Series

# Fewer samples than this [-] are no run.
_FEWEST_SAMPLES = 50

USED = ("torque", "speed", "position", "acceleration", "reference_position", "reference_speed", "reference_torque")


@dataclass(frozen=True, eq=False)
class AxisRun:
    """A joint's channels on the load side (SI), every `period` [s] from `start` [s].

    Every array has n samples; a sample that a channel does not have is NaN. A channel that was not logged is None.
    `derived` names the channels that are the integral or the causal derivative of another one.
    """

    name: str
    start: float
    period: float
    torque: FloatArray
    speed: FloatArray | None = None
    position: FloatArray | None = None
    acceleration: FloatArray | None = None
    reference_position: FloatArray | None = None
    reference_speed: FloatArray | None = None
    reference_torque: FloatArray | None = None
    derived: frozenset[str] = field(default_factory=frozenset)

    def __len__(self) -> int:
        return len(self.torque)

    @property
    def time(self) -> FloatArray:
        """Return the times of the samples (n,) [s]."""
        return _uniform(self.start, self.period, len(self.torque))

    def known(self, *channels: str) -> BoolArray:
        """Return where all of these channels have a sample (n,)."""
        present = np.ones(len(self), dtype=np.bool_)
        for channel in channels:
            values = getattr(self, channel)
            present &= np.isfinite(values) if values is not None else False
        return present


def axis_run(recording: Recording, joint: int = 0) -> AxisRun:
    """Return a joint's channels of a recording on the load side, on one uniform clock.

    The clock has the longest median step of torque, speed and position, so that no sample is invented. Raises
    RecordingError without torque or without speed and position, and for fewer than 50 samples that all channels cover.
    """
    series = {name: recording[name] for name in USED if name in recording and len(recording[name]) > 1}
    if "torque" not in series:
        raise RecordingError(f"{recording.name}: no torque", "identification needs torque and speed or position")
    moving = [name for name in ("speed", "position") if name in series]
    if not moving:
        raise RecordingError(f"{recording.name}: no speed or position", "map one of them in [channels]")
    base = [series[name] for name in ("torque", *moving)]
    period = max(item.period for item in base)
    start, end = max(float(item.time[0]) for item in base), min(float(item.time[-1]) for item in base)
    count = math.floor((end - start) / period + 1e-6) + 1 if end > start else 0
    if count < _FEWEST_SAMPLES:
        raise RecordingError(
            f"{recording.name}: torque and {moving[0]} have {count} samples in common",
            f"identification needs at least {_FEWEST_SAMPLES}",
        )
    clock = _uniform(start, period, count)
    channels = {name: _interpolated(item, joint, clock) for name, item in series.items()}
    return AxisRun(recording.name, start, period, derived=_derived(recording), **channels)


def _derived(recording: Recording) -> frozenset[str]:
    """Return the channels that were computed from others when the log was read."""
    computed = ("derived_speed", "integrated_position", "integrated_reference")
    return frozenset(item.channel for item in recording.findings if item.kind in computed)


def _uniform(start: float, period: float, count: int) -> FloatArray:
    clock: FloatArray = np.arange(count, dtype=np.float64)
    clock *= period
    clock += start
    return clock


def _interpolated(series: Series, joint: int, clock: FloatArray) -> FloatArray:
    """Return a joint's values at the clock's times; NaN outside the channel and in its gaps."""
    values = series.values[:, joint if series.joint_count > 1 else 0]
    present = np.isfinite(values)
    time, values = series.time[present], values[present]
    if len(time) < 2:
        return np.full(len(clock), np.nan)
    usual = float(np.median(np.diff(time)))
    near = 1e-3 * usual  # a time closer to a sample is that sample's
    found: FloatArray = np.interp(clock, time, values)
    after = np.clip(np.searchsorted(time, clock, side="left"), 1, len(time) - 1)
    # A step longer than 3.5 usual steps of a channel is a gap: nothing is interpolated across it.
    in_gap = (time[after] - time[after - 1] > 3.5 * usual) & (clock > time[after - 1] + near)
    found[in_gap & (clock < time[after] - near)] = np.nan
    found[(clock < time[0] - near) | (clock > time[-1] + near)] = np.nan
    return found
