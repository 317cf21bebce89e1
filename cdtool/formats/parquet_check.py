"""How much do the pages of a Parquet file unpack to? Its library allots whatever a page's header claims.

The footer's figures may be others: headers are walked, page by page. They are written in Thrift's compact protocol.
https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift, struct PageHeader
"""

from __future__ import annotations

import mmap
from collections.abc import Collection
from pathlib import Path
from typing import Any

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_size

_UNPACKED, _PACKED = 2, 3  # fields of a page's header
_BINARY, _LIST, _SET, _MAP, _STRUCT = 8, 9, 10, 11, 12
_SIZES = {1: 0, 2: 0, 3: 1, 7: 8}  # types of a fixed size: true, false, a byte, a double


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
