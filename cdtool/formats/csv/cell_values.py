"""Read the cells of a text table's columns: numbers, stamps, categories; an unreadable cell is a loss or an error."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, lines_of
from cdtool.formats.columns import Categories
from cdtool.formats.csv.cells import NULLS, STAMP_LIKE, number
from cdtool.formats.csv.stamps import MISSING_STAMP, Integers
from cdtool.formats.csv_dialect.dialect import Dialect, quoted

_DECIMAL = re.compile(r"(?P<whole>[0-9]*)(?:[.,](?P<decimals>[0-9]*))?")


@dataclass(frozen=True)
class RequestedColumns:
    """The columns of a table that are read, by number: `numeric`, `stamps`, and the columns of days of some stamps.

    `left_out` are the columns that a survey leaves out, with the finding. `categories` are the columns whose texts are
    categories. `whole` are columns of decimal numbers with more digits than float64 can represent, which are read as
    integers: multiples of 1 / 10^`decimals`.
    """

    numeric: Sequence[int]
    stamps: Sequence[int] = ()
    dates: Mapping[int, int] = field(default_factory=dict)
    left_out: Mapping[int, Finding] = field(default_factory=dict)
    categories: Mapping[int, Categories] = field(default_factory=dict)
    whole: Sequence[int] = ()
    decimals: int = 0


class CellValues:
    """Reader of the cells of the `requested` columns.

    With `survey` an unreadable cell is a missing value and a loss, and a column with many unreadable cells is left out;
    without it an unreadable cell is an error. `left_out` are the columns that are not numeric, with the finding, and
    `numeric` the columns of numbers that remain.
    """

    def __init__(self, dialect: Dialect, requested: RequestedColumns, survey: bool) -> None:
        self.dialect, self.requested, self.survey = dialect, requested, survey
        self.numeric, self.left_out = [*requested.numeric], {**requested.left_out}
        self._unread: dict[int, list[tuple[int, str]]] = {}

    def are_readable(self, cells: Sequence[str]) -> bool:
        """Return whether all requested cells of a row can be read."""
        numbers = all(self._number(column, cells[column]) is not None for column in self.numeric)
        return numbers and not any(self.stamps(column, [cells[column]])[1] for column in self.requested.stamps)

    def numbers(self, column: int, cells: Sequence[str]) -> tuple[FloatArray, list[int]]:
        """Return the numbers of a column, and the rows of the cells that cannot be read."""
        known = {cell: self._number(column, cell) for cell in set(cells)}
        values = [known[cell] for cell in cells]
        unread = [row for row, value in enumerate(values) if value is None] if None in known.values() else []
        return np.array(values, dtype=np.float64), unread

    def stamps(self, column: int, cells: Sequence[str]) -> tuple[Integers, list[int]]:
        """Return the stamps [ns] of a column, and the rows of the cells that cannot be read."""
        stamps = self.dialect.stamped[column].layouts[0].read_all(cells)
        missing = np.flatnonzero(stamps == MISSING_STAMP).tolist()
        return stamps, [row for row in missing if cells[row] not in ("", *self.dialect.missing)]

    def multiples(self, cells: Sequence[str]) -> Integers:
        """Return numbers without a sign or an exponent as `RequestedColumns.whole`; MISSING_STAMP for other cells."""
        known = ("" if cell in self.dialect.missing else cell for cell in cells)
        return np.array([_multiple(cell, self.requested.decimals) for cell in known], dtype=np.int64)

    def _number(self, column: int, cell: str) -> float | None:
        """Return a number, or the code of a text in a column of categories; NaN if missing, None if unreadable.

        There a text such as `None` is a category, unless it is pinned as a missing value: a kind of contact.
        """
        dialect, categories = self.dialect, self.requested.categories.get(column)
        missing = dialect.missing if categories is None or cell not in NULLS else dialect.pins.missing
        marks = dialect.marks
        value = float("nan") if cell in missing else number(cell, marks.decimal, marks.thousands)
        if value is None and categories is not None and cell != dialect.names[column].strip():
            return categories.code(cell)
        return value

    def lose(self, cells: Iterable[tuple[int, int, str]]) -> None:
        """Take cells that cannot be read (line, column, text) as missing; raises RecordingError with the first one."""
        for line, column, cell in sorted(cells):
            if not self.survey:
                raise self._error(line, column, cell)
            unread = self._unread.setdefault(column, [])
            unread.append((line, cell))
            so_far = max(self.dialect.sampled, line - self.dialect.first_line)
            # With more unreadable cells it is not a column of numbers.
            if len(unread) > max(3, 0.05 * so_far) and column not in self.left_out:
                self.left_out[column] = self._not_numeric(*unread[0], column)
                self.numeric = [other for other in self.numeric if other != column]

    def findings(self) -> list[Finding]:
        """Return the findings on columns that are left out and on cells that cannot be read."""
        findings = list(self.left_out.values())
        for column, cells in self._unread.items():
            if column not in self.left_out:
                first = cells[0][1]
                fact = {**lines_of([line for line, _ in cells]), "cell": first, "advice": self._advice(first)}
                findings.append(Finding("unread_cells", self.dialect.names[column], fact))
        return findings

    def _error(self, line: int, column: int, cell: str) -> RecordingError:
        """Return the error for an unreadable cell of a wanted column."""
        layouts = self.dialect.stamped.get(column)
        problem, hint = "is not a number", self._not_numeric(line, cell, column).words_for("advice[looks_like]")
        if layouts is not None and column in self.requested.stamps:
            problem = f"is not a time with the layout {layouts.layouts[0].pattern}"
        elif layouts is not None and STAMP_LIKE.fullmatch(cell):
            problem, hint = "is a date or time, not a number", "only the channel time may be a date or time"
        elif STAMP_LIKE.fullmatch(cell):
            problem = "is not a number, nor a date or time with a known layout"
        where = f"line {line}, column '{self.dialect.names[column]}'"
        return RecordingError(f"{where}: {cell[:60]!r} {problem}", hint)

    def _not_numeric(self, line: int, cell: str, column: int) -> Finding:
        numbers = {"column": self.dialect.names[column], "line": line, "cell": cell}
        return Finding("not_numeric", "", {**numbers, "advice": self._advice(cell)}, "warning")

    def _advice(self, cell: str) -> dict[str, Any]:
        """Return the advice on a cell that cannot be read."""
        if STAMP_LIKE.fullmatch(cell):
            return {"looks_like": "time", "text": ""}
        if any(letter.isdigit() for letter in cell):
            return {"looks_like": "number", "text": self.dialect.details["decimal mark"]}
        return {"looks_like": "word", "text": quoted(cell[:40])}


def not_numeric(name: str, line: int, cell: str) -> Finding:
    """Return the note on a column that a survey leaves out."""
    advice = {"looks_like": "time", "text": ""} if STAMP_LIKE.fullmatch(cell) else None
    return Finding("not_numeric", "", {"column": name, "line": line, "cell": cell, "advice": advice})


def _multiple(cell: str, decimals: int) -> int:
    match = _DECIMAL.fullmatch(cell)
    digits = match["whole"] + (match["decimals"] or "")[:decimals].ljust(decimals, "0") if match else ""
    value = int(digits or MISSING_STAMP)
    return value if value < 2**63 else int(MISSING_STAMP)
