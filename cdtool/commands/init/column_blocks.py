"""Find the channels of a table without names: blocks of J columns, one per joint, related by derivatives."""

from __future__ import annotations

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.stream import Stream, joined

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
