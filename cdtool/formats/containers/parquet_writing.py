"""Write one table of a recording as Parquet, piece by piece."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.columns import Column
from cdtool.formats.containers.container_checks import library
from cdtool.formats.groups import Group, Parts, WrittenNames, prefix_keys, single_group
from cdtool.formats.pieces import VALUES_PER_PIECE


def write_parquet(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write one table of float64 with units as metadata of its fields, and provenance as metadata of its schema."""
    arrow = library("pyarrow", "parquet")
    group = single_group(groups)
    columns = [Column(OWN_CLOCK, np.empty(0), unit="s")] if group.own_clock else []
    columns += chain(*group.flat)
    fields = [
        arrow.field(column.name, arrow.float64(), metadata={"unit": column.unit} if column.unit else None)
        for column in columns
    ]
    schema = arrow.schema(fields, metadata=prefix_keys(provenance))
    group_rows = max(2**14, VALUES_PER_PIECE // len(columns))
    buffered: list[Any] = []
    with library("pyarrow.parquet", "parquet").ParquetWriter(path, schema, compression="zstd") as writer:

        def flush() -> None:
            if buffered:
                writer.write_table(arrow.concat_tables(buffered).combine_chunks(), group_rows)
            buffered.clear()

        for (part,) in parts:
            if part is not None:
                arrays = [part.time, *part.flat] if group.own_clock else part.flat
                buffered.append(arrow.Table.from_arrays([arrow.array(array) for array in arrays], schema=schema))
            if sum(table.num_rows for table in buffered) >= group_rows:
                flush()
        flush()
    return [[[part.name for part in parts] for parts in group.flat]]
