"""Chunks (op=0x06): decompressed into a given piece of memory, never beyond the size they declare, then checked.

zstd and lz4 are frames of their own formats (RFC 8878; LZ4 Frame Format 1.6.x). What they claim of themselves is not
believed: the chunk's `uncompressed_size` is the bound, and it is refused where no honest writer would reach it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdtool.formats.mcap.container.checksums import crc32
from cdtool.formats.mcap.container.damage import DamageError, RefusedError
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import PREFIX
from cdtool.formats.mcap.container.walk_kernel import Bytes

# The most that one record may hold, compressed or not [bytes]: writers make chunks of 1 to 8 MB.
LARGEST = 128 << 20
# Sensor data shrinks to between a half and a fiftieth; small chunks may be all zeros.
LARGEST_SHARE, _SMALL = 250, 16 << 20
# A long log moves now and then: it does not shrink as much. lz4 cannot reach the other share.
_LONG, _LONG_SHARE = 1 << 30, 100
# lz4's decompressor copies what it is given and what it gives: pieces of these sizes [bytes].
_LZ4_IN, _LZ4_OUT = 1 << 20, 8 << 20
_LZ4_FRAMES = 1000  # of a chunk: writers make one

_FIXED = struct.Struct("<BQQQQII")  # opcode, content length, three sizes, CRC, length of the compression's name
_KNOWN = ("", "zstd", "lz4")


@dataclass(frozen=True)
class ChunkHeader:
    """What stands before a chunk's data: `length` is the record's, `data` and `size` where the compressed data lies."""

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
        """The record's length is that of its fields and its data: what does not begin a chunk is hardly ever so."""
        return self.data + self.size == self.at + self.length and self.compression in _KNOWN

    def check(self) -> None:
        """Raise DamageError where its sizes or compression cannot be."""
        if self.compression not in _KNOWN:
            raise DamageError(f"unknown compression '{self.compression}'")
        if self.data + self.size > self.at + self.length:
            raise DamageError(f"a chunk's data claim {self.size} bytes in a record of {self.length}")
        if not self.compression and self.size != self.uncompressed_size:
            raise DamageError(f"a chunk of {self.size} bytes claims {self.uncompressed_size}")
        if max(self.size, self.uncompressed_size) > LARGEST:
            raise DamageError(
                f"a chunk claims {max(self.size, self.uncompressed_size)} bytes, more than {LARGEST >> 20} MiB"
            )
        if self.uncompressed_size > max(_SMALL, LARGEST_SHARE * self.size):
            raise RefusedError(f"{self.size} bytes claim to become {self.uncompressed_size}: not decompressed")


HEADER_LENGTH = _FIXED.size + 64 + 8


def chunk_header(at: int, head: memoryview) -> ChunkHeader | None:
    """The header of the record at byte `at` of which `head` holds the first HEADER_LENGTH bytes; None: it has none."""
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
    """What the chunks of a file become together: many small bombs are one large one."""

    packed: int = 0
    unpacked: int = 0

    def add(self, header: ChunkHeader) -> None:
        """Take a chunk; raises DamageError where that would be more than any sensor's data."""
        packed, unpacked = self.packed + header.size, self.unpacked + header.uncompressed_size
        share = LARGEST_SHARE if unpacked <= _LONG else _LONG_SHARE
        if unpacked > LARGEST + share * packed:
            raise RefusedError(f"chunks of {packed} bytes in all claim to become {unpacked}: not decompressed")
        self.packed, self.unpacked = packed, unpacked


class Decompressor:
    """Decompressors that are made once a file."""

    def __init__(self) -> None:
        self._into: dict[str, Callable[[Bytes, Bytes], int]] = {}

    def read(self, file: FileBytes, header: ChunkHeader, target: Bytes) -> None:
        """Read a whole chunk from the file into `target` (uncompressed_size,) and check it; raises DamageError."""
        if header.compression:
            self.fill(header, file.read_scratch(header.data, header.size), target)
        else:
            file.read_into(header.data, target)
            check_crc(header, target)

    def fill(self, header: ChunkHeader, packed: Bytes, target: Bytes) -> None:
        """Decompress a whole chunk into `target` (uncompressed_size,) and check it; raises DamageError."""
        size = self.fill_available(header, packed, target)
        if size != len(target):
            raise DamageError(f"a chunk of {size} bytes claims {len(target)}")
        check_crc(header, target)

    def fill_available(self, header: ChunkHeader, packed: Bytes, target: Bytes) -> int:
        """The same of a chunk that is cut off: how many bytes could be had. Nothing tells whether they are right."""
        if header.compression not in self._into:
            self._into[header.compression] = _zstd() if header.compression == "zstd" else _lz4()
        return self._into[header.compression](packed, target)


def check_crc(header: ChunkHeader, content: Bytes) -> None:
    """Raise DamageError where a chunk's content is not what its CRC is of."""
    if header.uncompressed_crc and crc32(content) != header.uncompressed_crc:
        raise DamageError("the checksum of a chunk does not fit")


def _zstd() -> Callable[[Bytes, Bytes], int]:
    import zstandard

    made = zstandard.ZstdDecompressor(max_window_size=LARGEST)

    def decompress(packed: Bytes, target: Bytes) -> int:
        # All at once into memory of the declared size: zstd then needs no window of its own, and cannot go beyond.
        with made.stream_reader(packed.data, read_size=max(1, len(packed)), read_across_frames=True) as stream:
            filled = 0
            try:
                while filled < len(target) and (got := stream.readinto(target.data[filled:])):
                    filled += got
                more = stream.read(1) if filled == len(target) else b""
            except zstandard.ZstdError as fault:
                raise DamageError(f"zstd: {fault}") from fault
        if more:
            raise DamageError(f"a chunk holds more than the {len(target)} bytes it claims")
        return filled

    return decompress


def _lz4() -> Callable[[Bytes, Bytes], int]:
    import lz4.frame  # type: ignore[import-untyped]

    def decompress(packed: Bytes, target: Bytes) -> int:
        filled, left = 0, packed.data
        try:
            for _ in range(_LZ4_FRAMES):  # one frame after another, as a file of them would be read
                if not len(left):
                    break
                made = lz4.frame.LZ4FrameDecompressor()
                while not made.eof and (len(left) or not made.needs_input):
                    given = left[:0]
                    if made.needs_input:
                        given, left = left[:_LZ4_IN], left[_LZ4_IN:]
                    part = made.decompress(given, max_length=min(len(target) - filled + 1, _LZ4_OUT))
                    if len(part) > len(target) - filled:
                        raise DamageError(f"a chunk holds more than the {len(target)} bytes it claims")
                    target[filled : filled + len(part)] = np.frombuffer(part, np.uint8)
                    filled += len(part)
                    if not (len(part) or len(given) or made.needs_input):
                        break
                if made.eof and made.unused_data:
                    left = packed.data[len(packed) - len(left) - len(made.unused_data) :]
        except RuntimeError as fault:
            raise DamageError(f"lz4: {fault}") from fault
        return filled

    return decompress
