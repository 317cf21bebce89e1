"""Share of contacts that are still undetected over time: a Kaplan-Meier curve for each detector and group."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.results.results import ContactResult, Results, grouped
from cdtool.results.summary import latencies
from cdtool.statistics.kaplan_meier import Survival, survival


@dataclass(frozen=True)
class SurvivalCurve:
    """One detector in one group: `curve` over the time since the onset [ms], up to `end` [ms].

    `end` is the latest detection or the longest time monitored. `missed` (k,): the times [ms] for which the missed
    contacts were monitored, in ascending order.
    """

    detector: str
    group: str
    contacts: int
    detected: int
    not_assessable: int
    curve: Survival
    missed: FloatArray
    end: float


def survival_curves(results: Results) -> tuple[SurvivalCurve, ...]:
    """Return a survival curve for each detector and group with contacts.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    tuple of SurvivalCurve
        In the order of the benchmark file. If no contact could be assessed the curve is only the time 0, with a band
        from 0 to 1, and `end` is 0.

    Examples
    --------
    `survival` computes a curve; `cdtool.benchmark` returns the results.
    """
    rows = grouped(results.scored_contacts, "group", "detector")
    return tuple(
        _curve(detector, group, rows[group, detector])
        for group in results.groups
        for detector in results.detectors
        if (group, detector) in rows
    )


def _curve(detector: str, group: str, contacts: Sequence[ContactResult]) -> SurvivalCurve:
    latency, censored = latencies(contacts)
    return SurvivalCurve(
        detector=detector,
        group=group,
        contacts=len(contacts),
        detected=int(np.count_nonzero(~censored)),
        not_assessable=len(contacts) - len(latency),
        curve=survival(latency, censored),
        missed=np.sort(latency[censored]),
        end=float(latency.max(initial=0.0)),
    )
