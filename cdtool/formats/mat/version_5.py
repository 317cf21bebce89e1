"""Read and check the elements of a .mat file of version 5 to 7.

SciPy's reader is not used: it constructs everything inside of a struct or object, and some damaged files crash the
process in it. Each element must be within the element that contains it, and the numbers of an array must be of a known
kind and as many as its dimensions require. https://www.mathworks.com/help/pdf_doc/matlab/matfile_format.pdf
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_size
from cdtool.formats.mat.variables import Cells, Numbers, Opaque, Structs, Text, Value, ValueCount, Variables

MAGIC = b"MATLAB 5.0 MAT-file"
_HEADER = 128
# Flags and dimensions of an array are within its first bytes: MATLAB has at most 32 dimensions.
_HEAD = 256
_MATRIX, _COMPRESSED = 14, 15
_NUMBER_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_ENCODINGS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_NUMERIC_CLASSES = range(6, 16)
_COMPLEX = 1 << 11
# Texts are shown, not evaluated: of a longer one the beginning is kept.
_LONGEST_TEXT = 4096


def read_variables(path: Path) -> Variables:
    """Return the variables of a file; raises RecordingError, with the byte, if it is cut off or damaged."""
    content = path.read_bytes()
    if not content.startswith(MAGIC) or len(content) < _HEADER:
        raise RecordingError(f"{path}: is not a MATLAB file of version 5 to 7", "save it with save(name, ..., '-v7')")
    order = ">" if content[126:128] == b"MI" else "<"
    _refuse_bomb(path, content, order)
    elements = _Elements(content, order)
    count, variables = ValueCount(str(path)), dict[str, Value]()
    at = _HEADER
    while at < len(content):
        try:
            kind, element, end = elements.at(at)
            if kind == _MATRIX:
                name, value = _Array(elements, at, count).read(memoryview(element), 0)
                if name:  # the objects of the file are stored in an array without a name
                    variables[_unique(name, variables)] = value
        except (ValueError, struct.error, zlib.error, OverflowError) as fault:
            raise RecordingError(
                f"{path}: damaged at byte {at}: {fault}", "copy the file again or save it again"
            ) from fault
        at = end
    return variables


class _Elements:
    """The elements of a file; the one that was decompressed last is kept, as the numbers of a struct are in one."""

    def __init__(self, content: bytes, order: str) -> None:
        self._content, self.order = content, order
        self._last: tuple[int, tuple[int, bytes | memoryview, int]] = (-1, (0, b"", 0))

    def at(self, at: int) -> tuple[int, bytes | memoryview, int]:
        """Return kind and content of the element at a byte, decompressed, and its end in the file."""
        if self._last[0] != at:
            self._last = (-1, (0, b"", 0))
            kind, start, size = _tag(memoryview(self._content), at, self.order)
            stored = memoryview(self._content)[start : start + size]
            element: bytes | memoryview = stored
            if kind == _COMPRESSED:
                kind, element = _inflated(stored, self.order)
            self._last = (at, (kind, element, start + size))
        return self._last[1]


class _Array:
    """Reads an array and what is inside of it; `element` is the byte in the file at which it is stored."""

    def __init__(self, elements: _Elements, element: int, count: ValueCount) -> None:
        self._elements, self._element, self._count = elements, element, count
        self._order, self._start = elements.order, 0

    def read(self, content: memoryview, start: int, level: int = 0) -> tuple[str, Value]:
        """Return name and value of an array whose content begins at the byte `start` of its element."""
        self._count.add(level)
        if not content:
            return "", Numbers((0, 0), partial(np.empty, (0, 0)))
        kind, at, size = _tag(content, 0, self._order)
        if kind != 6 or size != 8:
            raise ValueError("an array without its flags")
        flags = struct.unpack_from(f"{self._order}I", content, at)[0]
        matlab_class, parts = flags & 0xFF, _Parts(content, 16, self._order)
        if matlab_class == _OPAQUE:
            name, _, what = (parts.text() for _ in range(3))
            return name, Opaque(what or "object")
        shape, name = parts.dimensions(), parts.text()
        if matlab_class in _NUMERIC_CLASSES:
            return name, self._numbers(parts, start, shape, bool(flags & _COMPLEX))
        if matlab_class == _CHAR:
            return name, Text(parts.characters(shape))
        if matlab_class == _CELL:
            return name, Cells(tuple(self._inner(parts, start, math.prod(shape), level)))
        if matlab_class == _STRUCT:
            return name, self._structs(parts, start, math.prod(shape), level)
        if matlab_class == _OBJECT:
            return name, Opaque(f"{parts.text()} object")
        what = {_SPARSE: "sparse matrix", _FUNCTION: "function handle"}.get(matlab_class, f"class {matlab_class}")
        return name, Opaque(what)

    def _numbers(self, parts: _Parts, start: int, shape: tuple[int, ...], is_complex: bool) -> Numbers:
        places = []
        for _ in range(2 if is_complex else 1):
            kind, at, size = parts.next()
            if kind not in _NUMBER_TYPES:
                raise ValueError(f"the numbers of an array are of an unknown kind ({kind})")
            dtype = np.dtype(self._order + _NUMBER_TYPES[kind])
            if size != math.prod(shape) * dtype.itemsize:
                raise ValueError(f"an array of {math.prod(shape)} numbers has {size} bytes")
            places.append((start + at, dtype))
        return Numbers(shape, partial(self._load, places[0], shape), is_complex)

    def _load(self, place: tuple[int, np.dtype[Any]], shape: tuple[int, ...]) -> npt.NDArray[Any]:
        element = self._elements.at(self._element)[1]
        return np.frombuffer(element, place[1], math.prod(shape), place[0]).reshape(shape, order="F")

    def _structs(self, parts: _Parts, start: int, count: int, level: int) -> Structs:
        _, at, size = parts.next()
        length = struct.unpack_from(f"{self._order}i", parts.content, at)[0] if size == 4 else 0
        _, at, size = parts.next()
        if size and (length <= 0 or size % length):
            raise ValueError(f"the names of a struct's fields have {size} bytes, {length} each")
        if not size:
            return Structs(())
        names: dict[str, None] = {}
        for first in range(at, at + size, length):
            name = bytes(parts.content[first : first + length]).split(b"\0")[0].decode("utf-8", "replace")
            names[_unique(name, names)] = None
        values = list(self._inner(parts, start, count * len(names), level))
        width = len(names)
        return Structs(
            tuple(dict(zip(names, values[i : i + width], strict=True)) for i in range(0, len(values), width))
        )

    def _inner(self, parts: _Parts, start: int, count: int, level: int) -> Iterator[Value]:
        for _ in range(count):
            kind, at, size = parts.next()
            if kind != _MATRIX:
                raise ValueError(f"an array inside of another is of an unknown kind ({kind})")
            yield self.read(parts.content[at : at + size], start + at, level + 1)[1]


class _Parts:
    """The parts of an array, one after the other."""

    def __init__(self, content: memoryview, at: int, order: str) -> None:
        self.content, self._at, self._order = content, at, order

    def next(self) -> tuple[int, int, int]:
        """Return kind, start and size of the next part."""
        kind, at, size = _tag(self.content, self._at, self._order)
        self._at = _padded(at + size)
        return kind, at, size

    def dimensions(self) -> tuple[int, ...]:
        """Return the dimensions of the array."""
        kind, at, size = self.next()
        if kind not in (5, 6) or size % 4 or not 8 <= size <= _HEAD:
            raise ValueError("an array without its dimensions")
        shape: tuple[int, ...] = struct.unpack_from(f"{self._order}{size // 4}i", self.content, at)
        if min(shape) < 0:
            raise ValueError(f"an array of negative dimensions ({' x '.join(map(str, shape))})")
        return shape

    def text(self) -> str:
        """Return a name."""
        kind, at, size = self.next()
        if kind not in _ENCODINGS:
            raise ValueError(f"a name is of an unknown kind ({kind})")
        return bytes(self.content[at : at + min(size, _LONGEST_TEXT)]).decode("utf-8", "replace")

    def characters(self, shape: tuple[int, ...]) -> str:
        """Return the text in an array of characters; its rows are separated by a space."""
        if not math.prod(shape):
            return ""
        kind, at, size = self.next()
        encoding = _ENCODINGS.get(kind, "latin-1")
        encoding += {"utf-16": "-be", "utf-32": "-be"}.get(encoding, "") if self._order == ">" else ""
        encoding += "-le" if self._order == "<" and encoding in ("utf-16", "utf-32") else ""
        text = bytes(self.content[at : at + size]).decode(encoding, "replace")
        if len(shape) == 2 and shape[0] > 1 and len(text) == math.prod(shape):
            text = " ".join(text[row :: shape[0]].strip() for row in range(shape[0]))
        return text[:_LONGEST_TEXT]


def _unique(name: str, taken: dict[str, Any]) -> str:
    """Return a name that is not taken: of several fields with one name, the second is `name#2`, as in a table."""
    number, unique = 2, name
    while unique in taken:
        unique, number = f"{name}#{number}", number + 1
    return unique


def _refuse_bomb(path: Path, content: bytes, order: str) -> None:
    """Raise RecordingError, before decompression, if the elements or arrays need far more memory than the file."""
    view = memoryview(content)
    at, unpacked, numbers = _HEADER, 0, 0
    with suppress(ValueError, struct.error, zlib.error):  # damage is reported with its byte later
        while at < len(content):
            kind, start, size = _tag(view, at, order)
            element: bytes | memoryview = view[start : start + min(size, _HEAD)]
            if kind == _COMPRESSED:
                element = zlib.decompressobj().decompress(view[start : start + size], _HEAD)
                kind, declared = struct.unpack_from(f"{order}II", element)
                unpacked += declared
                element = element[8:]
            if kind == _MATRIX:
                with suppress(ValueError, struct.error):
                    numbers += _array_size(element, order)
            check_size(path, max(unpacked // 8, numbers))
            at = start + size


def _array_size(element: bytes | memoryview, order: str) -> int:
    """Return the number of values that the dimensions in an array's first bytes declare; 0 if it is not numeric."""
    if struct.unpack_from(f"{order}I", element, 8)[0] & 0xFF not in _NUMERIC_CLASSES:
        return 0
    size = struct.unpack_from(f"{order}I", element, 20)[0]
    dimensions: tuple[int, ...] = struct.unpack_from(f"{order}{min(size, _HEAD) // 4}i", element, 24)
    return abs(math.prod(dimensions))


def _tag(content: memoryview, at: int, order: str) -> tuple[int, int, int]:
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


def _inflated(packed: memoryview, order: str) -> tuple[int, bytes]:
    # Decompress at most the size that the element declares in its first bytes.
    stream = zlib.decompressobj()
    kind, size = struct.unpack(f"{order}II", stream.decompress(packed, 8))
    content = stream.decompress(stream.unconsumed_tail, size) if size else b""
    if len(content) < size:
        raise ValueError(f"an element declares {size} bytes and has {len(content)}")
    stream.decompress(stream.unconsumed_tail, 1)  # verifies the checksum behind the last byte
    if not stream.eof:
        raise ValueError(f"an element declares {size} bytes and has more, or is cut off")
    return kind, content


def _padded(at: int) -> int:
    return -(-at // 8) * 8
