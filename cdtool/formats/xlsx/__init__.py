"""Excel workbooks, by openpyxl: each sheet is read as the text table that it would be exported to."""

from __future__ import annotations

import os
import re
import warnings
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.clock_beside import assumed_clock, is_clock_name
from cdtool.formats.column_names import OWN_CLOCK, requested_keys, split_unit
from cdtool.formats.container_checks import check_size, library, one_line_errors
from cdtool.formats.csv import Csv
from cdtool.formats.epoch_clock import common_origin
from cdtool.formats.source import Source
from cdtool.formats.xlsx.sheet_text import SEPARATOR, SheetText, write_sheet
from cdtool.recording import FloatArray

_MAGIC, _WORKBOOK = b"PK\x03\x04", "xl/workbook.xml"
# The texts of a workbook are held in memory.
_MOST_TEXT = 64 * 2**20
# A formula that is followed by the end of its cell has no value.
_FORMULA = re.compile(rb"(</f>|<f[^>]{0,2000}/>)\s*(<v\s*/>|<v>\s*</v>)?\s*</c>")
_CHUNK, _OVERLAP = 1 << 20, 1 << 12
_NO_TABLE = "it contains no rows of numbers"


@dataclass(frozen=True)
class Xlsx:
    """Excel workbooks: each sheet is a table, read by the rules of text tables; of several, a column is `sheet!column`.

    Of several tables each column has the clock of its own sheet, found by its name.
    """

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
        openpyxl = library("openpyxl", "xlsx", path)
        if not self.sniff(path):
            raise RecordingError(f"{path}: is not an Excel workbook", "see cdtool list formats")
        with one_line_errors(path, "an Excel workbook"), TemporaryDirectory(prefix="cdtool-") as folder:
            sheets = _read_sheets(path, openpyxl, Path(folder))
            left_out = tuple(
                Finding("sheet_left_out", "", {"sheet": sheet.name, "reason": _NO_TABLE})
                for sheet in sheets
                if sheet.text.rows_of_numbers < 2 and not sheet.text.is_empty
            )
            tables = [sheet for sheet in sheets if sheet.text.rows_of_numbers > 1]
            if not tables:
                raise RecordingError(f"{path}: no sheet contains rows of numbers", "is it the right workbook?")
            source = tables[0].source(wanted) if len(tables) == 1 else _join(path, tables, wanted)
        details = {"sheets": ", ".join(sheet.name for sheet in sheets)}
        return replace(
            source, path=path, format=self.name, findings=(*left_out, *source.findings), details=details, dialect=""
        )


@dataclass(frozen=True)
class _Sheet:
    """A sheet of the workbook at `path`, as the text file `file`; formulas without a value by column."""

    path: Path
    name: str
    file: Path
    text: SheetText
    formulas: Mapping[int, tuple[int, int]]

    def source(self, wanted: ChannelMap | None = None) -> Source:
        """Return its columns, by the rules of text tables."""
        if wanted is not None:
            wanted = replace(wanted, pins=replace(wanted.pins, separator=SEPARATOR, encoding="utf-8"))
        try:
            source = Csv().columns(self.file, wanted)
        except RecordingError as fault:
            place = f"{self.path}: sheet '{self.name}'"
            message = fault.message.replace(f"{self.file}", place, 1)
            raise RecordingError(message, fault.hint, channel=fault.channel) from fault
        return replace(source, findings=(*source.findings, *self._findings(source)))

    def _findings(self, source: Source) -> list[Finding]:
        """Return what cells of the requested columns could not be read."""
        shown = {i: name for i, name in enumerate(source.names) if name in source.columns}
        errors = {i: found for i, found in self.text.errors.items() if i in shown}
        findings = [
            Finding("error_cells", shown[i], {"count": count, "error": error, "row": row})
            for i, (count, error, row) in errors.items()
        ]
        for i in self.text.commas.keys() & self.text.integers.keys() & shown.keys():
            count, text, row = self.text.commas[i]
            numbers = {"count": count, "text": text, "row": row, "integers": self.text.integers[i]}
            findings.append(Finding("numbers_among_texts", shown[i], numbers))
        formulas = {i: found for i, found in self.formulas.items() if i in shown or i >= len(source.names)}
        return findings + [
            Finding("formulas_without_value", shown.get(i, ""), {"count": count, "row": row})
            for i, (count, row) in formulas.items()
        ]


def _read_sheets(path: Path, openpyxl: Any, folder: Path) -> list[_Sheet]:
    """Return the sheets of a workbook, their texts in files of a folder; raises RecordingError."""
    with zipfile.ZipFile(path) as archive:
        _check_archive(path, archive)
        has_formulas = any(_has_formulas(archive, name) for name in archive.namelist() if "/worksheets/" in name)
    sheets = []
    with _opened(openpyxl, path, True) as workbook:
        # Dates as numbers of days, since the library rounds moments to milliseconds.
        workbook._date_formats, workbook._timedelta_formats = set(), set()
        for number, sheet in enumerate(workbook.worksheets):
            sheet.reset_dimensions()  # a wrong size would cut rows off, or add millions
            target = folder / f"{number}.txt"
            text = write_sheet(path, sheet.iter_rows, workbook.epoch, target)
            formulas = _formulas(openpyxl, path, number, sheet) if has_formulas else {}
            sheets.append(_Sheet(path, str(sheet.title), target, text, formulas))
    return sheets


@contextmanager
def _opened(openpyxl: Any, path: Path, with_values: bool) -> Iterator[Any]:
    """Yield the workbook: its values, or its formulas."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about parts of a workbook that are not data
        workbook = openpyxl.load_workbook(os.fspath(path), read_only=True, data_only=with_values, keep_links=False)
        try:
            yield workbook
        finally:
            workbook.close()


def _check_archive(path: Path, archive: zipfile.ZipFile) -> None:
    """Raise RecordingError if the parts of a workbook are damaged, encrypted, or far larger than the file."""
    parts = archive.infolist()
    check_size(path, sum(part.file_size for part in parts) // 8)
    for part in parts:
        if part.flag_bits & 1:
            raise RecordingError(f"{path}: is encrypted", "save it without a password")
        if part.filename.endswith("sharedStrings.xml") and part.file_size > _MOST_TEXT:
            raise RecordingError(f"{path}: contains {part.file_size >> 20} MiB of texts: refused", "save it as CSV")


def _has_formulas(archive: zipfile.ZipFile, name: str) -> bool:
    """Return whether a sheet has a formula without a value."""
    before = b""
    with archive.open(name) as part:
        while piece := part.read(_CHUNK):
            if _FORMULA.search(before + piece):
                return True
            before = piece[-_OVERLAP:]
    return False


def _formulas(openpyxl: Any, path: Path, number: int, values: Any) -> dict[int, tuple[int, int]]:
    """Return by column how many formulas of a sheet have no value, and the row of the first."""
    found: dict[int, tuple[int, int]] = {}
    with _opened(openpyxl, path, False) as workbook:
        sheet = workbook.worksheets[number]
        sheet.reset_dimensions()
        for row, (cells, of_values) in enumerate(zip(sheet.iter_rows(), values.iter_rows(), strict=False), 1):
            for column, (cell, value) in enumerate(zip(cells, of_values, strict=False)):
                if cell.data_type == "f" and value.value is None:
                    count, first = found.get(column, (0, row))
                    found[column] = (count + 1, first)
    return found


def _join(path: Path, tables: list[_Sheet], wanted: ChannelMap | None) -> Source:
    """Return the columns of several sheets, `sheet!column`, each with the clock of its sheet."""
    sources: dict[str, Source] = {}
    findings: list[Finding] = []
    for sheet in tables:
        try:
            sources[sheet.name] = sheet.source()
        except RecordingError as fault:
            reason = fault.message.replace(f"{path}: sheet '{sheet.name}': ", "", 1)
            findings.append(Finding("sheet_left_out", "", {"sheet": sheet.name, "reason": reason}, "loss"))
    if not sources:
        raise RecordingError(f"{path}: no sheet can be read: {findings[0]}", "save each sheet as CSV")
    names = tuple(f"{sheet}!{name}" for sheet, source in sources.items() for name in source.names)
    keys = set(requested_keys(path, wanted, names))
    own_clocks = wanted is None or wanted.time.column == OWN_CLOCK
    start = min((source.origin for source in sources.values() if source.origin), default=0.0)
    columns: dict[str, Column] = {}
    sheet_of: dict[str, str] = {}
    clocks: dict[str, FloatArray] = {}
    for sheet in tables:
        if sheet.name in sources:
            source = _on_common_origin(sources[sheet.name], sheet.text.dates, start)
            findings += _named(sheet.name, source.findings)
            if own_clocks and (clock := _clock_of(source)) is not None:
                clocks[sheet.name] = clock.values
            columns |= {f"{sheet.name}!{name}": column for name, column in source.columns.items()}
            sheet_of |= dict.fromkeys((f"{sheet.name}!{name}" for name in source.columns), sheet.name)
    origin, times = _times(columns, sources, clocks, findings) if own_clocks else (0.0, {})
    missing = [key for key in names if key in keys and key not in columns] if wanted is not None else []
    if missing:
        raise RecordingError(f"{path}: column '{missing[0]}' has cells that are not numbers", "see cdtool info")
    shown = {
        key: replace(column, name=key, time=times.get(sheet_of[key])) for key, column in columns.items() if key in keys
    }
    return Source(path, Xlsx.name, shown, start or origin, tuple(findings), names=names)


def _on_common_origin(source: Source, dates: set[int], start: float) -> Source:
    """Return a source whose dates count from the start of the workbook instead of that of the sheet."""
    if not source.origin or source.origin == start:
        return source
    dated = {source.names[i] for i in dates if i < len(source.names)}
    columns = {
        name: replace(column, values=column.values + (source.origin - start)) if name in dated else column
        for name, column in source.columns.items()
    }
    return replace(source, columns=columns)


def _clock_of(source: Source) -> Column | None:
    named = (column for name, column in source.columns.items() if is_clock_name(split_unit(name)[0]))
    return next((column for column in named if np.isfinite(column.values).any()), None)


def _times(
    columns: Mapping[str, Column],
    sources: Mapping[str, Source],
    clocks: Mapping[str, FloatArray],
    findings: list[Finding],
) -> tuple[float, dict[str, FloatArray]]:
    """Return the origin of the clocks of the sheets, and their times [s] by sheet."""
    found = {}
    for sheet, stamps in clocks.items():
        name = next(key for key, column in columns.items() if column.values is stamps)
        found[sheet] = assumed_clock(name, stamps, findings, columns[name].unit)
    origin = (
        common_origin(found.values()) if not any(source.origin for source in sources.values()) else common_origin([])
    )
    return float(origin), {sheet: clock.times(0, len(clocks[sheet]), origin) for sheet, clock in found.items()}


def _named(sheet: str, findings: tuple[Finding, ...]) -> list[Finding]:
    """Return the findings on a sheet with its name."""
    return [
        replace(finding, channel=f"{sheet}!{finding.channel}") if finding.channel else replace(finding, file=sheet)
        for finding in findings
    ]
