"""Latency against false alarms (activity monitor operating characteristic, AMOC): one curve per detector and group.

Conventions: latencies come from a group of impacts, false alarms from the impact-free hold-out, with the same limits.
No false alarm does not mean a rate of zero: the upper bound is given as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

from cdtool.base.errors import UsageError
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.results import Results, SweepResult
from cdtool.statistics.rates import poisson_at_most

Per = Literal["hour", "operation"]


@dataclass(frozen=True)
class AmocCurve:
    """One detector in one group: points by ascending safety factor, `in_use` the number of the one that is set.

    The rates refer to the hold-out's `operations` and `hours`. `at_most`: the rate that is not exceeded if there was no
    false alarm (one-sided, 95 %).
    """

    detector: str
    group: str
    per: Per
    operations: int
    hours: float
    at_most: float
    not_assessable: int
    points: tuple[SweepResult, ...]
    in_use: int

    @property
    def set_point(self) -> SweepResult:
        """The point of the safety factor that is set."""
        return self.points[self.in_use]

    @property
    def exposure(self) -> float:
        """The hours or operations to which rates refer."""
        return self.hours if self.per == "hour" else float(self.operations)

    def rate(self, point: SweepResult) -> float:
        """Return the rate of false alarms at a point."""
        return point.false_alarms / self.exposure


def amoc_curves(results: Results) -> tuple[AmocCurve, ...]:
    """Return the curves of latency against false alarms of a benchmark.

    Parameters
    ----------
    results : Results
        The results; their `sweep` has the points.

    Returns
    -------
    tuple of AmocCurve
        In the order of the benchmark file. Rates have the unit of the false-alarm budget, else of hours if one
        was recorded, else of operations. A detector that was nowhere assessable in the hold-out has no curve.

    Examples
    --------
    `cdtool.benchmark` returns the results.
    """
    rows: dict[tuple[str, str], list[SweepResult]] = {}
    for row in results.sweep:
        rows.setdefault((row.group, row.detector), []).append(row)
    per = _rate_unit(results)
    made = [_curve(items, per) for items in rows.values()]
    return tuple(curve for curve in made if curve is not None)


def _rate_unit(results: Results) -> Per:
    """Return the unit of false-alarm rates: that of the budget, else hours if one was recorded, else operations."""
    budget = results.provenance.get("false_alarm_budget")
    if budget:
        with suppress(UsageError):
            return Budget.parse(str(budget)).per
    return "hour" if any(row.hours >= 1.0 for row in results.sweep) else "operation"


def _curve(rows: Sequence[SweepResult], per: Per) -> AmocCurve | None:
    rows = sorted(rows, key=lambda row: row.safety_factor)
    first = rows[0]
    exposure = first.hours if per == "hour" else float(first.operations)
    if exposure <= 0.0:
        return None
    return AmocCurve(
        detector=first.detector,
        group=first.group,
        per=per,
        operations=first.operations,
        hours=first.hours,
        at_most=poisson_at_most(0, exposure),
        not_assessable=first.not_assessable,
        points=tuple(rows),
        in_use=next((i for i, row in enumerate(rows) if row.in_use), 0),
    )
