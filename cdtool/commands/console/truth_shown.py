"""Notes on contacts with an unseen or unrecorded onset, and on negative latencies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cdtool.base.plain_text import counted
from cdtool.commands.console.console import say

if TYPE_CHECKING:
    from cdtool.results.evaluated import Evaluated

# Shown next to a negative latency.
NEGATIVE = "alarm before the onset, within its uncertainty: counted as 0"


def show_truth(evaluated: Evaluated) -> None:
    """Print one line per group with contacts in progress at the start, and one per group with negative latencies."""
    for group in evaluated.results.groups:
        items = [item for item in evaluated.summaries if item.group == group]
        begun = max((item.in_progress for item in items), default=0)
        if begun:
            say(f"{group}: {counted(begun, 'contact')} in progress at the start: neither detected nor missed")
        unseen = max(items, key=lambda item: item.onset_holes, default=None)
        if unseen and unseen.onset_holes:
            later = max(item.later_ms for item in items)
            what = f": latencies up to {later:.0f} ms longer are possible" if later else ""
            of = counted(unseen.contacts, "contact")
            say(f"{group}: load-cell samples are missing where {unseen.onset_holes} of {of} may have begun{what}")
        negative = [item for item in items if item.clipped]
        if negative:
            each = ", ".join(f"{item.detector} {item.clipped} of {item.detected}" for item in negative)
            say(f"{group}: negative latencies, within the onset's uncertainty, counted as 0: {each}")
