"""CSV and its kin: text tables, one row a sample, with or without a header line.

`dialect.py` finds how a table is written (text, lines, separator, head, marks, stamps: a file each), `table.py` and
`rows.py` read it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from cdtool.channels import ChannelMap, TablePins
from cdtool.errors import RecordingError, UsageError
from cdtool.formats.source import Column, Source, column_key, split_unit, wanted_keys
from cdtool.recording import Finding, FloatArray


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
        from cdtool.formats.csv.dialect import find_dialect
        from cdtool.formats.csv.table import read_table
        from cdtool.formats.csv.text import read_sample

        sample = read_sample(path)
        if not sample.strip():
            raise RecordingError(f"{path}: is empty", "was the recording stopped at once, or the copy cut off?")
        pins = TablePins() if wanted is None else wanted.pins
        dialect = find_dialect(path, sample, pins)
        names = dialect.names
        keys = list(names) if wanted is None else wanted_keys(path, wanted, names)
        clock = None
        if wanted is not None and wanted.time.column is not None:
            clock = column_key(wanted.time.column, names)
        table = read_table(path, dialect, keys, clock, wanted)
        told = {name: dialect.units[i] for i, name in enumerate(names) if i < len(dialect.units)}
        columns = {
            key: Column(key, values, unit="s" if key in table.stamped else split_unit(key)[1] or _bare(told.get(key)))
            for key, values in table.values.items()
        }
        found: tuple[Finding, ...] = (*dialect.findings, *table.findings)
        return TableSource(
            path=path,
            format=self.name,
            columns=columns,
            origin=table.origin,
            findings=found,
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
