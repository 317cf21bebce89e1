"""How many impacts, or how many hours, a test needs before it is made.

Conventions: `level` is the confidence of the result (two-sided for differences, one-sided for "at most"), `power` the
chance that a difference of that size is then seen. Standard deviations are guesses from earlier tests. Contacts are
taken as independent: with several in a recording, count recordings.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from cdtool.errors import UsageError
from cdtool.evaluation.statistics.interval import check_level
from cdtool.evaluation.statistics.rates import binomial_at_most, check_count, poisson_at_most

# Nobody makes more impacts than this.
_MOST = 10_000_000


def impacts_for_difference(
    difference: float, std_of_differences: float, power: float = 0.8, level: float = 0.95
) -> int:
    """Impacts for which a paired t-test sees a mean `difference` between two detectors.

    Least n with P(|T| > t) >= power, T noncentral t with n - 1 degrees of freedom and noncentrality
    difference / std * sqrt(n), t its central quantile at (1 + level) / 2. Both in one unit. Skewed differences
    need some more. Raises UsageError for a difference or std that is not above 0, or where ten million are too few.
    """
    effect = _effect(difference, std_of_differences, power, level)
    return _least(2, lambda n: _power(effect * math.sqrt(n), n - 1, level) >= power)


def impacts_for_unpaired(difference: float, std: float, power: float = 0.8, level: float = 0.95) -> int:
    """Impacts in each of two groups for which a t-test sees a `difference` of their means; `std` within a group.

    As `impacts_for_difference`, with 2 n - 2 degrees of freedom and noncentrality difference / std * sqrt(n / 2).
    """
    effect = _effect(difference, std, power, level)
    return _least(2, lambda n: _power(effect * math.sqrt(0.5 * n), 2 * n - 2, level) >= power)


def detectable_difference(n: int, std: float, power: float = 0.8, level: float = 0.95) -> float:
    """Mean difference that a paired t-test sees with `n` impacts, in the unit of `std` (of the differences).

    The inverse of `impacts_for_difference`. Raises UsageError for fewer than 2 impacts.
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
    """Impacts of which at most `allowed_missed` may be missed to show that no more than `share` is, one-sided.

    Least n whose bound `binomial_at_most(allowed_missed, n)` is at most `share`: ln(1 - level) / ln(1 - share) for 0.
    Raises UsageError for a share outside 0 to 1, or where ten million are too few.
    """
    check_level(level)
    check_count("allowed_missed", allowed_missed)
    if not 0.0 < share < 1.0:
        raise UsageError(f"missed share is {share:g}", "give a share between 0 and 1, such as 0.05")
    return _least(allowed_missed + 1, lambda n: binomial_at_most(allowed_missed, n, level) <= share)


def exposure_for_rate(rate: float, allowed: int = 0, level: float = 0.95) -> float:
    """Hours (or operations) with at most `allowed` false alarms that show a rate of no more than `rate`, one-sided.

    chi2(level; 2 x + 2) / (2 rate): 3.0 / rate for none. `rate` per hour gives hours. Raises UsageError for a rate that
    is not above 0.
    """
    if not (rate > 0.0 and math.isfinite(rate)):
        raise UsageError(f"rate is {rate:g}", "give events per hour or operation, above 0")
    return poisson_at_most(allowed, 1.0, level) / rate


def _effect(difference: float, std: float, power: float, level: float) -> float:
    """The difference in standard deviations, once all four arguments are sound."""
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
        raise UsageError(f"{name} is {value:g}", "a number above 0")


def _power(noncentrality: float, freedom: int, level: float) -> float:
    """Power of a two-sided t-test, both tails."""
    from scipy import stats

    limit = stats.t.ppf(0.5 + 0.5 * level, freedom)
    # The far tail as a mirrored upper one: nct.cdf gives NaN there (scipy 1.17).
    return float(stats.nct.sf(limit, freedom, noncentrality) + stats.nct.sf(limit, freedom, -noncentrality))


def _least(fewest: int, enough: Callable[[int], bool]) -> int:
    """The least n from `fewest` on that is enough, by doubling and halving: what is enough stays enough with more."""
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
