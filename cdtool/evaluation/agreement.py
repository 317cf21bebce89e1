"""How well injected contacts agree with real ones of the same machine: medians of their latencies, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cdtool.evaluation.evaluated import Evaluated


@dataclass(frozen=True)
class Agreement:
    """The median latency [ms] of a detector on injected and on real contacts; NaN where it is not known.

    `injected_count`, `real_count`: assessable contacts; the missed ones count in the median.
    """

    detector: str
    injected_group: str
    real_group: str
    injected_ms: float
    real_ms: float
    injected_count: int
    real_count: int


def agreements(evaluated: Evaluated) -> Sequence[Agreement]:
    """Return the agreement of every injected group with the real group that the benchmark file compares it with.

    Parameters
    ----------
    evaluated : Evaluated
        The evaluated benchmark; its provenance says which groups are injected.

    Returns
    -------
    sequence of Agreement
        One per detector and injected group; empty without `compare_with` in the benchmark file.

    Examples
    --------
    `cdtool.benchmark` returns the evaluated benchmark.
    """
    by_name = {(row.group, row.detector): row for row in evaluated.summaries}
    found = []
    for group, stated in evaluated.results.provenance.get("injected", {}).items():
        real = stated["compared_with"]
        for (name, detector), injected in by_name.items():
            if name == group and real and (real, detector) in by_name:
                other = by_name[real, detector]
                found.append(
                    Agreement(
                        detector,
                        group,
                        real,
                        injected.median_ms,
                        other.median_ms,
                        injected.detected + injected.missed,
                        other.detected + other.missed,
                    )
                )
    return found
