"""How much do the pages of a Parquet file unpack to? Its library allots whatever a page's header claims.

The footer's figures may be others: headers are walked, page by page. They are written in Thrift's compact protocol.
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
_SIZES = {1: 0, 2: 0, 3: 1, 7: 8}  # types of a fixed size: true, false, a byte, a double
_FIRST, _MAGIC = 8, b"ARROW1"
_CONTINUED = 0xFFFFFFFF
_DICTIONARY, _BATCH = 2, 3
_BLOCK = 24


def check_pages(path: Path, metadata: Any, keys: Collection[str]) -> None:
    """Refuse a Parquet file whose columns `keys` unpack to far more than a log; raises RecordingError.

    `metadata` is its footer, as pyarrow reads it.
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
    """To how many bytes a column's pages in one row group unpack."""
    at = min(chunk.dictionary_page_offset or chunk.data_page_offset, chunk.data_page_offset)
    end, total = at + chunk.total_compressed_size, 0
    while at < end:
        try:
            fields, at = _Header(content, at).numbers()
        except IndexError:
            fields = {}
        if min(fields.get(_PACKED, -1), fields.get(_UNPACKED, -1)) < 0:
            raise RecordingError(f"{path}: damaged: column '{chunk.path_in_schema}' has a page without its size")
        total += fields[_UNPACKED]
        at += fields[_PACKED]
    return total


class _Header:
    """A struct of Thrift's compact protocol; raises IndexError at the file's end."""

    def __init__(self, content: mmap.mmap, at: int) -> None:
        self.content, self.at = content, at

    def numbers(self) -> tuple[dict[int, int], int]:
        """Its integers by the numbers of their fields, and where it ends."""
        found: dict[int, int] = {}
        number = 0
        while head := self._byte():
            kind, step = head & 15, head >> 4
            number = number + step if step else self._integer()
            if 4 <= kind <= 6:
                found[number] = self._integer()
            else:
                self._skip(kind)
        return found, self.at

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
        """As a field, but that a truth value takes a byte."""
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
                raise IndexError("no integer")

    def _integer(self) -> int:
        """Zigzag: the sign is the lowest bit."""
        value = self._varint()
        return (value >> 1) ^ -(value & 1)


def check_batches(path: Path) -> None:
    """Refuse a Feather (Arrow IPC) file whose compressed batches unpack to far more than a log; raises RecordingError.

    Arrow allots whatever a compressed buffer claims before it looks. The file's messages are walked, both one behind
    the other and where the footer points; of a compressed batch each buffer begins with the number of bytes it unpacks
    to (https://arrow.apache.org/docs/format/Columnar.html#ipc-file-format). Damage is not looked for: where a message
    cannot be walked, Arrow will not read it either.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        claimed = 0
        for at in sorted({*_in_sequence(content), *_in_footer(content)}):
            try:
                claimed += _claimed(content, at)
            except (struct.error, IndexError, ValueError):
                continue
            check_size(path, claimed // 8)


@dataclass(frozen=True)
class _Table:
    """A table of a flatbuffer: a vtable says at which byte a field lies, if it is there."""

    content: mmap.mmap
    at: int

    def field(self, number: int) -> int:
        """Where a field lies, 0 if it is not there."""
        vtable = self.at - _read(self.content, "<i", self.at)
        place = 4 + 2 * number
        if place >= _read(self.content, "<H", vtable):
            return 0
        offset = _read(self.content, "<H", vtable + place)
        return self.at + offset if offset else 0

    def table(self, number: int) -> _Table | None:
        """A field that is a table."""
        place = self.field(number)
        return _Table(self.content, _pointed(self.content, place)) if place else None

    def vector(self, number: int) -> tuple[int, int]:
        """Where a field's elements begin, and how many they are."""
        place = self.field(number)
        if not place:
            return 0, 0
        start = _pointed(self.content, place)
        return start + 4, _read(self.content, "<I", start)


def _claimed(content: mmap.mmap, at: int) -> int:
    """To how many bytes the compressed buffers of the message at that byte unpack, as they say."""
    message, body = _message(content, at)
    kind = message.field(1)
    header = message.table(2)
    which = content[kind] if kind else 0
    batch = header.table(1) if which == _DICTIONARY and header is not None else header
    if which not in (_DICTIONARY, _BATCH) or batch is None or not batch.field(3):
        return 0
    first, count = batch.vector(2)
    claimed = 0
    for place in range(first, min(first + 16 * count, len(content)), 16):
        offset, length = struct.unpack_from("<qq", content, place)
        if length >= 8:
            claimed += max(0, _read(content, "<q", body + offset))
    return claimed


def _in_sequence(content: mmap.mmap) -> Iterator[int]:
    """Where messages begin, one behind the other from the file's start; up to the first that is not whole."""
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
    """Where the footer says that dictionaries and batches begin."""
    end = len(content) - len(_MAGIC) - 4
    if end < _FIRST or content[-len(_MAGIC) :] != _MAGIC:
        return
    try:
        start = end - _read(content, "<i", end)
        footer = _Table(content, _pointed(content, start))
        for number in (_DICTIONARY, _BATCH):
            first, count = footer.vector(number)
            for place in range(first, min(first + _BLOCK * count, end), _BLOCK):
                yield _read(content, "<q", place)
    except (struct.error, ValueError):
        return


def _message(content: mmap.mmap, at: int) -> tuple[_Table, int]:
    """The message at that byte, and where its body begins; raises ValueError at the end of the messages."""
    size = _read(content, "<I", at)
    if size == _CONTINUED:  # older files have no such mark
        at += 4
        size = _read(content, "<I", at)
    if not size:
        raise ValueError("no message")
    return _Table(content, _pointed(content, at + 4)), at + 4 + size


def _pointed(content: mmap.mmap, at: int) -> int:
    return at + int(_read(content, "<I", at))


def _read(content: mmap.mmap, form: str, at: int) -> int:
    if at < 0:
        raise ValueError("before the file")
    return int(struct.unpack_from(form, content, at)[0])
