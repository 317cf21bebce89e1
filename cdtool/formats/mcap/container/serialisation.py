"""Readers of serialised values (section "Serialization" of the specification).

A reader is called with a record's content and an offset; it returns the value there and the offset after it. Integers
are little-endian. A reader raises DamageError if the content ends within the value.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cdtool.formats.mcap.container.damage import DamageError

_CHANNEL_NUMBER = struct.Struct("<HQ")

Read = Callable[[memoryview, int], tuple[Any, int]]


def _integer(code: str) -> Read:
    unpack, size = struct.Struct(f"<{code}").unpack_from, struct.calcsize(f"<{code}")

    def read(body: memoryview, at: int) -> tuple[int, int]:
        try:
            return unpack(body, at)[0], at + size
        except struct.error as fault:
            raise _cut_number(body) from fault

    return read


def _cut_number(body: memoryview) -> DamageError:
    return DamageError(f"a record of {len(body)} bytes ends within a number")


uint8, uint16, uint32, uint64 = (_integer(code) for code in "BHIQ")
# The code of the module struct for each.
INTEGERS: Mapping[Read, str] = {uint8: "B", uint16: "H", uint32: "I", uint64: "Q"}


def integers(reads: Sequence[Read]) -> Callable[[memoryview, int], tuple[tuple[int, ...], int]]:
    """Return a reader of consecutive integers, at once: `reads` are those of each of them."""
    together = struct.Struct("<" + "".join(INTEGERS[read] for read in reads))

    def read(body: memoryview, at: int) -> tuple[tuple[int, ...], int]:
        try:
            return together.unpack_from(body, at), at + together.size
        except struct.error as fault:
            raise _cut_number(body) from fault

    return read


def _prefixed(length: Read) -> Read:
    """Return a reader of bytes that follow their length."""

    def read(body: memoryview, at: int) -> tuple[memoryview, int]:
        size, at = length(body, at)
        if size > len(body) - at:
            raise DamageError(f"a field declares {size} bytes, but only {len(body) - at} are left")
        return body[at : at + size], at + size

    return read


block, long_block = _prefixed(uint32), _prefixed(uint64)


def byte_block(body: memoryview, at: int) -> tuple[bytes, int]:
    """Read bytes that follow their length, as a copy."""
    content, at = block(body, at)
    return bytes(content), at


def string(body: memoryview, at: int) -> tuple[str, int]:
    """Read a text that follows its length; raises DamageError if it is not UTF-8."""
    content, at = block(body, at)
    try:
        return str(content, "utf-8"), at
    except UnicodeDecodeError as fault:
        raise DamageError("a text is not UTF-8") from fault


def mapping(key: Read, value: Read) -> Read:
    """Return a reader of Map<key, value>; the last value of a repeated key is valid."""

    def read(body: memoryview, at: int) -> tuple[dict[Any, Any], int]:
        content, at = block(body, at)
        entries, inside = {}, 0
        while inside < len(content):
            name, inside = key(content, inside)
            entries[name], inside = value(content, inside)
        return entries, at

    return read


def numbers_by_channel(body: memoryview, at: int) -> tuple[dict[int, int], int]:
    """Read Map<uint16, uint64>."""
    content, at_end = block(body, at)
    if len(content) % _CHANNEL_NUMBER.size:  # cut off within an entry
        return mapping(uint16, uint64)(body, at)
    return dict(_CHANNEL_NUMBER.iter_unpack(content)), at_end


def index_entries(body: memoryview, at: int) -> tuple[tuple[tuple[int, int], ...], int]:
    """Read Array<Tuple<Timestamp, uint64>>."""
    content, at = block(body, at)
    if len(content) % 16:
        raise DamageError(f"a message index of {len(content)} bytes")
    return tuple(struct.iter_unpack("<QQ", content)), at


def rest(body: memoryview, at: int) -> tuple[memoryview, int]:
    """Read all bytes to the record's end."""
    return body[at:], len(body)
