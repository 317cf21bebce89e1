"""Pattern and plans -> the recipe by which more messages like the last ones become rows (uniform.py)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.messages.columns.pattern import Pattern, dtype_of
from cdtool.messages.columns.picking import Plan, elements_of
from cdtool.messages.columns.slots import Place
from cdtool.messages.taken import Numbers, Recipe, Stamp

_MOST_NUMBERS = 1024  # of one place


def recipe_of(
    pattern: Pattern, plans: Sequence[Plan], joints: Sequence[str], stamp: tuple[Place, ...]
) -> Recipe | None:
    """The recipe of the plans' fields and of a stamp's places; None where the pattern alone does not tell all."""
    fields = [_numbers(pattern, plan, joints) for plan in plans]
    there = [each for each in fields if each is not None]
    seconds = _stamp(pattern, stamp) if stamp else None
    if len(there) < len(fields) or (stamp and seconds is None):
        return None
    return Recipe(pattern.alike, tuple(there), seconds)


def _numbers(pattern: Pattern, plan: Plan, joints: Sequence[str]) -> Numbers | None:
    offset, count, kind = pattern.places[plan.place]
    if kind is None or not 0 < count <= _MOST_NUMBERS or plan.arrays:
        return None
    names = () if plan.names is None else pattern.names[plan.names].names
    elements = elements_of(plan, count, names, joints)
    if elements is None:
        return None
    chosen = np.arange(count)[elements]
    at = tuple((offset + kind.size * chosen).ravel().tolist())
    return Numbers(at, dtype_of(kind), single=chosen.ndim == 0)


def _stamp(pattern: Pattern, stamp: tuple[Place, ...]) -> Stamp | None:
    """Seconds of 4 bytes with nanoseconds right behind them, as in both ROS; None where it is otherwise."""
    (at, count, seconds), (behind, other, rest) = (pattern.places[place] for place in stamp)
    if seconds is None or rest is None or (count, other, behind) != (1, 1, at + 4):
        return None
    return Stamp(at, seconds.dtype == "i4") if seconds.dtype in ("i4", "u4") and rest.dtype == "u4" else None
