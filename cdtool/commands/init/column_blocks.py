"""Guess the channels of a table without names: blocks of J columns, one per joint, related by derivatives.

Without speeds, an angle is known by the circle on which it moves a tool.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import joined
from cdtool.machines.plausibility.drive import explained

_FITS, _ALIKE = 0.9, 0.97
# A single pair must fit better: of a tool on a circle one coordinate is nearly the derivative of the other.
_FITS_ALONE = 0.98
# A circle leaves at most this share of what a parabola leaves of a coordinate.
_CIRCLE = 0.01
# A column is a function of the place above this share. Friction and inertia change an effort by more than this share.
_PLACE, _CHANGES = 0.9, 0.05
# Share of an effort that inertia, friction and weight must explain.
_DRIVES = 0.6
# A block directly behind the speeds is preferred unless another one is explained better by this much.
_BETTER = 0.1
_BEHIND = 0.2
# Without a lag the measured one of two like blocks varies more from sample to sample by this factor.
_ROUGHER = 1.5
# A position is at most this share of its travel from its set value.
_APART = 0.1


@dataclass(frozen=True)
class Blocks:
    """The blocks found: J joints, streams of J columns by channel, and the correlation of position and speed."""

    joints: int
    streams: dict[str, Stream]
    correlation: float
    explained: float


def find_blocks(streams: list[Stream]) -> Blocks | None:
    """Return position, speed, effort and set values of a table without names; None if no column is the integral of one.

    Parameters
    ----------
    streams : list of Stream
        The columns in their order, without the clock.
    """
    fits = _fits(streams)
    joints = _joints(streams, fits)
    if not joints:
        return None
    pairs = _pairs(fits, joints)
    speeds_of = {
        first: max((pair for pair in pairs if pair[0] == first), key=lambda pair: pair[2]) for first, _, _ in pairs
    }
    # A speed that has a derivative of its own is not a position.
    positions = [first for first in speeds_of if not any(pair[1] == first for pair in pairs)] or list(speeds_of)
    chosen = positions[0]
    for first in positions[1:]:  # of two like blocks, the one behind is measured; else the rougher one
        one, other = _block(streams, chosen, joints), _block(streams, first, joints)
        ahead = motion.lead(one, other)
        rougher = motion.roughness(other) > _ROUGHER * motion.roughness(one) and _same_values(one, other)
        if ahead < -_BEHIND or (ahead <= _BEHIND and rougher):
            chosen = first
    _, speed, correlation = speeds_of[chosen]
    found = {"position": _block(streams, chosen, joints), "speed": _block(streams, speed, joints)}
    taken = {chosen, speed}
    for first in positions:
        if abs(first - chosen) >= joints and _same_values(found["position"], _block(streams, first, joints)):
            found["reference_position"] = _block(streams, first, joints)
            taken.add(first)
            if speeds_of[first][1] != speed:
                found["reference_speed"] = _block(streams, speeds_of[first][1], joints)
                taken.add(speeds_of[first][1])
            break
    taken |= {first for pair in pairs for first in pair[:2]}
    effort, explained = _effort(streams, joints, taken, speed + joints, found)
    if effort is not None:
        found["torque"] = effort
    return Blocks(joints, found, correlation, explained)


def find_angle(streams: list[Stream]) -> tuple[Stream, tuple[Stream, ...]] | None:
    """Return the column that is an angle in degrees, and the columns that are coordinates on its circle; None without.

    x = c + r cos(q + phi): the first column q of which two others are such functions.
    """
    moving = [stream for stream in streams if stream.moves]
    for angle in moving:
        q = angle.values
        circle, parabola = np.hstack([np.cos(np.radians(q)), np.sin(np.radians(q))]), np.hstack([q, q**2])
        left = {
            other.name: [1.0 - explained(columns, other.values[:, 0]) for columns in (circle, parabola)]
            for other in moving
            if other is not angle
        }
        places = tuple(
            other for other in moving if other is not angle and left[other.name][0] < _CIRCLE * left[other.name][1]
        )
        if len(places) > 1:
            return replace(angle, unit="deg"), places
    return None


def find_efforts(streams: list[Stream], position: Stream, speed: Stream) -> list[Stream]:
    """Return the columns that inertia and friction explain, but the place alone does not."""
    place = np.hstack([position.values**power for power in (1, 2, 3)])
    return [
        other
        for other in streams
        if np.nanmax(np.abs(other.values)) * _CHANGES < np.ptp(other.values)
        and explained(place, other.values[:, 0]) < _PLACE
        and motion.drive_fit(other, speed) > _DRIVES
    ]


def _fits(streams: list[Stream]) -> FloatArray:
    """Return the correlation of each column with the integral of each other; NaN where one does not move."""
    fits = np.full((len(streams), len(streams)), np.nan)
    for i, position in enumerate(streams):
        for k, speed in enumerate(streams):
            if i != k and motion.stirs(position, speed):
                fits[i, k] = motion.integral_fit(position, speed).correlation
    return fits


def _joints(streams: list[Stream], fits: FloatArray) -> int:
    """Return the largest number of joints with a block of positions and one of speeds; 0 without any."""
    for joints in range(len(streams) // 2, 0, -1):
        if pairs := _pairs(fits, joints):
            first, half = pairs[0][0], joints // 2
            if joints % 2 == 0 and half:
                parts = _block(streams, first, half), _block(streams, first + half, half)
                if _same_values(*parts):
                    return half  # measured and set values, one behind the other
            return joints
    return 0


def _pairs(fits: FloatArray, joints: int) -> list[tuple[int, int, float]]:
    """Return (first position, first speed, median correlation) of all blocks that do not overlap."""
    found = []
    for first in range(len(fits) - joints + 1):
        for speed in range(len(fits) - joints + 1):
            if abs(first - speed) < joints:
                continue
            known = np.array([fits[first + j, speed + j] for j in range(joints)])
            known = known[np.isfinite(known)]
            least = _FITS if joints > 1 else _FITS_ALONE
            if len(known) >= max(1, (joints + 1) // 2) and known.min() > least:
                found.append((first, speed, float(np.median(known))))
    return found


def _effort(
    streams: list[Stream], joints: int, taken: set[int], behind: int, found: dict[str, Stream]
) -> tuple[Stream | None, float]:
    used = {first + j for first in taken for j in range(joints)}
    shares = {
        first: motion.drive_fit(_block(streams, first, joints), found["speed"], found["position"])
        for first in range(len(streams) - joints + 1)
        if not used & set(range(first, first + joints))
    }
    # A table has its blocks at distances of J columns.
    aligned = {first: share for first, share in shares.items() if (first - behind) % joints == 0}
    shares = aligned if max(aligned.values(), default=0.0) >= _DRIVES else shares
    if not shares:
        return None, 0.0
    best = max(shares, key=lambda first: shares[first] + _BETTER * (first == behind))
    block = _block(streams, best, joints)
    if shares[best] < _DRIVES or (joints == 1 and motion.rests_and_peaks(block)):
        return None, shares[best]
    return block, shares[best]


def _same_values(one: Stream, other: Stream) -> bool:
    """Return whether two blocks of positions are set values and what follows them: like courses, with equal values.

    The joints of a robot often move in proportion, so that like courses alone say nothing.
    """
    if motion.likeness(one, other) <= _ALIKE or len(one.values) != len(other.values):
        return False
    apart = np.nanmedian(np.abs(one.values - other.values), axis=0)
    travel = np.nanmax(one.values, axis=0) - np.nanmin(one.values, axis=0)
    return bool(np.all(apart <= _APART * np.maximum(travel, np.nanmax(travel) * _APART)))


def _block(streams: list[Stream], first: int, joints: int) -> Stream:
    part = streams[first : first + joints]
    name = f"columns {part[0].name} to {part[-1].name}" if joints > 1 else f"column {part[0].name}"
    return joined(part, name)
