"""Latencies of injected contacts: a range where parameters are not known, beside those of real contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdtool.results.evaluated import Evaluated
from cdtool.results.summary import Summary

MODEL = "parameters of a model from impact-free logs, 15 %"


@dataclass(frozen=True)
class Agreement:
    """The median latency [ms] of a detector on the injected contacts with an obstacle, and on real ones.

    `injected_ms`: least and greatest median of the assumptions about what is not known, equal where all is known;
    infinite where most contacts are missed, NaN where none is assessable. `range_ms`: the same with the error of the
    model, or with the 95 % interval of the median if that is wider. `assumed`: the assumptions that differ, and the
    error of the model. `real_group`: what the benchmark file compares it with, or None. `injected_count`,
    `real_count`: assessable contacts; the missed ones count in the median as later than all. `resolution_ms`: that of
    the latencies, None if unknown.
    """

    detector: str
    injected_group: str
    injected_ms: tuple[float, float]
    range_ms: tuple[float, float]
    injected_count: int
    assumed: tuple[str, ...]
    real_group: str | None
    real_ms: float
    real_count: int
    resolution_ms: float | None

    @property
    def is_range(self) -> bool:
        """Whether the assumptions lead to different latencies."""
        return self.injected_ms[0] != self.injected_ms[1] and not any(map(math.isnan, self.injected_ms))


def with_model_error(low: float, high: float) -> tuple[float, float]:
    """Return a range of injected latencies, widened by what parameters from impact-free logs are wrong by.

    15 %: of 160 means on ten machines of another simulator than the model's, 158 are within it
    (`python benchmarks/injection.py --plain 10`). Known parameters leave less: 5 % or 2 ms on the simulated gate.

    Parameters
    ----------
    low, high : float
        The range of the latencies of a model [ms].

    Returns
    -------
    tuple of float
        The wider range [ms].

    Examples
    --------
    >>> with_model_error(20.0, 40.0)
    (17.0, 46.0)
    """
    return 0.85 * low, 1.15 * high


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
    return [
        _agreement(detector, rows, groups, by_name)
        for groups in by_obstacle.values()
        for detector in evaluated.results.detectors
        if (rows := [by_name[group, detector] for group in groups if (group, detector) in by_name])
    ]


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
    low, high = (min(known), max(known)) if known else (math.nan, math.nan)
    least, most = with_model_error(low, high)
    lows, highs = zip(*((row.median.low, row.median.high) for row in rows), strict=True)
    return Agreement(
        detector=detector,
        injected_group=first,
        injected_ms=(low, high),
        range_ms=(float(np.fmin.reduce([least, *lows])), float(np.fmax.reduce([most, *highs]))),
        injected_count=max(row.detected + row.missed for row in rows),
        assumed=(*dict.fromkeys(text for stated in groups.values() for text in stated["assumed"] if low < high), MODEL),
        real_group=None if real is None else real.group,
        real_ms=math.nan if real is None else _median(real),
        real_count=0 if real is None else real.detected + real.missed,
        resolution_ms=max((row.resolution_ms for row in rows if row.resolution_ms), default=None),
    )


def _median(row: Summary) -> float:
    """Return the median latency [ms]; infinite where it is not reached because most contacts are missed."""
    return math.inf if math.isnan(row.median_ms) and row.detected + row.missed > 0 else row.median_ms
