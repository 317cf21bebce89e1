"""Read the rows of a text table block by block: pandas reads the numbers of regular lines.

`block_lines.py` finds the lines that are regular: the others, and those with a cell that is not a number, are listed
for `irregular_lines.py`. pandas therefore never sees a line that is too short or too long.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any
from warnings import catch_warnings

import numpy as np
import pandas as pd

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_size
from cdtool.formats.csv.block_lines import BlockLines
from cdtool.formats.csv.cells import MISSING
from cdtool.formats.csv.dialect import MOST_CELLS, Dialect
from cdtool.formats.csv.irregular_lines import IrregularLine, IrregularLines
from cdtool.formats.csv.row_arrays import EMPTY, LEFT, STAMP, Rows
from cdtool.formats.csv.stamps import MISSING_STAMP, Integers, as_integers, by_shape
from cdtool.recording import BoolArray, FloatArray

# Blank lines, comments and repeated headers, of which there may be more only beside as many rows.
_MOST_SKIPPED = 20_000
# pandas reads the nearest float64 by itself since 3.1; before that it must be asked.
_VERSION = tuple(map(int, pd.__version__.split(".")[:2]))
_EXACT: dict[str, Any] = {"float_precision": "round_trip"} if _VERSION < (3, 1) else {}
# An integer with so many digits fits into 64 bits if the first of them is not a nine.
_MOST_DIGITS = 19
_DECIMAL = re.compile(r"(?P<whole>[0-9]*)(?:[.,](?P<decimals>[0-9]*))?")


class RowReader:
    """Reads the rows of one file. `numeric` and `stamped` are the requested columns, by number, in order.

    `whole` are columns of decimal numbers with more digits than float64 can represent, which follow the stamps as
    integers: multiples of 1 / 10^`decimals`.
    """

    def __init__(
        self,
        path: Path,
        dialect: Dialect,
        numeric: Sequence[int],
        stamped: Sequence[int],
        whole: Sequence[int] = (),
        decimals: int = 0,
    ) -> None:
        self.path, self.dialect = path, dialect
        self.targets = np.full(dialect.width, LEFT, dtype=np.int64)
        self.targets[list(numeric)] = np.arange(len(numeric))
        self.targets[list(stamped)] = STAMP - np.arange(len(stamped))
        if dialect.trailing:
            self.targets[-1] = EMPTY
        self.whole, self.decimals = tuple(whole), decimals
        self.shape = (len(numeric), len(stamped) + len(whole))
        self.ended, self.line, self.skipped = True, dialect.first_line, 0
        # Whether the blocks so far had only rows of numbers.
        self.plain = dialect.text.line_end == b"\n" and dialect.separator != " " and dialect.width - 1 in numeric
        self.plain &= not (dialect.short_rows or self.shape[1] or dialect.width == 1)
        encoding = dialect.text.stream_encoding
        self.comment = dialect.comment.encode(encoding, "replace") if dialect.comment else b"\0"
        self._missing = [text.encode(encoding, "replace").decode("latin-1") for text in dialect.missing]

    def read(self, irregular: IrregularLines) -> Rows:
        """Return all rows in one pair of arrays; raises RecordingError."""
        if self.dialect.text.content is not None and not (self.dialect.text.recoded or self.dialect.short_rows):
            return next(self.pieces(irregular), self.allocate(0))  # of a single block
        lines = self.dialect.text.count_lines(self.dialect.offset)
        check_size(self.path, lines * sum(self.shape))
        whole = self.allocate(lines)
        parts = list(self.pieces(irregular, whole))
        count = sum(part.count for part in parts)
        not_rows = np.concatenate([whole.not_rows, *(part.not_rows for part in parts)])
        return Rows(whole.numbers[:, :count], whole.stamps[:, :count], count, whole.first_line, not_rows)

    def pieces(self, irregular: IrregularLines, whole: Rows | None = None) -> Iterator[Rows]:
        """Yield the rows block by block, in arrays of their own or one after another in `whole`.

        Irregular lines are passed to `irregular`. Raises RecordingError with the first line that cannot be read.
        """
        first, self.line = 0, self.dialect.first_line
        for block in self._blocks():
            self.ended = block.endswith((b"\n", b"\r"))
            numbers = self._plain(block) if self.plain and not irregular.categories else None
            self.plain = numbers is not None
            if numbers is None:
                rows = self._by_lines(BlockLines.of(block, self.dialect), irregular, whole, first)
            else:
                rows = self._room(len(numbers[self.dialect.width - 1]), whole, first)
                for column, values in numbers.items():
                    rows.numbers[self.targets[column]] = values
                self.line += rows.count
            rows.drop(irregular.end_block(range(rows.count)))
            yield rows
            first += rows.count
            check_size(self.path, first * sum(self.shape))

    def _room(self, count: int, whole: Rows | None, first: int) -> Rows:
        """Return arrays for the rows of the next block, which starts in line `self.line`."""
        rows = self.allocate(count) if whole is None else whole.part(first, first + count)
        rows.first_line = self.line
        return rows

    def _plain(self, block: bytes) -> Mapping[int, FloatArray] | None:
        """Return the numbers of a block that has only rows of numbers; None if it may have anything else.

        pandas fills a row that is too short with NaN, and drops the cells of one that is too long: if the last column
        has no NaN and the block has as many separators as its rows need, there are no such rows.
        """
        if any(mark in block for mark in (b'"', b"\0", self.comment)):
            return None
        data, width = np.frombuffer(block, dtype=np.uint8), self.dialect.width
        lines = np.count_nonzero(data == ord("\n")) + (not self.ended)
        if np.count_nonzero(data == ord(self.dialect.separator)) != lines * (width - 1):
            return None
        try:
            with catch_warnings(action="error", category=pd.errors.ParserWarning):
                numbers = _by_column(self._parsed(block, width, np.flatnonzero(self.targets >= 0).tolist(), np.float64))
        except (ValueError, pd.errors.ParserWarning):  # a cell that is not a number, a first row that is too long
            return None
        last = numbers.get(width - 1, np.array([np.nan]))
        return numbers if len(last) == lines and not np.isnan(last).any() else None

    def _by_lines(self, lines: BlockLines, irregular: IrregularLines, whole: Rows | None, first: int) -> Rows:
        """Return the rows of a block of any lines; `first` is the number of rows before it."""
        is_row = lines.blank | True if self.dialect.blank_is_missing else ~lines.blank
        row = np.cumsum(is_row) - 1
        rows = self._room(int(row[-1]) + 1, whole, first)
        self.skipped += int(np.count_nonzero(lines.blank))
        self._check(self.skipped, first + int(np.count_nonzero(lines.regular)))
        readable = self._read(lines, row, rows, irregular)
        for at in map(int, np.flatnonzero(~readable & ~lines.blank)):
            final = not self.ended and at == len(row) - 1
            irregular.read(IrregularLine(at, int(row[at]), lines.line(at), final), self.line, rows)
            dropped = len(irregular.dropped)
            self._check(self.skipped + dropped, first + int(row[at]) - dropped)
        blank = np.flatnonzero(lines.blank) + self.line
        (irregular.empty if self.dialect.blank_is_missing else irregular.blank).extend(blank.tolist())
        rows.not_rows = blank[:0] if self.dialect.blank_is_missing else blank
        self.skipped += len(irregular.dropped)
        self.line += len(row)
        return rows

    def _check(self, skipped: int, rows: int) -> None:
        """Raise RecordingError if a file has many more lines of other kinds than rows."""
        if skipped > max(_MOST_SKIPPED, 2 * rows):
            raise RecordingError(f"{self.path}: more than {_MOST_SKIPPED} lines are not rows", "is it a table?")

    def allocate(self, count: int) -> Rows:
        """Return uninitialised arrays for `count` rows."""
        numbers, stamps = np.empty((self.shape[0], count)), np.empty((self.shape[1], count), dtype=np.int64)
        return Rows(numbers, stamps, count, self.dialect.first_line)

    def _blocks(self) -> Iterator[bytes]:
        """Yield blocks of complete lines; if rows end early, with at most MOST_CELLS cells."""
        most, end = max(1, MOST_CELLS // self.dialect.width), self.dialect.text.line_end
        for block, size in self.dialect.text.blocks(self.dialect.offset):
            if self.dialect.short_rows and block.count(end) > most:
                ends = np.flatnonzero(np.frombuffer(block, dtype=np.uint8) == end[0])[most - 1 :: most] + 1
                yield from (block[a:b] for a, b in pairwise([0, *ends.tolist(), size]) if b > a)
            else:
                yield block

    def _read(self, lines: BlockLines, row: Integers, rows: Rows, irregular: IrregularLines) -> BoolArray:
        """Read the regular lines, line `i` as row `row[i]`; return the lines that have been read."""
        readable = lines.regular.copy()
        if lines.widest < self.dialect.width or not lines.regular.all():
            rows.numbers[:], rows.stamps[:] = np.nan, MISSING_STAMP
        if not lines.widest:
            return readable
        at = np.flatnonzero(lines.regular)
        to = slice(None) if len(at) == rows.count else row[at]
        content = lines.joined(lines.regular)
        targets = self.targets[: lines.widest]
        numeric = [column for column in np.flatnonzero(targets >= 0).tolist() if column not in irregular.categories]
        parsed = self._numbers(content, lines.widest, numeric)
        for column, numbers in parsed.items():
            rows.numbers[targets[column], to] = numbers
        worded = [column for column in np.flatnonzero(targets >= 0).tolist() if column not in parsed]
        stamped = np.flatnonzero(targets <= STAMP).tolist()
        whole = [column for column in self.whole if column < lines.widest]
        texts = self._texts(content, lines.widest, [*worded, *stamped, *whole])
        for column in worded:
            values = _known(texts[column], lambda cell: irregular.value(column, cell))  # noqa: B023
            rows.numbers[targets[column], to] = np.array(values, dtype=np.float64)
            readable[at[[value is None for value in values]]] = False
        for column in stamped:
            stamps = self.dialect.stamped[column].layouts[0].read_all(texts[column])
            rows.stamps[STAMP - targets[column], to] = stamps
            missing = ("", *self.dialect.missing)
            doubtful = np.flatnonzero(stamps == MISSING_STAMP).tolist()
            readable[at[[i for i in doubtful if texts[column][i] not in missing]]] = False
        for column in whole:
            k = self.shape[1] - len(self.whole) + self.whole.index(column)
            rows.stamps[k, to] = _multiples(texts[column], self.decimals)
        return readable

    def _numbers(self, content: bytes, width: int, columns: Sequence[int]) -> dict[int, FloatArray]:
        """Return the columns in which each cell is a number in plain notation, or missing."""
        if not columns:
            return {}
        try:
            return _by_column(self._parsed(content, width, columns, np.float64))
        except ValueError:  # of one of the columns
            kinds = self._parsed(content, width, columns, None).dtypes
        numeric = [column for column in columns if kinds[column].kind in "iuf"]  # read again: integers have no -0.0
        return self._numbers(content, width, numeric) if len(numeric) < len(columns) else {}

    def _texts(self, content: bytes, width: int, columns: Sequence[int]) -> dict[int, list[str]]:
        """Return the cells of columns."""
        if not columns:
            return {}
        frame = self._parsed(content, width, columns, np.object_)
        if content.isascii():
            return {column: [cell.strip(" \t") for cell in cells] for column, cells in frame.items()}
        encoding = self.dialect.text.stream_encoding
        return {
            column: [cell.encode("latin-1").decode(encoding, "replace").strip(" \t") for cell in cells]
            for column, cells in frame.items()
        }

    def _parsed(self, content: bytes, width: int, columns: Sequence[int], dtype: Any) -> Any:
        """Return columns as parsed by pandas; the bytes are decoded as Latin-1, one letter each."""
        dialect, is_text = self.dialect, dtype is np.object_
        return pd.read_csv(
            io.BytesIO(content),
            sep=r"\s+" if dialect.separator == " " else dialect.separator,
            header=None,
            names=range(width),
            usecols=None if len(columns) == width else list(columns),
            index_col=False,
            dtype=dtype,
            engine="c",
            encoding="latin-1",
            skip_blank_lines=False,
            keep_default_na=False,
            na_filter=not is_text,
            na_values=[] if is_text else [*MISSING, *self._missing],
            quoting=csv.QUOTE_MINIMAL if b'"' in content else csv.QUOTE_NONE,
            skipinitialspace=dialect.separator != " " and b" " in content,
            decimal=dialect.marks.decimal,
            low_memory=False,
            **_EXACT,
        )


def _by_column(frame: Any) -> dict[int, FloatArray]:
    return dict(zip(frame.columns.tolist(), frame.to_numpy().T, strict=True))


def _known(cells: Sequence[str], value: Callable[[str], float | None]) -> list[float | None]:
    """Return the values of cells, of which many may be equal."""
    known = {cell: value(cell) for cell in set(cells)}
    return [known[cell] for cell in cells]


def _multiples(cells: Sequence[str], decimals: int) -> Integers:
    """Return numbers without a sign or an exponent as multiples of 1 / 10^decimals; MISSING_STAMP for other cells."""
    multiples = np.full(len(cells), MISSING_STAMP, dtype=np.int64)
    for rows, example, digits in by_shape(cells):
        match = _DECIMAL.fullmatch(example)
        if match is None or not 0 < len(match["whole"]) + decimals <= _MOST_DIGITS:
            continue
        (first, whole_end), (begin, end) = match.span("whole"), match.span("decimals")
        end = min(end, begin + decimals)
        places = end - begin
        fraction = as_integers(digits, begin, end) if places else 0
        values = (as_integers(digits, first, whole_end) * 10**places + fraction) * 10 ** (decimals - places)
        fits = len(match["whole"]) + decimals < _MOST_DIGITS or digits[:, 0] < 9
        multiples[rows] = np.where(fits, values, MISSING_STAMP)
    return multiples
