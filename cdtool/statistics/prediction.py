"""The chance that the next run exceeds a limit, predicted from the largest values of a few runs.

Conventions: `values` (n,) are maxima, one per run (critical factors, for example); one more run of the same kind is
predicted. The prediction includes its own uncertainty: with few runs neither mean nor spread is certain.

A run's maximum is modelled as the sum of two parts of equal variance: a normal one that shifts the run as a whole, and
the largest of its noise (Gumbel). Measured by `benchmarks/signature_coverage.py` at commit def748d0: limits for 1 in
1000 are exceeded by 0.4 on average; by 1.8 if the maxima are modelled as normal, by fewer than 0.1 if as Gumbel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError

# Two values have a spread, but none of it is certain.
LEAST_VALUES = 3
# Nobody makes more runs than this.
MOST_RUNS = 1000

# The Gumbel part's share of the variance.
GUMBEL_SHARE = 0.5
# Samples of n maxima on which a prediction rests: the fewer, the longer each is.
_DRAWN, _FEWEST, _MOST = 2_000_000, 2_000, 20_000
# The distribution's tail is tabulated up to so many standard deviations.
_TABLE = np.linspace(-12.0, 60.0, 3601)


@dataclass(frozen=True)
class Prediction:
    """The maxima of several runs: what one more run will do.

    Attributes
    ----------
    n : int
        Number of maxima.
    mean, std : float
        Their mean and standard deviation (n - 1), in their unit.
    gumbel_share : float
        The share of the variance that is modelled as Gumbel.
    """

    n: int
    mean: float
    std: float
    gumbel_share: float = GUMBEL_SHARE

    def chance_above(self, limit: float) -> float:
        """Return the chance that one more run exceeds a limit.

        Parameters
        ----------
        limit : float
            The limit, in the unit of the maxima.

        Returns
        -------
        float
            The chance.

        Notes
        -----
        P(x > limit) = E[S(m + t s)], t = (limit - mean) / std, where m and s are mean and standard deviation of n
        values whose tail is S. The expectation is over samples of the standardised distribution, so that the chance is
        right on average for any true mean and standard deviation.
        """
        if self.std == 0.0:
            return 0.0 if limit > self.mean else 1.0
        return _chance((limit - self.mean) / self.std, self.n, self.gumbel_share)

    def limit_for(self, chance: float) -> float:
        """Return the limit that one more run exceeds with that `chance`: the inverse of `chance_above`.

        The chance is above 0 and below 1, and above the tail at its last tabulated deviation: below, no limit is found.
        """
        if self.std == 0.0:
            return self.mean
        from scipy import optimize

        above = 1.0
        while _chance(above, self.n, self.gumbel_share) > chance:
            above *= 2.0
        below = -1.0
        while _chance(below, self.n, self.gumbel_share) < chance:
            below *= 2.0

        def too_much(t: float) -> float:
            return math.log(max(_chance(t, self.n, self.gumbel_share), 1e-300) / chance)

        return self.mean + self.std * float(optimize.brentq(too_much, below, above, xtol=1e-6))

    def runs_for(self, limit: float, chance: float) -> int | None:
        """Return the smallest number of runs with which `chance_above` is at most `chance`, for equal mean and std.

        More runs make mean and std more certain, not smaller: None if even `MOST_RUNS` are too few.
        """
        if self.std == 0.0:
            return LEAST_VALUES if limit > self.mean else None
        t = (limit - self.mean) / self.std
        if _chance(t, MOST_RUNS, self.gumbel_share) > chance:
            return None
        below, above = LEAST_VALUES - 1, MOST_RUNS
        while above - below > 1:
            middle = (above + below) // 2
            enough = _chance(t, middle, self.gumbel_share) <= chance
            below, above = (below, middle) if enough else (middle, above)
        return above


def prediction_of(values: npt.ArrayLike, gumbel_share: float = GUMBEL_SHARE) -> Prediction:
    """Return what the maxima of several runs predict for one more run.

    Parameters
    ----------
    values : array_like of float, shape (n,)
        The maxima, at least 3, in any unit.
    gumbel_share : float
        The share of the variance that is modelled as Gumbel.

    Returns
    -------
    Prediction
        Their number, mean and standard deviation.

    Raises
    ------
    UsageError
        There are fewer than 3 values, or one is not finite.

    Examples
    --------
    >>> prediction = prediction_of([2.8, 3.0, 3.2, 2.9, 3.1, 3.0, 2.7, 3.3, 3.0, 3.0])
    >>> bool(prediction.chance_above(5.5) < 0.001 < prediction.chance_above(3.5))
    True
    """
    given = np.asarray(values, dtype=np.float64)
    if len(given) < LEAST_VALUES or not np.isfinite(given).all():
        raise UsageError(f"{len(given)} values to predict from", f"at least {LEAST_VALUES}, all of them finite")
    return Prediction(len(given), float(given.mean()), float(given.std(ddof=1)), gumbel_share)


def tail(deviation: npt.ArrayLike, gumbel_share: float = GUMBEL_SHARE) -> FloatArray:
    """Return the chance that a maximum exceeds a limit, for a known mean and standard deviation.

    Parameters
    ----------
    deviation : array_like of float
        The limit's distance from the mean of the maxima, in their standard deviations.
    gumbel_share : float
        The share of the variance that is modelled as Gumbel.

    Returns
    -------
    ndarray of float
        The chance, of the shape of `deviation`; it is constant beyond -12 and 60.

    Examples
    --------
    >>> tail([0.0, 3.0]).round(4).tolist()
    [0.4769, 0.0055]
    """
    log_tail: FloatArray = np.interp(np.asarray(deviation, dtype=np.float64), _TABLE, _log_tail(gumbel_share))
    return np.exp(log_tail)


def _chance(t: float, n: int, share: float) -> float:
    mean, std = _samples(n, share)
    return float(tail(mean + t * std, share).mean())


@cache
def _samples(n: int, share: float) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation of many samples of n from the standardised distribution."""
    rng = np.random.default_rng((1, n))  # the same prediction in every call
    number = int(np.clip(_DRAWN // n, _FEWEST, _MOST))
    scale = _gumbel_scale(share)
    drawn = scale * (rng.gumbel(size=(number, n)) - np.euler_gamma)
    drawn += math.sqrt(1.0 - share) * rng.standard_normal((number, n))
    return drawn.mean(axis=1), drawn.std(axis=1, ddof=1)


@cache
def _log_tail(share: float) -> FloatArray:
    """Return ln P(x > `_TABLE`) of the standardised sum: the Gumbel tail averaged over the normal part."""
    from scipy import stats

    if share == 0.0:
        return np.asarray(stats.norm.logsf(_TABLE))
    nodes, weights = np.polynomial.hermite_e.hermegauss(61)  # Gauss and Hermite, exact to rounding
    reduced = (_TABLE[:, np.newaxis] - math.sqrt(1.0 - share) * nodes) / _gumbel_scale(share) + np.euler_gamma
    log_tail: FloatArray = np.log(-np.expm1(-np.exp(-reduced)) @ (weights / weights.sum()))
    return log_tail


def _gumbel_scale(share: float) -> float:
    """Return the scale of a Gumbel distribution with the variance `share`: pi^2 scale^2 / 6."""
    return math.sqrt(6.0 * share) / math.pi
