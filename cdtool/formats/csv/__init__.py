"""CSV and similar text tables, one row per sample, with or without a header line.

`find_dialect.py` detects the dialect of a table (text, lines, separator, head, marks, stamps: one module each);
`table.py` and `rows.py` read the table.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, UsageError, naming
from cdtool.formats.channels.channel_map import ChannelMap, TablePins, TimeSource
from cdtool.formats.column_names import OWN_CLOCK, column_key, wanted_keys
from cdtool.formats.pieces import Pieces, join_pieces, split_by_clock
from cdtool.formats.source import Source

if TYPE_CHECKING:
    from cdtool.formats.csv_dialect.dialect import Dialect


@dataclass(frozen=True)
class Csv:
    """Text tables, also compressed with gzip: separator, header, decimal mark and encoding are detected or pinned."""

    name: ClassVar[str] = "csv"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".csv.gz", ".txt", ".tsv", ".dat", ".lvm")

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts with text other than markup, and is not of another format of text."""
        from cdtool.formats.csv.encoding import HEAD_BYTES, looks_like_text
        from cdtool.formats.csv.text import read_sample
        from cdtool.formats.csv_dialect.foreign_heads import is_scope_export

        head = read_sample(path, HEAD_BYTES)
        if is_scope_export(head):
            return False
        return bool(head.strip() or read_sample(path).strip()) and looks_like_text(head)

    def columns(self, path: Path, wanted: ChannelMap | None = None, pins: TablePins | None = None) -> Source:
        """Return the columns that `wanted` names, or all numeric columns; raises RecordingError with the line.

        `pins` are in place of those of the map.
        """
        from cdtool.formats.csv.several_clocks import Clocks, pieces_by_own_clock
        from cdtool.formats.csv.table import read_table
        from cdtool.formats.csv_dialect.find_dialect import find_dialect

        with naming(path):
            dialect = find_dialect(path, pins or (TablePins() if wanted is None else wanted.pins))
            if wanted is not None:
                return _read_wanted(dialect, wanted)
            table, clocks = read_table(dialect, dialect.names), Clocks.by_names(dialect)
            if len(clocks.groups) < 2:  # joined from pieces, a large table would be in memory twice
                return table
            return join_pieces(pieces_by_own_clock(dialect, clocks, split_by_clock(table), None), sort=False)

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:
        """Yield all numeric columns, or the columns `keys`, one MiB of the file at a time; raises RecordingError."""
        from cdtool.formats.csv.several_clocks import Clocks, pieces_by_own_clock
        from cdtool.formats.csv.table import table_pieces
        from cdtool.formats.csv_dialect.find_dialect import find_dialect

        with naming(path):
            dialect = find_dialect(path, TablePins())
            clocks = Clocks.by_names(dialect)
            # The last column is always read: it shows whether the file's end is complete.
            read = dialect.names if keys is None else {*keys, dialect.names[-1]}
            if len(clocks.groups) > 1:
                read = {*read, *(dialect.names[i] for i in clocks.columns)}
            return (yield from pieces_by_own_clock(dialect, clocks, table_pieces(dialect, read), keys))


def _read_wanted(dialect: Dialect, wanted: ChannelMap) -> Source:
    from cdtool.formats.csv.several_clocks import HINT, Clocks, other_clocks, pieces_by_own_clock
    from cdtool.formats.csv.table import read_table

    names, time = dialect.names, wanted.time
    clock = column_key(time.column, names) if time.column is not None else None
    clocks = Clocks.by_names(dialect, clock)
    own = time.column == OWN_CLOCK and time.factor == 1.0
    if len(clocks.groups) < 2 or (clock is None and not own):
        return read_table(dialect, wanted_keys(wanted, names), clock, wanted)
    keys = wanted_keys(wanted if clock is not None else replace(wanted, time=TimeSource()), names)
    table = read_table(dialect, {*keys, *(names[column] for column in clocks.columns)}, clock, wanted)
    if clock is not None:
        values = {key: column.values for key, column in table.columns.items()}
        other = other_clocks(dialect, clocks, clock, keys, values)
        if other and not own:
            beside = f"column '{other[0].numbers['columns'][0]}' is beside the clock '{other[0].channel}'"
            differs = other[0].words_for("difference[what]")
            raise RecordingError(f"{beside}, but the machine file names '{clock}': {differs}", HINT)
        if not other:
            return replace(table, columns={key: column for key, column in table.columns.items() if key in keys})
        # Back to the file's values, which can be compared with the other clocks.
        as_written = replace(table.columns[clock], values=table.columns[clock].values + table.origin)
        table = replace(table, columns={**table.columns, clock: as_written})
    channels = [key for key in keys if key != clock]
    for key in channels:
        if dialect.names.index(key) not in clocks.of:
            raise RecordingError(f"no clock is beside column '{key}'", "name its clock in [channels] time")
    return join_pieces(pieces_by_own_clock(dialect, clocks, split_by_clock(table), channels, stated=True), sort=False)


def write_csv(path: Path, columns: Mapping[str, FloatArray], formats: Mapping[str, str]) -> None:
    """Write columns of equal length, each with its printf format (default %.17g, which reads back exactly)."""
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1:
        raise UsageError(f"{path}: columns of lengths {sorted(lengths)}", "columns of a table have the same length")
    row = ",".join(formats.get(name, "%.17g") for name in columns) + "\n"
    values = np.column_stack(list(columns.values()))
    body = (row * len(values)) % tuple(values.ravel().tolist())
    path.write_text(",".join(columns) + "\n" + body, encoding="utf-8", newline="\n")
