"""The messages of a chunk or of a part of the file: where their payloads are, and their channels and log times.

Message indexes after a chunk state where its messages begin. They are used if they are true: the messages follow one
another, and between them are only definitions. Otherwise the records are walked one by one.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cdtool.formats.mcap.chunks import Bytes
from cdtool.formats.mcap.records import PREFIX, Opcode
from cdtool.formats.messages.batch import Batch, numbers_at

# Times from here [ns] are invalid: relative to them, other times would lose digits.
NO_DATE = 1 << 63
NO_KIND = "a record of kind 0, which does not exist"
TOO_LONG = "a record declares more bytes than are left in its chunk"
SHORT_MESSAGE = "a message shorter than its header"
OTHER_KIND = "a record that is not one of a chunk"
HEADER = 22  # bytes of a message before its payload: channel id, sequence, two times
_PREFIX = struct.Struct("<BQ")
_MESSAGE, _DEFINITIONS = int(Opcode.MESSAGE), (int(Opcode.SCHEMA), int(Opcode.CHANNEL))
Positions = npt.NDArray[np.int64]
Definition = tuple[int, int, int]  # opcode, first byte and length of the content


class Walk(NamedTuple):
    """The messages by the first byte of their records, the definitions, and the byte and reason of the walk's end."""

    records: Positions
    definitions: list[Definition]
    end: int
    reason: str = ""


def walk(content: Bytes, at: int = 0, top_level: bool = False) -> Walk:
    """Walk over records; at the top level, one of another kind ends the walk, in a chunk it is skipped."""
    data, size, unpack = content.data, len(content), _PREFIX.unpack_from
    records = array("q")  # of numbers, not of objects: a chunk may have millions of short messages
    definitions: list[Definition] = []
    reason = ""
    while at < size:
        opcode, length = unpack(data, at) if size - at >= PREFIX else (_MESSAGE, size)
        if opcode == _MESSAGE:
            if PREFIX + length > size - at:
                reason = TOO_LONG
                break
            if length < HEADER:
                reason = SHORT_MESSAGE
                break
            records.append(at)
        else:
            is_definition = opcode in _DEFINITIONS
            reason = NO_KIND if not opcode else OTHER_KIND if top_level and not is_definition else ""
            reason = reason or (TOO_LONG if PREFIX + length > size - at else "")
            if reason:
                break
            if is_definition:
                definitions.append((opcode, at + PREFIX, length))
        at += PREFIX + length
    return Walk(np.array(records, dtype=np.int64), definitions, at, reason)


def walk_by_indexes(content: Bytes, records: Positions) -> Walk:
    """Return the same for a chunk, whose message indexes name these bytes as those of its messages."""
    size = len(content)
    records = np.sort(records)
    if not len(records) or records[0] < 0 or records[-1] > size - PREFIX - HEADER:
        return walk(content)
    lengths = numbers_at(content, records + 1, "<u8")
    if (content[records] != _MESSAGE).any() or (lengths < HEADER).any() or (lengths > size).any():
        return walk(content)
    ends = records + PREFIX + lengths.astype(np.int64)
    following = np.append(records[1:], size)
    if (ends > following).any():
        return walk(content)
    definitions: list[Definition] = []
    between = np.flatnonzero(ends < following)
    gaps = [(0, int(records[0])), *zip(ends[between].tolist(), following[between].tolist(), strict=True)]
    for begin, end in gaps:
        inside = walk(content[:end], begin)
        if inside.reason or len(inside.records):
            return walk(content)
        definitions += inside.definitions
    return Walk(records, definitions, size)


def by_channel(data: Bytes, records: Positions) -> Iterator[tuple[int, Batch]]:
    """Yield the messages with these records channel by channel, in the file's order."""
    channels = channel_ids(data, records)
    order = np.argsort(channels, kind="stable")
    records, channels = records[order], channels[order]
    times = log_times(data, records)
    lengths = numbers_at(data, records + 1, "<u8").astype(np.int64) - HEADER
    starts = records + PREFIX + HEADER
    borders = np.flatnonzero(np.append(len(channels) > 0, channels[1:] != channels[:-1]))
    for begin, end in zip(borders, np.append(borders[1:], len(channels)), strict=True):
        rows = slice(begin, end)
        yield int(channels[begin]), Batch(data, starts[rows], lengths[rows], times[rows])


def channel_ids(content: Bytes, records: Positions) -> npt.NDArray[Any]:
    """Return the channels of the messages with these records."""
    return numbers_at(content, records + PREFIX, "<u2")


def log_times(content: Bytes, records: Positions) -> npt.NDArray[Any]:
    """Return the log times [ns] of the messages with these records."""
    return numbers_at(content, records + PREFIX + 6, "<u8")
