"""The summary held against the data section, without decompressing anything: may chunks be passed over?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from cdtool.formats.mcap.container.chunks import HEADER_LENGTH, chunk_header
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import (
    MAGIC,
    PREFIX,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Message,
    MessageIndex,
    Schema,
)
from cdtool.formats.mcap.container.summary import Summary, matches_header


def skippable_chunks(file: FileBytes, summary: Summary, wanted: Callable[[str], bool]) -> dict[int, dict[int, int]]:
    """Places of the chunks that hold no wanted topic -> their messages by channel; empty unless that can be trusted.

    It can where the summary's CRC fits, the chunks stand where the index has them with the same figures, no message
    stands outside of them, and the message indexes add up to the statistics, channel by channel. The first chunk is
    always read: with it the log's time begins.
    """
    if not summary.verified or summary.statistics is None or not summary.chunks:
        return {}
    unwanted = {place for place, index in summary.chunks.items() if not _wanted(index, summary, wanted)}
    unwanted.discard(min(summary.chunks))
    if not unwanted:
        return {}
    held = _indexed_messages(file, summary)
    if held is None:
        return {}
    total: Counter[int] = Counter()
    for counts in held.values():
        total.update(counts)
    stated = {channel: count for channel, count in summary.statistics.channel_message_counts.items() if count}
    return {place: held[place] for place in unwanted} if dict(total) == stated else {}


def only_message_indexes(file: FileBytes, at: int, end: int) -> bool:
    """Nothing else stands from byte `at` to `end`: a summary could hide a chunk there."""
    while at < end:
        head = file.read(at, PREFIX)
        if len(head) < PREFIX or head[0] != MessageIndex.opcode:
            return False
        at += PREFIX + int.from_bytes(head[1:], "little")
    return at == end


def _wanted(index: ChunkIndex, summary: Summary, wanted: Callable[[str], bool]) -> bool:
    """The chunk may hold a wanted topic: its index names one, or a channel that is not there, or nothing."""
    channels = [summary.channels.get(channel) for channel in index.message_index_offsets]
    return not channels or any(channel is None or wanted(channel.topic) for channel in channels)


def _indexed_messages(file: FileBytes, summary: Summary) -> dict[int, dict[int, int]] | None:
    """Messages by channel of every chunk, as the message indexes behind it have them; None where anything disagrees."""
    held: dict[int, dict[int, int]] = {}
    at, place = len(MAGIC), -1
    while at < file.size:
        head = file.read(at, HEADER_LENGTH)
        if len(head) < PREFIX or head[0] in (0, Schema.opcode, Channel.opcode, Message.opcode):
            return None
        length = PREFIX + int.from_bytes(head[1:PREFIX], "little")
        header = chunk_header(at, head)
        if head[0] == DataEnd.opcode:
            same = all(set(held[place]) == set(summary.chunks[place].message_index_offsets) for place in held)
            return held if same and len(held) == len(summary.chunks) else None
        if head[0] == Chunk.opcode:
            index = summary.chunks.get(at)
            if header is None or index is None or not matches_header(index, header):
                return None
            place = at
            held[place] = {}
        elif head[0] == MessageIndex.opcode:
            channel, size = int.from_bytes(head[9:11], "little"), int.from_bytes(head[11:15], "little")
            known = summary.chunks[place].message_index_offsets.get(channel) if place >= 0 else None
            if known != at or length < PREFIX + 6 + size:
                return None
            held[place][channel] = size // 16
        at += length
    return None
