"""Figures as text: "38.0 (36.2 to 41.5)", "not reached" where infinite, "–" where there is none.

Conventions: three significant digits, those of the value for its bounds too; never an exponent.
"""

from __future__ import annotations

import math

from cdtool.evaluation.statistics.interval import Interval

NOTHING = "–"
NOT_REACHED = "not reached"
NOT_ASSESSABLE = "not assessable"


def spoken(word: str) -> str:
    """A word of the data as people read it: "not assessable"."""
    return word.replace("_", " ")


# What rounding leaves of equal numbers is no figure of its own: below this, or this share of the interval's width.
_ZERO_BELOW = 1e-12
_ZERO_SHARE = 1e-9


def number(value: float | None, digits: int = 3) -> str:
    """A figure with so many significant digits."""
    return NOTHING if value is None else _written(value, _decimals(value, digits))


def with_interval(figure: Interval) -> str:
    """A figure with its interval; "(–)" where there is too little data for one."""
    if not figure.known:
        return NOTHING
    width = figure.high - figure.low
    least = max(_ZERO_BELOW, _ZERO_SHARE * width if math.isfinite(width) else 0.0)
    parts = [0.0 if abs(item) < least else item for item in (figure.value, figure.low, figure.high)]
    leading = next((item for item in (parts[0], parts[2], parts[1]) if item and math.isfinite(item)), 0.0)
    value, low, high = (_written(item, _decimals(leading)) for item in parts)
    if low == high == NOT_REACHED:
        return NOT_REACHED
    return f"{value} ({NOTHING})" if low == high == NOTHING else f"{value} ({low} to {high})"


def percent(share: float) -> str:
    """A share in per cent with two significant digits."""
    return NOTHING if math.isnan(share) else f"{number(100.0 * share, 2)} %"


def missed(count: int, assessable: int, at_most: float) -> str:
    """Missed contacts with the one-sided bound of their share: "0 of 30: at most 9.5 %"."""
    return f"{count} of {assessable}: at most {percent(at_most)}" if assessable else NOTHING


def rate(count: int, figure: Interval, at_most: float) -> str:
    """A rate of false alarms with its interval and its one-sided bound; without an alarm the bound alone counts."""
    if math.isnan(at_most):
        return NOTHING
    return f"{with_interval(figure) if count else 0}: at most {number(at_most)}"


def _written(value: float, decimals: int) -> str:
    if math.isnan(value):
        return NOTHING
    return f"{value:z.{decimals}f}" if math.isfinite(value) else NOT_REACHED


def _decimals(value: float, digits: int = 3) -> int:
    if not math.isfinite(value) or value == 0.0:
        return 0
    return max(digits - 1 - math.floor(math.log10(abs(value))), 0)
