"""Where a log shows that a joint moves: its average speed over the last 0.1 s differs from zero by more than noise."""

from __future__ import annotations

import math

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.recordings.motion.motion_class import AVERAGED_SAMPLES, AVERAGED_SECONDS
from cdtool.recordings.recording import Series


def evident_speed(speed: Series) -> FloatArray:
    """Return the average speed over the last 0.1 s (n, J) where it shows motion, and 0 elsewhere.

    Parameters
    ----------
    speed : Series
        The speed (n, J), in any unit; NaN: no sample.

    Returns
    -------
    ndarray of float, shape (n, J)
        Mean of the last 0.1 s, and of the last 5 samples at least, if its magnitude is above 5 of its standard errors;
        otherwise 0. Causal.

    Notes
    -----
    No scale is needed: it works for a joint whose nominal speed is unknown. A drift of a filtered speed at rest can
    count as slow motion.

    Examples
    --------
    >>> noise = 0.01 * np.array([1.0, -2.0, 1.5, -1.0, 0.5, -1.5, 1.0, -0.5, 0.0, 1.0])
    >>> speed = Series(0.02 * np.arange(10), noise + np.repeat([0.0, 0.5], 5), "m/s")
    >>> evident_speed(speed)[[4, 9], 0].round(3).tolist()
    [0.0, 0.417]
    """
    found = np.zeros(speed.values.shape)
    column = np.empty(len(speed))
    for joint in range(speed.joint_count):
        _evident(speed.time, np.ascontiguousarray(speed.values[:, joint]), column)
        found[:, joint] = column
    return found


@kernel(f"void({READ_ONLY}, {READ_ONLY}, float64[::1])")
def _evident(time: FloatArray, speed: FloatArray, found: FloatArray) -> None:
    for k in range(len(time)):
        found[k] = 0.0
        count, total, first = 0, 0.0, k
        for i in range(k, -1, -1):
            if time[k] - time[i] > AVERAGED_SECONDS and k - i >= AVERAGED_SAMPLES:
                break
            first = i
            if math.isfinite(speed[i]):
                count += 1
                total += speed[i]
        if count < 3:  # with fewer samples, noise cannot be told from motion
            continue
        mean, squares = total / count, 0.0
        for i in range(first, k + 1):
            if math.isfinite(speed[i]):
                squares += (speed[i] - mean) ** 2
        error = math.sqrt(squares / (count - 1) / count)
        if abs(mean) > 5.0 * error:  # standard errors from zero: hardly noise
            found[k] = mean
