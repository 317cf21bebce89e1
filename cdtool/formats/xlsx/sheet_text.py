"""A sheet of a workbook as the text table that Excel would export, one line per row, for the reader of text tables.

Excel's own export rounds numbers to what a cell shows, and writes dates in the format of the cell. Here numbers have
all their digits, and dates are ISO dates. Numbers have a decimal comma if numbers that are stored as texts have one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import date, datetime, time, timedelta
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_size

SEPARATOR = "\t"
# Excel has at most so many rows; a log has no more columns than this.
_MOST_ROWS, _MOST_COLUMNS = 1_048_576, 4096
_TEXT_NUMBER = re.compile(r"\s*[+-]?[0-9][0-9., ]*([eE][+-]?[0-9]+)?\s*")
_DAY_US = 86_400_000_000
# Days in the first year of Excel's calendar are times of day, which may have passed midnight.
_FIRST_DATE = 366.0
# The lines are counted in blocks of so many, in which the size of the text is checked.
_BLOCK = 1000
_THOUSAND = 1000.0


@dataclass
class SheetText:
    """What is known about a sheet after its text is written.

    `columns` is the width of its widest row, `rows_of_numbers` the number of rows with a number. By column, from 0:
    `dates` are those with dates, `errors` the number of cells with an error, the first of them and its row, `commas`
    the same of texts that are numbers with a comma, `integers` the number of integers of 1000 and more.
    """

    columns: int = 0
    rows_of_numbers: int = 0
    is_empty: bool = True
    decimal_comma: bool = False
    decimal_point: bool = False
    dates: set[int] = field(default_factory=set)
    errors: dict[int, tuple[int, str, int]] = field(default_factory=dict)
    commas: dict[int, tuple[int, str, int]] = field(default_factory=dict)
    integers: dict[int, int] = field(default_factory=dict)


def write_sheet(path: Path, rows: Callable[[], Iterable[Any]], epoch: datetime, target: Path) -> SheetText:
    """Write the rows of cells of a sheet to a text file; `epoch` is the day 0 of its dates.

    Raises RecordingError if the sheet is larger than any log.
    """
    raw = target.with_suffix(".raw")
    found = _write(path, rows(), epoch, raw, ".")
    if found.decimal_comma and not found.decimal_point:
        found = _write(path, rows(), epoch, raw, ",")
    _pad(path, raw, target, found.columns)
    return found


def _pad(path: Path, raw: Path, target: Path, columns: int) -> None:
    """Write lines of equal width; blank lines stay blank. Raises RecordingError if the text is larger than any log."""
    size = 0
    with raw.open(encoding="utf-8") as lines, target.open("w", encoding="utf-8", newline="\n") as file:
        for number, line in enumerate(lines):
            text = line.rstrip("\n")
            missing = columns - 1 - text.count(SEPARATOR) if text else 0
            size += file.write(f"{text}{SEPARATOR * missing}\n")
            if number % _BLOCK == 0:
                check_size(path, size // 8)
    raw.unlink()


def _write(path: Path, rows: Iterable[Any], epoch: datetime, target: Path, decimal: str) -> SheetText:
    sheet = _Cells(SheetText(), epoch, decimal)
    blank = size = count = 0
    rows = iter(rows)
    with target.open("w", encoding="utf-8", newline="\n") as file:
        while block := list(islice(rows, _BLOCK)):
            for row in block:
                count += 1
                if count > _MOST_ROWS or len(row) > _MOST_COLUMNS:
                    raise RecordingError(
                        f"{path}: a sheet has more than {_MOST_COLUMNS} columns or {_MOST_ROWS} rows: refused",
                        "delete the columns and rows that contain no data",
                    )
                line = sheet.line(row, count)
                if line:
                    size += file.write("\n" * blank + line + "\n")
                    blank = 0
                else:
                    blank += 1
            check_size(path, size // 8)
    return sheet.found


class _Cells:
    """Writes cells as text."""

    def __init__(self, found: SheetText, epoch: datetime, decimal: str) -> None:
        self.found, self._epoch, self._decimal = found, epoch, decimal
        self._has_number = False

    def line(self, row: Iterable[Any], number: int) -> str:
        """Return a row as a line; empty for a row without values."""
        self._has_number = False
        texts = [self._text(cell, column, number) for column, cell in enumerate(row)]
        while texts and not texts[-1]:
            texts.pop()
        self.found.rows_of_numbers += self._has_number
        self.found.is_empty = self.found.is_empty and not texts
        self.found.columns = max(self.found.columns, len(texts))
        return SEPARATOR.join(texts)

    def _text(self, cell: Any, column: int, row: int) -> str:
        value = cell.value
        if value is None:
            return ""
        if cell.data_type == "e":
            count, first, first_row = self.found.errors.get(column, (0, str(value), row))
            self.found.errors[column] = (count + 1, first, first_row)
            return "nan"
        if isinstance(value, str):
            return self._word(value, column, row)
        if isinstance(value, bool):
            return "true" if value else "false"
        self._has_number = True
        if isinstance(value, int | float):
            kind = _kind(cell.number_format) if cell.has_style else ""
            if abs(value) >= _THOUSAND and value == int(value):
                self.found.integers[column] = self.found.integers.get(column, 0) + 1
            return self._number(value) if not kind else self._date(float(value), kind, column)
        self.found.dates.add(column)
        return _moment(value)

    def _word(self, text: str, column: int, row: int) -> str:
        if _TEXT_NUMBER.fullmatch(text):
            self._has_number = True
            if "," in text:
                self.found.decimal_comma = True
                count, first, first_row = self.found.commas.get(column, (0, text.strip(), row))
                self.found.commas[column] = (count + 1, first, first_row)
            self.found.decimal_point |= "." in text and "," not in text
        return " ".join(text.replace('"', "'").split())

    def _number(self, value: float) -> str:
        return repr(value).replace(".", self._decimal)

    def _date(self, days: float, kind: str, column: int) -> str:
        """Return days since the epoch as a date, a time of day or elapsed seconds."""
        try:
            moment = timedelta(microseconds=round(days * _DAY_US))
            if kind == "elapsed":
                return self._number(moment.total_seconds())
            self.found.dates.add(column)
            if 0.0 <= days < _FIRST_DATE:
                return (datetime.min + moment).time().isoformat("microseconds")
            return (self._epoch + moment).isoformat(timespec="microseconds")
        except (OverflowError, ValueError):  # not a day that a calendar has
            return self._number(days)


@cache
def _kind(number_format: str | None) -> str:
    """Return what a number format shows: an "elapsed" time, or a "date" or time of day; empty for a number."""
    from openpyxl.styles.numbers import is_date_format, is_timedelta_format

    if number_format is None or number_format == "General":
        return ""
    return "elapsed" if is_timedelta_format(number_format) else "date" if is_date_format(number_format) else ""


def _moment(value: Any) -> str:
    """Return a date or time that the library has already converted."""
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    if isinstance(value, datetime | time):
        return value.isoformat(timespec="microseconds")
    return value.isoformat() if isinstance(value, date) else " ".join(str(value).split())
