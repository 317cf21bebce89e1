"""Parts of one log between which nothing was logged: a recorder that was stopped, or a part that nobody names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from cdtool.clock import GAP_PERIODS
from cdtool.findings import Finding
from cdtool.findings.parts import PartGap
from cdtool.recording import GROUND_TRUTH, Recording


@dataclass(frozen=True)
class PartSpan:
    """What a part spans: each channel's first and last time and its median step [s], times counted from `origin`."""

    path: Path
    origin: float
    channels: Mapping[str, tuple[float, float, float]]

    @classmethod
    def of(cls, part: Recording) -> PartSpan:
        """That of a part which is in memory."""
        times = {name: part[name].time for name in part.channels}
        spans = {
            name: (float(time[0]), float(time[-1]), float(np.median(np.diff(time))) if len(time) > 1 else np.inf)
            for name, time in times.items()
        }
        return cls(Path(part.source), part.origin, spans)


def gaps_between(parts: Sequence[PartSpan]) -> Iterator[Finding]:
    """One finding a part that begins later than its channels' steps explain; `parts` follow one another.

    Ground truth may be in some parts only. Where not all channels pause, the finding names those that do.
    """
    for before, after in pairwise(parts):
        channels = [name for name in before.channels if name in after.channels and name not in GROUND_TRUTH]
        gaps = {}
        for name in channels:
            _, end, step = before.channels[name]
            gap = after.channels[name][0] + (after.origin - before.origin) - end
            if gap > GAP_PERIODS * step:
                gaps[name] = gap
        if gaps:
            paused = () if len(gaps) == len(channels) else tuple(gaps)
            yield Finding(PartGap(min(gaps.values()), paused), file=after.path.name)
