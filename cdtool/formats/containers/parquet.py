"""Parquet: tables of typed columns, by pyarrow."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import column_key, requested_keys, split_unit
from cdtool.formats.columns import Categories, Column, Piece, as_float64
from cdtool.formats.containers.container_checks import check_size, left_out_finding, library, one_line_errors
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.pieces import VALUES_PER_PIECE, Pieces, PiecewiseFormat
from cdtool.formats.source import Source

_MAGIC = b"PAR1"
_UNIT_KEYS = (b"unit", b"units", b"Unit")


@dataclass(frozen=True)
class Parquet(PiecewiseFormat):
    """Parquet tables: a missing value (null) becomes NaN, a time stamp becomes seconds."""

    name: ClassVar[str] = "parquet"
    suffixes: ClassVar[tuple[str, ...]] = (".parquet",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a Parquet file."""
        with path.open("rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        arrow = library("pyarrow", "parquet")
        findings: list[Finding] = []
        with one_line_errors("a Parquet file"):
            table = _Table(path, arrow, findings, wanted.worded if wanted is not None else ())
            names = tuple(table.schema.names)
            keys = [key for key in requested_keys(wanted, names) if some is None or key in some]
            read = [key for key in keys if table.is_number(key)]
            left_out = [key for key in keys if key not in read]
            findings += [left_out_finding(key, str(table.schema.field(key).type)) for key in left_out]
            if wanted is not None and left_out:
                raise RecordingError(f"column '{left_out[0]}' is not numeric", "map another column")
            if not read:
                raise RecordingError("has no column of numbers", "see cdtool info")
            yield from table.pieces(read)
        findings += [finding for key in read for finding in rounding_finding(key, table.rounded[key])]
        details = {"rows": str(table.rows)}
        unique = tuple(dict.fromkeys(findings))
        return Source(path, self.name, table.headers(read), table.origin, unique, details, names)


class _Table:
    """Schema and rows of a file; `rows` is their number after `pieces` has read them.

    The columns `worded` may contain texts, which are read as categories.
    """

    def __init__(self, path: Path, arrow: Any, findings: list[Finding], worded: Collection[str | int] = ()) -> None:
        self.path, self.arrow, self.findings = path, arrow, findings
        self.rows, self.rounded = 0, Counter[str]()
        self._file = library("pyarrow.parquet", "parquet").ParquetFile(os.fspath(path))
        self.schema = self._file.schema_arrow
        self.origin = float((self.schema.metadata or {}).get(b"cdtool.origin_s", b"0"))
        self._starts: dict[str, Any] = {}  # of columns of time stamps
        asked = (key for name in worded if (key := column_key(name, self.schema.names)))
        self._categories = {key: Categories() for key in asked if self._has_texts(key)}

    def _has_texts(self, key: str) -> bool:
        types, kind = self.arrow.types, self.schema.field(key).type
        kind = kind.value_type if types.is_dictionary(kind) else kind
        return bool(types.is_string(kind) or types.is_large_string(kind))

    def is_number(self, key: str) -> bool:
        """Return whether a column has numbers, booleans or time stamps, or is read as categories."""
        types, kind = self.arrow.types, self.schema.field(key).type
        return key in self._categories or bool(
            types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_timestamp(kind)
        )

    def headers(self, keys: Sequence[str]) -> dict[str, Column]:
        """Return the columns without their rows."""
        words = {key: each.words for key, each in self._categories.items()}
        return {key: Column(key, np.empty(0), None, self._unit(key), words.get(key, {})) for key in keys}

    def pieces(self, keys: Sequence[str]) -> Iterator[Piece]:
        """Yield the rows of these columns, one group of rows at a time."""
        metadata = self._file.metadata
        check_size(self.path, sum(metadata.row_group(i).num_rows for i in range(metadata.num_row_groups)) * len(keys))
        for batch in self._file.iter_batches(max(2**12, VALUES_PER_PIECE // len(keys)), columns=list(keys)):
            self.rows += batch.num_rows
            check_size(self.path, self.rows * len(keys))
            columns = {key: self._numbers(key, batch.column(batch.schema.get_field_index(key))) for key in keys}
            yield Piece("", None, columns, batch.num_rows)

    def _numbers(self, key: str, column: Any) -> FloatArray:
        """Return the values, NaN where one is absent (null)."""
        absent = np.asarray(column.is_null().to_numpy(zero_copy_only=False))
        if key in self._categories:
            return self._codes(self._categories[key], column, absent)
        if self.arrow.types.is_timestamp(column.type):
            return self._seconds(key, column.to_numpy(zero_copy_only=False).astype("datetime64[ns]"))
        if self.arrow.types.is_boolean(column.type):
            column = column.cast(self.arrow.uint8())
        is_integer = self.arrow.types.is_integer(column.type)
        raw = (column.fill_null(0) if is_integer else column).to_numpy(zero_copy_only=False)
        self.rounded[key] += rounded_integers(raw) if is_integer else 0
        values = as_float64(raw)
        return np.where(absent, np.nan, values) if absent.any() else values

    def _codes(self, categories: Categories, column: Any, absent: Any) -> FloatArray:
        """Return the codes of a column of texts; NaN where a text is missing or empty."""
        encoded = column if self.arrow.types.is_dictionary(column.type) else column.dictionary_encode()
        texts = encoded.dictionary.to_pylist()
        codes = np.array([categories.code(text) if text else np.nan for text in texts], dtype=np.float64)
        values = np.full(len(column), np.nan)
        if len(codes):
            values[~absent] = codes[encoded.indices.to_numpy(zero_copy_only=False)[~absent].astype(np.intp)]
        return values

    def _seconds(self, key: str, stamps: Any) -> FloatArray:
        """Return time stamps as seconds after the first one, which float64 can represent."""
        absent = np.isnat(stamps)
        if key not in self._starts and not absent.all():
            self._starts[key] = stamps[~absent][0]
            self.findings.append(Finding("stamps_as_seconds", key, {"start": str(self._starts[key])}))
        seconds: FloatArray = (stamps - self._starts.get(key, np.datetime64(0, "ns"))).astype(np.int64) / 1e9
        seconds[absent] = np.nan
        return seconds

    def _unit(self, key: str) -> str | None:
        if self.arrow.types.is_timestamp(self.schema.field(key).type):
            return "s"
        metadata = self.schema.field(key).metadata or {}
        stated = next((metadata[name].decode("utf-8", "replace") for name in _UNIT_KEYS if name in metadata), None)
        return stated or split_unit(key)[1]
