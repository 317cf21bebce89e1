"""Which figures of the latency tables show for a detector: below ten detected contacts median and range, no mean.

Conventions: a column that no row fills is left out. Shared by every table, so that all of them show the same.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, Literal

from cdtool.evaluation.statistics.interval import Interval
from cdtool.evaluation.statistics.small_sample import FEWEST
from cdtool.evaluation.summary import Summary
from cdtool.report.number_text import NOTHING, number, with_interval

LatencyColumn = Literal["mean", "std", "median", "range", "P95"]

EXPLAINED: Final = (
    f"Fewer than {FEWEST} contacts detected: median and range, no mean, std or P95. The 95 % interval of the mean of "
    "four contacts holds the true mean in about 80 of 100 tests, in 47 where 15 % of the contacts are slow. The median "
    "has an interval from 6 contacts on (docs/statistics.md)."
)
GROUPED: Final = (
    f"No interval where fewer than {FEWEST} recordings or campaigns hold several contacts each: those of one are alike."
)


def latency_columns(rows: Iterable[Summary]) -> tuple[LatencyColumn, ...]:
    """The columns of latency that a table of these rows has."""
    hit = [item for item in rows if item.contacts]
    few, enough = any(item.few for item in hit), any(not item.few for item in hit)
    several: tuple[LatencyColumn, ...] = ("mean", "std") if enough else ()
    spread: tuple[LatencyColumn, ...] = ("range",) if few else ()
    highest: tuple[LatencyColumn, ...] = ("P95",) if enough else ()
    return (*several, "median", *spread, *highest)


def latency_words(item: Summary, column: LatencyColumn) -> str:
    """A cell of a report: the figure with its interval, the range as "25.0 to 28.0", a dash where there is none."""
    if column == "range":
        ends = (number(item.min_ms), number(item.max_ms))
        return ends[0] if ends[0] == ends[1] else " to ".join(ends)
    figure = latency_figure(item, column)
    return NOTHING if figure is None else with_interval(figure)


def latency_figure(item: Summary, column: LatencyColumn) -> Interval | None:
    """The figure of a column; None in the range, and where too few contacts were detected for it."""
    if column == "median":
        return item.median
    if item.few or column == "range":
        return None
    return {"mean": item.mean, "std": item.std, "P95": item.p95}[column]


def draws_no_interval(item: Summary) -> bool:
    """Whether a plot shows the median without a bar: below ten contacts, or where it has no interval."""
    return item.assessable < FEWEST or bool(item.median.reason)


def grouped(rows: Iterable[Summary]) -> bool:
    """Whether ten or more contacts have no interval since too few recordings hold them."""
    return any(item.assessable >= FEWEST and item.median.reason for item in rows)


def explained(rows: Iterable[Summary]) -> str:
    """Why rows show no mean or no interval; empty where all show both."""
    hit = [item for item in rows if item.contacts > item.not_assessable]
    words = [EXPLAINED] if any(item.few for item in hit) else []
    words += [GROUPED] if any(not item.few and item.mean.reason for item in hit) else []
    return " ".join(words)
