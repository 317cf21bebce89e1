"""A line's cells, and what one cell is: a number, a stamp of time, a missing value, or words."""

from __future__ import annotations

import csv
import math
import re

SEPARATORS = {"\t": "tab", ";": "semicolon", "|": "pipe", ",": "comma", " ": "blanks"}
MISSING = ("", "nan", "NaN", "NAN")
MINUS_SIGN = "\u2212"
# Blanks that do not break a line: what French and Swiss tables set between thousands.
NARROW_BLANKS = ("\u00a0", "\u202f")

_TAIL = r"(?:[eE][+-]?[0-9]+)?"
_WORDS = re.compile(r"[+-]?(?:nan|inf|infinity|true|false)", re.IGNORECASE)
_PLAIN = {
    mark: re.compile(rf"[+-]?(?:[0-9]+(?:{re.escape(mark)}[0-9]*)?|{re.escape(mark)}[0-9]+){_TAIL}") for mark in ".,"
}
# As the run-time library of Microsoft's C writes what is no number: 1.#QNAN, -1.#IND, 1.#INF.
_MICROSOFT = re.compile(r"[+-]?1[.,]#(?P<kind>QNAN|SNAN|IND|INF)[0-9]*|[+-]?nan\((?:ind|snan)\)", re.IGNORECASE)
_QUICK = re.compile(r"-?[0-9]+(?:[.,][0-9]+)?")
_NUMBER_LIKE = re.compile(
    rf"[+-]?(?:[0-9]+(?:[.,'\u00a0\u202f][0-9]+)*[.,]?|[.,][0-9]+|[0-9]{{1,3}}(?: [0-9]{{3}})+(?:[.,][0-9]+)?){_TAIL}"
)
STAMP_LIKE = re.compile(
    r"[0-9]{1,4}[-/.](?:[0-9]{1,2}|[A-Za-z]{3})[-/.][0-9]{1,4}(?:[T _].*)?|[0-9]{8}[T ][0-9].*"
    r"|[0-9]{1,2}:[0-9]{2}(?::[0-9]{2})?(?:[.,:][0-9]+)?(?: ?[AaPp][Mm])?"
)


def split_line(line: str, separator: str) -> list[str]:
    """Cells without their outer blanks and quotes."""
    if separator == " " and '"' not in line:
        return _words(line)
    if '"' not in line:
        return [cell.strip(" \t\r\n") for cell in line.split(separator)]
    if separator == " ":
        line = " ".join(_words(line))
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error:  # stray quotes: told with their line when the rows are read
        cells = line.split(separator)
    return [cell.strip(" \t\r\n") for cell in cells]


def _words(line: str) -> list[str]:
    """A line cut at its blanks and tabs: a blank that does not break is within a number."""
    return [word for word in line.strip(" \t\r\n").replace("\t", " ").split(" ") if word]


def kind(cell: str) -> str:
    """N a number in any notation or said to be none (nan), T a stamp, M nothing, X words."""
    if _QUICK.fullmatch(cell):
        return "N"
    if not cell:
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
    """The value of a cell as Python's float() has it, NaN for a missing one, or None if it is no number."""
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


def holds_numbers(line: str) -> bool:
    """True for a line of numbers, stamps beside them or not, whichever mark separates them: words hold no sample."""
    for separator in SEPARATORS:
        cells = [cell for cell in split_line(line, separator) if cell]
        if any(_is_plain_number(cell) for cell in cells) and all(kind(cell) in "NT" for cell in cells):
            return True
    return False


def _is_plain_number(cell: str) -> bool:
    """A number, and neither a stamp nor an address such as 192.168.0.1."""
    return kind(cell) == "N" and (cell.count(".") < 2 or _grouped(cell))
