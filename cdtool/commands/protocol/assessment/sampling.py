"""How often a sensor was read, and what may have been between its readings.

Conventions: curves of a force [N], or of a pressure [N/cm2], over the time since the contact [s]. A log repeats each
reading of a sensor that is slower than the log.
"""

from __future__ import annotations

import math

import numpy as np

from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.verdict import StepVerdict
from cdtool.truth.missing_samples import CellClock


def repeats(curve: ForceTimeCurve) -> int:
    """Return how many samples of the log in a row have one reading of the sensor, at least 1."""
    changes = np.flatnonzero(np.diff(curve.force))
    if len(changes) < 20:  # they show nothing
        return 1
    # A steady force repeats, too: a tenth of the changes follows the one before as soon as the sensor can.
    return int(np.quantile(np.diff(changes), 0.1, method="lower"))


def sample_rate(curve: ForceTimeCurve) -> float:
    """Return the measured sample rate of the sensor [Hz]; NaN below two samples.

    It is the inverse of the median step, divided by how often the log repeats each reading.
    """
    period = (curve.clock or CellClock(curve.time)).period
    return 1.0 / (period * repeats(curve)) if period > 0.0 else math.nan


def above_between_samples(curve: ForceTimeCurve, step: StepVerdict, alone: float) -> float:
    """Return by how much the curve may exceed the peak of a step between samples.

    Three readings a, m, b of half a sine are t apart with cos t = (a + b) / 2 m, and its peak is the square root of
    m^2 + ((b - a) / 2 sin t)^2. Beside a single reading that is twice as large as one beside it, `alone` times as much
    may be missed.
    """
    highest, apart = int(np.searchsorted(curve.time, step.peak_at)), repeats(curve)
    before = float(curve.force[highest - apart]) if highest >= apart else 0.0
    after = float(curve.force[min(highest + apart, len(curve.force) - 1)])
    before, after = min(before, step.peak), min(after, step.peak)
    # Readings from half of a peak on, before and after it, show its shape; a single one may be that of a spike.
    if not min(before, after) >= 0.5 * step.peak > 0.0:
        return alone * abs(step.peak)
    sine = math.sin(math.acos((before + after) / (2.0 * step.peak)))
    return math.hypot(step.peak, 0.5 * (after - before) / sine) - step.peak if after != before else 0.0


def equal_readings_at_peak(curve: ForceTimeCurve) -> int:
    """Return how many readings in a row are the largest one; a log that repeats each reading counts it once."""
    at_peak = np.concatenate(([False], curve.force == curve.peak, [False]))
    edges = np.flatnonzero(np.diff(at_peak))
    return int((edges[1::2] - edges[::2]).max()) // repeats(curve)
