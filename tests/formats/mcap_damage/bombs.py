"""Decompression bombs: small files that declare or have a very large decompressed size.

Each bomb is between undamaged chunks, whose messages must still be read: no file is refused as a whole.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

import lz4.frame
import numpy as np
import zstandard

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Block, assemble, blocks_of, with_false_header
from tests.formats.mcap_damage.messages import ALL_DEFINITIONS, START, ordinary
from tests.formats.mcap_damage.truth import Case, Truth

_TEN_GB = 10 * 10**9
_MIB = 1 << 20


def bombs() -> dict[str, Callable[[], Case]]:
    """Return the functions that create the bombs, by name; the bombs are created one by one, since some are large."""
    return {
        "zstd, 10 GB of zeros, declared as 10 GB": lambda: _one(_zeros_zstd(_TEN_GB), _TEN_GB, "zstd"),
        "zstd, 10 GB of zeros, declared as 1000 bytes": lambda: _one(_zeros_zstd(_TEN_GB), 1000, "zstd"),
        "zstd, 10 GB of zeros, declared as 120 MiB": lambda: _one(_zeros_zstd(_TEN_GB), 120 * _MIB, "zstd"),
        "zstd, 10 GB of zeros, declared as 2^63": lambda: _one(_zeros_zstd(_TEN_GB), 2**63, "zstd"),
        "zstd, 10 GB of zeros, its frame without a size": lambda: _one(_zeros_zstd(_TEN_GB, False), _TEN_GB, "zstd"),
        "zstd, a window of 2 GB": lambda: _one(_wide_window(), 1000, "zstd"),
        "lz4, 10 GB of zeros, declared as 10 GB": lambda: _one(_zeros_lz4(_TEN_GB), _TEN_GB, "lz4"),
        "lz4, 10 GB of zeros, declared as 1000 bytes": lambda: _one(_zeros_lz4(_TEN_GB), 1000, "lz4"),
        "lz4, 10 GB of zeros, declared as 120 MiB": lambda: _one(_zeros_lz4(_TEN_GB), 120 * _MIB, "lz4"),
        "no compression, declared as 2^63": lambda: _one(b"abc", 2**63, ""),
        "zstd, 10 GB in 600 chunks of 16 MiB": lambda: _quilt("zstd", 600),
        "lz4, 10 GB in 600 chunks of 16 MiB": lambda: _quilt("lz4", 600),
        "zstd, half a million definitions": lambda: _many(records.channel(9, 0, "/t", "json")),
        "zstd, half a million different definitions": _many_definitions,
        "zstd, half a million messages of no channel": lambda: _many(records.message(999, START, b"")),
        "zstd, half a million undecodable messages": lambda: _many(records.message(9, START, b"{")),
        "zstd, half a million empty records": lambda: _many(records.record(0x80, b""), 3 * _MIB),
        "zstd, a message of 16 MB of brackets": lambda: _many(records.message(9, START, b"[" * 15 * _MIB), 1),
    }


def without_bomb() -> Case:
    """Return the same file without a bomb."""
    return _around([])


def _one(data: bytes, size: int, compression: str) -> Case:
    return _around([with_false_header(Block(compression=compression), data=data, size=size, crc=0)])


def _around(blocks: list[Block], truth_of_it: bool = True) -> Case:
    """Return a file with these chunks between others; `truth_of_it` False: their messages are unknown, perhaps read."""
    rng = np.random.default_rng(5)
    messages = ordinary(rng, 48)
    around = blocks_of(messages, 8, "zstd", everywhere=True)
    truth = Truth(tuple(messages), tuple(messages), loss=True if truth_of_it else None, checked=truth_of_it)
    return Case("bomb", assemble([*around[:3], *blocks, *around[3:]]), truth)


def _quilt(compression: str, count: int) -> Case:
    """Return a file with many chunks, each of a correct and allowed size."""
    content = bytes(16 * _MIB)
    data = zstandard.compress(content) if compression == "zstd" else lz4.frame.compress(content)
    return _around([with_false_header(Block(compression=compression), data=data, size=len(content), crc=0)] * count)


def _many(record: bytes, size: int = 15 * _MIB) -> Case:
    return _filled(record * max(1, size // len(record)))


def _many_definitions() -> Case:
    numbers = range(10, 65_000)
    return _filled(b"".join(records.channel(i, 0, f"/{i % 9}", "json") for _ in range(7) for i in numbers))


def _filled(content: bytes) -> Case:
    content = ALL_DEFINITIONS + records.channel(9, 0, "/many", "json") + content
    block = Block(compression="zstd")
    return _around(
        [with_false_header(block, data=zstandard.compress(content), size=len(content), crc=0)], truth_of_it=False
    )


def _zeros_zstd(size: int, with_size: bool = True) -> bytes:
    """Return a frame of RLE blocks (RFC 8878, 3.1.1.2): four bytes for each 128 KiB."""
    if with_size:
        head = struct.pack("<IBBQ", 0xFD2FB528, 0b1100_0000, 0x58, size)
    else:
        head = struct.pack("<IBB", 0xFD2FB528, 0, 0x58)
    whole, rest = divmod(size, 1 << 17)

    def block(length: int, last: bool) -> bytes:
        return struct.pack("<I", length << 3 | 1 << 1 | last)[:3] + b"\0"

    return head + block(1 << 17, False) * whole + block(rest, True)


def _wide_window() -> bytes:
    """Return a frame with a window of 2 GB (RFC 8878, 3.1.1.1.2) and 1000 zeros."""
    return struct.pack("<IBB", 0xFD2FB528, 0, 21 << 3) + struct.pack("<I", 1000 << 3 | 1 << 1 | 1)[:3] + b"\0"


def _zeros_lz4(size: int) -> bytes:
    """Return a frame of equal, independent blocks of 4 MiB."""
    frame = lz4.frame.compress(
        bytes(8 * _MIB), block_size=lz4.frame.BLOCKSIZE_MAX4MB, block_linked=False, store_size=False
    )
    (length,) = struct.unpack_from("<I", frame, 7)
    block = frame[7 : 7 + 4 + length]
    return frame[:7] + block * (size // (4 * _MIB)) + bytes(4)
