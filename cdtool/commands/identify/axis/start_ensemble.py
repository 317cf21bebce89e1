"""The starts of motion of many runs, aligned and averaged: noise that is not common to the runs averages out.

A start from rest is where a drive is wound up: it is the part of an impact-free run that shows its elasticity.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.machines.axis_model.axis_run import AxisRun

# What is averaged: the rest before the start and the motion after it [s].
BEFORE, AFTER = 0.3, 2.0
# A joint is at rest below this share of its highest speed; a reference has no noise.
_REST_SHARE = {"reference_speed": 0.005, "speed": 0.05}

CHANNELS = ("torque", "speed", "position", "acceleration", "reference_position", "reference_speed", "reference_torque")


@dataclass(frozen=True, eq=False)
class StartEnsemble:
    """Aligned starts of `count` runs with the same motion, every `period` [s]; the motion starts at `start_index`.

    `mean` and `deviation` (from run to run, ddof 1; 0 for one run) by channel (n,), on the load side. Position and
    acceleration count from the rest before the start. `direction` is +1 or -1, `nominal_speed` [m/s, rad/s] the one
    one, unsigned. `members`: index of each run and of the sample at which its window begins.
    """

    period: float
    start_index: int
    count: int
    mean: Mapping[str, FloatArray]
    deviation: Mapping[str, FloatArray]
    direction: int
    nominal_speed: float
    members: tuple[tuple[int, int], ...]

    def __len__(self) -> int:
        return len(self.mean["torque"])


@dataclass(frozen=True, eq=False)
class _Start:
    period: float
    channels: dict[str, FloatArray]
    direction: int
    speed: float
    member: tuple[int, int]


def start_ensembles(runs: Sequence[AxisRun], before: float = BEFORE, after: float = AFTER) -> tuple[StartEnsemble, ...]:
    """Return the ensembles of equal starts of all runs, the largest first; empty if no run starts from rest.

    A start belongs to the first ensemble with the same direction, period and speed over time (5 % RMS).
    """
    groups: list[list[_Start]] = []
    for number, run in enumerate(runs):
        for start in _starts(run, number, before, after):
            group = next((item for item in groups if _alike(item[0], start)), None)
            if group is None:
                groups.append([start])
            else:
                group.append(start)
    groups.sort(key=len, reverse=True)
    return tuple(_averaged(group, before) for group in groups)


def _starts(run: AxisRun, number: int, before: float, after: float) -> list[_Start]:
    """Return every start from rest in a run that is long enough before and after it."""
    name = "reference_speed" if run.reference_speed is not None else "speed"
    speed = motor_speed(run) if name == "speed" else run.reference_speed
    assert speed is not None
    size = np.abs(np.nan_to_num(speed))
    if name == "speed":
        # Noise must neither end a rest nor begin a motion.
        width = max(round(0.05 / run.period), 1)
        size = np.abs(np.convolve(np.nan_to_num(speed), np.full(width, 1.0 / width), mode="same"))
    highest = float(np.quantile(size, 0.98))
    moves: BoolArray = size > _REST_SHARE[name] * highest
    rest, length = round(before / run.period), round((before + after) / run.period)
    found = []
    if highest > 0.0 and rest > 2:
        for index in np.flatnonzero(moves[1:] & ~moves[:-1]) + 1:
            first = int(index) - rest
            if first < 0 or first + length > len(run) or moves[first : int(index)].any():
                continue
            part = slice(first, first + length)
            if size[part].max() < 0.2 * highest:
                continue  # noise at rest, not a motion
            channels = _channels(run, part, rest)
            if channels:
                later = speed[part][rest:]
                sign = 1 if np.nansum(later) > 0.0 else -1
                top = float(np.nanquantile(np.abs(later), 0.9))
                found.append(_Start(run.period, channels, sign, top, (number, first)))
    return found


def motor_speed(run: AxisRun) -> FloatArray:
    """Return the measured speed of a run, or the derivative of its position (n,) [m/s, rad/s]."""
    if run.speed is not None:
        return run.speed
    assert run.position is not None
    rate: FloatArray = np.gradient(run.position, run.period)
    return rate


def _channels(run: AxisRun, part: slice, rest: int) -> dict[str, FloatArray]:
    """Return the channels of a window without missing samples; empty if torque or speed miss too many."""
    channels: dict[str, FloatArray] = {}
    for name in CHANNELS:
        values = motor_speed(run) if name == "speed" else getattr(run, name)
        if values is None:
            continue
        values = values[part]
        known = np.isfinite(values)
        if known.mean() < 0.95:
            if name in ("torque", "speed"):
                return {}
            continue
        index = np.arange(len(values))
        filled: FloatArray = np.interp(index, index[known], values[known])
        # Of an acceleration bias and gravity.
        has_rest_level = name == "acceleration" or name.endswith("position")
        channels[name] = filled - np.mean(filled[:rest]) if has_rest_level else filled
    return channels


def _alike(first: _Start, other: _Start) -> bool:
    if first.direction != other.direction or abs(first.period - other.period) > 1e-3 * first.period:
        return False
    if first.channels.keys() != other.channels.keys() or len(first.channels["torque"]) != len(other.channels["torque"]):
        return False
    name = "reference_speed" if "reference_speed" in first.channels else "speed"
    difference = first.channels[name] - other.channels[name]
    # Runs are averaged if their speeds differ by less than 5 % of the highest speed (RMS).
    return bool(np.sqrt(np.mean(difference**2)) < 0.05 * first.speed)


def _averaged(group: Sequence[_Start], before: float) -> StartEnsemble:
    shifted = group if "reference_speed" in group[0].channels else _aligned(group)
    stacked = {name: np.array([item.channels[name] for item in shifted]) for name in group[0].channels}
    mean: dict[str, FloatArray] = {name: values.mean(axis=0) for name, values in stacked.items()}
    many = len(group) > 1
    deviation: dict[str, FloatArray] = {
        name: values.std(axis=0, ddof=1) if many else np.zeros(values.shape[1]) for name, values in stacked.items()
    }
    first = group[0]
    speed = float(np.mean([item.speed for item in group]))
    start = round(before / first.period)
    members = tuple(item.member for item in group)
    return StartEnsemble(first.period, start, len(group), mean, deviation, first.direction, speed, members)


def _aligned(group: Sequence[_Start]) -> list[_Start]:
    """Return starts moved by fractions of a sample so that their speeds fit the mean best (least squares)."""
    shifts = np.zeros(len(group))
    index = np.arange(len(group[0].channels["torque"]), dtype=np.float64)
    speeds = [item.channels["speed"] for item in group]
    for _ in range(3):
        moved = [np.interp(index + shift, index, speed) for shift, speed in zip(shifts, speeds, strict=True)]
        mean = np.mean(moved, axis=0)
        slope = np.gradient(mean)
        power = float(np.sum(slope**2))
        if power <= 0.0:
            break
        shifts -= np.array([np.sum((speed - mean) * slope) / power for speed in moved])
        shifts -= np.mean(shifts)
    result = []
    for shift, item in zip(shifts, group, strict=True):
        channels = {name: np.interp(index + shift, index, values) for name, values in item.channels.items()}
        result.append(replace(item, channels=channels))
    return result
