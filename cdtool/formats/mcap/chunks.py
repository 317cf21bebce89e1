"""Decompress chunks (op=0x06) up to the size that they declare, and check their CRC.

zstd and lz4 are frames of their own formats (RFC 8878; LZ4 Frame Format 1.6.x). The sizes that these frames declare are
not used: the limit is the chunk's `uncompressed_size`, and a chunk is refused if no writer of sensor data reaches it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cdtool.formats.mcap.records import LARGEST, PREFIX, DamageError, RefusedError, crc32

# The largest compression ratio: sensor data has ratios of 2 to 50.
LARGEST_SHARE = 250
# Long logs contain motion, so that their ratio is smaller. lz4 cannot reach the larger ratio.
_LONG, _LONG_SHARE = 1 << 30, 100
_LZ4_OUT = 8 << 20  # lz4's decompressor needs memory for the most that it may return [bytes]

_FIXED = struct.Struct("<BQQQQII")  # opcode, content length, three sizes, CRC, length of the compression's name
HEADER_LENGTH = _FIXED.size + 64 + 8
_KNOWN = ("", "zstd", "lz4")
Bytes = npt.NDArray[np.uint8]


class ChunkHeader(NamedTuple):
    """The fields before a chunk's data: `length` is the record's, `data` and `size` locate the compressed data."""

    at: int
    length: int
    message_start_time: int
    message_end_time: int
    uncompressed_size: int
    uncompressed_crc: int
    compression: str
    data: int
    size: int

    @property
    def consistent(self) -> bool:
        """Return whether the record's length matches its fields and data, which is rare for bytes of anything else."""
        return self.data + self.size == self.at + self.length and self.compression in _KNOWN

    def check(self) -> None:
        """Raise DamageError if its sizes or compression are impossible."""
        if self.compression not in _KNOWN:
            raise DamageError(f"unknown compression '{self.compression}'")
        if self.data + self.size > self.at + self.length:
            raise DamageError(f"a chunk declares {self.size} bytes of data in a record of {self.length}")
        if not self.compression and self.size != self.uncompressed_size:
            raise DamageError(f"a chunk of {self.size} bytes declares {self.uncompressed_size}")
        if max(self.size, self.uncompressed_size) > LARGEST:
            raise DamageError(
                f"a chunk declares {max(self.size, self.uncompressed_size)} bytes, more than {LARGEST >> 20} MiB"
            )
        if self.uncompressed_size > max(16 << 20, LARGEST_SHARE * self.size):  # small chunks may be all zeros
            raise RefusedError(f"{self.size} bytes declare {self.uncompressed_size} uncompressed: not decompressed")


def chunk_header(at: int, head: bytes | memoryview) -> ChunkHeader | None:
    """Return the chunk header of the record at byte `at` from its first HEADER_LENGTH bytes; None if it is invalid."""
    if len(head) < _FIXED.size:
        return None
    _, length, first, last, size, crc, name = _FIXED.unpack_from(head)
    end = _FIXED.size + name
    if name > 64 or len(head) < end + 8:
        return None
    compression = str(head[_FIXED.size : end], "utf-8", "replace")
    (packed,) = struct.unpack_from("<Q", head, end)
    return ChunkHeader(at, PREFIX + length, first, last, size, crc, compression, at + end + 8, packed)


@dataclass
class ClaimedSizes:
    """The total size of a file's chunks, compressed and uncompressed, which detects many small bombs."""

    packed: int = 0
    unpacked: int = 0

    def add(self, header: ChunkHeader) -> None:
        """Add a chunk; raises RefusedError if the total ratio exceeds that of any sensor's data."""
        packed, unpacked = self.packed + header.size, self.unpacked + header.uncompressed_size
        share = LARGEST_SHARE if unpacked <= _LONG else _LONG_SHARE
        if unpacked > LARGEST + share * packed:
            raise RefusedError(f"chunks of {packed} bytes in all declare {unpacked} uncompressed: not decompressed")
        self.packed, self.unpacked = packed, unpacked


def unpack(header: ChunkHeader, packed: Bytes, target: Bytes) -> None:
    """Write the content of a complete chunk to `target` (uncompressed_size,), and check it; raises DamageError."""
    size = unpack_available(header, packed, target)
    if size != len(target):
        raise DamageError(f"a chunk of {size} bytes declares {len(target)}")
    if header.uncompressed_crc and crc32(target) != header.uncompressed_crc:
        raise DamageError("the checksum of a chunk does not match")


def unpack_available(header: ChunkHeader, packed: Bytes, target: Bytes) -> int:
    """Write the available part of a chunk that is cut off, without a check, and return its number of bytes."""
    if not header.compression:
        target[: len(packed)] = packed
        return len(packed)
    return (_zstd if header.compression == "zstd" else _lz4)(packed, target)


def _zstd(packed: Bytes, target: Bytes) -> int:
    import zstandard

    # Into memory of the declared size: zstd then needs no window of its own, and cannot exceed the size.
    size, filled, more = len(target), 0, b""
    decompressor = zstandard.ZstdDecompressor(max_window_size=LARGEST)
    with decompressor.stream_reader(packed.data, read_size=max(1, len(packed)), read_across_frames=True) as stream:
        try:
            while filled < size and (count := stream.readinto(target.data[filled:])):
                filled += count
            more = stream.read(1) if filled == size else b""
        except zstandard.ZstdError as fault:
            raise DamageError(f"zstd: {fault}") from fault
    if more:
        raise DamageError(f"a chunk has more than the {size} bytes that it declares")
    return filled


def _lz4(packed: Bytes, target: Bytes) -> int:
    import lz4.frame  # type: ignore[import-untyped]

    size, filled, left = len(target), 0, packed.data
    try:
        for _ in range(1000):  # consecutive frames, as in a file; writers make one
            frame = lz4.frame.LZ4FrameDecompressor()
            while not frame.eof and (len(left) or not frame.needs_input):
                data, left = left, left[:0]
                part = frame.decompress(data, max_length=min(size - filled + 1, _LZ4_OUT))
                if len(part) > size - filled:
                    raise DamageError(f"a chunk has more than the {size} bytes that it declares")
                target[filled : filled + len(part)] = np.frombuffer(part, np.uint8)
                filled += len(part)
                if not (len(part) or len(data)):
                    break
            if not (frame.eof and frame.unused_data):
                break
            left = memoryview(frame.unused_data)
    except RuntimeError as fault:
        raise DamageError(f"lz4: {fault}") from fault
    return filled
