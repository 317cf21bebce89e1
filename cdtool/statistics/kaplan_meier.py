"""Latency in the presence of missed contacts: the Kaplan-Meier curve of the share still undetected, and its quantiles.

Conventions: a missed contact is right-censored at the end of the time in which it was monitored; at equal times a
detection comes before a miss. Latencies are not below 0. Contacts are treated as independent of each other.
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cdtool.base.errors import UsageError
from cdtool.statistics.interval import Interval, check_level

if TYPE_CHECKING:
    from cdtool.base.arrays import BoolArray, FloatArray

# A level of the curve within this of the one that is sought is hit exactly: the tolerance of R's survival package.
_EXACT = math.sqrt(np.finfo(np.float64).eps)


class Survival(NamedTuple):
    """A step curve of the share still undetected, with its confidence band.

    Attributes
    ----------
    times : ndarray of float, shape (m,)
        Where the steps are, in the unit of the latencies; the first is 0.
    share : ndarray of float, shape (m,)
        The share undetected from each time to the next; the first is 1.
    low, high : ndarray of float, shape (m,)
        The band.
    """

    times: FloatArray
    share: FloatArray
    low: FloatArray
    high: FloatArray


def survival(latency: npt.ArrayLike, censored: npt.ArrayLike, level: float = 0.95) -> Survival:
    """Return the share of contacts still undetected over time.

    Parameters
    ----------
    latency : array_like of float, shape (n,)
        Latency of each contact in any unit of time, not below 0; of a missed contact the time for which it was
        monitored.
    censored : array_like of bool, shape (n,)
        True if the contact was missed.
    level : float
        Confidence level of the band.

    Returns
    -------
    Survival
        The curve and its band. Empty input: only the time 0, with a band from 0 to 1.

    Raises
    ------
    UsageError
        The lengths differ, a latency is below 0 or not finite, or the level is not between 0 and 1.

    Notes
    -----
    Kaplan and Meier, "Nonparametric estimation from incomplete observations", JASA 53, 1958:

        S(t) = product over t_i <= t of 1 - d_i / n_i

    d_i contacts are detected at t_i, n_i were monitored and undetected until then. The band holds at each time, not for
    the whole curve: S ** exp(-+ z sqrt(V) / ln S), V = sum of d_i / (n_i (n_i - d_i)) (log-log of Greenwood's
    variance). At S = 1, where it does not exist, it is the exact bound of 0 of n_i; at S = 0 the upper limit is held,
    or if several contacts are detected at the last time, the exact bound of 0 of all detected; the lower is 0.

    Examples
    --------
    Three contacts are detected after 30, 40 and 50 ms; one was missed in 1000 ms.

    >>> curve = survival([30.0, 40.0, 50.0, 1000.0], [False, False, False, True])
    >>> curve.times[:4].tolist(), curve.share[:4].tolist()
    ([0.0, 30.0, 40.0, 50.0], [1.0, 0.75, 0.5, 0.25])
    """
    check_level(level)
    time, missed = _checked(latency, censored)
    if not len(time):
        return Survival(np.zeros(1), np.ones(1), np.zeros(1), np.ones(1))
    times, share, low, high = _curve(time, missed, level)
    times = np.concatenate(([0.0], times))
    share, low, high = (np.concatenate(([1.0], column)) for column in (share, low, high))
    watched = len(time) - np.searchsorted(np.sort(time), times)
    low = np.where(share == 1.0, (0.5 - 0.5 * level) ** (1.0 / watched), low)
    high = np.where(share == 1.0, 1.0, high)
    return Survival(times, share, low, np.where(np.isnan(high), np.fmin.accumulate(high), high))


def latency_quantile(latency: npt.ArrayLike, censored: npt.ArrayLike, share: float, level: float = 0.95) -> Interval:
    """Return the latency within which a share of the contacts is detected, counting misses.

    Parameters
    ----------
    latency : array_like of float, shape (n,)
        Latency of each contact in any unit of time, not below 0; of a missed contact the time for which it was
        monitored.
    censored : array_like of bool, shape (n,)
        True if the contact was missed.
    share : float
        0.5 for the median, 0.95 for the P95.
    level : float
        Confidence level.

    Returns
    -------
    Interval
        In the unit of the latencies. Infinite: not reached in the time monitored, because too many were missed or there
        are too few contacts (with all detected, the median has an upper limit with 7 contacts or more, the P95 with
        98). Empty input: NaN.

    Raises
    ------
    UsageError
        The lengths differ, a latency is below 0 or not finite, or `share` or `level` is not between 0 and 1.

    Notes
    -----
    The time at which S(t) = 1 - share (see `survival`), as R's survival::quantile.survfit defines it: the first time at
    which S is at or below 1 - share; if S equals 1 - share on a whole step, the middle of that step, from its beginning
    to the next detection or to the last time monitored. So the median of an even number of detections is the usual one.
    Interval of Brookmeyer and Crowley, "A confidence interval for the median survival time", Biometrics 38, 1982: the
    times, by the same definition, at which the limits of the log-log band pass 1 - share. If all were detected at one
    time, or none was, the curve has no band: exact binomial bounds replace it.

    Examples
    --------
    >>> latency_quantile([30.0, 40.0, 50.0, 1000.0], [False, False, False, True], 0.5).value
    45.0
    >>> latency_quantile([30.0, 40.0, 50.0, 1000.0], [False, False, False, True], 0.95).value
    inf
    """
    check_level(level)
    if not 0.0 < share < 1.0:
        raise UsageError(f"quantile is {share:g}", "give a share between 0 and 1, such as 0.95 for the P95")
    time, missed = _checked(latency, censored)
    if not len(time):
        return Interval(math.nan, math.nan, math.nan, level)
    times, curve, low, high = _curve(time, missed, level)
    value = _reached(times, curve, 1.0 - share)
    if np.all((curve == 0.0) | (curve == 1.0)):
        return _without_band(time, missed, value, share, level)
    return Interval(value, _reached(times, low, 1.0 - share), _reached(times, high, 1.0 - share), level)


def _checked(latency: npt.ArrayLike, censored: npt.ArrayLike) -> tuple[FloatArray, BoolArray]:
    time = np.asarray(latency, dtype=np.float64)
    missed = np.asarray(censored, dtype=np.bool_)
    if time.ndim != 1 or time.shape != missed.shape:
        hint = "give one of each per contact"
        raise UsageError(f"latency {time.shape} and censored {missed.shape} do not match", hint)
    if not np.all(np.isfinite(time) & (time >= 0.0)):
        hint = "for a missed contact, give the time for which it was monitored"
        raise UsageError("a latency is missing or below 0", hint)
    return time, missed


def _curve(time: FloatArray, missed: BoolArray, level: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return times, S and its log-log band; the lower limit is 0 at S = 0, the upper one NaN; both are NaN at S = 1.

    If several are detected at the last time, the upper limit there is the exact bound of 0 of n detected: between
    coarse times the curve has no step close to 0 whose limit could be used.
    """
    from scipy import stats

    sample: stats.CensoredData[np.float64] = stats.CensoredData(time[~missed], right=time[missed])
    curve = stats.ecdf(sample).sf
    with warnings.catch_warnings():
        # scipy warns of the NaN at S = 0 and S = 1, which the callers deal with.
        warnings.simplefilter("ignore", RuntimeWarning)
        band: Any = curve.confidence_interval(level, method="log-log")
    low = np.where(curve.probabilities == 0.0, 0.0, band.low.probabilities)
    tied = np.count_nonzero(time[~missed] == time.max()) > 1
    unseen = 1.0 - (0.5 - 0.5 * level) ** (1.0 / np.count_nonzero(~missed)) if tied else math.nan
    high = np.where(curve.probabilities == 0.0, unseen, band.high.probabilities)
    return curve.quantiles, curve.probabilities, low, high


def _reached(times: FloatArray, level: FloatArray, target: float) -> float:
    """Return the time at which a falling step curve is at `target`; infinite if never."""
    at = np.flatnonzero(level <= target + _EXACT)
    if not len(at):
        return math.inf
    below = np.flatnonzero(level < target - _EXACT)
    return float(0.5 * (times[at[0]] + times[below[0] if len(below) else -1]))


def _without_band(time: FloatArray, missed: BoolArray, value: float, share: float, level: float) -> Interval:
    """Return the interval if all are detected at one time, or none is.

    A bound is the value itself if all n of n on one side of the quantile have a chance below (1 - level) / 2.
    """
    detected = time[~missed]
    watched = np.count_nonzero(time >= detected[0]) if len(detected) else len(time)
    certain = (0.5 - 0.5 * level) ** (1.0 / watched)
    low = value if certain > 1.0 - share else 0.0
    high = value if 1.0 - certain < 1.0 - share else math.inf
    return Interval(value, low, high, level)
