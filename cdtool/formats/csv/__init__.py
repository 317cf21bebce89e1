"""CSV and its kin: text tables, one row a sample, with or without a header line.

`find_dialect.py` finds how a table is written (text, lines, separator, head, marks, stamps: a file each),
`table.py` and `rows.py` read it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from cdtool.channels import ChannelMap, TablePins, TimeSource
from cdtool.columns import Column
from cdtool.errors import RecordingError, UsageError
from cdtool.formats.column_names import OWN_CLOCK, column_key, wanted_keys
from cdtool.formats.pieces import Pieces
from cdtool.formats.source import Source
from cdtool.recording import FloatArray

if TYPE_CHECKING:
    from cdtool.formats.csv.dialect import Dialect
    from cdtool.formats.csv.table import Table
import math
from itertools import takewhile

from cdtool.formats.groups import PREFIX

_MARK = b"# " + PREFIX.encode()
_KEY = _MARK + b"origin_s: "
# A long list of parts, or of what was lost, may follow it.
_HEAD = 1 << 16


@dataclass(frozen=True)
class Csv:
    """Tables of text: separator, header, decimal mark and encoding are found from the first lines, or pinned."""

    name: ClassVar[str] = "csv"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".txt", ".tsv", ".dat", ".lvm")
    sniffs_any_text: ClassVar[bool] = True

    def sniff(self, path: Path) -> bool:
        """True if the file starts as text that is no markup."""
        from cdtool.formats.csv.encoding import looks_like_text
        from cdtool.formats.csv.text import read_sample

        sample = read_sample(path)
        return bool(sample.strip()) and looks_like_text(sample)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The columns that `wanted` names, or all numeric ones; raises RecordingError with the line number."""
        dialect = _dialect(path, TablePins() if wanted is None else wanted.pins)
        return _survey(path, dialect) if wanted is None else _wanted(path, dialect, wanted)

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:
        """All numeric columns, or those of `keys`, a MiB of the file at a time; raises RecordingError."""
        from cdtool.formats.csv.table import table_pieces

        dialect = _dialect(path, TablePins())
        # The last column, too: it shows whether the file's end is whole.
        asked = dialect.names if keys is None else {*keys, dialect.names[-1]}
        table = yield from table_pieces(path, dialect, asked)
        return _source(path, dialect, table)


def _dialect(path: Path, pins: TablePins) -> Dialect:
    from cdtool.formats.csv.find_dialect import find_dialect
    from cdtool.formats.csv.text import read_sample

    sample = read_sample(path)
    if not sample.strip():
        raise RecordingError(f"{path}: is empty", "was the recording stopped at once, or the copy cut off?")
    return find_dialect(path, sample, pins)


def _survey(path: Path, dialect: Dialect) -> Source:
    from cdtool.formats.csv.several_clocks import Clocks, clock_findings
    from cdtool.formats.csv.table import read_table

    table = read_table(path, dialect, dialect.names)
    table.findings += clock_findings(dialect, Clocks.by_names(dialect), table.values)
    return _source(path, dialect, table)


def _wanted(path: Path, dialect: Dialect, wanted: ChannelMap) -> Source:
    from cdtool.formats.csv.several_clocks import HINT, Clocks, other_clock, own_clocks
    from cdtool.formats.csv.table import read_table

    names, time = dialect.names, wanted.time
    clock = column_key(time.column, names) if time.column is not None else None
    clocks = Clocks.by_names(dialect, clock)
    own = time.column == OWN_CLOCK and time.factor == 1.0
    if len(clocks.groups) < 2 or (clock is None and not own):
        return _source(path, dialect, read_table(path, dialect, wanted_keys(path, wanted, names), clock, wanted))
    keys = wanted_keys(path, wanted if clock is not None else replace(wanted, time=TimeSource()), names)
    table = read_table(path, dialect, {*keys, *(names[column] for column in clocks.columns)}, clock, wanted)
    other = other_clock(dialect, clocks, clock, keys, table.values) if clock is not None else ""
    if other and not own:
        raise RecordingError(f"{path}: {other}", HINT)
    if clock is not None and not other:
        table.values = {key: values for key, values in table.values.items() if key in keys}
        return _source(path, dialect, table)
    if clock is not None:  # as it stands in the file, beside the others
        table.values[clock] = table.values[clock] + table.origin
    asked = [key for key in keys if key != clock]
    columns, origin, told = own_clocks(path, dialect, clocks, asked, table.values)
    table.values, table.findings = {}, [*table.findings, *told]
    origin = origin or written_origin(path)
    return replace(_source(path, dialect, table), columns=columns, origin=origin, first_row=0)


def _source(path: Path, dialect: Dialect, table: Table) -> Source:
    from cdtool.formats.csv.several_clocks import told_unit

    columns = {
        key: Column(key, values, unit="s" if key in table.stamped else told_unit(dialect, key))
        for key, values in table.values.items()
    }
    return Source(
        path=path,
        format=Csv.name,
        columns=columns,
        origin=table.origin or written_origin(path),
        findings=(*dialect.findings, *table.findings),
        details=dialect.details,
        names=dialect.names,
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


def written_origin(path: Path) -> float:
    """Return the origin [s] that a text table's own head gives; 0 where it gives no origin."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    lines = takewhile(lambda line: line.startswith(_MARK), head.splitlines())
    written = next((line.removeprefix(_KEY) for line in lines if line.startswith(_KEY)), b"0")
    try:
        origin = float(written)
    except ValueError:  # somebody has edited it
        return 0.0
    return origin if math.isfinite(origin) else 0.0
