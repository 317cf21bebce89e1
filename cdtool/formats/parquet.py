"""Parquet and Feather (Arrow IPC): tables of columns with types, by pyarrow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError
from cdtool.formats.container_checks import as_numbers, check_size, left_out, library, one_line_errors
from cdtool.formats.groups import Group, Written, clock_of, one_table, stored
from cdtool.formats.own_clocks import OWN_CLOCK, asked_keys
from cdtool.formats.source import Column, Source, split_unit
from cdtool.recording import Finding, FloatArray

_PARQUET, _ARROW = b"PAR1", b"ARROW1"
_UNIT_KEYS = (b"unit", b"units", b"Unit")
_OWN_CLOCKS = b"cdtool.own_clocks"
_ROW_GROUP = 2**20


@dataclass(frozen=True)
class Parquet:
    """Tables of Arrow's kind, `.parquet` and `.feather`: a missing value (null) is NaN, a time stamp seconds."""

    name: ClassVar[str] = "parquet"
    suffixes: ClassVar[tuple[str, ...]] = (".parquet", ".feather", ".arrow")

    def sniff(self, path: Path) -> bool:
        """True if the file starts as Parquet or Arrow writes it."""
        with path.open("rb") as file:
            head = file.read(len(_ARROW))
        return head == _ARROW or head.startswith(_PARQUET)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The columns that `wanted` names, or all numeric ones; raises RecordingError."""
        arrow = library("pyarrow", "parquet", path)
        if not self.sniff(path):
            raise RecordingError(f"{path}: is no Parquet or Feather file", "see cdtool list formats")
        findings: list[Finding] = []
        with one_line_errors(path, "a Parquet or Feather file"):
            table = _Table(path, arrow, findings)
            names = tuple(table.schema.names)
            keys = asked_keys(path, wanted, names)
            read = [key for key in keys if table.is_number(key)]
            findings += [left_out(key, str(table.schema.field(key).type)) for key in keys if key not in read]
            lost = [key for key in keys if key not in read]
            if wanted is not None and lost:
                raise RecordingError(f"{path}: column '{lost[0]}' holds no numbers", "name another column")
            if not read:
                raise RecordingError(f"{path}: holds no column of numbers", "see cdtool info")
            columns = dict(table.columns(read))
        details = {"rows": str(table.rows), "container": table.kind}
        return Source(path, self.name, columns, table.origin, tuple(findings), details, names)


class _Table:
    """A file's schema and columns, whichever of the two containers it is."""

    def __init__(self, path: Path, arrow: Any, findings: list[Finding]) -> None:
        self.path, self.arrow, self.findings = path, arrow, findings
        with path.open("rb") as file:
            self.kind = "parquet" if file.read(4) == _PARQUET else "feather"
        if self.kind == "parquet":
            self._file = library("pyarrow.parquet", "parquet", path).ParquetFile(path, memory_map=True)
            self.schema, self.rows = self._file.schema_arrow, self._file.metadata.num_rows
        else:
            self._file = None
            self._table = self._feather()
            self.schema, self.rows = self._table.schema, self._table.num_rows
        metadata = self.schema.metadata or {}
        self.own_clocks = metadata.get(_OWN_CLOCKS) == b"1" and OWN_CLOCK in self.schema.names
        self.origin = float(metadata.get(b"cdtool.origin_s", b"0")) if self.own_clocks else 0.0

    def is_number(self, key: str) -> bool:
        """True for numbers, booleans and time stamps."""
        types, kind = self.arrow.types, self.schema.field(key).type
        return bool(
            types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_timestamp(kind)
        )

    def columns(self, keys: Sequence[str]) -> Iterator[tuple[str, Column]]:
        """The columns one by one, so that no more than one is there twice."""
        check_size(self.path, self.rows * len(keys))
        time = self._read(OWN_CLOCK)[0] if self.own_clocks else None
        for key in keys:
            if time is not None and key == OWN_CLOCK:
                continue
            values, absent = self._read(key)
            unit = self._unit(key)
            if time is None:
                yield key, Column(key, values, unit=unit)
            else:  # written by cdtool from several clocks: no value (null) means no sample of this column then
                yield key, Column(key, values[~absent], time[~absent], unit)

    def _read(self, key: str) -> tuple[FloatArray, Any]:
        column = self._file.read(columns=[key]).column(0) if self._file is not None else self._table.column(key)
        if self.arrow.types.is_timestamp(column.type):
            return self._seconds(key, column)
        absent = np.asarray(column.is_null().to_numpy())
        values = column.cast(self.arrow.float64(), safe=False) if absent.any() else column
        return as_numbers(key, values.to_numpy(), self.findings), absent

    def _seconds(self, key: str, column: Any) -> tuple[FloatArray, Any]:
        """A time stamp as seconds from the first: what float64 can hold exactly."""
        stamps = column.to_numpy().astype("datetime64[ns]")
        absent = np.isnat(stamps)
        first = stamps[~absent][0] if not absent.all() else np.datetime64(0, "ns")
        seconds = (stamps - first).astype(np.int64) / 1e9
        seconds[absent] = np.nan
        self.findings.append(Finding(f"time stamps: taken as seconds from {first}", key, "note"))
        return seconds, absent

    def _unit(self, key: str) -> str | None:
        if self.arrow.types.is_timestamp(self.schema.field(key).type):
            return "s"
        metadata = self.schema.field(key).metadata or {}
        told = next((metadata[name].decode("utf-8", "replace") for name in _UNIT_KEYS if name in metadata), None)
        return told or split_unit(key)[1]

    def _feather(self) -> Any:
        """The whole record batches of an Arrow file; of one that is cut off those before the cut."""
        ipc = library("pyarrow.ipc", "parquet", self.path)
        try:
            with self.arrow.memory_map(str(self.path)) as file:
                table = ipc.open_file(file).read_all()
        except self.arrow.ArrowInvalid:
            with self.path.open("rb") as stream:
                stream.seek(8)  # behind the magic bytes and their padding an Arrow file is a stream
                batches: list[Any] = []
                reader = ipc.open_stream(stream)
                with suppress(self.arrow.ArrowInvalid, OSError, StopIteration):
                    while True:
                        batches.append(reader.read_next_batch())
                rows = sum(batch.num_rows for batch in batches)
                text = f"the file is cut off or damaged behind row {rows}: what came after is lost"
                self.findings.append(Finding(text, severity="loss"))
                table = self.arrow.Table.from_batches(batches, reader.schema)
        table.validate(full=True)  # Arrow trusts what a file declares unless it is asked to check
        return table


def write_table(path: Path, groups: Sequence[Group], provenance: Mapping[str, str]) -> Written:
    """Write one table: of several clocks the union of their times, without a value where a clock has no sample."""
    arrow = library("pyarrow", "parquet", path)
    own = len(groups) > 1
    if own:
        time = np.unique(np.concatenate([clock_of(path, group) for group in groups]))
    else:
        group = one_table(path, groups)
        time = np.empty(0) if group.time is None or group.is_table else group.time
    fields, arrays, names = [], [], []
    if len(time):
        fields.append(arrow.field(OWN_CLOCK, arrow.float64(), metadata={"unit": "s"}))
        arrays.append(arrow.array(time))
    for group in groups:
        names.append([[part.name for part in parts] for parts in group.flat])
        rows = np.searchsorted(time, clock_of(path, group)) if own else None
        for column in chain(*group.flat):
            fields.append(
                arrow.field(column.name, arrow.float64(), metadata={"unit": column.unit} if column.unit else None)
            )
            arrays.append(_spread(arrow, column.values, rows, len(time)))
    metadata = stored(provenance) | ({_OWN_CLOCKS.decode(): "1"} if own else {})
    table = arrow.Table.from_arrays(arrays, schema=arrow.schema(fields, metadata=metadata))
    if path.suffix == ".parquet":
        library("pyarrow.parquet", "parquet", path).write_table(
            table, path, row_group_size=_ROW_GROUP, compression="zstd"
        )
    else:
        library("pyarrow.feather", "parquet", path).write_feather(table, str(path), compression="zstd")
    return names


def _spread(arrow: Any, values: FloatArray, rows: Any, count: int) -> Any:
    """Values as they are, or at their rows of a longer table, null elsewhere."""
    if rows is None:
        return arrow.array(values)
    spread, absent = np.zeros(count), np.ones(count, dtype=bool)
    spread[rows], absent[rows] = values, False
    return arrow.array(spread, mask=absent)
