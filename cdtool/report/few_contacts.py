"""Which values of the latency the tables show for a detector: below ten detected contacts median and range, no mean.

Conventions: a column that no row fills is left out. All tables and plots use this module, so that they show the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, Literal

from cdtool.report.number_text import number
from cdtool.results.summary import Summary
from cdtool.statistics.interval import Interval
from cdtool.statistics.small_sample import FEWEST

LatencyColumn = Literal["mean", "std", "median", "range", "P95"]

EXPLAINED: Final = (
    f"Fewer than {FEWEST} contacts detected: median and range, no mean, std or P95. If 15 % of all contacts are slow, "
    "the 95 % interval of the mean of four contains the true mean in 49 of 100 tests. The median has an interval with "
    "6 or more contacts (docs/statistics.md)."
)
# With five times as many, slow cases cost the interval of a mean little of its coverage (docs/statistics.md).
SLOW: Final = (
    f"Mean of fewer than {5 * FEWEST} contacts: slow ones are easily absent. If 5 to 15 % of all contacts are slow, "
    "its 95 % interval contains the true mean in 72 to 91 of 100 tests."
)
GROUPED: Final = (
    f"No interval if fewer than {FEWEST} recordings or campaigns contain several contacts each: those of one are alike."
)


def latency_columns(rows: Iterable[Summary]) -> tuple[LatencyColumn, ...]:
    """Return the columns of latency that a table of these rows has."""
    hit = [item for item in rows if item.contacts]
    few, enough = any(item.few for item in hit), any(not item.few for item in hit)
    several: tuple[LatencyColumn, ...] = ("mean", "std") if enough else ()
    spread: tuple[LatencyColumn, ...] = ("range",) if few else ()
    highest: tuple[LatencyColumn, ...] = ("P95",) if enough else ()
    return (*several, "median", *spread, *highest)


def latency_interval(item: Summary, column: LatencyColumn) -> Interval | None:
    """Return the value of a column with its interval; None for the range, and if too few contacts were detected."""
    if column == "median":
        return item.median
    if item.few or column == "range":
        return None
    return {"mean": item.mean, "std": Interval(item.std_ms, math.nan, math.nan), "P95": item.p95}[column]


def draws_no_interval(item: Summary) -> bool:
    """Return whether a plot shows the median without a bar: below ten contacts, or if it has no interval."""
    return item.assessable < FEWEST or bool(item.median.reason)


def open_end(item: Summary) -> tuple[float, str] | None:
    """Return where a latency without an upper end begins [ms], and it in words; None if a plot shows both ends.

    Missed contacts leave the interval of the median open or, below ten contacts, the range if the median is not
    reached: "≥ 25.0 (n = 4)". Nothing is drawn where no contact was detected.
    """
    median = item.median
    least, end = (item.min_ms, median.value) if draws_no_interval(item) else (median.low, median.high)
    words = f"≥ {number(least, error=item.resolution_ms)} (n = {item.assessable})"
    return (least, words) if end == math.inf and math.isfinite(least) else None


def grouped(rows: Iterable[Summary]) -> bool:
    """Return whether ten or more contacts have no interval because too few recordings contain them."""
    return any(item.assessable >= FEWEST and item.median.reason for item in rows)


def explained(rows: Iterable[Summary]) -> str:
    """Return why rows show no mean or no interval; empty if all rows show both."""
    hit = [item for item in rows if item.contacts > item.not_assessable]
    words = [EXPLAINED] if any(item.few for item in hit) else []
    words += [SLOW] if any(not item.few and item.detected < 5 * FEWEST for item in hit) else []
    words += [GROUPED] if any(not item.few and item.mean.reason for item in hit) else []
    return " ".join(words)
