"""Settings that several rules have, and the side that a rule monitors."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Annotated, Literal, TypeVar, get_args

from msgspec import Meta

from cdtool.base.settings import Positive, setting
from cdtool.recordings.motion import MotionClass
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.limit import FittedLimit

Rule = TypeVar("Rule", bound=Threshold)
Sides = Literal["one", "two"]
SIDES: tuple[Sides, ...] = get_args(Sides)

SafetyFactor = Annotated[Positive, setting("k: spreads from the learned mean, or from 0, to the limit")]
# None: not filled in by `with_context` or `Signature.sided`. `fit` then monitors two sides, that of a signature one.
SidesOfMachine = Annotated[
    Sides | None,
    setting("the side that opposes the motion, or both; default: one for a single joint, two for several"),
]
#: A model of a higher order fits the noise of the runs that it is learned from.
LARGEST_ORDER = 20
Order = Annotated[
    Annotated[int, Meta(ge=1, le=LARGEST_ORDER)], setting("order of the model that predicts the next sample")
]


def watched_side(sides: str | None, motion: MotionClass | None, signed: bool) -> int:
    """Return +1 if only the upper limit counts, -1 if only the lower one, 0 for both.

    An obstacle opposes the motion: a signed signal rises with a motion forward and falls with one backward.
    """
    if sides != "one" or motion is None:
        return 0
    return -1 if signed and motion.direction < 0 else 1


def on_side(limit: FittedLimit, side: int) -> FittedLimit:
    """Return only the limits of the monitored side; the other one becomes infinite."""
    nothing = (float("inf"),) * len(limit.least)
    if side > 0:
        return replace(limit, spread_below=nothing)
    return replace(limit, spread_above=nothing) if side < 0 else limit


def with_context(rule: Rule, sides: str | None, signature: Threshold | None) -> Rule:
    """Return a rule with the settings that it leaves open filled in.

    Parameters
    ----------
    rule : Threshold
        Any threshold.
    sides : {"one", "two"} or None
        Used if the rule has a field `sides` that is None.
    signature : Signature or None
        Used if the rule has a field `signature` that is None.

    Returns
    -------
    Threshold
        The rule with its open settings filled in.

    Examples
    --------
    >>> from cdtool.thresholds.trend import Trend
    >>> with_context(Trend(), "one", None).sides, with_context(Trend(sides="two"), "one", None).sides
    ('one', 'two')
    """
    open_fields = {item.name for item in fields(rule) if getattr(rule, item.name) is None}
    given = {"sides": sides, "signature": signature}
    return replace(rule, **{name: value for name, value in given.items() if name in open_fields})
