"""Which messages of each channel a chunk holds, as the chunk indexes tell (section "Chunk Index").

A message index has 16 bytes for each message of its channel, and where it stands in the file is in the chunk's index.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import pairwise

from cdtool.formats.mcap.container.records import PREFIX, ChunkIndex

# Channel's id and the length of all entries stand before these; each is a time and an offset [bytes].
_BEFORE_ENTRIES, _ENTRY = PREFIX + 6, 16


def foretold_messages(chunks: Iterable[ChunkIndex]) -> dict[int, Mapping[int, range]]:
    """By a chunk's place and a channel's id the numbers of its messages among all of the channel in these chunks.

    It ends before the first chunk whose message indexes cannot be as long as they claim.
    """
    foretold: dict[int, Mapping[int, range]] = {}
    passed: Counter[int] = Counter()
    for index in chunks:
        places = sorted((at, channel) for channel, at in index.message_index_offsets.items())
        behind = index.chunk_start_offset + index.chunk_length + index.message_index_length
        rows = {}
        for (at, channel), (end, _) in pairwise((*places, (behind, 0))):
            count, rest = divmod(end - at - _BEFORE_ENTRIES, _ENTRY)
            if count < 0 or rest:
                return foretold
            rows[channel] = range(passed[channel], passed[channel] + count)
            passed[channel] += count
        foretold[index.chunk_start_offset] = rows
    return foretold
