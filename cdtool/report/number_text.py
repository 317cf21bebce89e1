"""Numbers as text: "38.0 (36.2 to 41.5)", "not reached" where infinite, "–" where there is no value.

Conventions: three significant digits, those of the value for its bounds too; fewer where the error of the value is
known: no digit is finer than the first one of its error. Ties are rounded away from zero; never an exponent. Functions
that return several texts return a value and what follows it, each with the punctuation that joins it to the text before
it.
"""

from __future__ import annotations

import math

from cdtool.base.plain_text import digits as plain_digits
from cdtool.base.plain_text import digits_beside
from cdtool.statistics.interval import Interval

NOTHING = "–"
NOT_REACHED = "not reached"
NOT_ASSESSABLE = "not assessable"


def spoken(word: str) -> str:
    """Return a word of the data as people read it: "not assessable"."""
    return word.replace("_", " ")


def number(value: float | None, digits: int = 3, error: float | None = None) -> str:
    """Return a number with the given count of significant digits, none finer than its error.

    >>> number(27.5), number(27.5, error=2.0), number(2.44, error=0.2), number(1858.3)
    ('27.5', '28', '2.4', '1858')
    """
    return NOTHING if value is None else _written(value, _decimals(value, digits, error))


def beside(value: float | None, limit: float) -> str:
    """Return a number with the digits that show on which side of its limit it is.

    >>> beside(400.04, 400.0), beside(412.3, 400.0)
    ('400.04', '412')
    """
    return NOTHING if value is None else number(value, digits_beside(value, limit, 3))


def short(value: float) -> str:
    """Return a number with up to three significant digits, without zeros that say nothing.

    >>> short(3.0), short(38.89), short(0.07071)
    ('3', '38.9', '0.0707')
    """
    return plain_digits(float(f"{value:.3g}"))


def with_interval(interval: Interval, error: float | None = None) -> str:
    """Return a value with its interval, if there is enough data for one."""
    return "".join(value_and_interval(interval, error))


def value_and_interval(interval: Interval, error: float | None = None) -> tuple[str, ...]:
    """Return a value and its interval in brackets; an interval without an upper end is in two parts."""
    if not interval.known:
        return (NOTHING,)
    width = interval.high - interval.low
    # The remainder of rounding equal numbers is shown as 0.
    least = max(1e-12, 1e-9 * width if math.isfinite(width) else 0.0)
    parts = [0.0 if abs(item) < least else item for item in (interval.value, interval.low, interval.high)]
    leading = next((item for item in (parts[0], parts[2], parts[1]) if item and math.isfinite(item)), 0.0)
    value, low, high = (_written(item, _decimals(leading, error=error)) for item in parts)
    if low == high and low in (NOT_REACHED, NOTHING):
        return (value,)
    return (value, f" ({low}", f" to {high})") if high == NOT_REACHED else (value, f" ({low} to {high})")


def percent(share: float) -> str:
    """Return a share in per cent with two significant digits."""
    return NOTHING if math.isnan(share) else f"{number(100.0 * share, 2)} %"


def missed(count: int, assessable: int, at_most: float) -> tuple[str, ...]:
    """Return missed contacts with the one-sided bound of their share: "0 of 30", ": at most 9.5 %"."""
    return (f"{count} of {assessable}", f": at most {percent(at_most)}") if assessable else (NOTHING,)


def rate(count: int, interval: Interval, at_most: float) -> tuple[str, ...]:
    """Return a rate of false alarms with its interval and its one-sided bound; of no alarm only the bound."""
    if math.isnan(at_most):
        return (NOTHING,)
    return (*(value_and_interval(interval) if count else ("0",)), f": at most {number(at_most)}")


def _written(value: float, decimals: int) -> str:
    if math.isnan(value):
        return NOTHING
    # A tie that arithmetic left just below itself, as 26.499999999999996, is one too.
    return f"{value * (1.0 + 1e-12):z.{decimals}f}" if math.isfinite(value) else NOT_REACHED


def _decimals(value: float, digits: int = 3, error: float | None = None) -> int:
    if not math.isfinite(value) or value == 0.0:
        return 0
    finest = -math.floor(math.log10(error)) if error else math.inf
    return int(max(min(digits - 1 - math.floor(math.log10(abs(value))), finest), 0))
