"""Check to what size the pages of a Parquet file decompress: its library allocates what a page's header declares.

The sizes in the footer may differ, so that the headers are read page by page. They use Thrift's compact protocol.
https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift, struct PageHeader
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_size

_UNPACKED, _PACKED = 2, 3  # fields of a page's header
_BINARY, _LIST, _SET, _MAP, _STRUCT = 8, 9, 10, 11, 12
_SIZES = {1: 0, 2: 0, 3: 1, 7: 8}  # types of fixed size: true, false, byte, double
_FIRST, _MAGIC = 8, b"ARROW1"
_CONTINUED = 0xFFFFFFFF
_DICTIONARY, _BATCH = 2, 3
_BLOCK = 24


def check_pages(path: Path, metadata: Any, keys: Collection[str]) -> None:
    """Raise RecordingError if the columns `keys` of a Parquet file decompress to far more than a log.

    `metadata` is the file's footer as read by pyarrow.
    """
    columns = [j for j in range(metadata.num_columns) if metadata.schema.column(j).path in keys]
    values = unpacked = 0
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        for i in range(metadata.num_row_groups):
            group = metadata.row_group(i)
            for chunk in map(group.column, columns):
                values += max(group.num_rows, chunk.num_values)
                unpacked += _unpacked(path, content, chunk)
            check_size(path, max(values, unpacked // 8))


def _unpacked(path: Path, content: mmap.mmap, chunk: Any) -> int:
    """Return the decompressed size [bytes] of a column's pages in one row group."""
    at = min(chunk.dictionary_page_offset or chunk.data_page_offset, chunk.data_page_offset)
    end, total = at + chunk.total_compressed_size, 0
    while at < end:
        try:
            fields, at = _PageHeader(content, at).numbers()
        except IndexError:
            fields = {}
        if min(fields.get(_PACKED, -1), fields.get(_UNPACKED, -1)) < 0:
            raise RecordingError(f"{path}: damaged: column '{chunk.path_in_schema}' has a page without its size")
        total += fields[_UNPACKED]
        at += fields[_PACKED]
    return total


class _PageHeader:
    """A struct of Thrift's compact protocol; reading raises IndexError at the file's end."""

    def __init__(self, content: mmap.mmap, at: int) -> None:
        self.content, self.at = content, at

    def numbers(self) -> tuple[dict[int, int], int]:
        """Return the integers by field number, and the byte where the struct ends."""
        integers: dict[int, int] = {}
        number = 0
        while head := self._byte():
            kind, step = head & 15, head >> 4
            number = number + step if step else self._integer()
            if 4 <= kind <= 6:
                integers[number] = self._integer()
            else:
                self._skip(kind)
        return integers, self.at

    def _skip(self, kind: int) -> None:
        if kind == _STRUCT:
            self.numbers()
        elif kind == _BINARY:
            size = self._varint()
            self.at += size
        elif kind in (_LIST, _SET):
            head = self._byte()
            for _ in range(head >> 4 if head < 240 else self._varint()):
                self._skip_element(head & 15)
        elif kind == _MAP:
            count = self._varint()
            kinds = self._byte() if count else 0
            for _ in range(count):
                self._skip_element(kinds >> 4)
                self._skip_element(kinds & 15)
        elif kind in _SIZES:
            self.at += _SIZES[kind]
        else:
            self._varint()

    def _skip_element(self, kind: int) -> None:
        """Skip an element of a list: like a field, except that a boolean has one byte."""
        if self.at >= len(self.content):
            raise IndexError("the file ends")
        if kind in (1, 2):
            self._byte()
        else:
            self._skip(kind)

    def _byte(self) -> int:
        self.at += 1
        return self.content[self.at - 1]

    def _varint(self) -> int:
        value = shift = 0
        while True:
            byte = self._byte()
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value
            if shift > 63:
                raise IndexError("an integer of more than 64 bits")

    def _integer(self) -> int:
        """Return an integer in zigzag encoding, whose lowest bit is the sign."""
        value = self._varint()
        return (value >> 1) ^ -(value & 1)


def check_batches(path: Path) -> None:
    """Raise RecordingError if the compressed batches of a Feather (Arrow IPC) file decompress to far more than a log.

    Arrow allocates the size that a compressed buffer declares before it decompresses the buffer. The file's messages
    are read both in sequence and at the positions that the footer names. Each buffer of a compressed batch starts with
    its decompressed size (https://arrow.apache.org/docs/format/Columnar.html#ipc-file-format). Damage is not reported:
    Arrow does not read a damaged message either.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        declared = 0
        for at in sorted({*_in_sequence(content), *_in_footer(content)}):
            try:
                declared += _declared_size(content, at)
            except (struct.error, IndexError, ValueError):
                continue
            check_size(path, declared // 8)


@dataclass(frozen=True)
class _FlatbufferTable:
    """A table of a flatbuffer: its vtable states the byte of each field that is present."""

    content: mmap.mmap
    at: int

    def field(self, number: int) -> int:
        """Return the byte of a field; 0 if the field is absent."""
        vtable = self.at - _read(self.content, "<i", self.at)
        entry = 4 + 2 * number
        if entry >= _read(self.content, "<H", vtable):
            return 0
        offset = _read(self.content, "<H", vtable + entry)
        return self.at + offset if offset else 0

    def table(self, number: int) -> _FlatbufferTable | None:
        """Return a field that is a table; None if the field is absent."""
        at = self.field(number)
        return _FlatbufferTable(self.content, _target(self.content, at)) if at else None

    def vector(self, number: int) -> tuple[int, int]:
        """Return the byte of a field's first element, and the number of elements."""
        at = self.field(number)
        if not at:
            return 0, 0
        start = _target(self.content, at)
        return start + 4, _read(self.content, "<I", start)


def _declared_size(content: mmap.mmap, at: int) -> int:
    """Return the decompressed size [bytes] that the compressed buffers of the message at that byte declare."""
    message, body = _message(content, at)
    kind_at = message.field(1)
    header = message.table(2)
    kind = content[kind_at] if kind_at else 0
    batch = header.table(1) if kind == _DICTIONARY and header is not None else header
    if kind not in (_DICTIONARY, _BATCH) or batch is None or not batch.field(3):
        return 0
    first, count = batch.vector(2)
    declared = 0
    for entry in range(first, min(first + 16 * count, len(content)), 16):
        offset, length = struct.unpack_from("<qq", content, entry)
        if length >= 8:
            declared += max(0, _read(content, "<q", body + offset))
    return declared


def _in_sequence(content: mmap.mmap) -> Iterator[int]:
    """Yield the bytes where consecutive messages start, from the file's start to the first incomplete message."""
    at = _FIRST
    while at + 8 <= len(content):
        try:
            message, body = _message(content, at)
            length = message.field(3)
            size = _read(content, "<q", length) if length else 0
        except (struct.error, ValueError):
            return
        yield at
        if size < 0 or body <= at:
            return
        at = body + size


def _in_footer(content: mmap.mmap) -> Iterator[int]:
    """Yield the bytes where dictionaries and batches start according to the footer."""
    end = len(content) - len(_MAGIC) - 4
    if end < _FIRST or content[-len(_MAGIC) :] != _MAGIC:
        return
    try:
        start = end - _read(content, "<i", end)
        footer = _FlatbufferTable(content, _target(content, start))
        for number in (_DICTIONARY, _BATCH):
            first, count = footer.vector(number)
            for block in range(first, min(first + _BLOCK * count, end), _BLOCK):
                yield _read(content, "<q", block)
    except (struct.error, ValueError):
        return


def _message(content: mmap.mmap, at: int) -> tuple[_FlatbufferTable, int]:
    """Return the message at that byte, and the byte where its body starts; raises ValueError after the last message."""
    size = _read(content, "<I", at)
    if size == _CONTINUED:  # older files do not have this marker
        at += 4
        size = _read(content, "<I", at)
    if not size:
        raise ValueError("no message")
    return _FlatbufferTable(content, _target(content, at + 4)), at + 4 + size


def _target(content: mmap.mmap, at: int) -> int:
    return at + int(_read(content, "<I", at))


def _read(content: mmap.mmap, form: str, at: int) -> int:
    if at < 0:
        raise ValueError("before the file")
    return int(struct.unpack_from(form, content, at)[0])
