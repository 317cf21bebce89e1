"""Chunks that were not decompressed, since no sensor's data shrink as they do: the way out for a log that is honest.

Messages of joints and sensors do not shrink so, however constant they are: each has a time of its own. Images of a dark
camera do, and maps that are empty.
"""

from __future__ import annotations

from cdtool.formats.mcap.container.log import Log
from cdtool.recording import Finding

# How the container gives the reason.
REASON = "not decompressed"


def refused_chunks(log: Log) -> list[Finding]:
    """What to do about them, in one line; nothing where there are none."""
    count = sum(loss.chunks for loss in log.section.losses.places if loss.reason.endswith(REASON))
    if not count:
        return []
    what = "1 chunk is" if count == 1 else f"{count} chunks are"
    text = f"{what} not damaged but refused: they would grow as only a bomb or images of nothing do"
    return [
        Finding(f"{text}. If the log is yours, `mcap decompress LOG -o PLAIN` (mcap.dev) makes one that is read whole")
    ]
