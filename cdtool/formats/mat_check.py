"""Check that a .mat file (version 5 to 7) is complete: some damaged files crash the process in scipy's reader.

Each element must be within the element that contains it, and the numbers of an array must be of a known kind and as
many as its dimensions require. https://www.mathworks.com/help/pdf_doc/matlab/matfile_format.pdf
"""

from __future__ import annotations

import math
import struct
import zlib
from contextlib import suppress
from pathlib import Path

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_size

MAGIC = b"MATLAB 5.0 MAT-file"
_HEADER = 128
# Flags and dimensions of an array are within its first bytes: MATLAB has at most 32 dimensions.
_HEAD = 256
_MATRIX, _COMPRESSED = 14, 15
_NUMBER_SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}
_NUMERIC_CLASSES = range(6, 16)
_COMPLEX = 1 << 11


def check_complete(path: Path) -> None:
    """Raise RecordingError, with the byte, if the file is cut off or damaged."""
    content = path.read_bytes()
    if not content.startswith(MAGIC) or len(content) < _HEADER:
        raise RecordingError(f"{path}: is not a MATLAB file of version 5 to 7", "save it with save(name, ..., '-v7')")
    order = ">" if content[126:128] == b"MI" else "<"
    _refuse_bomb(path, content, order)
    at = _HEADER
    while at < len(content):
        try:
            kind, start, size = _tag(content, at, order)
            element = content[start : start + size]
            if kind == _COMPRESSED:
                kind, element = _inflated(element, order)
            if kind == _MATRIX:
                _check_array(element, order)
        except (ValueError, struct.error, zlib.error) as fault:
            raise RecordingError(
                f"{path}: damaged at byte {at}: {fault}", "copy the file again or save it again"
            ) from fault
        at = start + size


def _refuse_bomb(path: Path, content: bytes, order: str) -> None:
    """Raise RecordingError, before decompression, if the elements or arrays need far more memory than the file."""
    at, unpacked, numbers = _HEADER, 0, 0
    with suppress(ValueError, struct.error, zlib.error):  # damage is reported with its byte later
        while at < len(content):
            kind, start, size = _tag(content, at, order)
            element = content[start : start + min(size, _HEAD)]
            if kind == _COMPRESSED:
                element = zlib.decompressobj().decompress(content[start : start + size], _HEAD)
                kind, declared = struct.unpack_from(f"{order}II", element)
                unpacked += declared
                element = element[8:]
            if kind == _MATRIX:
                with suppress(ValueError, struct.error):
                    numbers += _array_size(element, order)
            check_size(path, max(unpacked // 8, numbers))
            at = start + size


def _array_size(element: bytes, order: str) -> int:
    """Return the number of values that the dimensions in an array's first bytes declare; 0 if it is not numeric."""
    if struct.unpack_from(f"{order}I", element, 8)[0] & 0xFF not in _NUMERIC_CLASSES:
        return 0
    size = struct.unpack_from(f"{order}I", element, 20)[0]
    dimensions: tuple[int, ...] = struct.unpack_from(f"{order}{min(size, _HEAD) // 4}i", element, 24)
    return abs(math.prod(dimensions))


def _tag(content: bytes, at: int, order: str) -> tuple[int, int, int]:
    """Return kind, start and size of the element at a byte; raises ValueError if it extends beyond the content."""
    kind, size = struct.unpack_from(f"{order}II", content, at)
    start = at + 8
    if kind >> 16:  # a small element: kind and size in two bytes each, the data in the other four
        kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
        if size > 4:
            raise ValueError(f"a small element declares {size} bytes")
    if start + size > len(content):
        raise ValueError(f"an element declares {size} bytes, but only {len(content) - start} are left")
    return kind, start, size


def _inflated(packed: bytes, order: str) -> tuple[int, bytes]:
    # Decompress at most the size that the element declares in its first bytes.
    stream = zlib.decompressobj()
    kind, size = struct.unpack(f"{order}II", stream.decompress(packed, 8))
    content = stream.decompress(stream.unconsumed_tail, size) if size else b""
    if len(content) < size:
        raise ValueError(f"an element declares {size} bytes and has {len(content)}")
    return kind, content


def _check_array(content: bytes, order: str) -> None:
    kind, at, size = _tag(content, 0, order)
    if kind != 6 or size != 8:
        raise ValueError("an array without its flags")
    flags = struct.unpack_from(f"{order}I", content, at)[0]
    if flags & 0xFF not in _NUMERIC_CLASSES:
        return  # never read
    kind, at, size = _tag(content, 16, order)
    if kind != 5 or size % 4:
        raise ValueError("an array without its dimensions")
    count = math.prod(struct.unpack_from(f"{order}{size // 4}i", content, at))
    _, at, size = _tag(content, _padded(at + size), order)
    for _ in range(2 if flags & _COMPLEX else 1):
        kind, at, size = _tag(content, _padded(at + size), order)
        if kind not in _NUMBER_SIZES:
            raise ValueError(f"the numbers of an array are of an unknown kind ({kind})")
        if size != count * _NUMBER_SIZES[kind]:
            raise ValueError(f"an array of {count} numbers has {size} bytes")


def _padded(at: int) -> int:
    return -(-at // 8) * 8
