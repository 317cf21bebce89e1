"""The scale of the torque channel from a slow press on a load cell and the release of it.

In quasi-static motion the torque channel tau, scaled by s, carries contact force and friction, which may grow with the
force as in a gear::

    s tau = F + sign (F_r + mu F) + F_0,  sign = +1 while the force grows, -1 while it falls

At one force, s = 2 (F + F_0) / (tau_press + tau_release): friction cancels only if both directions are known. A hit
does not do: it has inertia forces, and friction is added to its torque.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.commands.identify.axis.start_ensemble import motor_speed
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.machines.axis_model.axis_run import axis_run
from cdtool.recordings.recording import Contact, Recording

# The load cell's axis is that of its force within this long of the onset [s].
_BEGINNING = 0.2
# Standard deviation of the low-pass of all channels [s].
_SMOOTHING = 0.05
# Force counts above this share of the peak; press and release must have this share of the peak in common.
_LEAST_FORCE, _LEAST_COMMON = 0.1, 0.4
# The force grows or falls where its rate exceeds this share of peak over duration.
_LEAST_RATE = 0.05
# The motion is quasi-static where the inertia force is below this share of the peak, at its 95th percentile.
_LARGEST_INERTIA = 0.03
# The shortest press or release [s].
_SHORTEST = 0.3
# After the force turned, friction turns too: until then a sample belongs to neither direction [s].
_AFTER_TURN = 0.1
# Errors are independent from block to block: number of blocks per contact, and the shortest one [s].
_BLOCKS, _SHORTEST_BLOCK = 12, 0.2
# A factor with a larger relative standard error is not worth reporting.
_LARGEST_ERROR = 0.1


@dataclass(frozen=True)
class TorqueScale:
    """The factor by which the scale of the torque channel must be multiplied, with its standard error.

    `friction` [N, N m]: mean friction under load, with the scaled torque. `contacts`: number of contacts used.
    """

    factor: float
    standard_error: float
    friction: float
    contacts: int


@dataclass(frozen=True, eq=False)
class _PressAndRelease:
    """Smoothed samples (n,) of one contact: torque and force along the press, `sign` +1 or -1."""

    torque: FloatArray
    force: FloatArray
    sign: FloatArray
    period: float


def identify_torque_scale(
    recordings: Sequence[tuple[Recording, Contact]], total_mass: float, joint: int = 0, lever_arm: float = 1.0
) -> TorqueScale:
    """Return the factor of the torque channel's scale from contacts that were pressed and released slowly.

    `total_mass` of motor and load [kg, kg m2] decides what is slow. `lever_arm` [m]: of a rotary axis. Raises
    IdentificationError where no contact has press and release in slow motion over a common range of forces, or where
    the standard error exceeds 10 %; the message has the first reason.
    """
    parts, reasons = [], []
    for recording, contact in recordings:
        try:
            parts.append(_press_and_release(recording, contact, total_mass, joint, lever_arm))
        except RecordingError as fault:
            reasons.append(fault.message)
    if not parts:
        reason = reasons[0] if reasons else "no contact with a load cell"
        raise IdentificationError(
            f"the torque constant cannot be identified: {reason}",
            "press slowly against a load cell, and release slowly",
        )
    solution, error = _solve(parts)
    factor = 1.0 / solution[0]
    relative = error / abs(solution[0])
    if not (factor > 0.0 and relative <= _LARGEST_ERROR):
        raise IdentificationError(
            f"the torque constant cannot be identified: its relative standard error is {100.0 * relative:.0f} %",
            "press and release more often, and to a higher force",
        )
    mean = float(np.mean(np.concatenate([item.force for item in parts])))
    friction = float(factor * (solution[1] + solution[2] * mean))
    return TorqueScale(float(factor), float(factor * relative), friction, len(parts))


def _press_and_release(
    recording: Recording, contact: Contact, total_mass: float, joint: int, lever_arm: float
) -> _PressAndRelease:
    run = axis_run(recording, joint)
    cell_time, cell_force = _contact_force(recording, contact, lever_arm)
    inside = (run.time >= contact.start) & (run.time <= contact.end)
    if np.count_nonzero(inside) * run.period < 2.0 * _SHORTEST:
        raise RecordingError(f"{run.name}: the contact lasts {contact.end - contact.start:.2f} s", "press slowly")
    speed = motor_speed(run)
    if not np.all(np.isfinite(run.torque[inside]) & np.isfinite(speed[inside])):
        raise RecordingError(f"{run.name}: samples are missing in the contact", "use other contacts")
    force = _smooth(np.interp(run.time, cell_time, cell_force), run.period)
    peak = float(np.max(force[inside]))
    loaded = inside & (force > _LEAST_FORCE * peak)
    acceleration = np.gradient(_smooth(np.nan_to_num(speed), run.period), run.period)
    inertia = float(np.quantile(np.abs(acceleration[loaded]), 0.95)) * total_mass
    if inertia > _LARGEST_INERTIA * peak:
        raise RecordingError(
            f"{run.name}: the contact is a hit: inertia forces of {inertia:.0f} of {peak:.0f} N", "press slowly"
        )
    sign = _directions(force, loaded, run.period)
    _check_common(run.name, force, sign, peak, run.period)
    used = sign != 0.0
    torque = _smooth(np.nan_to_num(run.torque), run.period)
    # The force counts as positive; the torque that presses has the sign of its mean under load.
    direction = math.copysign(1.0, float(np.mean(torque[loaded])))
    return _PressAndRelease(direction * torque[used], force[used], sign[used], run.period)


def _contact_force(recording: Recording, contact: Contact, lever_arm: float) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and force over the rest level before the contact, positive in the contact [N, N m]."""
    if "force" not in recording:
        raise RecordingError(f"{recording.name}: no load cell", "map its channel 'force' in [channels]")
    series = recording["force"]
    known = np.all(np.isfinite(series.values), axis=1)
    time, values = series.time[known], series.values[known]
    before = (time > contact.start - 0.5) & (time < contact.start - 0.02)
    within = (time >= contact.start) & (time <= contact.start + _BEGINNING)
    if np.count_nonzero(before) < 3 or np.count_nonzero(within) < 3:
        raise RecordingError(f"{recording.name}: the load cell does not cover the contact", "use other contacts")
    over = values - np.median(values[before], axis=0)
    along = np.mean(over[within], axis=0)
    return time, lever_arm * over @ (along / max(float(np.linalg.norm(along)), 1e-300))


def _smooth(values: FloatArray, period: float) -> FloatArray:
    """Return the values (n,) through a symmetrical Gaussian low-pass; the ends are repeated."""
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, _SMOOTHING / period, mode="nearest", truncate=3.0))


def _directions(force: FloatArray, loaded: BoolArray, period: float) -> FloatArray:
    """Return +1 where the force grows, -1 where it falls, 0 where it rests or has just turned (n,)."""
    rate = np.gradient(force, period)
    usual = float(np.max(force)) / max(float(np.count_nonzero(loaded)) * period, period)
    sign = np.where(loaded & (np.abs(rate) > _LEAST_RATE * usual), np.sign(rate), 0.0)
    count = max(round(_AFTER_TURN / period), 1)
    steady = sign.copy()
    for turn in np.flatnonzero(np.diff(sign) != 0.0):
        steady[max(turn + 1 - count // 2, 0) : turn + 1 + count] = 0.0
    return steady


def _check_common(name: str, force: FloatArray, sign: FloatArray, peak: float, period: float) -> None:
    """Raise RecordingError unless press and release share a range of forces."""
    ranges = []
    for direction, word in ((1.0, "press"), (-1.0, "release")):
        chosen = force[sign == direction]
        if len(chosen) * period < _SHORTEST:
            raise RecordingError(
                f"{name}: the {word} lasts {len(chosen) * period:.2f} s", "friction cancels only in both directions"
            )
        ranges.append((float(np.min(chosen)), float(np.max(chosen))))
    common = min(high for _, high in ranges) - max(low for low, _ in ranges)
    if common < _LEAST_COMMON * peak:
        raise RecordingError(
            f"{name}: press and release have only {max(common, 0.0):.0f} of {peak:.0f} N in common",
            "release as slowly as the press",
        )


def _solve(parts: Sequence[_PressAndRelease]) -> tuple[FloatArray, float]:
    """Return the coefficients of tau = F / s + sign (a + b F) + c by least squares, and the standard error of 1 / s.

    The load cell has less noise than the torque, so that it is the regressor. The standard error is that of blocks,
    and contains how far the slope moves without the friction that grows with the force.
    """
    force = np.concatenate([item.force for item in parts])
    sign = np.concatenate([item.sign for item in parts])
    torque = np.concatenate([item.torque for item in parts])
    design = np.stack((force, sign, sign * force, np.ones(len(force))), axis=1)
    inverse = _inverse(design)
    solution: FloatArray = inverse @ torque
    weighed = inverse[0] * (torque - design @ solution)
    blocks: list[float] = []
    begin = 0
    for item in parts:
        end = begin + len(item.force)
        step = max(math.ceil(len(item.force) / _BLOCKS), round(_SHORTEST_BLOCK / item.period), 1)
        blocks += [float(np.sum(weighed[low:high])) for low, high in pairwise([*range(begin, end, step), end])]
        begin = end
    spread = math.sqrt(len(blocks) / max(len(blocks) - 4, 1) * float(np.sum(np.square(blocks))))
    without = float(_inverse(design[:, [0, 1, 3]])[0] @ torque)
    return solution, math.hypot(spread, without - float(solution[0]))


def _inverse(design: FloatArray) -> FloatArray:
    """Return the pseudo-inverse of a design (n, k) with columns of different units."""
    scale = np.max(np.abs(design), axis=0)
    inverse: FloatArray = np.linalg.pinv(design / scale, rcond=1e-6) / scale[:, np.newaxis]
    return inverse
