"""Offset and drift of a clock from the delays of many events, with intervals that include their scatter.

Each event has its own standard error; what they scatter more than that is a variance between events, the same for all
(random effects). Offset and drift follow by regression on time, weighted by both, with Huber's bound on the influence
of an event: one whose standard error is much too small moves the line little, and does not make the soft contacts count
as much as the stiff ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.statistics.interval import Interval
from cdtool.statistics.spread import MAD_TO_STD
from cdtool.truth.synchronisation.delay import EventDelay

# From so many events on, intervals include the scatter between events, and a drift can be estimated.
LEAST_EVENTS = 4
# Residuals count up to so many standard deviations (Huber 1981): 95 % efficiency without outliers. Second, the expected
# square of bounded residuals that are normal.
_BOUND, _BOUNDED_SQUARE = 1.345, 0.71016


@dataclass(frozen=True)
class ClockLine:
    """An offset at the time `at` [s] of the events' centre [s], and a drift [s/s] (NaN: not assessable).

    `used` are the numbers of the events that count; `scatter` [s] is their standard deviation beyond their own errors.
    """

    offset: Interval
    at: float
    drift: Interval
    used: tuple[int, ...]
    scatter: float


def clock_line(events: Sequence[EventDelay]) -> ClockLine:
    """Return the offset and drift that the delays of events show.

    Parameters
    ----------
    events : sequence of EventDelay
        Those with a delay; at least one.

    Returns
    -------
    ClockLine
        With four events or more, delay = offset + drift (time - at). With fewer, drift is not assessable, and the
        interval of the offset rests on the events' own standard errors: it does not include a scatter between events.

    Notes
    -----
    Huber's M-estimate (1981) with deviations sqrt(s_i^2 + tau^2). tau^2 is the one by which the bounded
    residuals are as large as expected, as Paule and Mandel (1982) choose it for unbounded ones. The intervals rest on
    the covariance of the M-estimate, with a variance of the residuals of at least 1 times the expected one, and on
    Student's t with as many degrees of freedom as there are events minus parameters (Knapp and Hartung 2003). Events
    further from the median line (Theil and Sen) than 6 robust standard deviations are left out.

    Examples
    --------
    >>> events = [EventDelay(10.0 * i, 2e-3 + 1e-3 * i / 10, 1e-5, 1.0) for i in range(5)]
    >>> line = clock_line(events)
    >>> round(line.offset.value, 6), round(line.at, 3), round(line.drift.value * 1e6, 3)
    (0.0022, 20.0, 10.0)
    """
    times = np.array([event.time for event in events])
    delays = np.array([event.delay for event in events])
    errors = np.array([event.error for event in events])
    used = _without_outliers(times, delays, errors)
    times, delays, errors = times[used], delays[used], errors[used]
    numbers = tuple(int(number) for number in np.flatnonzero(used))
    with_drift = len(times) >= LEAST_EVENTS and float(np.ptp(times)) > 0.0
    variance = _between(times, delays, errors, with_drift)
    line = _robust_line(times, delays, errors, variance, with_drift)
    free = len(times) - len(line.estimate)
    quantile = _quantile(free if len(times) >= LEAST_EVENTS else _few(events, used))
    covariance = line.covariance() if len(times) >= LEAST_EVENTS else line.least_covariance()
    found = [
        Interval(float(value), float(value) - half, float(value) + half)
        for value, half in zip(line.estimate, quantile * np.sqrt(np.diag(covariance)), strict=True)
    ]
    unknown = Interval(math.nan, math.nan, math.nan)
    return ClockLine(found[0], line.at, found[1] if with_drift else unknown, numbers, math.sqrt(variance))


def _quantile(freedom: float) -> float:
    from scipy import stats

    return float(stats.t.ppf(0.975, freedom))


def _few(events: Sequence[EventDelay], used: BoolArray) -> float:
    """Return the degrees of freedom of the standard errors of few events."""
    free: float = math.fsum(event.freedom for event, counts in zip(events, used, strict=True) if counts)
    # Of few events' free residuals half count: nothing else shows that a standard error is too small. With all
    # of them, intervals of single contacts at 30 to 125 Hz contain the true offset in 82 to 92 of 100 simulated logs.
    return max(0.5 * free, 1.0)


@dataclass(frozen=True)
class _RobustLine:
    """An M-estimate (p,) of the offset at `at` [s], and of the drift, with `design` (n, p) and `residual` (n,).

    Both are in standard deviations; residuals beyond `bound` count as if they were at it.
    """

    at: float
    estimate: FloatArray
    design: FloatArray
    residual: FloatArray
    bound: float

    @property
    def scatter(self) -> float:
        """Return the sum of the squares of the bounded residuals, by what is expected of one normal residual."""
        bounded = np.clip(self.residual, -self.bound, self.bound)
        return float(bounded @ bounded) / (_BOUNDED_SQUARE if math.isfinite(self.bound) else 1.0)

    def least_covariance(self) -> FloatArray:
        """Return the covariance (p, p) if the events scatter as they should."""
        return np.asarray(np.linalg.inv(self.design.T @ self.design), dtype=np.float64)

    def covariance(self) -> FloatArray:
        """Return the covariance (p, p) by the scatter of the events, at least the one expected (Huber 1981, 7.6)."""
        count, parameters = self.design.shape
        # Fewer than 30 % within the bound would make the covariance infinite.
        inside = max(float(np.mean(np.abs(self.residual) < self.bound)), 0.3)
        correction = 1.0 + parameters / count * (1.0 - inside) / inside
        scatter = _BOUNDED_SQUARE * self.scatter / (count - parameters) / inside**2
        return np.asarray(self.least_covariance() * (correction**2 * max(1.0, scatter)), dtype=np.float64)


def _robust_line(
    times: FloatArray, delays: FloatArray, errors: FloatArray, variance: float, with_drift: bool
) -> _RobustLine:
    # Three events do not show which one of them is wrong.
    bound = _BOUND if len(times) >= LEAST_EVENTS else math.inf
    deviation = np.sqrt(errors**2 + variance)
    # About a centre in time, so that few digits are lost.
    middle = float(times.mean())
    design, target = _design(times - middle, with_drift) / deviation[:, np.newaxis], delays / deviation
    shares, residual = np.ones(len(times)), np.full(len(times), np.inf)
    estimate: FloatArray = np.zeros(design.shape[1])
    for _ in range(200):
        root = np.sqrt(shares)
        estimate = np.asarray(np.linalg.lstsq(design * root[:, np.newaxis], target * root, rcond=None)[0])
        before, residual = residual, target - design @ estimate
        if np.max(np.abs(residual - before)) < 1e-9:  # standard deviations
            break
        shares = np.minimum(1.0, bound / np.maximum(np.abs(residual), 1e-300))
    weights = shares / deviation**2
    at = float(weights @ times / weights.sum())
    if with_drift:
        estimate = np.array([estimate[0] + estimate[1] * (at - middle), estimate[1]])
    return _RobustLine(at, estimate, _design(times - at, with_drift) / deviation[:, np.newaxis], residual, bound)


def _design(times: FloatArray, with_drift: bool) -> FloatArray:
    columns = (np.ones(len(times)), times) if with_drift else (np.ones(len(times)),)
    return np.column_stack(columns)


def _between(times: FloatArray, delays: FloatArray, errors: FloatArray, with_drift: bool) -> float:
    """Return the variance between events [s2] by which their bounded residuals are as large as expected."""
    free = len(times) - (2 if with_drift else 1)
    if free < 1:
        return 0.0

    def excess(variance: float) -> float:
        return _robust_line(times, delays, errors, variance, with_drift).scatter - free

    if excess(0.0) <= 0.0:
        return 0.0
    from scipy.optimize import brentq

    high = float(np.var(delays)) + float(np.max(errors) ** 2)
    while excess(high) > 0.0:
        high *= 4.0
    return float(brentq(excess, 0.0, high, xtol=1e-20, rtol=1e-6))


def _without_outliers(times: FloatArray, delays: FloatArray, errors: FloatArray) -> BoolArray:
    if len(times) < LEAST_EVENTS + 1:
        return np.ones(len(times), dtype=np.bool_)
    from scipy import stats

    slope = float(stats.theilslopes(delays, times)[0]) if float(np.ptp(times)) > 0.0 else 0.0
    about = delays - slope * times
    distance = np.abs(about - np.median(about))
    spread = MAD_TO_STD * float(np.median(distance))
    # An event further from the others than six robust standard deviations, or six of its own errors, is not used.
    kept: BoolArray = distance <= 6.0 * np.maximum(spread, errors)
    return kept
