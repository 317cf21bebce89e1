"""The rows of a text table: is each as wide as the first, and in which line of the file does it stand?

pandas fills short rows with NaN and, given the wanted columns, cuts long ones, both silently: so this looks first.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.formats.csv_dialect import Dialect

_BLOCK = 1 << 24


@dataclass(frozen=True)
class Rows:
    """`count` rows of numbers; `blank` are the lines between them that hold nothing; `cut`: the last line is broken."""

    count: int
    blank: tuple[int, ...]
    first_line: int
    cut: bool
    ended: bool

    def line(self, row: int) -> int:
        """The file's line (from 1) of a row (from 0)."""
        line = self.first_line + row
        for blank in self.blank:
            if blank > line:
                break
            line += 1
        return line


def check_rows(path: Path, dialect: Dialect) -> Rows:
    """Count the rows; raises RecordingError with the line of the first that is wider or narrower than it should be."""
    count, line, blank = 0, dialect.first_line, []
    ended, quotes = True, False
    for block, last in _blocks(path, dialect):
        ended = block.endswith((b"\n", b"\r"))
        quotes = quotes or b'"' in block
        try:
            widths = _quoted_widths(block, dialect) if quotes else _widths(block, dialect)
        except csv.Error as fault:
            raise RecordingError(
                f"{path}: not a table after line {line}: {fault}", "are the quotes in pairs?"
            ) from fault
        odd = np.flatnonzero(widths != dialect.width)
        for index in odd:
            width = int(widths[index])
            if width == 0:
                blank.append(line + int(index))
            elif last and index == len(widths) - 1 and not ended and width < dialect.width and count + index > 0:
                rows = count + len(widths) - 1 - int(np.count_nonzero(widths == 0))
                return Rows(rows, tuple(blank), dialect.first_line, True, False)
            else:
                expected = f"the header has {dialect.width}" if dialect.header else f"the first has {dialect.width}"
                raise RecordingError(
                    f"{path}: line {line + int(index)} has {width} cells, {expected}",
                    "repair or remove the line; the first row sets the width",
                )
        count += len(widths) - int(np.count_nonzero(widths == 0))
        line += len(widths)
    return Rows(count, tuple(blank), dialect.first_line, False, ended)


def _blocks(path: Path, dialect: Dialect) -> Iterator[tuple[bytes, bool]]:
    """Blocks of whole lines, and whether one is the last."""
    with path.open("rb") as file:
        file.seek(dialect.offset)
        rest = b""
        while True:
            fresh = file.read(_BLOCK)
            if not fresh:
                if rest:
                    yield rest, True
                return
            block = rest + fresh
            cut = block.rfind(dialect.line_end) + 1
            if cut:
                yield block[:cut], False
            rest = block[cut:]


def _widths(block: bytes, dialect: Dialect) -> npt.NDArray[np.int64]:
    """Cells in each line; 0 for a line of blanks."""
    data = np.frombuffer(block, dtype=np.uint8)
    ends = np.flatnonzero(data == dialect.line_end[0])
    if not len(ends) or ends[-1] != len(data) - 1:
        ends = np.append(ends, len(data))
    blanks = (data == 32) | (data == 13) | (data == 10)
    if dialect.separator != "\t":  # a line of tabs alone is a row of empty cells, as pandas has it
        blanks |= data == 9
    if dialect.separator == " ":
        starts_cell = ~blanks
        starts_cell[1:] &= blanks[:-1]
        return _per_line(starts_cell, ends)
    widths = _per_line(data == ord(dialect.separator), ends) + 1
    widths[_per_line(~blanks, ends) == 0] = 0
    return widths


def _per_line(marks: npt.NDArray[np.bool_], ends: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    at = np.flatnonzero(marks)
    return np.diff(np.searchsorted(at, ends, side="left"), prepend=0)


def _quoted_widths(block: bytes, dialect: Dialect) -> npt.NDArray[np.int64]:
    # Separators inside quotes do not count: slow, and right.
    text = io.StringIO(block.decode("latin-1"), newline="")
    if dialect.separator == " ":
        lines = text.getvalue().splitlines()
        return np.array([len(line.split()) for line in lines], dtype=np.int64)
    rows = csv.reader(text, delimiter=dialect.separator, skipinitialspace=True)
    return np.array([len(row) if any(map(str.strip, row)) or len(row) > 1 else 0 for row in rows], dtype=np.int64)
