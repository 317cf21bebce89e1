"""The delay of a signal against another one in an event or a section, with its standard error.

The model is y(t) = scale x(t - delay) + offset + residual: scale and offset are estimated together with the delay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.truth.synchronisation.smoothing import Grid

# The best fit must explain this share of the variance (the correlation is its root).
LEAST_EXPLAINED = 0.5
# A second maximum of the explained share counts as another solution from this share of the first one.
_AMBIGUOUS = 0.95
# A correlation counts from so many standard deviations of chance: the best of many delays is chosen.
# An event that both signals must show, as a contact, needs less.
_SIGNIFICANT, _SIGNIFICANT_EVENT = 3.5, 2.0
# A section needs so many grid points.
LEAST_POINTS = 16


@dataclass(frozen=True)
class EventDelay:
    """The delay of one event: `time` of the event [s], `delay` and its standard error [s], number of free residuals.

    `explained` is the share of the variance that the fit explains; `reason` states why there is no delay (NaN).
    """

    time: float
    delay: float
    error: float
    explained: float
    freedom: float = math.inf
    reason: str = ""

    @property
    def known(self) -> bool:
        """Whether there is a delay."""
        return not self.reason


@dataclass(frozen=True)
class SmoothSignal:
    """A signal (n,) on a grid; NaN where samples are missing."""

    grid: Grid
    values: FloatArray


def delay_of(
    observed: SmoothSignal,
    predictor: SmoothSignal,
    start: float,
    end: float,
    longest: float,
    is_transient: bool = True,
) -> EventDelay:
    """Return the delay of an observed signal against its predictor, in one event or section.

    Parameters
    ----------
    observed : SmoothSignal
        A signal y (n,).
    predictor : SmoothSignal
        A signal x (n,) on a grid with the same step, of which a point is a point of the observed one's; it should
        extend beyond the event by the longest delay.
    start, end : float
        The event on the observed signal's clock [s].
    longest : float
        Delays from -longest to longest are tried [s].
    is_transient : bool, optional
        The section contains one event that both signals must show, as a contact. Otherwise the correlation must exceed
        by far what chance explains at the best of many delays.

    Returns
    -------
    EventDelay
        The delay; positive: the observed signal's stamps are later than the predictor's.

    Notes
    -----
    All delays on the grid are compared by the share of the variance that the linear model explains; the best one is
    refined by Gauss and Newton, with cubic splines between the grid's points. The standard error is the sandwich of the
    least-squares estimate, with the autocovariance of the residual by Bartlett's weights (Newey and West 1987), as
    smoothed noise is correlated. No delay is returned if the fit explains less than half of the variance, at the limits
    of the range, or if two delays fit almost equally (a periodic motion).

    Examples
    --------
    >>> import numpy as np
    >>> grid = Grid.over(0.0, 2.0, 0.005)
    >>> bump = lambda t: np.exp(-(((t - 1.0) / 0.05) ** 2))
    >>> late = SmoothSignal(grid, 2.0 * bump(grid.times - 0.0123))
    >>> true = SmoothSignal(grid, bump(grid.times))
    >>> round(delay_of(late, true, 0.8, 1.2, longest=0.1).delay, 6)
    0.0123
    """
    grid, step = observed.grid, observed.grid.step
    first = max(math.ceil((start - grid.start) / step - 1e-6), 0)
    last = min(math.floor((end - grid.start) / step + 1e-6), grid.count - 1)
    middle = 0.5 * (start + end)
    y = observed.values[first : last + 1]
    shift = round((grid.start - predictor.grid.start) / step) + first
    most = max(int(longest / step), 1)
    x = _section(predictor.values, shift - most, len(y) + 2 * most)
    # The delay does not depend on scales; squares of large or small numbers would overflow or vanish.
    y, x = _scaled(y), _scaled(x)
    if np.count_nonzero(np.isfinite(y)) < LEAST_POINTS:
        return _unknown(middle, "too few samples")
    explained = _explained(y, x, most)
    if not np.isfinite(explained).any():
        return _unknown(middle, "too few samples")
    best = int(np.nanargmax(explained))
    share = float(explained[best])
    reason = _doubt(explained, best)
    least = _SIGNIFICANT_EVENT if is_transient else _SIGNIFICANT
    if not reason and _chance(y, x[2 * most - best :][: len(y)], share) < least:
        reason = f"correlation {math.sqrt(share):.2f} may be chance"
    if reason:
        return EventDelay(middle, math.nan, math.nan, share, reason=reason)
    return _refined(y, x, most, (best - most) * step, step, middle)


def _chance(y: FloatArray, x: FloatArray, explained: float) -> float:
    """Return the correlation in standard deviations of that of independent signals with these autocorrelations.

    Fisher's transform, with the effective number of samples n / sum_k r_x(k) r_y(k) (Bartlett 1935).
    """
    both = np.isfinite(y) & np.isfinite(x)
    one, other = y[both] - y[both].mean(), x[both] - x[both].mean()
    lags = len(one) // 2
    products = 1.0
    for lag in range(1, lags):
        products += (
            2.0 * float((one[lag:] @ one[:-lag]) * (other[lag:] @ other[:-lag])) / float((one @ one) * (other @ other))
        )
    independent = len(one) / max(products, 1.0)
    return math.atanh(min(math.sqrt(max(explained, 0.0)), 1.0 - 1e-12)) * math.sqrt(max(independent - 3.0, 1.0))


def _unknown(middle: float, reason: str) -> EventDelay:
    return EventDelay(middle, math.nan, math.nan, math.nan, reason=reason)


def _scaled(values: FloatArray) -> FloatArray:
    """Return values divided by the largest of them; infinite ones are missing."""
    known = np.where(np.isfinite(values), values, np.nan)
    largest = float(np.max(np.abs(known), initial=0.0, where=np.isfinite(known)))
    return np.asarray(known / largest if largest > 0.0 else known, dtype=np.float64)


def _section(values: FloatArray, begin: int, count: int) -> FloatArray:
    """Return the values (n,) from `begin` to `begin + count`, NaN outside of them."""
    found = np.full(count, np.nan)
    low, high = max(begin, 0), min(begin + count, len(values))
    if high > low:
        found[low - begin : high - begin] = values[low:high]
    return found


def _explained(y: FloatArray, x: FloatArray, most: int) -> FloatArray:
    """Return the explained share of the variance for the lags -most to most (steps), NaN where points are missing."""
    is_y, is_x = np.isfinite(y), np.isfinite(x)
    shares = np.full(2 * most + 1, np.nan)
    if not is_y.any() or not is_x.any():
        return shares
    known_y, known_x = is_y.astype(np.float64), is_x.astype(np.float64)
    # About their means, so that sums of squares lose few digits; a missing point counts as 0 in each sum.
    own = np.where(is_y, y - y[is_y].mean(), 0.0)
    other = np.where(is_x, x - x[is_x].mean(), 0.0)

    def sums(of_x: FloatArray, of_y: FloatArray) -> FloatArray:
        return np.asarray(np.correlate(of_x, of_y, "valid")[::-1], dtype=np.float64)

    count = np.maximum(sums(known_x, known_y), 1.0)
    sum_x, sum_y = sums(other, known_y), sums(known_x, own)
    squares_x = sums(other**2, known_y) - sum_x**2 / count
    squares_y = sums(known_x, own**2) - sum_y**2 / count
    products = sums(other, own) - sum_x * sum_y / count
    sound = count >= max(LEAST_POINTS, np.count_nonzero(is_y) // 2)
    sound &= (squares_x > 1e-24 * count) & (squares_y > 1e-24 * count)  # of values up to 1, less is rounding
    shares[sound] = products[sound] ** 2 / (squares_x[sound] * squares_y[sound])
    return shares


def _doubt(explained: FloatArray, best: int) -> str:
    """Return why the best lag is not the delay; empty if it is."""
    share = float(explained[best])
    if share < LEAST_EXPLAINED:
        return f"correlation {math.sqrt(max(share, 0.0)):.2f}"
    known = np.flatnonzero(np.isfinite(explained))
    if best in (known[0], known[-1]):
        return "at the limit of the range of delays"
    inner = explained[1:-1]
    with np.errstate(invalid="ignore"):
        peaks = np.flatnonzero((inner >= explained[:-2]) & (inner > explained[2:])) + 1
    for peak in peaks[peaks != best]:
        between = explained[min(peak, best) : max(peak, best) + 1]
        if explained[peak] > _AMBIGUOUS * share and np.nanmin(between) < _AMBIGUOUS * explained[peak]:
            return "periodic: several delays fit"
    return ""


def _refined(y: FloatArray, x: FloatArray, most: int, delay: float, step: float, middle: float) -> EventDelay:
    from scipy.interpolate import CubicSpline

    at_y = np.asarray(step * np.arange(len(y)), dtype=np.float64)
    at_x = step * (np.arange(len(x)) - most)
    is_x = np.asarray(np.isfinite(x))
    spline = CubicSpline(at_x[is_x], x[is_x])
    for _ in range(20):  # steps of Gauss and Newton, which end at 1e-4 of the grid's step
        both = _usable(y, is_x, at_y - delay, float(at_x[0]), step)
        if np.count_nonzero(both) < LEAST_POINTS:
            return _unknown(middle, "too few samples")
        shifted, rate = spline(at_y[both] - delay), spline(at_y[both] - delay, 1)
        design = np.column_stack((np.ones(len(shifted)), shifted))
        linear = np.linalg.lstsq(design, y[both], rcond=None)[0]
        residual = y[both] - design @ linear
        sensitivity = -rate * linear[1]
        # What a change of scale or offset could explain says nothing about the delay.
        own = sensitivity - design @ np.linalg.lstsq(design, sensitivity, rcond=None)[0]
        power = float(own @ own)
        if power <= 1e-9 * float(sensitivity @ sensitivity) or power == 0.0:
            return _unknown(middle, "the signals do not change enough")
        change = float(own @ residual) / power
        delay += float(np.clip(change, -step, step))
        if abs(change) < 1e-4 * step:
            break
    else:
        return _unknown(middle, "no unique delay")
    if not abs(delay) < most * step:
        return _unknown(middle, "at the limit of the range of delays")
    error, freedom = _standard_error(own, residual)
    total = float(np.sum((y[both] - y[both].mean()) ** 2))
    explained = 1.0 - float(residual @ residual) / total
    # A standard error is at least 1 ns: data without noise do not make an infinite weight.
    return EventDelay(middle, delay, max(error, 1e-9), explained, freedom)


def _usable(y: FloatArray, is_x: BoolArray, at: FloatArray, first: float, step: float) -> BoolArray:
    """Return which points of y have predictors on both sides at their shifted times `at`."""
    place = np.clip(np.floor((at - first) / step).astype(np.int64), 0, len(is_x) - 2)
    usable: BoolArray = np.isfinite(y) & is_x[place] & is_x[place + 1]
    return usable


def _standard_error(own: FloatArray, residual: FloatArray) -> tuple[float, float]:
    """Return the standard error of the delay [s], and the number of residuals on which it rests, less parameters.

    The larger of two estimates: with the autocovariance of the scores (Newey and West), and with that of the residual.
    """
    count, power = len(own), float(own @ own)
    # Six widths of the smoothing, and an eighth of a long section.
    lags = min(max(12, count // 8), count - 1)
    weights = 1.0 - np.arange(1, lags + 1) / (lags + 1)
    of_scores, of_residual, of_own = (_autocovariance(item, lags) for item in (own * residual, residual, own))
    scores = float(of_scores[0] + 2.0 * weights @ of_scores[1:])
    stationary = float(of_residual[0] * power + 2.0 * (weights * of_residual[1:]) @ of_own[1:]) / count
    variance = max(scores, stationary, float(of_scores[0]))
    # Of the independent residuals those count at which the signals change.
    decay = max(1.0 + 2.0 * float(weights @ of_residual[1:]) / max(float(of_residual[0]), 1e-300), 1.0)
    independent = power**2 / float(np.sum(own**4)) / decay
    freedom = max(independent - 4.0, 1.0)  # scale, offset, delay and the width of the smoothing
    return math.sqrt(variance * max(independent / freedom, 1.0)) / power, freedom


def _autocovariance(values: FloatArray, lags: int) -> FloatArray:
    """Return the sums of the products of values (n,) with later ones, for lags 0 to `lags`."""
    return np.array([values[lag:] @ values[: len(values) - lag] for lag in range(lags + 1)])
