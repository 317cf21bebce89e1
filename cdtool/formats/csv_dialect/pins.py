"""`[csv]` of the machine file: the parts of a table's dialect that are pinned instead of detected."""

from __future__ import annotations

import codecs

from cdtool.base.tables import Table
from cdtool.base.value_words import value_in_words
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv.stamps import check_pattern
from cdtool.formats.csv.text import UNIT_BYTES

_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "pipe": "|", "blanks": " "}
_THOUSANDS = ("", ",", ".", "'", " ", "\u00a0", "\u202f")
_TIME_WORDS = ("", "number", "excel")


def read_pins(table: Table) -> TablePins:
    """Return the pins of `[csv]`; raises ConfigurationError naming the key."""
    separator = _one_of(table, "separator", {**_SEPARATORS, **{mark: mark for mark in _SEPARATORS.values()}})
    decimal = _one_of(table, "decimal", {",": ",", ".": ".", "comma": ",", "point": "."})
    thousands = table.text("thousands") if "thousands" in table else None
    if thousands is not None and thousands not in _THOUSANDS:
        raise table.fault("thousands", f"is {value_in_words(thousands)}", '",", ".", "\'", a blank, or "" for none')
    if decimal and thousands == decimal:
        raise table.fault(
            "thousands", f"is {value_in_words(thousands)}, the same as decimal", "the two marks must differ"
        )
    pins = TablePins(
        separator=separator,
        decimal=decimal,
        thousands=thousands,
        encoding=_encoding(table),
        header=_line(table, "header"),
        units=_line(table, "units"),
        skip_lines=table.whole("skip_lines", 0, minimum=0),
        comment=table.text("comment") if "comment" in table else None,
        missing=table.texts("missing", ()),
        time_format=_time_format(table),
    )
    if pins.header is False and isinstance(pins.units, int) and pins.units is not False:
        raise table.fault("units", f"is {pins.units}, but header is false", "units need a header")
    table.finish()
    return pins


def _one_of(table: Table, name: str, meaning: dict[str, str]) -> str:
    if name not in table:
        return ""
    given = table.text(name)
    if given not in meaning:
        words = ", ".join(repr(word) for word in meaning)
        raise table.fault(name, f"is {value_in_words(given)}", f"one of {words}")
    return meaning[given]


def _line(table: Table, name: str) -> int | bool | None:
    value = table.raw(name)
    if value is None or value is False:
        return value
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise table.fault(name, f"is {value_in_words(value)}", "the number of its line, counted from 1, or false")
    return value


def _encoding(table: Table) -> str:
    name = table.text("encoding", "")
    if not name:
        return ""
    try:
        known = codecs.lookup(name).name
        # Also the codec of host names agrees with ASCII, but it cannot replace what it cannot decode.
        narrow = "1,2\n".encode(known) == b"1,2\n" == b"1,2\n".decode(known, "replace").encode()
    except (LookupError, UnicodeError, AssertionError):
        raise table.fault("encoding", f"is '{name}'", "utf-8, utf-16-le, utf-16-be, latin-1 or cp1252") from None
    # Numbers are read byte by byte: their bytes must be ASCII, or the encoding must be one that is recoded to UTF-8.
    known = {"iso8859-1": "latin-1"}.get(known, known)
    if not narrow and known not in UNIT_BYTES:
        raise table.fault("encoding", f"is '{name}'", "utf-8, utf-16-le, utf-16-be, latin-1 or cp1252")
    return known


def _time_format(table: Table) -> str:
    value = table.text("time_format", "")
    if value in _TIME_WORDS:
        return value
    problem = check_pattern(value) if "%" in value else "is not a layout"
    if problem:
        raise table.fault(
            "time_format", f"is '{value}': {problem}", "number, excel, or a layout such as %d.%m.%Y %H:%M:%S.%f"
        )
    return value
