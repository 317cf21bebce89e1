"""`[csv]` of the machine file: the parts of a table's dialect that are pinned instead of detected."""

from __future__ import annotations

import codecs
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from cdtool.base.settings import Count, CountFromZero, Place, read, setting
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv.stamps import check_pattern
from cdtool.formats.csv.text import UNIT_BYTES

_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "pipe": "|", "blanks": " "}
_DECIMALS = {"comma": ",", "point": "."}
_TIME_WORDS = ("", "number", "excel")
_ENCODINGS = "give utf-8, utf-16-le, utf-16-be, latin-1 or cp1252"
_LINE = Annotated[
    bool | Count | None,
    setting(
        "the number of its line, counted from 1, or false", hint="give the number of its line, counted from 1, or false"
    ),
]


@dataclass(frozen=True, kw_only=True)
class CsvTable:
    """[csv]: the parts of a table's dialect that are set; the others are found in each file."""

    separator: Annotated[
        Literal["comma", "semicolon", "tab", "pipe", "blanks", ",", ";", "\t", "|", " "] | None,
        setting("between the columns", hint="give comma, semicolon, tab, pipe or blanks, or the character"),
    ] = None
    decimal: Annotated[
        Literal["comma", "point", ",", "."] | None, setting("the decimal mark", hint='give "." or ","')
    ] = None
    thousands: Annotated[
        Literal["", ",", ".", "'", " ", "\u00a0", "\u202f"] | None,
        setting("between groups of three digits", hint='give ",", ".", "\'", a blank, or "" for none'),
    ] = None
    encoding: Annotated[str, setting("utf-8, utf-16-le, utf-16-be, latin-1 or cp1252")] = ""
    header: _LINE = None
    units: _LINE = None
    skip_lines: Annotated[CountFromZero, setting("lines above the table that are not read")] = 0
    comment: Annotated[str | None, setting("mark at the beginning of a line that is not read")] = None
    missing: Annotated[tuple[str, ...], setting("texts that stand for a missing value")] = ()
    time_format: Annotated[str, setting("number, excel, or a layout such as %d.%m.%Y %H:%M:%S.%f")] = ""


def read_pins(values: Mapping[str, Any], place: Place) -> TablePins:
    """Return the pins of `[csv]`, with the mistakes in `place`."""
    table = read(CsvTable, values, place)
    if table is None:
        return TablePins()
    for name in ("header", "units"):
        if getattr(table, name) is True:
            place.note(name, "is true", "give the number of its line, counted from 1, or false")
    if table.header is False and table.units:
        place.note("units", f"is {table.units}, but header is false", "units need a header")
    decimal = _DECIMALS.get(table.decimal or "", table.decimal or "")
    if decimal and table.thousands == decimal:
        place.note("thousands", f"is '{decimal}', the same as decimal", "the two marks must differ")
    return TablePins(
        separator=_SEPARATORS.get(table.separator or "", table.separator or ""),
        decimal=decimal,
        thousands=table.thousands,
        encoding=place.tried("", _encoding, table.encoding, place),
        header=table.header,
        units=table.units,
        skip_lines=table.skip_lines,
        comment=table.comment,
        missing=table.missing,
        time_format=place.tried("", _time_format, table.time_format, place),
    )


def _encoding(name: str, place: Place) -> str:
    if not name:
        return ""
    try:
        known = codecs.lookup(name).name
        # Also the codec of host names agrees with ASCII, but it cannot replace what it cannot decode.
        narrow = "1,2\n".encode(known) == b"1,2\n" == b"1,2\n".decode(known, "replace").encode()
    except (LookupError, UnicodeError, AssertionError):
        raise place.fault("encoding", f"is '{name}'", _ENCODINGS) from None
    # Numbers are read byte by byte: their bytes must be ASCII, or the encoding must be one that is recoded to UTF-8.
    known = {"iso8859-1": "latin-1"}.get(known, known)
    if not narrow and known not in UNIT_BYTES:
        raise place.fault("encoding", f"is '{name}'", _ENCODINGS)
    return known


def _time_format(value: str, place: Place) -> str:
    if value in _TIME_WORDS:
        return value
    problem = check_pattern(value) if "%" in value else "is not a layout"
    if problem:
        raise place.fault(
            "time_format", f"is '{value}': {problem}", "give number, excel, or a layout such as %d.%m.%Y %H:%M:%S.%f"
        )
    return value
