"""Excel workbooks, by openpyxl: the sheet with numbers is read as the text table that it would be exported to.

Excel's own export rounds numbers to what a cell shows, and writes dates in the format of the cell. Here numbers have
all their digits, and dates are ISO dates. Numbers have a decimal comma if numbers that are stored as texts have one.
"""

from __future__ import annotations

import os
import re
import warnings
import zipfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime, time, timedelta
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

from cdtool.base.errors import RecordingError, naming
from cdtool.base.files.bounded_loading import MIB
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.containers.container_checks import check_size, library, one_line_errors
from cdtool.formats.csv import Csv
from cdtool.formats.source import Source

_MAGIC, _WORKBOOK, _SEPARATOR = b"PK\x03\x04", "xl/workbook.xml", "\t"
# Excel has at most so many rows; a log has no more columns than this.
_MOST_ROWS, _MOST_COLUMNS = 1_048_576, 4096
# A cell with a formula but without a value, and its place in its attributes.
_FORMULA = re.compile(rb"<c(\s[^>]*)?>\s*<f(?:[^>]*/>|[^>]*>[^<]*</f>)\s*(?:<v\s*/>|<v>\s*</v>)?\s*</c>")
_PLACE = re.compile(rb'\br="([A-Z]+)([0-9]+)"')
_TEXT_NUMBER = re.compile(r"\s*[+-]?[0-9][0-9., ]*([eE][+-]?[0-9]+)?\s*")
# Stands for the decimal mark until all cells are known; no XML contains it.
_MARK = "\x01"
# Begins a number.
_NUMBER = "\x02"


@dataclass(frozen=True)
class Xlsx:
    """Excel workbooks: the sheet with rows of numbers is a table, read by the rules of text tables."""

    name: ClassVar[str] = "xlsx"
    suffixes: ClassVar[tuple[str, ...]] = (".xlsx", ".xlsm")

    def sniff(self, path: Path) -> bool:
        """Return whether the file is a ZIP archive of a workbook, or a damaged one of that suffix."""
        with path.open("rb") as file:
            if file.read(len(_MAGIC)) != _MAGIC:
                return False
        try:
            with zipfile.ZipFile(path) as archive:
                return _WORKBOOK in archive.namelist()
        except Exception:  # damaged bytes cause errors of any type
            return path.suffix.lower() in self.suffixes

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all numeric columns; raises RecordingError."""
        with naming(path), one_line_errors("an Excel workbook"), TemporaryDirectory(prefix="cdtool-") as folder:
            openpyxl = library("openpyxl", "xlsx")
            sheets = _read_sheets(path, openpyxl, Path(folder))
            tables = [sheet for sheet in sheets if sheet.rows_of_numbers > 1]
            if not tables:
                raise RecordingError("no sheet contains rows of numbers", "is it the right workbook?")
            if len(tables) > 1:
                names = ", ".join(f"'{sheet.name}'" for sheet in tables)[:200]
                raise RecordingError(f"several sheets contain rows of numbers: {names}", "save each sheet as CSV")
            source = tables[0].source(wanted)
        left_out = tuple(
            Finding("sheet_left_out", "", {"sheet": sheet.name, "reason": "it contains no rows of numbers"})
            for sheet in sheets
            if sheet not in tables and sheet.width
        )
        details = {"sheets": ", ".join(sheet.name for sheet in sheets)}
        return replace(
            source, path=path, format=self.name, findings=(*left_out, *source.findings), details=details, dialect=""
        )


@dataclass(eq=False)
class _Sheet:
    """A sheet of the workbook at `path`, as the text table `file`; `epoch` is the day 0 of its dates.

    By column, from 0: `errors` are the number of cells with an error, the first of them and its row, `commas` the same
    of texts that are numbers with a comma, `integers` the number of integers of 1000 and more, `formulas` the number of
    formulas without a value, and the row of the first.
    """

    path: Path
    name: str
    file: Path
    epoch: datetime
    width: int = 0
    rows_of_numbers: int = 0
    decimal_point: bool = False
    errors: dict[int, tuple[Any, ...]] = field(default_factory=dict)
    commas: dict[int, tuple[Any, ...]] = field(default_factory=dict)
    integers: dict[int, int] = field(default_factory=dict)
    formulas: dict[int, tuple[Any, ...]] = field(default_factory=dict)

    def source(self, wanted: ChannelMap | None) -> Source:
        """Return its columns, by the rules of text tables."""
        if wanted is not None:
            wanted = replace(wanted, pins=replace(wanted.pins, separator=_SEPARATOR, encoding="utf-8"))
        try:
            source = Csv().columns(self.file, wanted)
        except RecordingError as fault:
            message = fault.message.replace(f"{self.file}", f"sheet '{self.name}'", 1)
            raise RecordingError(message, fault.hint, channel=fault.channel) from fault
        shown = {i: name for i, name in enumerate(source.names) if name in source.columns}
        findings = [
            Finding("error_cells", shown[i], {"count": count, "error": error, "row": row})
            for i, (count, error, row) in self.errors.items()
            if i in shown
        ]
        for i in self.commas.keys() & self.integers.keys() & shown.keys():
            count, text, row = self.commas[i]
            numbers = {"count": count, "text": text, "row": row, "integers": self.integers[i]}
            findings.append(Finding("numbers_among_texts", shown[i], numbers))
        for i, (count, row) in self.formulas.items():
            if i in shown or i >= len(source.names):
                findings.append(Finding("formulas_without_value", shown.get(i, ""), {"count": count, "row": row}))
        return replace(source, findings=(*source.findings, *findings))

    def write(self, rows: Iterable[Any]) -> None:
        """Write the rows of cells as lines of equal width; raises RecordingError if there are more than in any log."""
        lines: list[str] = []
        size = 0
        for row in rows:
            if len(lines) >= _MOST_ROWS or len(row) > _MOST_COLUMNS:
                raise RecordingError(
                    f"a sheet has more than {_MOST_COLUMNS} columns or {_MOST_ROWS} rows: refused",
                    "delete the columns and rows that contain no data",
                )
            texts = [self._text(cell, column, len(lines) + 1) for column, cell in enumerate(row)]
            lines.append(_SEPARATOR.join(texts).rstrip(_SEPARATOR))
            self.rows_of_numbers += any(text.startswith(_NUMBER) for text in texts)
            self.width = max(self.width, lines[-1].count(_SEPARATOR) + 1 if lines[-1] else 0)
            size += max(len(lines[-1]), self.width if lines[-1] else 0)
            check_size(self.path, size // 8)
        decimal = "," if self.commas and not self.decimal_point else "."
        with self.file.open("w", encoding="utf-8", newline="\n") as file:
            for line in "\n".join(lines).rstrip("\n").split("\n"):
                missing = self.width - 1 - line.count(_SEPARATOR) if line else 0
                file.write(f"{line}{_SEPARATOR * missing}\n".replace(_NUMBER, "").replace(_MARK, decimal))

    def _text(self, cell: Any, column: int, row: int) -> str:
        """Return a cell as text; one that is a number, a date or a time begins with _NUMBER."""
        value = cell.value
        if value is None:
            return ""
        if cell.data_type == "e":
            _count(self.errors, column, str(value), row)
            return "nan"
        if isinstance(value, str):
            is_number = _TEXT_NUMBER.fullmatch(value) is not None
            if is_number and "," in value:
                _count(self.commas, column, value.strip(), row)
            self.decimal_point |= is_number and "." in value and "," not in value
            return (_NUMBER if is_number else "") + " ".join(value.replace('"', "'").split())
        if isinstance(value, bool):
            return "true" if value else "false"
        if not isinstance(value, int | float):
            return _NUMBER + _moment(value)
        if abs(value) >= 1000.0 and value == int(value):
            self.integers[column] = self.integers.get(column, 0) + 1
        kind = _kind(cell.number_format) if cell.has_style else ""
        shown = self._date(float(value), kind) if kind else value
        return _NUMBER + (shown if isinstance(shown, str) else repr(shown).replace(".", _MARK))

    def _date(self, days: float, kind: str) -> str | float:
        """Return days since the epoch as a date, a time of day or elapsed seconds."""
        try:
            moment = timedelta(microseconds=round(days * 86_400_000_000))
            if kind == "elapsed":
                return moment.total_seconds()
            # The first year of Excel's calendar are times of day, which may have passed midnight.
            if 0.0 <= days < 366.0:
                return (datetime.min + moment).time().isoformat("microseconds")
            return (self.epoch + moment).isoformat(timespec="microseconds")
        except (OverflowError, ValueError):  # not a day that a calendar has
            return days


def _count(found: dict[int, tuple[Any, ...]], column: int, *first: Any) -> None:
    """Count what is found in a column; the first of them is kept."""
    count, *kept = found.get(column, (0, *first))
    found[column] = (count + 1, *kept)


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
    return value.isoformat(timespec="microseconds") if isinstance(value, datetime | time) else str(value)


def _read_sheets(path: Path, openpyxl: Any, folder: Path) -> list[_Sheet]:
    """Return the sheets of a workbook, their texts in files of a folder; raises RecordingError."""
    with zipfile.ZipFile(path) as archive:
        check_size(path, sum(part.file_size for part in archive.infolist()) // 8)
    sheets = list[_Sheet]()
    with _opened(openpyxl, path) as workbook:
        # Dates as numbers of days, since the library rounds moments to milliseconds.
        workbook._date_formats, workbook._timedelta_formats = set(), set()
        for sheet in workbook.worksheets:
            sheet.reset_dimensions()  # a wrong size would cut rows off, or add millions
            found = _Sheet(path, str(sheet.title), folder / f"{len(sheets)}.txt", workbook.epoch)
            found.write(sheet.iter_rows())
            with workbook._archive.open(sheet._worksheet_path) as part:
                _find_formulas(part, openpyxl.utils.column_index_from_string, found.formulas)
            sheets.append(found)
    return sheets


def _find_formulas(part: Any, number_of: Callable[[str], int], found: dict[int, tuple[Any, ...]]) -> None:
    """Count the formulas without a value in the XML of a sheet, which the library reads as empty cells."""
    rest = b""
    while piece := part.read(MIB):
        cells, end, rest = (rest + piece).rpartition(b"</c>")
        for cell in _FORMULA.finditer(cells + end):
            place = _PLACE.search(cell[1] or b"")
            _count(found, *((number_of(place[1].decode()) - 1, int(place[2])) if place else (_MOST_COLUMNS, 0)))


@contextmanager
def _opened(openpyxl: Any, path: Path) -> Iterator[Any]:
    """Yield the workbook with its values."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about parts of a workbook that are not data
        workbook = openpyxl.load_workbook(os.fspath(path), read_only=True, data_only=True, keep_links=False)
        try:
            yield workbook
        finally:
            workbook.close()
