"""Statistics of the outcomes of one detector in one group; undefined = NaN, never zero.

Mean and standard deviation describe the detected contacts only and are to be read beside n, missed, not assessable and
false alarms: a detector that misses its slow cases looks fast.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.evaluation.results import ContactResult, ExposureResult, FalseAlarmResult, Results


@dataclass(frozen=True)
class Summary:
    """Latency [ms] over the detected contacts, and the counts to read it with."""

    detector: str
    group: str
    contacts: int
    detected: int
    missed: int
    not_assessable: int
    mean_ms: float
    std_ms: float
    median_ms: float
    false_alarms: int
    operations: int
    hours: float


def summarise(results: Results) -> list[Summary]:
    """One Summary for each detector and group, in the order of the benchmark file; hold-out last."""
    return [
        _summary(
            detector,
            group,
            [c for c in results.contacts if c.detector == detector and c.group == group],
            [f for f in results.false_alarms if f.detector == detector and f.group == group],
            next((e for e in results.exposure if e.detector == detector and e.group == group), None),
        )
        for group in results.groups
        for detector in results.detectors
    ]


def _summary(
    detector: str,
    group: str,
    contacts: Sequence[ContactResult],
    false_alarms: Sequence[FalseAlarmResult],
    exposure: ExposureResult | None,
) -> Summary:
    latencies = np.array([c.latency_ms for c in contacts if c.latency_ms is not None], dtype=np.float64)
    return Summary(
        detector=detector,
        group=group,
        contacts=len(contacts),
        detected=len(latencies),
        missed=sum(c.outcome == "missed" for c in contacts),
        not_assessable=sum(c.outcome == "not_assessable" for c in contacts),
        mean_ms=float(np.mean(latencies)) if len(latencies) else float("nan"),
        std_ms=float(np.std(latencies, ddof=1)) if len(latencies) > 1 else float("nan"),
        median_ms=float(np.median(latencies)) if len(latencies) else float("nan"),
        false_alarms=len(false_alarms),
        operations=exposure.operations if exposure else 0,
        hours=exposure.hours if exposure else 0.0,
    )
