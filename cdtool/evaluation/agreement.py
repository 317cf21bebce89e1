"""Latencies of injected contacts: a range where parameters are not known, beside those of real contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.summary import Summary


@dataclass(frozen=True)
class Agreement:
    """The median latency [ms] of a detector on the injected contacts with an obstacle, and on real ones.

    `injected_ms`: least and greatest median of the assumptions about what is not known, equal where all is known;
    infinite where most contacts are missed, NaN where none is assessable. `assumed`: these assumptions. `doubts`: the
    number of contacts that each applies to. `real_group`: what the benchmark file compares it with, or None.
    `injected_count`, `real_count`: assessable contacts; the missed ones count in the median as later than all.
    """

    detector: str
    injected_group: str
    injected_ms: tuple[float, float]
    injected_count: int
    assumed: tuple[str, ...]
    doubts: Mapping[str, int]
    real_group: str | None
    real_ms: float
    real_count: int

    @property
    def is_range(self) -> bool:
        """Whether the assumptions lead to different latencies."""
        return self.injected_ms[0] != self.injected_ms[1] and not any(map(math.isnan, self.injected_ms))


def agreements(evaluated: Evaluated) -> Sequence[Agreement]:
    """Return the latency of every detector on every injected obstacle, with that on the real contacts compared with it.

    Parameters
    ----------
    evaluated : Evaluated
        The evaluated benchmark; its provenance says which groups are injected, and with which assumptions.

    Returns
    -------
    sequence of Agreement
        One per obstacle and detector, in the order of the groups; empty if nothing was injected.

    Examples
    --------
    `cdtool.benchmark` returns the evaluated benchmark.
    """
    by_name = {(row.group, row.detector): row for row in evaluated.summaries}
    by_obstacle: dict[str, dict[str, Any]] = {}
    stated = evaluated.results.provenance.get("injected")
    for group, values in (stated if isinstance(stated, Mapping) else {}).items():
        by_obstacle.setdefault(values["obstacle"], {})[group] = values
    found = []
    for groups in by_obstacle.values():
        for detector in evaluated.results.detectors:
            rows = [by_name[group, detector] for group in groups if (group, detector) in by_name]
            if rows:
                found.append(_agreement(detector, rows, groups, by_name))
    return found


def _agreement(
    detector: str,
    rows: Sequence[Summary],
    groups: Mapping[str, Any],
    by_name: Mapping[tuple[str, str], Summary],
) -> Agreement:
    first, values = next(iter(groups.items()))
    real = by_name.get((values["compared_with"] or "", detector))
    medians = [_median(row) for row in rows]
    known = [value for value in medians if not math.isnan(value)]
    doubts: dict[str, int] = {}
    for stated in groups.values():
        for doubt, count in stated["doubts"].items():
            doubts[doubt] = max(doubts.get(doubt, 0), count)
    return Agreement(
        detector=detector,
        injected_group=first,
        injected_ms=(min(known), max(known)) if known else (math.nan, math.nan),
        injected_count=max(row.detected + row.missed for row in rows),
        assumed=tuple(dict.fromkeys(text for stated in groups.values() for text in stated["assumed"])),
        doubts=doubts,
        real_group=None if real is None else real.group,
        real_ms=math.nan if real is None else _median(real),
        real_count=0 if real is None else real.detected + real.missed,
    )


def _median(row: Summary) -> float:
    """Return the median latency [ms]; infinite where it is not reached because most contacts are missed."""
    if math.isnan(row.median_ms) and row.detected + row.missed > 0:
        return math.inf
    return row.median_ms
