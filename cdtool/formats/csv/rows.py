"""Read the rows of a text table block by block: pandas reads the blocks of plain rows, Python the lines of the others.

pandas fills rows that are too short with NaN, and drops the cells of rows that are too long. A block is plain if it has
as many separators as its rows need, and no NaN in its last column; or else if each line has as many as a row. Any other
block is halved down to a few hundred lines.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any
from warnings import catch_warnings

import numpy as np
import numpy.typing as npt
import pandas as pd

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.formats.containers.container_checks import check_size
from cdtool.formats.csv.cell_values import CellValues, RequestedColumns
from cdtool.formats.csv.cells import MISSING, kind, number, split_line
from cdtool.formats.csv.stamps import Integers
from cdtool.formats.csv.table_lines import TableLines
from cdtool.formats.csv_dialect.dialect import MOST_CELLS, Dialect

# Rows above an unfinished last one that show what its last cell is like.
RECENT = 20
# pandas reads the nearest float64 by itself since 3.1; before that it must be asked.
_VERSION = tuple(map(int, pd.__version__.split(".")[:2]))
_EXACT: dict[str, Any] = {"float_precision": "round_trip"} if _VERSION < (3, 1) else {}
# The number of plain rows, and by their column the numbers and the texts of their cells.
PlainRows = tuple[int, dict[int, FloatArray], dict[int, list[str]]]
_END = re.compile(r"(?:.*(?P<mark>[.,eE]))?[+-]?(?P<digits>[0-9]*)")


@dataclass
class Rows:
    """Rows of a table; the last one is in line `last_line` (from 1).

    Cells (n,) by the number of their column: `numbers` are NaN where a cell is empty, `whole` (integers, also stamps)
    are MISSING_STAMP there.
    """

    count: int
    last_line: int
    numbers: dict[int, FloatArray]
    whole: dict[int, Integers]


class RowReader:
    """Reads the `requested` columns of one file; with `survey` an unreadable cell is a loss, otherwise an error."""

    def __init__(self, dialect: Dialect, requested: RequestedColumns, survey: bool) -> None:
        self.dialect, self.requested = dialect, requested
        self.values = CellValues(dialect, requested, survey)
        self.lines = TableLines(dialect, self.values)
        self.findings: list[Finding] = []
        self._texts = sorted({*requested.stamps, *requested.whole})

    def pieces(self) -> Iterator[Rows]:
        """Yield the rows block by block; after the last one `findings` are those on lines, cells and the file's end.

        Raises RecordingError with the first line that cannot be read.
        """
        last, ended = self._read([], []), True
        for block in self.dialect.text.blocks(self.dialect.offset):
            ended = block.endswith((b"\n", b"\r"))
            for rows in self._rows(block, ended):
                check_size(self.dialect.text.path, self.lines.rows * (len(self.values.numeric) + len(self._texts)))
                if rows.count:
                    if last.count:
                        yield last
                    last = rows
        self.findings = self._end(last, ended)
        yield last

    def _rows(self, block: bytes, ended: bool) -> Iterator[Rows]:
        """Yield the rows of a block: the plain ones by pandas, the lines of the others one by one."""
        half = block.rfind(self.dialect.text.line_end, 0, len(block) // 2) + 1
        plain = self._plain(block, ended)
        if plain is not None:
            yield plain
        # A smaller block is read line by line: pandas would take as long to start.
        elif len(block) > (1 << 14) and half:
            yield from self._rows(block[:half], ended=True)
            yield from self._rows(block[half:], ended)
        else:
            yield from self._by_lines(block, ended)

    def _plain(self, block: bytes, ended: bool) -> Rows | None:
        """Return the rows of a block that has only plain rows; None if it may have anything else."""
        if self.lines.may_end or self.requested.categories:
            return None
        if (plain := plain_rows(self.dialect, self.values.numeric, self._texts, block, ended)) is None:
            return None
        count, numbers, texts = plain
        whole, unread = self._whole(texts)
        if unread:
            return None
        self.lines.line += count
        self.lines.rows += count
        return Rows(count, self.lines.line - 1, numbers, whole)

    def _by_lines(self, block: bytes, ended: bool) -> Iterator[Rows]:
        """Yield the rows of a block of any lines."""
        lines = self.dialect.text.decode(block).split(self.dialect.text.line_end.decode())
        count = len(lines) - (not lines[-1])
        most = max(1, MOST_CELLS // self.dialect.width)
        for first in range(0, count, most):
            rows: list[tuple[int, list[str]]] = []
            for i in range(first, min(first + most, count)):
                rows += self.lines.read(lines[i], unfinished=not ended and i == len(lines) - 1)
            yield self._read([cells for _, cells in rows], [line for line, _ in rows])

    def _read(self, cells: Sequence[Sequence[str]], lines: Sequence[int]) -> Rows:
        """Return rows of cells, which are in these lines."""
        columns = [*zip_longest(*cells, fillvalue="")]
        columns += [("",) * len(cells)] * (self.dialect.width - len(columns))
        numbers, (whole, unread) = {}, self._whole(columns)
        for column in self.values.numeric:
            numbers[column], rows = self.values.numbers(column, columns[column])
            unread += [(row, column) for row in rows]
        self.values.lose((lines[row], column, columns[column][row]) for row, column in unread)
        return Rows(len(cells), lines[-1] if lines else 0, numbers, whole)

    def _whole(
        self, texts: Mapping[int, Sequence[str]] | Sequence[Sequence[str]]
    ) -> tuple[dict[int, Integers], list[tuple[int, int]]]:
        """Return the stamps and the large numbers, and row and column of the stamps that cannot be read."""
        whole = {column: self.values.multiples(texts[column]) for column in self.requested.whole}
        unread = []
        for column in self.requested.stamps:
            whole[column], rows = self.values.stamps(column, texts[column])
            unread += [(row, column) for row in rows]
        return whole, unread

    def _end(self, rows: Rows, ended: bool) -> list[Finding]:
        """Return all findings; the last one of the last `rows` may be removed."""
        lines, padding = self.lines, self.dialect.text.padding
        findings = [*self.values.findings(), *lines.findings(rows.last_line)]
        if not ended and not lines.cut_line and not lines.ends_skipped:
            findings += self._check_last_line(rows)
        if lines.cut_line or padding:
            findings.insert(0, Finding("last_line_cut", "", {"line": lines.cut_line or lines.line - (not ended)}))
        if padding:
            findings.append(Finding("nul_bytes_at_end", "", {"count": padding}))
        return findings

    def _check_last_line(self, rows: Rows) -> list[Finding]:
        """Check a last row without line end: keep it, keep it with a warning, or remove it with a loss."""
        dialect, text, last = self.dialect, self.dialect.text, self.dialect.width - 1
        is_read = bool(dialect.short_rows) or last in (*self.values.numeric, *self.requested.stamps)
        *others, unfinished = text.tail()
        if not rows.count or dialect.trailing or not is_read or not unfinished.strip():
            return []
        above = []
        for raw in reversed(others[1:] if len(others) > 1 else others):
            cells = split_line(text.decode(raw), dialect.separator)
            if len(cells) == dialect.width and kind(cells[-1]) != "X":
                above.append(cells[-1])
            if len(above) == RECENT:
                break
        line = text.decode(unfinished).rstrip()
        cell = '"' if line.endswith('"') else split_line(line, dialect.separator)[-1]
        complete, certain = is_complete(cell, above[: self.lines.rows - 1])
        fact = {"line": rows.last_line, "cell": cell}
        if complete and (certain or not text.padding):
            return [] if certain else [Finding("last_line_kept", "", fact)]
        rows.count -= 1
        rows.numbers = {column: values[:-1] for column, values in rows.numbers.items()}
        rows.whole = {column: values[:-1] for column, values in rows.whole.items()}
        self.lines.rows -= 1
        return [] if text.padding else [Finding("last_line_dropped", "", fact)]


def plain_rows(
    dialect: Dialect, numeric: Sequence[int], texts: Sequence[int], block: bytes, ended: bool
) -> PlainRows | None:
    """Return the plain rows of a block that has no others, as read by pandas; None if it may have anything else.

    `ended`: the last line has a line end.
    """
    separator, width = dialect.separator.encode(), dialect.width
    if dialect.text.line_end != b"\n":
        return None
    if separator != b" " and b'"' in block:
        block = without_quotes(block, separator)
    # A repeated header is not a row, even if its words are in columns that are not read.
    encoding = dialect.text.stream_encoding
    odd = (text.strip().encode(encoding, "replace") for text in (dialect.comment, *dialect.header_text))
    if any(mark in block for mark in (b'"', b"\0", *odd) if mark):
        return None
    if separator == b" ":  # one between two cells
        block = re.sub(rb"^ | (?=\r?$)", b"", re.sub(rb"[ \t]+", b" ", block), flags=re.MULTILINE)
    data = np.frombuffer(block, dtype=np.uint8)
    count = int(np.count_nonzero(data == ord("\n"))) + (not ended)
    seem_full = np.count_nonzero(data == separator[0]) == count * (width - 1)
    if not seem_full and not _have_cells(dialect, data, ended):
        return None
    if dialect.trailing and sum(block.count(separator + end) for end in (b"\n", b"\r\n")) < count:
        return None
    try:
        with catch_warnings(action="error", category=pd.errors.ParserWarning):
            numbers, words = _parsed(dialect, numeric, texts, block)
    except (ValueError, pd.errors.ParserWarning):  # a cell is not a number in plain notation; a first row too long
        return None
    if {*map(len, numbers.values()), *map(len, words.values())} != {count}:  # line ends are mixed
        return None
    if np.isnan(numbers.get(width - 1, np.nan)).any() and (
        width == 1  # a blank line is not a row
        or (seem_full and not _have_cells(dialect, data, ended))
    ):
        return None
    return count, numbers, words


def _have_cells(dialect: Dialect, data: npt.NDArray[np.uint8], ended: bool) -> bool:
    """Return whether each line has as many cells as a row."""
    ends = np.flatnonzero(data == ord("\n")) if ended else [*np.flatnonzero(data == ord("\n")), len(data)]
    separators = np.flatnonzero(data == ord(dialect.separator))
    cells = 1 + np.diff(np.searchsorted(separators, ends), prepend=0)
    short = cells[cells != dialect.width]
    return all(each in dialect.short_rows for each in np.unique(short)) and (ended or cells[-1] == dialect.width)


def _parsed(
    dialect: Dialect, numeric: Sequence[int], texts: Sequence[int], block: bytes
) -> tuple[dict[int, FloatArray], dict[int, list[str]]]:
    """Return the columns of numbers and the texts of the others, as parsed by pandas.

    The bytes are decoded as Latin-1, one letter each: a stamp that is not ASCII cannot be read.
    """
    columns = [*numeric, *texts]
    dtypes: Any = np.float64  # one type is quicker than one for each column
    if texts:
        dtypes = dict.fromkeys(columns, np.float64) | dict.fromkeys(texts, np.object_)
    # pandas would take each number that equals a pinned one as missing, in whatever digits.
    pinned = {text: value for text in dialect.missing if (value := number(text, dialect.marks.decimal)) is not None}
    words = [text for text in dialect.missing if text not in pinned]
    missing = [text.encode(dialect.text.stream_encoding, "replace").decode("latin-1") for text in words]
    frame = pd.read_csv(
        io.BytesIO(block),
        sep=dialect.separator,
        header=None,
        names=range(dialect.width),
        usecols=None if len(columns) == dialect.width else columns,
        index_col=False,
        dtype=dtypes,
        engine="c",
        encoding="latin-1",
        skip_blank_lines=False,
        keep_default_na=False,
        na_values=[*MISSING, *missing],
        quoting=csv.QUOTE_NONE,
        skipinitialspace=b" " in block,
        decimal=dialect.marks.decimal,
        low_memory=False,
        **_EXACT,
    )
    if pinned and np.isin(frame[[*numeric]], [*pinned.values()]).any():
        raise ValueError("a number may be a missing value")
    cells = {column: [cell.strip(" \t") for cell in frame.pop(column).fillna("").tolist()] for column in texts}
    return dict(zip(frame.columns.tolist(), frame.to_numpy().T, strict=True)), cells


def without_quotes(block: bytes, separator: bytes) -> bytes:
    """Return lines without quotes, if each is the first or last letter of a cell, and none of these has a separator."""
    data = np.frombuffer(b"\n" + block + b"\n", dtype=np.uint8)
    border, quote = np.isin(data, [*separator, *b"\r\n"]), data == ord('"')
    places, inside = np.flatnonzero(quote), np.cumsum(quote) % 2 > 0
    simple = len(places) % 2 == 0 and border[places[::2] - 1].all() and border[places[1::2] + 1].all()
    return block.replace(b'"', b"") if simple and not (inside & border).any() else block


def is_complete(cell: str, above: Sequence[str]) -> tuple[bool, bool]:
    """Return whether the last cell of an unfinished line is complete, and whether that is certain.

    `above` are the cells above it in the same column. A cell that is cut off has fewer digits after its last mark (the
    decimal mark, or the e of an exponent). It is therefore certainly complete if it has as many as all cells above. If
    their number varies, it is assumed to be complete if it has at least as many as the shortest cell above with the
    same mark; otherwise it is incomplete.
    """
    if not above:
        return True, False
    if cell == '"':  # the closing quote is not cut off
        return True, True
    (mark, digits), ends = _end(cell), [_end(other) for other in above]
    alike = {other for other_mark, other in ends if other_mark == mark}
    complete = digits >= max(1, min(alike)) if alike else False
    return complete, complete and {*ends} == {(mark, digits)}


def _end(cell: str) -> tuple[str, int]:
    """Return the last mark of a number and how many digits follow it; the length of any other text."""
    match = _END.fullmatch(cell)
    return (match["mark"] or "", len(match["digits"])) if match else ("", len(cell))
