"""A survey of a table that need not fit into memory: its columns block by block."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Generator, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cdtool.columns import Piece
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.odd_lines import OddLines
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_pieces import RowPieces
from cdtool.formats.csv.several_clocks import Clocks, clock_findings
from cdtool.formats.csv.stamp_columns import StampColumns
from cdtool.formats.csv.stamps import NS
from cdtool.formats.csv.table import Asked, Table, end_findings, no_numbers
from cdtool.large_integers import rounded_integers, rounding_finding
from cdtool.recording import FloatArray


def table_pieces(path: Path, dialect: Dialect, keys: Collection[str]) -> Generator[Piece, None, Table]:
    """The columns `keys`, as far as they hold numbers; at the end the table without its rows. Raises RecordingError."""
    asked = Asked.of(path, dialect, keys, None, survey=True)
    reader = RowPieces(path, dialect, asked.numeric, asked.stamps)
    odd = OddLines(path, dialect, True, reader.targets, left_out=asked.left_out)
    stamped = StampColumns(dialect, asked.stamps, asked.dates)
    blocks = _Blocks(reader)
    clocks = Clocks.by_names(dialect)
    first: dict[str, FloatArray] = {}
    rounded: Counter[str] = Counter()

    def piece(rows: Rows) -> Piece:
        numbers = {dialect.names[column]: rows.numbers[k] for k, column in enumerate(asked.numeric)}
        rounded.update({key: rounded_integers(values) for key, values in numbers.items()})
        if not first:  # as much of the clocks as shows whether they are several
            first.update({key: numbers[key] for i in clocks.columns if (key := dialect.names[i]) in numbers})
        return Piece("", None, numbers | stamped.seconds(rows), rows.count)

    for rows in blocks.all_but_the_last(odd):
        yield piece(rows)
    findings = end_findings(dialect, asked, odd, blocks.reader.ended, blocks.last, blocks.before)
    yield piece(blocks.last)
    numeric = {dialect.names[column] for column in asked.numeric if column not in odd.left_out}
    names = [name for name in dialect.names if name in (*numeric, *stamped.names)]
    findings += stamped.findings()
    findings += clock_findings(dialect, clocks, first)
    findings += [found for name in names for found in rounding_finding(name, rounded[name])]
    if not names:
        raise no_numbers(path, findings)
    unbroken = blocks.unbroken and not len(blocks.last.not_rows)
    empty = {name: np.empty(0) for name in names}
    return Table(empty, findings, (stamped.origin or 0) / NS, set(stamped.names), unbroken)


@dataclass
class _Blocks:
    """Blocks of rows: the last one that holds any may lose its last row, once the file's end is known."""

    reader: RowPieces
    last: Rows = field(init=False)
    before: int = 0
    unbroken: bool = True

    def all_but_the_last(self, odd: OddLines) -> Iterator[Rows]:
        """Then `last` holds, `before` counts the rows before it, and `unbroken` tells of the lines among them."""
        self.last = self.reader.room(0)
        for rows in self.reader.pieces(odd):
            if rows.count:
                self.unbroken = self.unbroken and not len(self.last.not_rows)
                self.before += self.last.count
                if self.last.count:
                    yield self.last
                self.last = rows
            else:
                self.unbroken = self.unbroken and not len(rows.not_rows)
