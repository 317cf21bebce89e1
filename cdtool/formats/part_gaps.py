"""Parts of one log between which nothing was logged: a recorder that was stopped, or a part that nobody names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from cdtool.clock import GAP_PERIODS
from cdtool.recording import GROUND_TRUTH, Finding, Recording


def gaps_between(parts: Sequence[Recording]) -> Iterator[Finding]:
    """One finding a part that begins later than its channels' periods explain; `parts` follow one another.

    Ground truth may be in some parts only. Where not all channels pause, the finding names those that do.
    """
    for before, after in pairwise(parts):
        channels = [name for name in before.channels if name in after and name not in GROUND_TRUTH]
        gaps = {}
        for name in channels:
            time = before[name].time
            gap = float(after[name].time[0] + (after.origin - before.origin) - time[-1])
            if len(time) > 1 and gap > GAP_PERIODS * float(np.median(np.diff(time))):
                gaps[name] = gap
        if gaps:
            whose = "" if len(gaps) == len(channels) else f" ({', '.join(gaps)})"
            text = f"begins {min(gaps.values()):.3g} s after the part before it ends{whose}: nothing is logged between"
            yield Finding(f"{Path(after.source).name}: {text}")
