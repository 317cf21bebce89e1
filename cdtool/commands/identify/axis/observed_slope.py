"""The slope that a torque command had at least, for a slew limit that logs without its saturation do not show."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.filtered_regression import known_sections
from cdtool.machines.axis_model.axis_run import AxisRun

# The median of the magnitude of normal noise over its standard deviation.
_MEDIAN_TO_DEVIATION = 0.6745
# The largest of thousands of values of noise, in standard deviations.
_NOISE_DEVIATIONS = 4.0
# A measured torque is averaged over at least so many samples.
_FEWEST_SAMPLES = 4
# Lags of the torque over which its slope is taken: it has followed the command by then.
_LAGS = 3.0
# Windows, in shortest ones.
_WINDOWS = (1, 2, 4, 8, 16)


def observed_slope(runs: Sequence[AxisRun], is_command: bool, lag: float = math.nan) -> float:
    """Return a slope that the command reached in these runs [N/s, N m/s]; NaN where no run is long enough.

    Of a logged command it is the largest change from sample to sample. Of the measured torque, which follows the
    command later and flatter by the time constant `lag` [s], it is the largest mean slope over a window of at
    least three lags, less what noise adds: never more than the command had.
    """
    found = [slope for run in runs if math.isfinite(slope := _of_run(run, is_command, lag))]
    return max(found, default=math.nan)


def _of_run(run: AxisRun, is_command: bool, lag: float) -> float:
    values = run.reference_torque if is_command else run.torque
    if values is None:
        return math.nan
    if is_command:
        return _largest(np.diff(values)) / run.period
    shortest = max(_FEWEST_SAMPLES, round(_LAGS * lag / run.period) if math.isfinite(lag) else 0)
    known = np.isfinite(values)
    # A long window has little noise, a short one sees a short rise: each is a bound, and the highest counts.
    slopes = [
        _rise(values[a:b], window) / (window * run.period)
        for a, b in known_sections(known)
        for window in (shortest * factor for factor in _WINDOWS)
        if b - a > 3 * window
    ]
    return max(slopes, default=math.nan)


def _rise(values: FloatArray, window: int) -> float:
    """Return the largest change of the mean over a window to the next window, less what noise adds to it.

    The noise of a measured torque has passed its filter and is not white: its size is that of the usual change, which
    is noise alone as long as the torque is steady for more than half of the run.
    """
    means = np.convolve(values, np.full(window, 1.0 / window), mode="valid")
    changes = np.abs(means[window:] - means[:-window])
    noise = float(np.median(changes)) / _MEDIAN_TO_DEVIATION
    return max(float(np.max(changes)) - _NOISE_DEVIATIONS * noise, 0.0)


def _largest(changes: FloatArray) -> float:
    sizes = np.abs(changes)
    return float(np.nanmax(sizes)) if np.isfinite(sizes).any() else math.nan
