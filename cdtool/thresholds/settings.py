"""Checks of a rule's settings, and the side that it watches."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TypeVar

from cdtool.errors import UsageError
from cdtool.motion import MotionClass
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.fitted_signature import SIDES, known
from cdtool.thresholds.limit import FittedLimit

Rule = TypeVar("Rule", bound=Threshold)


def check_above(value: float, least: float, what: str) -> None:
    """Raise UsageError where a setting is not above `least`."""
    if not value > least:
        raise UsageError(f"{what} is {value:g}", f"a number above {least:g} is needed")


def check_sides(safety_factor: float, sides: str | None) -> None:
    """Raise UsageError for a wrong safety factor or an unknown side."""
    check_above(safety_factor, 0.0, "safety factor")
    if sides is not None:
        known("sides", sides, SIDES)


def watched_side(sides: str | None, motion: MotionClass | None, signed: bool) -> int:
    """+1: only the upper limit counts, -1: only the lower one, 0: both.

    An obstacle opposes the motion: a signed signal rises with a motion forward and falls with one backward.
    """
    if sides != "one" or motion is None:
        return 0
    return -1 if signed and motion.direction < 0 else 1


def on_side(limit: FittedLimit, side: int) -> FittedLimit:
    """The limits of the watched side alone; the other one becomes infinite."""
    nothing = (float("inf"),) * len(limit.least)
    if side > 0:
        return replace(limit, spread_below=nothing)
    return replace(limit, spread_above=nothing) if side < 0 else limit


def with_context(rule: Rule, sides: str | None, signature: Threshold | None) -> Rule:
    """The rule with these sides where it leaves them open, and this signature's settings where it has such a field."""
    open_fields = {item.name for item in fields(rule) if getattr(rule, item.name) is None}
    given = {"sides": sides, "signature": signature}
    return replace(rule, **{name: value for name, value in given.items() if name in open_fields})
