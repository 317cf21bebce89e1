"""A bound on the effort of an integration: constants of very different size end in an error, not in endless work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError

#: Some 10 s of work; an impact takes a few thousand, a window of many swings or contacts a hundred thousand.
MOST_EVALUATIONS = 500_000


def bounded(rates: Callable[[float, FloatArray], list[float]]) -> Callable[[float, Any], list[float]]:
    """The same rates of change, which raise UsageError when they have been asked too often.

    Explicit steps have to be as short as the quickest motion, however little of it is left.
    """
    asked = 0

    def counted(time: float, state: Any) -> list[float]:
        nonlocal asked
        asked += 1
        if asked > MOST_EVALUATIONS:
            raise UsageError(
                f"the motion is far quicker than what is looked at: given up after {time:.3g} s of it",
                "less stiffness, damping or friction, more mass or inertia, or a shorter time",
            )
        return rates(time, state)

    return counted
