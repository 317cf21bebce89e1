"""Rows of a sweep as a benchmark writes them."""

from __future__ import annotations

from collections.abc import Callable

from cdtool.results.curves.sweep import MULTIPLES
from cdtool.results.results import SweepResult

FACTOR = 5.5
CONTACTS = 20


def swept(
    detector: str,
    group: str,
    median: Callable[[float], float | None],
    false_alarms: Callable[[float], int],
    missed: Callable[[float], int] = lambda _: 0,
    operations: int = 40,
    hours: float = 0.1,
    not_assessable: int = 0,
) -> list[SweepResult]:
    """Return a row per safety factor; each value is a function of the multiple of the set factor."""
    return [
        SweepResult(
            detector=detector,
            group=group,
            safety_factor=FACTOR * multiple,
            false_alarms=false_alarms(multiple),
            operations=operations,
            hours=hours,
            detected=CONTACTS - missed(multiple),
            missed=missed(multiple),
            not_assessable=not_assessable,
            mean_ms=median(multiple),
            median_ms=median(multiple),
            in_use=multiple == 1.0,
        )
        for multiple in MULTIPLES.tolist()
    ]
