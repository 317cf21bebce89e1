"""Whether a log is sampled as the runs were that a model was learned from, so far."""

from __future__ import annotations

import numpy as np

from cdtool.recording import BoolArray, FloatArray

# Sample periods differ from the learned one by at most this share: a model counts in samples.
PERIOD_TOLERANCE = 0.2
# The median of this many steps decides; while there are fewer than the second number, the rate is taken to be right.
_STEPS, _ENOUGH = 101, 20


def at_learned_rate(time: FloatArray, period: float) -> BoolArray:
    """Return (n,) where the median of the steps so far, the last 101, lies within 20 % of `period` [s]. Causal.

    A median: lost samples and jitter do not move it.
    """
    steps = np.diff(time)
    long, short = steps > (1.0 + PERIOD_TOLERANCE) * period, steps < (1.0 - PERIOD_TOLERANCE) * period
    count = np.arange(1, len(steps) + 1)
    recent = np.minimum(count, _STEPS)
    right = np.ones(len(time), dtype=bool)
    for odd in (long, short):
        total = np.concatenate(([0], np.cumsum(odd)))
        right[1:] &= total[1:] - total[count - recent] <= 0.5 * np.maximum(recent, _ENOUGH)
    return right
