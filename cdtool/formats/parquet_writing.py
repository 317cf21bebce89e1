"""Writing recordings as Parquet and Feather (Arrow IPC): one table, piece by piece."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.columns import Column
from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.container_checks import library
from cdtool.formats.groups import Group, Part, Parts, Written, need_clocks, stored
from cdtool.formats.parquet import OWN_CLOCKS
from cdtool.recording import BoolArray, FloatArray

# What is written at once: so many numbers, 8 MiB of them, but no fewer rows.
_VALUES, _FEWEST_ROWS = 2**20, 2**14


def write_parquet(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> Written:
    """Write one table as Parquet: of several clocks a row for every time, null where a clock has no sample."""
    return _write_table(path, groups, parts, provenance, feather=False)


def write_feather(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> Written:
    """Write one table as Feather, as `write_parquet` does."""
    return _write_table(path, groups, parts, provenance, feather=True)


def _write_table(
    path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str], *, feather: bool
) -> Written:
    arrow = library("pyarrow", "parquet", path)
    several = len(groups) > 1
    if several:
        need_clocks(path, groups)
    columns = [Column(OWN_CLOCK, np.empty(0), unit="s")] if several or groups[0].own_clock else []
    columns += [column for group in groups for column in chain(*group.flat)]
    fields = [
        arrow.field(column.name, arrow.float64(), metadata={"unit": column.unit} if column.unit else None)
        for column in columns
    ]
    metadata = stored(provenance) | ({OWN_CLOCKS.decode(): "1"} if several else {})
    schema = arrow.schema(fields, metadata=metadata)
    with _opened(arrow, path, schema, feather=feather) as write:
        for ready in parts:
            arrays = _of_several(arrow, groups, ready) if several else _of_one(arrow, groups[0], ready[0])
            write(arrow.Table.from_arrays(arrays, schema=schema))
    return [[[part.name for part in parts] for parts in group.flat] for group in groups]


@contextmanager
def _opened(arrow: Any, path: Path, schema: Any, *, feather: bool) -> Iterator[Callable[[Any], None]]:
    """What takes the next rows of the file; they wait until a group of rows is full."""
    if feather:
        ipc = library("pyarrow.ipc", "parquet", path)
        writer = ipc.new_file(str(path), schema, options=ipc.IpcWriteOptions(compression="zstd"))
    else:
        writer = library("pyarrow.parquet", "parquet", path).ParquetWriter(path, schema, compression="zstd")
    waiting: list[Any] = []
    most = max(_FEWEST_ROWS, _VALUES // len(schema.names))

    def flush() -> None:
        if waiting:
            writer.write_table(arrow.concat_tables(waiting).combine_chunks(), most)
        waiting.clear()

    def write(table: Any) -> None:
        waiting.append(table)
        if sum(part.num_rows for part in waiting) >= most:
            flush()

    with writer:
        yield write
        flush()


def _of_one(arrow: Any, group: Group, part: Part | None) -> list[Any]:
    if part is None:
        return [_array(arrow, np.empty(0)) for _ in range(group.own_clock + len(list(chain(*group.flat))))]
    own = [part.time] if group.own_clock and part.time is not None else []
    return [_array(arrow, column) for column in (*own, *part.flat)]


def _of_several(arrow: Any, groups: Sequence[Group], ready: Sequence[Part | None]) -> list[Any]:
    """The times of any clock, then each column at the rows of its own."""
    times = [np.empty(0) if part is None or part.time is None else part.time for part in ready]
    table, rows = _rows(times)
    arrays = [_array(arrow, table)]
    for group, part, places in zip(groups, ready, rows, strict=True):
        empty = [np.empty(0)] * len(list(chain(*group.flat)))
        arrays += [_spread(arrow, values, places, len(table)) for values in (part.flat if part is not None else empty)]
    return arrays


def _rows(times: Sequence[FloatArray]) -> tuple[FloatArray, list[Any]]:
    """All times in order, and where the samples of each clock go; a time that a clock repeats has a row for each."""
    turns = [_turns(time) for time in times]
    time, turn = np.concatenate(times), np.concatenate(turns)
    order = np.lexsort((turn, time))
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(time[order]) != 0.0) | (np.diff(turn[order]) != 0)
    row = np.empty(len(order), dtype=np.intp)
    row[order] = np.cumsum(new) - 1
    return time[order][new], np.split(row, np.cumsum([len(part) for part in times])[:-1])


def _turns(time: FloatArray) -> Any:
    """How often each time was there before."""
    order = np.argsort(time, kind="stable")
    new = np.ones(len(time), dtype=bool)
    new[1:] = np.diff(time[order]) != 0.0
    number = np.arange(len(time))
    turns = np.empty(len(time), dtype=np.intp)
    turns[order] = number - np.maximum.accumulate(np.where(new, number, 0))
    return turns


def _spread(arrow: Any, values: FloatArray, rows: Any, count: int) -> Any:
    """Values at their rows of a longer table, null elsewhere."""
    spread, absent = np.zeros(count), np.ones(count, dtype=bool)
    spread[rows], absent[rows] = values, False
    return _array(arrow, spread, absent)


def _array(arrow: Any, values: FloatArray, absent: BoolArray | None = None) -> Any:
    """An arrow array of numbers, null where absent; made from its buffers, since pyarrow's own way imports pandas."""
    data = np.ascontiguousarray(values, dtype=np.float64)
    present = None if absent is None else arrow.py_buffer(np.packbits(~absent, bitorder="little"))
    return arrow.Array.from_buffers(arrow.float64(), len(data), [present, arrow.py_buffer(data)])
