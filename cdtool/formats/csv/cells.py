"""Split a line into cells and classify them: number, time stamp, missing value or words."""

from __future__ import annotations

import csv
import math
import re
from functools import lru_cache

SEPARATORS = {"\t": "tab", ";": "semicolon", "|": "pipe", ",": "comma", " ": "blanks"}
MISSING = ("", "nan", "NaN", "NAN")
# What programs write for a value that does not exist: JSON and SQL, Python, pandas.
NULLS = ("null", "NULL", "None", "<NA>")
MINUS_SIGN = "\u2212"

_TAIL = r"(?:[eE][+-]?[0-9]+)?"
_WORDS = re.compile(r"[+-]?(?:nan|inf|infinity|true|false)", re.IGNORECASE)
_PLAIN = {
    mark: re.compile(rf"[+-]?(?:[0-9]+(?:{re.escape(mark)}[0-9]*)?|{re.escape(mark)}[0-9]+){_TAIL}") for mark in ".,"
}
# NaN and infinity as written by Microsoft's C run-time library: 1.#QNAN, -1.#IND, 1.#INF.
_MICROSOFT = re.compile(r"[+-]?1[.,]#(?P<kind>QNAN|SNAN|IND|INF)[0-9]*|[+-]?nan\((?:ind|snan)\)", re.IGNORECASE)
_QUICK = re.compile(r"-?[0-9]+(?:[.,][0-9]+)?")
_NUMBER_LIKE = re.compile(
    rf"[+-]?(?:[0-9]+(?:[.,'\u00a0\u202f][0-9]+)*[.,]?|[.,][0-9]+|[0-9]{{1,3}}(?: [0-9]{{3}})+(?:[.,][0-9]+)?){_TAIL}"
)
STAMP_LIKE = re.compile(
    r"[0-9]{1,4}[-/.](?:[0-9]{1,2}|[A-Za-z]{3})[-/.][0-9]{1,4}(?:[T _].*)?|[0-9]{8}[T ][0-9].*"
    r"|[0-9]{1,2}:[0-9]{2}(?::[0-9]{2})?(?:[.,:;][0-9]+)?(?: ?[AaPp][Mm])?"
)


def split_line(line: str, separator: str) -> list[str]:
    """Return the cells of a line without outer blanks and quotes."""
    if separator == " " and '"' not in line:
        return _words(line)
    if '"' not in line:
        return [cell.strip(" \t\r\n") for cell in line.split(separator)]
    if separator == " ":
        line = " ".join(_words(line))
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error:  # stray quotes: reported with their line when the rows are read
        cells = line.split(separator)
    return [cell.strip(" \t\r\n") for cell in cells]


def has_open_quote(line: str, separator: str) -> bool:
    """Return whether a cell starts with a quote that is not closed; a quote within a cell is a letter."""
    try:
        next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True))
    except csv.Error:
        return True
    return False


def _words(line: str) -> list[str]:
    """Return a line split at blanks and tabs; non-breaking spaces do not split, as they are parts of numbers."""
    return [word for word in line.strip(" \t\r\n").replace("\t", " ").split(" ") if word]


@lru_cache(maxsize=1 << 12)  # the cells of a sample are classified several times
def kind(cell: str) -> str:
    """Return the kind of a cell: N number in any notation or NaN, T time stamp, M missing (empty), X words."""
    if _QUICK.fullmatch(cell):
        return "N"
    if not cell or cell in NULLS:
        return "M"
    text = cell.replace(MINUS_SIGN, "-")
    if _NUMBER_LIKE.fullmatch(text) and not (text.count(".") > 1 and text.count(",") > 1):
        return "T" if STAMP_LIKE.fullmatch(text) and not _grouped(text) else "N"
    if _WORDS.fullmatch(text) or _MICROSOFT.fullmatch(text):
        return "N"
    return "T" if STAMP_LIKE.fullmatch(text) else "X"


def _grouped(text: str) -> bool:
    return re.fullmatch(r"[+-]?[0-9]{1,3}(?:[.][0-9]{3})+", text) is not None


def number(text: str, decimal: str, thousands: str = "") -> float | None:
    """Return the value of a cell, equal to Python's float(); NaN for a missing value, None if it is not a number."""
    text = text.strip(" \t\r").replace(MINUS_SIGN, "-")
    if text in MISSING:
        return math.nan
    special = _MICROSOFT.fullmatch(text)
    if special:
        if special["kind"] and special["kind"].upper() == "INF":
            return -math.inf if text.startswith("-") else math.inf
        return math.nan
    word = _WORDS.fullmatch(text)
    if word:
        plain = text.lstrip("+-").lower()
        value = {"true": 1.0, "false": 0.0}.get(plain)
        return float(text) if value is None else -value if text.startswith("-") else value
    if thousands and thousands in text:
        whole, mark, rest = text.partition(decimal)
        if not re.fullmatch(rf"[+-]?[0-9]{{1,3}}(?:{re.escape(thousands)}[0-9]{{3}})+", whole):
            return None
        text = whole.replace(thousands, "") + mark + rest
    if not _PLAIN[decimal].fullmatch(text):
        return None
    return float(text.replace(",", "."))


def has_numbers(line: str) -> bool:
    """Return whether a line has numbers, with or without time stamps, but no words, for any separator."""
    for separator in SEPARATORS:
        cells = [cell for cell in split_line(line, separator) if cell]
        if any(_is_plain_number(cell) for cell in cells) and all(kind(cell) in "NT" for cell in cells):
            return True
    return False


def _is_plain_number(cell: str) -> bool:
    """Return whether a cell is a number, and neither a time stamp nor an address such as 192.168.0.1."""
    return kind(cell) == "N" and (cell.count(".") < 2 or _grouped(cell))
