"""Find the channels of a table without names: blocks of J columns, one per joint, related by derivatives.

Without speeds, an angle is known by the circle on which it moves a tool.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.stream import Stream, joined
from cdtool.machines.plausibility.drive import explained

# Columns that are compared, each with each: the time grows with their square.
_MOST = 48


def of_blocks(streams: list[Stream]) -> list[Stream]:
    """Return the columns in blocks of J, one per joint, without what is before the first; none without a derivative.

    The longest run of columns that are each the integral of the one d columns behind it is the block of positions:
    it has J columns, or 2 J if set values are beside the measured ones.

    Parameters
    ----------
    streams : list of Stream
        The columns in their order, without the clock.
    """
    streams = streams[:_MOST]
    fits = _fits(streams)
    runs = [run for lag in range(1 - len(streams), len(streams)) for run in _runs(np.diagonal(fits, lag), lag)]
    if not runs:
        return []
    joints, first = max(runs, key=lambda run: (run[0], -run[1]))
    half = joints // 2
    if joints % 2 == 0 and motion.same_values(_block(streams, first, half), _block(streams, first + half, half)):
        joints = half
    return [_block(streams, start, joints) for start in range(first % joints, len(streams) - joints + 1, joints)]


def on_circle(streams: list[Stream]) -> tuple[Stream, tuple[str, ...], list[Stream]] | None:
    """Return the column that is an angle in degrees, the coordinates on its circle, and what moves like its drive.

    x = c + r cos(q + phi): the first column q of which two others are such functions. None without.
    """
    moving = [stream for stream in streams[:_MOST] if stream.moves]
    for angle in moving:
        q = angle.values
        circle, parabola = np.hstack([np.cos(np.radians(q)), np.sin(np.radians(q))]), np.hstack([q, q**2])
        others = [stream for stream in moving if stream is not angle]
        places = tuple(
            stream.name
            for stream in others
            # A circle leaves at most a hundredth of what a parabola leaves of a coordinate.
            if 1.0 - explained(circle, stream.values[:, 0]) < 0.01 * (1.0 - explained(parabola, stream.values[:, 0]))
        )
        if len(places) > 1:
            speed, place = motion.derived(angle), np.hstack([q, q**2, q**3])
            drives = [
                stream
                for stream in others
                # Friction and inertia change an effort by more, and it is not a function of the place.
                if stream.reach * 0.05 < np.ptp(stream.values)
                and explained(place, stream.values[:, 0]) < 0.9
                and motion.drive_fit(stream, speed) > motion.DRIVES
            ]
            return replace(angle, unit="deg"), places[:2], drives
    return None


def _fits(streams: list[Stream]) -> FloatArray:
    """Return the correlation of each column with the integral of each other; NaN where one does not move."""
    fits = np.full((len(streams), len(streams)), np.nan)
    for i, position in enumerate(streams):
        for k, speed in enumerate(streams):
            if i != k and motion.stirs(position, speed):
                fits[i, k] = motion.integral_fit(position, speed).correlation
    return fits


def _runs(fits: FloatArray, lag: int) -> list[tuple[int, int]]:
    """Return (length, first position) of runs of joints that fit; one at rest may be among them, but not most."""
    found = []
    for first in range(len(fits)):
        below = np.flatnonzero(fits[first:] <= motion.FITS)
        length = min(int(below[0]) if len(below) else len(fits) - first, abs(lag))
        known = fits[first : first + length]
        known = known[np.isfinite(known)]
        if len(known) > length // 2 and (length > 1 or known[0] > motion.FITS_ALONE):
            found.append((length, first + max(0, -lag)))
    return found


def _block(streams: list[Stream], first: int, joints: int) -> Stream:
    part = streams[first : first + joints]
    name = f"columns {part[0].name} to {part[-1].name}" if joints > 1 else f"column {part[0].name}"
    return joined(part, name)
