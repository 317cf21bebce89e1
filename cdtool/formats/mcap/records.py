"""The records of an MCAP file (section "Records" of the specification), parsed by the package `mcap`, but strictly."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from io import BytesIO
from typing import Any

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

try:  # ISA-L's function needs about a seventh of the time of zlib's, and returns the same number
    from isal.isal_zlib import crc32
except ImportError:  # a platform without a wheel
    from zlib import crc32

__all__ = ["Opcode", "crc32"]  # of other packages

MAGIC = b"\x89MCAP0\r\n"
PREFIX = 9  # opcode (uint8) and content length (uint64)
# The largest size of a record, compressed or not [bytes]: writers make chunks of 1 to 8 MB.
LARGEST = 128 << 20
# The records that are parsed whole, by their opcode; the package names both alike (CHUNK_INDEX, ChunkIndex).
_WALKED = (Opcode.CHUNK, Opcode.MESSAGE, Opcode.MESSAGE_INDEX)
_KINDS: dict[int, Any] = {
    opcode: getattr(records, opcode.name.title().replace("_", "")) for opcode in Opcode if opcode not in _WALKED
}


class DamageError(Exception):
    """Bytes that cannot be what they declare; the text is the reason that is displayed to the user."""


class RefusedError(DamageError):
    """Bytes that are not decompressed because of their declared size: the file may be a decompression bomb."""


class _StrictStream(ReadDataStream):
    """A stream that does not return fewer bytes than a field declares."""

    def read(self, length: int) -> bytes:
        content = super().read(length)
        if len(content) < length:
            raise EOFError
        return content


def parse(opcode: int, body: bytes | memoryview) -> Any:
    """Return the record with the content `body`, without the bytes after its last known field; raises DamageError."""
    try:
        return _KINDS[opcode].read(_StrictStream(BytesIO(body)))
    except UnicodeDecodeError as fault:
        raise DamageError("a text is not UTF-8") from fault
    except Exception as fault:  # EndOfFile of the package, EOFError, struct.error
        raise DamageError(f"a record of {len(body)} bytes ends within a field") from fault


def parse_all(section: memoryview) -> Iterator[Any]:
    """Yield the known records of a part of a file; raises DamageError."""
    at = 0
    while at < len(section):
        length = record_length(at, section[at : at + PREFIX], len(section))
        if section[at] in _KINDS:
            yield parse(section[at], section[at + PREFIX : at + length])
        at += length


def record_length(at: int, head: bytes | memoryview, size: int) -> int:
    """Return the length of the record at byte `at` with its prefix; raises DamageError if `size` bytes cannot have it.

    Section "Records": opcode, length of the content, content.
    """
    left = size - at - PREFIX
    if left < 0:
        raise DamageError(f"the file ends within a record: {left + PREFIX} bytes are left")
    (length,) = struct.unpack_from("<Q", head, 1)
    if not head[0]:
        raise DamageError("a record of kind 0, which does not exist")
    if length > left:
        raise DamageError(f"a record declares {length} bytes, but only {left} are left")
    return PREFIX + int(length)
