"""CSV and its kin: text tables, one row a sample, with or without a header line.

`dialect.py` finds how a table is written (text, lines, separator, head, marks, stamps: a file each), `table.py` and
`rows.py` read it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from cdtool.channels import ChannelMap, TablePins
from cdtool.errors import RecordingError, UsageError
from cdtool.formats.pieces import Pieces
from cdtool.formats.source import Column, Source, column_key, split_unit, wanted_keys
from cdtool.recording import FloatArray

if TYPE_CHECKING:
    from cdtool.formats.csv.dialect import Dialect
    from cdtool.formats.csv.table import Table


@dataclass(frozen=True)
class TableSource(Source):
    """A table's columns; `dialect` is how it is written, as `[csv]` of a machine file."""

    dialect: str = ""


@dataclass(frozen=True)
class Csv:
    """Tables of text: separator, header, decimal mark and encoding are found from the first lines, or pinned."""

    name: ClassVar[str] = "csv"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".txt", ".tsv", ".dat")

    def sniff(self, path: Path) -> bool:
        """True if the file starts as text that is no markup."""
        from cdtool.formats.csv.encoding import looks_like_text
        from cdtool.formats.csv.text import read_sample

        sample = read_sample(path)
        return bool(sample.strip()) and looks_like_text(sample)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> TableSource:
        """The columns that `wanted` names, or all numeric ones; raises RecordingError with the line number."""
        from cdtool.formats.csv.table import read_table

        dialect = _dialect(path, TablePins() if wanted is None else wanted.pins)
        names = dialect.names
        keys = list(names) if wanted is None else wanted_keys(path, wanted, names)
        clock = None
        if wanted is not None and wanted.time.column is not None:
            clock = column_key(wanted.time.column, names)
        return _source(path, dialect, read_table(path, dialect, keys, clock, wanted))

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:
        """All numeric columns, or those of `keys`, a MiB of the file at a time; raises RecordingError."""
        from cdtool.formats.csv.table_pieces import table_pieces

        dialect = _dialect(path, TablePins())
        # The last column, too: it shows whether the file's end is whole.
        asked = dialect.names if keys is None else {*keys, dialect.names[-1]}
        table = yield from table_pieces(path, dialect, asked)
        return _source(path, dialect, table)


def _dialect(path: Path, pins: TablePins) -> Dialect:
    from cdtool.formats.csv.dialect import find_dialect
    from cdtool.formats.csv.text import read_sample

    sample = read_sample(path)
    if not sample.strip():
        raise RecordingError(f"{path}: is empty", "was the recording stopped at once, or the copy cut off?")
    return find_dialect(path, sample, pins)


def _source(path: Path, dialect: Dialect, table: Table) -> TableSource:
    names = dialect.names
    told = {name: dialect.units[i] for i, name in enumerate(names) if i < len(dialect.units)}
    columns = {
        key: Column(key, values, unit="s" if key in table.stamped else split_unit(key)[1] or _bare(told.get(key)))
        for key, values in table.values.items()
    }
    return TableSource(
        path=path,
        format=Csv.name,
        columns=columns,
        origin=table.origin,
        findings=(*dialect.findings, *table.findings),
        details=dialect.details,
        names=names,
        first_row=dialect.first_line if table.unbroken else 0,
        dialect=dialect.as_pins,
    )


def write_csv(path: Path, columns: Mapping[str, FloatArray], formats: Mapping[str, str]) -> None:
    """Write columns of equal length, each by its printf format (default %.17g, which reads back to the bit)."""
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1:
        raise UsageError(f"{path}: columns of lengths {sorted(lengths)}", "all columns of a table are equally long")
    row = ",".join(formats.get(name, "%.17g") for name in columns) + "\n"
    values = np.column_stack(list(columns.values()))
    body = (row * len(values)) % tuple(values.ravel().tolist())
    path.write_text(",".join(columns) + "\n" + body, encoding="utf-8", newline="\n")


def _bare(unit: str | None) -> str | None:
    """A cell of the row of units without its brackets."""
    text = (unit or "").strip()
    if text[:1] + text[-1:] in ("[]", "()"):
        text = text[1:-1].strip()
    return text if text not in ("", "-") else None
