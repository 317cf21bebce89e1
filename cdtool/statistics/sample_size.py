"""How many impacts, or how many hours, a test needs before it is run.

Conventions: `level` is the confidence of the result (two-sided for differences, one-sided for "at most"), `power` the
chance that a difference of that size is then shown. Standard deviations are estimates from earlier tests. Contacts are
treated as independent: with several per recording, count recordings.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from cdtool.base.errors import UsageError
from cdtool.statistics.interval import check_level
from cdtool.statistics.rates import binomial_at_most, check_count, poisson_at_most

# Nobody makes more impacts than this.
_MOST = 10_000_000


def impacts_for_difference(
    difference: float, std_of_differences: float, power: float = 0.8, level: float = 0.95
) -> int:
    """Return the number of impacts for which a paired t-test shows a mean difference between two detectors.

    Parameters
    ----------
    difference : float
        The difference to be shown, above 0.
    std_of_differences : float
        Standard deviation of the differences within pairs, in the same unit.
    power : float
        Chance that the test shows it.
    level : float
        Confidence level.

    Returns
    -------
    int
        The smallest sufficient number.

    Raises
    ------
    UsageError
        A number is not above 0, a share is outside its range, or more than ten million impacts are needed.

    Notes
    -----
    The smallest n with P(|T| > t) >= power, T noncentral t with n - 1 degrees of freedom and noncentrality
    difference / std * sqrt(n), t its central quantile at (1 + level) / 2. Skewed differences need a few more.

    Examples
    --------
    >>> impacts_for_difference(5.0, 8.0)
    23
    """
    effect = _effect(difference, std_of_differences, power, level)
    return _least(2, lambda n: _power(effect * math.sqrt(n), n - 1, level) >= power)


def impacts_for_unpaired(difference: float, std: float, power: float = 0.8, level: float = 0.95) -> int:
    """Return the number of impacts in each of two groups for which a t-test shows a difference of their means.

    Parameters
    ----------
    difference : float
        The difference to be shown, above 0.
    std : float
        Standard deviation within a group, in the same unit.
    power : float
        Chance that the test shows it.
    level : float
        Confidence level.

    Returns
    -------
    int
        The smallest sufficient number per group.

    Raises
    ------
    UsageError
        A number is not above 0, a share is outside its range, or more than ten million impacts are needed.

    Notes
    -----
    As `impacts_for_difference`, with 2 n - 2 degrees of freedom and noncentrality difference / std * sqrt(n / 2).

    Examples
    --------
    >>> impacts_for_unpaired(5.0, 8.0)
    42
    """
    effect = _effect(difference, std, power, level)
    return _least(2, lambda n: _power(effect * math.sqrt(0.5 * n), 2 * n - 2, level) >= power)


def detectable_difference(n: int, std: float, power: float = 0.8, level: float = 0.95) -> float:
    """Return the mean difference that a paired t-test shows with a given number of impacts.

    Parameters
    ----------
    n : int
        Number of impacts, at least 2.
    std : float
        Standard deviation of the differences within pairs.
    power : float
        Chance that the test shows it.
    level : float
        Confidence level.

    Returns
    -------
    float
        The difference, in the unit of `std`.

    Raises
    ------
    UsageError
        There are fewer than 2 impacts, `std` is not above 0, or a share is outside its range.

    Notes
    -----
    The inverse of `impacts_for_difference`.

    Examples
    --------
    >>> bool(detectable_difference(23, 8.0) <= 5.0 < detectable_difference(22, 8.0))
    True
    """
    _check_power(power, level)
    _check_above_zero("standard deviation", std)
    check_count("n", n)
    if n < 2:
        raise UsageError(f"n is {n}", "a standard deviation requires at least 2 impacts")
    from scipy import optimize

    def lacking(noncentrality: float) -> float:
        return _power(noncentrality, n - 1, level) - power

    above = 1.0
    while lacking(above) < 0.0:
        above *= 2.0
    return float(optimize.brentq(lacking, 0.0, above, xtol=1e-12)) * std / math.sqrt(n)


def impacts_for_missed_share(share: float, allowed_missed: int = 0, level: float = 0.95) -> int:
    """Return the number of impacts that show that no more than a share of them is missed.

    Parameters
    ----------
    share : float
        The share to be excluded, between 0 and 1.
    allowed_missed : int
        Number of misses allowed in the test.
    level : float
        Confidence level, one-sided.

    Returns
    -------
    int
        The smallest sufficient number.

    Raises
    ------
    UsageError
        The share or the level is outside 0 to 1, or more than ten million impacts are needed.

    Notes
    -----
    The smallest n whose `binomial_at_most` is at most `share`: ln(1 - level) / ln(1 - share) without a miss.

    Examples
    --------
    >>> impacts_for_missed_share(0.05)
    59
    """
    check_level(level)
    check_count("allowed_missed", allowed_missed)
    if not 0.0 < share < 1.0:
        raise UsageError(f"missed share is {share:g}", "give a share between 0 and 1, such as 0.05")
    return _least(allowed_missed + 1, lambda n: binomial_at_most(allowed_missed, n, level) <= share)


def exposure_for_rate(rate: float, allowed: int = 0, level: float = 0.95) -> float:
    """Return the exposure that shows that a rate of false alarms is not exceeded.

    Parameters
    ----------
    rate : float
        The rate to be shown, per hour or operation.
    allowed : int
        Number of false alarms allowed in the test.
    level : float
        Confidence level, one-sided.

    Returns
    -------
    float
        Hours or operations, as in the rate.

    Raises
    ------
    UsageError
        The rate is not above 0, or the level is outside 0 to 1.

    Notes
    -----
    chi2(level; 2 x + 2) / (2 rate): 3.0 / rate without a false alarm.

    Examples
    --------
    >>> round(exposure_for_rate(0.001))
    2996
    """
    if not (rate > 0.0 and math.isfinite(rate)):
        raise UsageError(f"rate is {rate:g}", "give events per hour or operation, above 0")
    return poisson_at_most(allowed, 1.0, level) / rate


def _effect(difference: float, std: float, power: float, level: float) -> float:
    """Return the difference in standard deviations, after checking all four arguments."""
    _check_power(power, level)
    _check_above_zero("difference", difference)
    _check_above_zero("standard deviation", std)
    return difference / std


def _check_power(power: float, level: float) -> None:
    check_level(level)
    if not 1.0 - level < power < 1.0:
        raise UsageError(
            f"power is {power:g}", f"give a share between {1.0 - level:g} (chance alone) and 1, such as 0.8"
        )


def _check_above_zero(name: str, value: float) -> None:
    if not (value > 0.0 and math.isfinite(value)):
        raise UsageError(f"{name} is {value:g}", "give a number above 0")


def _power(noncentrality: float, freedom: int, level: float) -> float:
    """Return the power of a two-sided t-test, both tails."""
    from scipy import stats

    limit = stats.t.ppf(0.5 + 0.5 * level, freedom)
    # The far tail as a mirrored upper one: nct.cdf gives NaN there (scipy 1.17).
    return float(stats.nct.sf(limit, freedom, noncentrality) + stats.nct.sf(limit, freedom, -noncentrality))


def _least(fewest: int, enough: Callable[[int], bool]) -> int:
    """Return the smallest n, at least `fewest`, that is enough, by doubling and halving; more is enough too."""
    above = fewest
    while not enough(above):
        if above >= _MOST:
            raise UsageError(f"more than {_MOST} impacts would be needed", "choose a larger difference or share")
        above = min(2 * above, _MOST)
    below = fewest - 1
    while above - below > 1:
        middle = (above + below) // 2
        below, above = (below, middle) if enough(middle) else (middle, above)
    return above
