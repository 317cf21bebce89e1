"""Contacts as a table for spreadsheets, and rows as CSV that is safe in them and in terminals: text stays text."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from io import StringIO
from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_pieces
from cdtool.base.plain_text import plain
from cdtool.report.writers.base import Report, Writer
from cdtool.results.results import ContactResult, Results

# A spreadsheet runs a cell that begins with one of these (the last four are their full-width forms). If its list
# separator is not that of the file, a cell begins after each semicolon or comma, in quotation marks or not.
_RUN_BY_SPREADSHEETS = re.compile(r"(^|[;,])(\s*)(?=[=+\-@＝＋－＠])")


class Contacts(Writer[Report]):
    """CSV: a row per contact and detector."""

    name: ClassVar[str] = "contacts"
    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    in_folder: ClassVar[str] = "contacts.csv"
    kinds: ClassVar[dict[str, Kind]] = {".csv": Kind(b"force_at_alarm_n", "table of cdtool")}

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        write_pieces(target, contacts_lines(report.evaluated.results))


def contacts_lines(results: Results) -> Iterator[str]:
    """Yield a row per contact and detector, in the order and under the names of results.json; empty = no value."""
    names = [item.name for item in fields(ContactResult)]
    return csv_lines(results, names, ([getattr(contact, name) for name in names] for contact in results.contacts))


def csv_lines(results: Results, names: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[str]:
    """Yield a line of names and a line per row; empty = no value.

    With `[report] decimal = "comma"` as Excel opens a file where numbers have a comma: semicolons, and the byte order
    mark without which it reads UTF-8 as the code page of Windows.
    """
    german = results.provenance.get("report") == {"decimal": "comma"}
    decimal = "," if german else "."
    text = StringIO()
    writer = csv.writer(text, delimiter=";" if german else ",", lineterminator="\n")
    yield "\ufeff" if german else ""
    writer.writerow(names)
    for row in rows:
        yield text.getvalue()
        text.seek(0)
        text.truncate()
        writer.writerow([_cell(value, decimal) for value in row])
    yield text.getvalue()


def _cell(value: object, decimal: str) -> object:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _RUN_BY_SPREADSHEETS.sub(r"\1\2'", plain(value))
    if isinstance(value, float):
        # What arithmetic leaves behind the digits of a measurement, as in 60.00000000000006 ms, is not written.
        tidy = round(value, 9) if abs(value) >= 1.0 else float(f"{value:.12g}")
        return str(tidy).replace(".", decimal) if math.isfinite(value) else None
    return value
