"""CSV and similar text tables, one row per sample, with or without a header line.

`find_dialect.py` detects the dialect of a table (text, lines, separator, head, marks, stamps: one module each);
`table.py` and `rows.py` read the table.
"""

from __future__ import annotations

from collections.abc import Collection, Generator, Mapping
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, UsageError, naming
from cdtool.formats.channels.channel_map import ChannelMap, TablePins, TimeSource
from cdtool.formats.column_names import OWN_CLOCK, column_key, wanted_keys
from cdtool.formats.columns import Column, Piece
from cdtool.formats.csv.gzipped import open_text
from cdtool.formats.groups import PREFIX
from cdtool.formats.pieces import Pieces, join_pieces
from cdtool.formats.source import Source, stated_origin

if TYPE_CHECKING:
    from cdtool.formats.csv.several_clocks import Clocks
    from cdtool.formats.csv.table import TextTable
    from cdtool.formats.csv_dialect.dialect import Dialect

_MARK = b"# " + PREFIX.encode()
_KEY = _MARK + b"origin_s: "
# Bytes that are searched for it: the provenance may contain a long list of parts, or of losses.
_HEAD = 1 << 16


@dataclass(frozen=True)
class Csv:
    """Text tables, also compressed with gzip: separator, header, decimal mark and encoding are detected or pinned."""

    name: ClassVar[str] = "csv"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".csv.gz", ".txt", ".tsv", ".dat", ".lvm")
    sniffs_any_text: ClassVar[bool] = True

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts with text other than markup, and is not of another format of text."""
        from cdtool.formats.csv.encoding import HEAD_BYTES, looks_like_text
        from cdtool.formats.csv.text import read_sample
        from cdtool.formats.csv_dialect.foreign_heads import is_measurement, is_scope_export

        head = read_sample(path, HEAD_BYTES)
        if is_measurement(head) or is_scope_export(head):
            return False
        return bool(head.strip() or read_sample(path).strip()) and looks_like_text(head)

    def columns(self, path: Path, wanted: ChannelMap | None = None, pins: TablePins | None = None) -> Source:
        """Return the columns that `wanted` names, or all numeric columns; raises RecordingError with the line.

        `pins` are in place of those of the map.
        """
        from cdtool.formats.csv.several_clocks import Clocks
        from cdtool.formats.csv.table import read_table
        from cdtool.formats.csv_dialect.find_dialect import find_dialect

        with naming(path):
            dialect = find_dialect(path, pins or (TablePins() if wanted is None else wanted.pins))
            if wanted is not None:
                return _read_wanted(dialect, wanted)
            table = read_table(dialect, dialect.names)
            return join_pieces(_by_clock(dialect, Clocks.by_names(dialect), None, _as_piece(table)), sort=False)

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:
        """Yield all numeric columns, or the columns `keys`, one MiB of the file at a time; raises RecordingError."""
        from cdtool.formats.csv.several_clocks import Clocks
        from cdtool.formats.csv.table import table_pieces
        from cdtool.formats.csv_dialect.find_dialect import find_dialect

        with naming(path):
            dialect = find_dialect(path, TablePins())
            clocks = Clocks.by_names(dialect)
            # The last column is always read: it shows whether the file's end is complete.
            read = dialect.names if keys is None else {*keys, dialect.names[-1]}
            if len(clocks.groups) > 1:
                read = {*read, *(dialect.names[i] for i in clocks.columns)}
            return (yield from _by_clock(dialect, clocks, keys, table_pieces(dialect, read)))


def _as_piece(table: TextTable) -> Generator[Piece, None, TextTable]:
    """Yield the columns of a table, and return it."""
    yield Piece("", None, table.values, len(next(iter(table.values.values()))))
    return table


def _by_clock(
    dialect: Dialect,
    clocks: Clocks,
    keys: Collection[str] | None,
    pieces: Generator[Piece, None, TextTable],
    stated: bool = False,
) -> Pieces:
    """Yield the columns of a table, by clock if it has several clocks whose rates differ, or if that is `stated`."""
    from cdtool.formats.csv.several_clocks import pieces_by_own_clock

    table, findings, origin = yield from pieces_by_own_clock(dialect, clocks, pieces, keys, stated)
    table.findings += findings
    if origin is None:
        return _source(dialect, table)
    times = {dialect.names[column] for column in clocks.columns}
    kept = {key for key in table.values if key not in times and (keys is None or key in keys)}
    table.values = {key: values for key, values in table.values.items() if key in kept}
    source = _source(dialect, table)
    columns = {key: replace(column, time=np.empty(0)) for key, column in source.columns.items()}
    return replace(source, columns=columns, origin=origin or written_origin(dialect.text.path), first_row=0)


def _read_wanted(dialect: Dialect, wanted: ChannelMap) -> Source:
    from cdtool.formats.csv.several_clocks import HINT, Clocks, other_clocks
    from cdtool.formats.csv.table import read_table

    names, time = dialect.names, wanted.time
    clock = column_key(time.column, names) if time.column is not None else None
    clocks = Clocks.by_names(dialect, clock)
    own = time.column == OWN_CLOCK and time.factor == 1.0
    if len(clocks.groups) < 2 or (clock is None and not own):
        return _source(dialect, read_table(dialect, wanted_keys(wanted, names), clock, wanted))
    keys = wanted_keys(wanted if clock is not None else replace(wanted, time=TimeSource()), names)
    table = read_table(dialect, {*keys, *(names[column] for column in clocks.columns)}, clock, wanted)
    other = [] if clock is None else other_clocks(dialect, clocks, clock, keys, table.values)
    if other and not own:
        beside = f"column '{other[0].numbers['columns'][0]}' is beside the clock '{other[0].channel}'"
        differs = other[0].words_for("difference[what]")
        raise RecordingError(f"{beside}, but the machine file names '{clock}': {differs}", HINT)
    if clock is not None and not other:
        table.values = {key: values for key, values in table.values.items() if key in keys}
        return _source(dialect, table)
    if clock is not None:  # back to the file's values, which can be compared with the other clocks
        table.values[clock] = table.values[clock] + table.origin
    channels = [key for key in keys if key != clock]
    for key in channels:
        if dialect.names.index(key) not in clocks.of:
            raise RecordingError(f"no clock is beside column '{key}'", "name its clock in [channels] time")
    return join_pieces(_by_clock(dialect, clocks, channels, _as_piece(table), stated=True), sort=False)


def _source(dialect: Dialect, table: TextTable) -> Source:
    from cdtool.formats.csv.several_clocks import unit_from_header

    columns = {
        key: Column(
            key,
            values,
            unit="s" if key in table.stamped else unit_from_header(dialect, key),
            words=table.words.get(key, {}),
        )
        for key, values in table.values.items()
    }
    return Source(
        path=dialect.text.path,
        format=Csv.name,
        columns=columns,
        origin=table.origin or written_origin(dialect.text.path),
        findings=(*dialect.findings, *table.findings),
        details=dialect.details,
        names=dialect.names,
        first_row=dialect.first_line if table.unbroken else 0,
        dialect=dialect.as_pins,
    )


def write_csv(path: Path, columns: Mapping[str, FloatArray], formats: Mapping[str, str]) -> None:
    """Write columns of equal length, each with its printf format (default %.17g, which reads back exactly)."""
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1:
        raise UsageError(f"{path}: columns of lengths {sorted(lengths)}", "columns of a table have the same length")
    row = ",".join(formats.get(name, "%.17g") for name in columns) + "\n"
    values = np.column_stack(list(columns.values()))
    body = (row * len(values)) % tuple(values.ravel().tolist())
    path.write_text(",".join(columns) + "\n" + body, encoding="utf-8", newline="\n")


def written_origin(path: Path) -> float:
    """Return the origin [s] that the head of a text table states; 0 if it does not state one."""
    with open_text(path) as file:
        head = file.read(len(_MARK)) or b""
        if head != _MARK:  # the usual case
            return 0.0
        head += file.read(_HEAD - len(_MARK)) or b""
    lines = takewhile(lambda line: line.startswith(_MARK), head.splitlines())
    return stated_origin(next((line.removeprefix(_KEY) for line in lines if line.startswith(_KEY)), b"0"))
