"""How values are written (section "Serialization" of the specification).

A reader takes a record's content and a place in it, and gives the value there and the place behind it. Integers are
little-endian. What ends before its value does is a DamageError.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from cdtool.formats.mcap.container.damage import DamageError

Read = Callable[[memoryview, int], tuple[Any, int]]


def _integer(code: str) -> Read:
    unpack, size = struct.Struct(f"<{code}").unpack_from, struct.calcsize(f"<{code}")

    def read(body: memoryview, at: int) -> tuple[int, int]:
        if at + size > len(body):
            raise DamageError(f"a record of {len(body)} bytes ends within a number")
        return unpack(body, at)[0], at + size

    return read


uint8, uint16, uint32, uint64 = (_integer(code) for code in "BHIQ")


def _prefixed(length: Read) -> Read:
    """Bytes behind their length."""

    def read(body: memoryview, at: int) -> tuple[memoryview, int]:
        size, at = length(body, at)
        if size > len(body) - at:
            raise DamageError(f"a field claims {size} bytes where {len(body) - at} are left")
        return body[at : at + size], at + size

    return read


block, long_block = _prefixed(uint32), _prefixed(uint64)


def byte_block(body: memoryview, at: int) -> tuple[bytes, int]:
    """Bytes behind their length, as a copy."""
    content, at = block(body, at)
    return bytes(content), at


def string(body: memoryview, at: int) -> tuple[str, int]:
    """UTF-8 behind its length; raises DamageError where it is not."""
    content, at = block(body, at)
    try:
        return str(content, "utf-8"), at
    except UnicodeDecodeError as fault:
        raise DamageError("a text is not UTF-8") from fault


def mapping(key: Read, value: Read) -> Read:
    """Map<key, value>: of a key that comes twice the last counts."""

    def read(body: memoryview, at: int) -> tuple[dict[Any, Any], int]:
        held, at = block(body, at)
        entries, inside = {}, 0
        while inside < len(held):
            name, inside = key(held, inside)
            entries[name], inside = value(held, inside)
        return entries, at

    return read


def index_entries(body: memoryview, at: int) -> tuple[tuple[tuple[int, int], ...], int]:
    """Array<Tuple<Timestamp, uint64>>."""
    held, at = block(body, at)
    if len(held) % 16:
        raise DamageError(f"a message index of {len(held)} bytes")
    return tuple(struct.iter_unpack("<QQ", held)), at


def rest(body: memoryview, at: int) -> tuple[memoryview, int]:
    """All bytes up to the record's end."""
    return body[at:], len(body)
