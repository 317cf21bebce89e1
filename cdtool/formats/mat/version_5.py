"""Read and check the elements of a .mat file of version 5 to 7.

SciPy's reader is not used. Of 400 files with one damaged place, 15 crash the process in it (an unknown kind of numbers
is enough, tests/formats/test_mat.py), and of 4 it returns a part without reporting the rest: it compares neither the
size of an element with the element that contains it, nor the numbers of an array with its dimensions.
https://www.mathworks.com/help/pdf_doc/matlab/matfile_format.pdf
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Container
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.errors import RecordingError
from cdtool.formats.containers.container_checks import check_size
from cdtool.formats.mat.variables import Numbers, Opaque, Value, ValueCount, Variables

MAGIC = b"MATLAB 5.0 MAT-file"
# Of the format of MathWorks (MAT-File Format, 1999): bytes of the header, types of elements.
_HEADER, _MATRIX, _COMPRESSED = 128, 14, 15
_NUMBER_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_ENCODINGS = {1: "latin-1", 2: "latin-1", 4: "utf-16-{}", 16: "utf-8", 17: "utf-16-{}", 18: "utf-32-{}"}
_CELL, _STRUCT, _CHAR = 1, 2, 4  # classes of arrays
_NUMERIC_CLASSES = range(6, 16)
# Up to the two dimensions of a matrix.
_HEAD = 40
# Texts are shown, not evaluated: of a longer one the beginning is kept.
LONGEST_TEXT = 4096


def read_variables(path: Path) -> Variables:
    """Return the variables of a file; raises RecordingError, with the byte, if it is cut off or damaged."""
    content = path.read_bytes()
    if not content.startswith(MAGIC) or len(content) < _HEADER:
        raise RecordingError("is not a MATLAB file of version 5 to 7", "save it with save(name, ..., '-v7')")
    reader, variables = _Version5Reader(path, ">" if content[126:128] == b"MI" else "<"), dict[str, Value]()
    reader.check_unpacked(memoryview(content))
    at = _HEADER
    while at < len(content):
        try:
            kind, element, end = reader.element(memoryview(content), at)
            if kind == _COMPRESSED:
                kind, element = reader.inflated(element)
            if kind == _MATRIX:
                name, value = reader.array(element, 0)
                if name:  # the objects of the file are stored in an array without a name
                    variables[_unique(name, variables)] = value
        except (ValueError, struct.error, zlib.error, OverflowError) as fault:
            raise RecordingError(f"damaged at byte {at}: {fault}", "copy the file again or save it again") from fault
        at = end
    return variables


class _Version5Reader:
    """Reads the elements of one file, whose byte order is `order`."""

    def __init__(self, path: Path, order: str) -> None:
        self._path, self.order = path, order
        self._count = ValueCount()

    def element(self, content: memoryview, at: int) -> tuple[int, memoryview, int]:
        """Return kind, content and end of the element at a byte; raises ValueError if it extends beyond `content`."""
        kind, size = struct.unpack_from(f"{self.order}II", content, at)
        start = at + 8
        if kind >> 16:  # a small element: kind and size in two bytes each, the data in the other four
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
            if size > 4:
                raise ValueError(f"a small element declares {size} bytes")
        if start + size > len(content):
            raise ValueError(f"an element declares {size} bytes, but only {len(content) - start} are left")
        return kind, content[start : start + size], start + size

    def check_unpacked(self, content: memoryview) -> None:
        """Raise RecordingError if the compressed elements together declare far more than a log of the file's size."""
        values, at = 0, _HEADER
        with suppress(ValueError, struct.error, zlib.error):  # damage is named with its byte later
            while at < len(content):
                kind, packed, at = self.element(content, at)
                if kind != _COMPRESSED:
                    continue
                head, numbers = zlib.decompressobj().decompress(packed, _HEAD), 0
                if len(head) == _HEAD and struct.unpack_from(f"{self.order}I", head, 16)[0] & 0xFF in _NUMERIC_CLASSES:
                    numbers = abs(math.prod(struct.unpack_from(f"{self.order}2i", head, 32)))
                values += max(struct.unpack_from(f"{self.order}II", head)[1] // 8, numbers)
                check_size(self._path, values)

    def inflated(self, packed: memoryview) -> tuple[int, memoryview]:
        """Return kind and content of a compressed element, of which at most the declared size is decompressed."""
        stream = zlib.decompressobj()
        kind, size = struct.unpack(f"{self.order}II", stream.decompress(packed, 8))
        content = stream.decompress(stream.unconsumed_tail, size) if size else b""
        if len(content) < size:
            raise ValueError(f"an element declares {size} bytes and has {len(content)}")
        stream.decompress(stream.unconsumed_tail, 1)  # verifies the checksum behind the last byte
        if not stream.eof:
            raise ValueError(f"an element declares {size} bytes and has more, or is cut off")
        return kind, memoryview(content)

    def array(self, content: memoryview, level: int) -> tuple[str, Value]:
        """Return name and value of an array that is inside of `level` others."""
        if not content:
            return "", Numbers((0, 0), partial(np.empty, (0, 0)))
        parts = _Parts(self, content)
        flags = parts.integers((6,))
        if len(flags) != 2:
            raise ValueError("an array without its flags")
        matlab_class = flags[0] & 0xFF
        if matlab_class == 17:  # opaque
            name, _, what = (parts.name() for _ in range(3))
            return name, Opaque(what or "object")
        shape = tuple(parts.integers((5, 6), 128))  # MATLAB has at most 32 dimensions, of four bytes each
        if len(shape) < 2 or min(shape) < 0:
            raise ValueError("an array without its dimensions")
        name = parts.name()
        if matlab_class in _NUMERIC_CLASSES:
            is_complex = bool(flags[0] & (1 << 11))  # the flag of complex numbers
            read = [self._numbers(parts, shape) for _ in range(1 + is_complex)]
            return name, Numbers(shape, read[0], is_complex)
        if matlab_class == _CHAR:
            return name, self._characters(parts, shape)
        if matlab_class == _CELL:
            return name, tuple(self._inner(parts, math.prod(shape), level))
        if matlab_class == _STRUCT:
            return name, self._structs(parts, math.prod(shape), level)
        if matlab_class == 3:
            return name, Opaque(f"{parts.name()} object")
        what = {5: "sparse matrix", 16: "function handle"}.get(matlab_class, f"class {matlab_class}")
        return name, Opaque(what)

    def _numbers(self, parts: _Parts, shape: tuple[int, ...]) -> partial[npt.NDArray[Any]]:
        kind, part = parts.next()
        if kind not in _NUMBER_TYPES:
            raise ValueError(f"the numbers of an array are of an unknown kind ({kind})")
        dtype = np.dtype(self.order + _NUMBER_TYPES[kind])
        if len(part) != math.prod(shape) * dtype.itemsize:
            raise ValueError(f"an array of {math.prod(shape):g} numbers has {len(part)} bytes")
        return partial(np.ndarray, shape, dtype, part, order="F")

    def _characters(self, parts: _Parts, shape: tuple[int, ...]) -> str:
        """Return the text in an array of characters; its rows are separated by a space."""
        if not math.prod(shape):
            return ""
        kind, part = parts.next()
        encoding = _ENCODINGS.get(kind, "latin-1").format("le" if self.order == "<" else "be")
        text = bytes(part).decode(encoding, "replace")
        if len(shape) == 2 and shape[0] > 1 and len(text) == math.prod(shape):
            text = " ".join(text[row :: shape[0]].strip() for row in range(shape[0]))
        return text[:LONGEST_TEXT]

    def _structs(self, parts: _Parts, count: int, level: int) -> list[dict[str, Value]]:
        length, (_, stored) = (parts.integers((5, 6), 4) or [0])[0], parts.next()
        if stored and (length <= 0 or len(stored) % length):
            raise ValueError(f"the names of a struct's fields have {len(stored)} bytes, {length} each")
        names: dict[str, None] = {}
        for first in range(0, len(stored), length or 1):
            name = bytes(stored[first : first + length]).split(b"\0")[0].decode("utf-8", "replace")
            names[_unique(name, names)] = None
        values = self._inner(parts, count * len(names), level)
        return [dict(zip(names, row, strict=True)) for row in zip(*[iter(values)] * len(names), strict=True)]

    def _inner(self, parts: _Parts, count: int, level: int) -> list[Value]:
        self._count.add(level + 1, count)
        return [self.array(parts.expect((_MATRIX,)), level + 1)[1] for _ in range(count)]


class _Parts:
    """The parts of an array, one after the other."""

    def __init__(self, reader: _Version5Reader, content: memoryview) -> None:
        self._reader, self._content, self._at = reader, content, 0

    def next(self) -> tuple[int, memoryview]:
        """Return kind and content of the next part."""
        kind, part, end = self._reader.element(self._content, self._at)
        self._at = -(-end // 8) * 8
        return kind, part

    def expect(self, kinds: Container[int]) -> memoryview:
        """Return the content of the next part; raises ValueError if it is not of one of these kinds."""
        kind, part = self.next()
        if kind not in kinds:
            raise ValueError(f"a part of an array is of an unknown kind ({kind})")
        return part

    def integers(self, kinds: Container[int], most: int = 8) -> list[int]:
        """Return integers of four bytes, at most so many bytes of them."""
        part = self.expect(kinds)
        if len(part) % 4 or len(part) > most:
            raise ValueError(f"a part of an array has {len(part)} bytes")
        return list(struct.unpack(f"{self._reader.order}{len(part) // 4}i", part))

    def name(self) -> str:
        """Return a name."""
        return bytes(self.expect(_ENCODINGS)[:LONGEST_TEXT]).decode("utf-8", "replace")


def _unique(name: str, taken: dict[str, Any]) -> str:
    """Return a name that is not taken: of several fields with one name, the second is `name#2`, as in a table."""
    number, unique = 2, name
    while unique in taken:
        unique, number = f"{name}#{number}", number + 1
    return unique
