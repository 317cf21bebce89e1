"""A normal band that follows the slow change of a run: other friction, other temperature, a sensor's offset.

The level m is the mean deviation of the signal from what was learned. It is learned from the run itself, over about
2 s, and only from samples that are at least 0.3 s old, so that it does not follow a contact before its alarm::

    m += g c(i - mean - m),    g = step / min(time in motion, 2 s)

c limits a deviation to 3 spreads once 0.3 s of motion have been learned from. While the signal is more than 4 spreads
from the level, and for 0.3 s afterwards, nothing is learned. The level is never more than `reach` spreads from what was
learned. Until 1 s of motion has been learned from, that is for about 1.3 s, the band is wider, twice at first.
"""

from __future__ import annotations

import math

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.detection import Status, StatusArray
from cdtool.recordings.motion.speed_range import GUARD, MEMORY

# A deviation counts as at most so many spreads, and nothing is learned from one of more than so many.
CLIP, FREEZE = 3.0, 4.0
# The band is so many times as wide at the start, and as learned after this time in motion [s].
WIDER, START = 2.0, 1.0

_TABLE = "Array(float64, 2, 'C', readonly=True)"


@kernel(
    f"void({READ_ONLY}, {_TABLE}, {_TABLE}, {_TABLE}, Array(uint8, 2, 'C', readonly=True), float64, "
    "float64[:,::1], float64[:,::1])"
)
def follow_level(
    time: FloatArray,
    values: FloatArray,
    mean: FloatArray,
    spread: FloatArray,
    status: StatusArray,
    reach: float,
    lower: FloatArray,
    upper: FloatArray,
) -> None:
    """Move both limits (n, J) with the level of each column, and widen them at the start of the motion.

    `mean` and `spread` (n, J): what was learned, NaN where nothing was. `reach`: in spreads.
    """
    for column in range(values.shape[1]):
        level = learned = 0.0
        old, frozen_until = 0, -math.inf
        for k in range(len(time)):
            wider = 1.0 + (WIDER - 1.0) * max(0.0, 1.0 - learned / START)
            middle, wide = mean[k, column], spread[k, column]
            departure = abs(values[k, column] - middle - level)
            if status[k, column] == Status.VALID and learned >= GUARD and departure > FREEZE * wider * wide:
                frozen_until = time[k] + GUARD
            while old < k and time[old] <= time[k] - GUARD:
                deviation = values[old, column] - mean[old, column] - level
                if status[old, column] == Status.VALID and time[k] > frozen_until and math.isfinite(deviation):
                    # What happened in a gap is unknown: the sample before it counts for the guard at most.
                    step = min(time[old + 1] - time[old], GUARD)
                    learned += step
                    if learned > GUARD:
                        most = CLIP * spread[old, column]
                        deviation = min(max(deviation, -most), most)
                    if learned > 0.0:
                        level += step / min(learned, MEMORY) * deviation
                old += 1
            shift = min(max(level, -reach * wide), reach * wide)
            lower[k, column] = middle + shift + wider * (lower[k, column] - middle)
            upper[k, column] = middle + shift + wider * (upper[k, column] - middle)
