"""Write recordings as Parquet and Feather (Arrow IPC): one table, piece by piece."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import reduce
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from cdtool.base.arrays import FloatArray
from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.columns import Column
from cdtool.formats.containers.container_checks import library
from cdtool.formats.containers.parquet import OWN_CLOCKS
from cdtool.formats.groups import Group, Part, Parts, WrittenNames, prefix_keys, require_clocks

# One row group contains this many numbers (8 MiB), but at least this many rows.
_VALUES, _FEWEST_ROWS = 2**20, 2**14


def write_parquet(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write one table as Parquet; with several clocks, one row per time, and null where a clock has no sample."""
    return _write_table(path, groups, parts, provenance, feather=False)


def write_feather(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write one table as Feather, as `write_parquet` does."""
    return _write_table(path, groups, parts, provenance, feather=True)


def _write_table(
    path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str], *, feather: bool
) -> WrittenNames:
    arrow = library("pyarrow", "parquet")
    several = len(groups) > 1
    if several:
        require_clocks(groups)
    columns = [Column(OWN_CLOCK, np.empty(0), unit="s")] if several or groups[0].own_clock else []
    columns += [column for group in groups for column in chain(*group.flat)]
    fields = [
        arrow.field(column.name, arrow.float64(), metadata={"unit": column.unit} if column.unit else None)
        for column in columns
    ]
    metadata = prefix_keys(provenance) | ({OWN_CLOCKS.decode(): "1"} if several else {})
    schema = arrow.schema(fields, metadata=metadata)
    with _opened(arrow, path, schema, feather=feather) as write:
        for ready in parts:
            arrays = _of_several(arrow, groups, ready) if several else _of_one(arrow, groups[0], ready[0])
            write(arrow.Table.from_arrays(arrays, schema=schema))
    return [[[part.name for part in parts] for parts in group.flat] for group in groups]


@contextmanager
def _opened(arrow: Any, path: Path, schema: Any, *, feather: bool) -> Iterator[Callable[[Any], None]]:
    """Yield a function that writes the next rows of the file; it buffers them until a row group is full."""
    if feather:
        ipc = library("pyarrow.ipc", "parquet")
        writer = ipc.new_file(str(path), schema, options=ipc.IpcWriteOptions(compression="zstd"))
    else:
        writer = library("pyarrow.parquet", "parquet").ParquetWriter(path, schema, compression="zstd")
    buffered: list[Any] = []
    group_rows = max(_FEWEST_ROWS, _VALUES // len(schema.names))

    def flush() -> None:
        if buffered:
            writer.write_table(arrow.concat_tables(buffered).combine_chunks(), group_rows)
        buffered.clear()

    def write(table: Any) -> None:
        buffered.append(table)
        if sum(part.num_rows for part in buffered) >= group_rows:
            flush()

    with writer:
        yield write
        flush()


def _of_one(arrow: Any, group: Group, part: Part | None) -> list[Any]:
    if part is None:
        return [arrow.array(np.empty(0)) for _ in range(group.own_clock + len(list(chain(*group.flat))))]
    own = [part.time] if group.own_clock and part.time is not None else []
    return [arrow.array(column) for column in (*own, *part.flat)]


def _of_several(arrow: Any, groups: Sequence[Group], ready: Sequence[Part | None]) -> list[Any]:
    """Return the times of all clocks, then each column with its values in the rows of its own clock."""
    times = [np.empty(0) if part is None or part.time is None else part.time for part in ready]
    table, rows = _rows(times)
    arrays = [arrow.array(table)]
    for group, part, own in zip(groups, ready, rows, strict=True):
        empty = [np.empty(0)] * len(list(chain(*group.flat)))
        arrays += [_spread(arrow, values, own, len(table)) for values in (part.flat if part is not None else empty)]
    return arrays


def _rows(times: Sequence[FloatArray]) -> tuple[FloatArray, list[Any]]:
    """Return all times in order, and the rows of each clock's samples; a repeated time has one row per repetition."""
    repetitions = [pd.Series(time).groupby(time, dropna=False).cumcount() for time in times]
    clocks = [pd.MultiIndex.from_arrays(pair) for pair in zip(times, repetitions, strict=True)]
    table = reduce(pd.MultiIndex.union, clocks)
    return table.get_level_values(0).to_numpy(), [table.get_indexer(clock) for clock in clocks]


def _spread(arrow: Any, values: FloatArray, rows: Any, count: int) -> Any:
    """Return values in these rows of a longer table, null in the other rows."""
    spread, absent = np.zeros(count), np.ones(count, dtype=bool)
    spread[rows], absent[rows] = values, False
    return arrow.array(spread, mask=absent)
