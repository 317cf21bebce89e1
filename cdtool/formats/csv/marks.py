"""Decimal mark and thousands separator, by the evidence of every number of the sample.

`1,5`, `0,250` and `1234,567` can only have a decimal comma; `1.234,5` and `1,234,567` show both marks or the groups.
`1,234` alone says nothing, and is refused; so is `1.234` among whole numbers (ambiguous_marks.py).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cdtool.errors import RecordingError
from cdtool.formats.csv.cells import MINUS_SIGN, NARROW_BLANKS

_DIGITS = re.compile(r"[0-9.,'\u00a0\u202f ]*")
_GROUPS = re.compile(r"[1-9][0-9]{0,2}(?P<mark>[.,'\u00a0\u202f ])[0-9]{3}(?:(?P=mark)[0-9]{3})*")


@dataclass(frozen=True)
class Seen:
    """A cell that is evidence, and its line."""

    text: str
    line: int

    def __str__(self) -> str:
        return f"'{self.text}' (line {self.line})"


@dataclass(frozen=True)
class Marks:
    """The decimal mark, the thousands separator ("" for none), and the number that might be read otherwise.

    Not `sure`: no number showed a decimal mark, and a point is taken for one.
    """

    decimal: str
    thousands: str = ""
    doubt: Seen | None = None
    sure: bool = True


class _Evidence:
    """The first cell for each reading, and those that fit two."""

    def __init__(self) -> None:
        self.decimal: dict[str, Seen] = {}
        self.thousands: dict[str, Seen] = {}
        self.either: dict[str, Seen] = {}
        self.blank_groups = 0

    def take(self, text: str, line: int) -> None:
        bare = text.lstrip("+-" + MINUS_SIGN)
        digits = _DIGITS.match(bare)
        body = digits[0] if digits else ""
        rest = bare[len(body) :]
        marks = [letter for letter in body if not letter.isdigit()]
        if not marks or (rest and rest[0] not in "eE"):
            return
        seen = Seen(text, line)
        last = marks[-1]
        if len(set(marks)) > 1:
            whole, _, _ = body.rpartition(last)
            if last in ".," and marks.count(last) == 1 and _GROUPS.fullmatch(whole):
                self.decimal.setdefault(last, seen)
                self._grouped(marks[0], seen)
            return
        if not _GROUPS.fullmatch(body):
            if len(marks) == 1 and last in ".,":
                self.decimal.setdefault(last, seen)
            return
        if last not in ".," or (len(marks) > 1 and not rest):
            self._grouped(last, seen)
        elif rest:
            self.decimal.setdefault(last, seen)
        else:
            self.either.setdefault(last, seen)

    def _grouped(self, mark: str, seen: Seen) -> None:
        self.blank_groups += mark == " "
        self.thousands.setdefault(mark, seen)


def find_marks(
    path: Path, cells: Iterable[tuple[str, int]], separator: str, decimal: str = "", thousands: str | None = None
) -> Marks:
    """The marks of (cell, line) pairs; `decimal` and `thousands` are pinned ones. Raises RecordingError if two fit."""
    evidence = _Evidence()
    for text, line in cells:
        evidence.take(text, line)
    # One cell with a blank in it may be two cells that ran together.
    if evidence.blank_groups < 2 or separator == " ":
        evidence.thousands.pop(" ", None)
    found = decimal or {",": ".", ".": ","}.get(thousands or "") or _decimal(path, evidence)
    if thousands is not None:
        return Marks(found, thousands)
    other = "." if found == "," else ","
    # A comma that is between thousands beside decimal points is usual where commas part the cells, in quotes.
    believed = evidence.either.get(other) if decimal or (separator == "," and found == ".") else None
    groups = {mark: seen for mark, seen in evidence.thousands.items() if mark != found}
    if believed and other not in groups:
        groups[other] = believed
    doubtful = evidence.either.get(other)
    if doubtful and other not in groups:
        sure = evidence.decimal.get(found)
        raise RecordingError(
            f"{path}: {doubtful} beside {sure}: the '{other}' parts thousands, or is a decimal mark too",
            "pin decimal and thousands in [csv] of the machine file",
        )
    if len(groups) > 1:
        shown = " and ".join(str(seen) for seen in groups.values())
        raise RecordingError(f"{path}: thousands are parted in two ways: {shown}", "pin thousands in [csv]")
    parted = next(iter(groups), "")
    alone = evidence.either.get(found)
    certain = bool(decimal or evidence.decimal or groups)
    is_doubtful = separator != "," and found == "." and not certain
    return Marks(found, parted, alone if is_doubtful else None, certain)


def _decimal(path: Path, evidence: _Evidence) -> str:
    comma, point = evidence.decimal.get(","), evidence.decimal.get(".")
    if comma and point:
        raise RecordingError(
            f"{path}: {comma} has a decimal comma, {point} a decimal point",
            "pin decimal in [csv], and repair the lines that hold the other",
        )
    if comma or point:
        return "," if comma else "."
    if "," in evidence.thousands and "." in evidence.thousands:
        raise RecordingError(
            f"{path}: thousands are parted in two ways: {evidence.thousands[',']} and {evidence.thousands['.']}",
            "pin thousands in [csv]",
        )
    if "." in evidence.thousands:
        return ","
    if "," in evidence.thousands:
        return "."
    doubtful = evidence.either.get(",")
    if doubtful and "." in evidence.either:
        raise RecordingError(
            f"{path}: {doubtful} and {evidence.either['.']}: which is the decimal mark?", "pin decimal in [csv]"
        )
    if doubtful:
        text = doubtful.text
        raise RecordingError(
            f"{path}: line {doubtful.line}: '{text}' is {text.replace(',', '.')} (decimal comma) or "
            f"{text.replace(',', '')} (thousands)",
            'pin decimal = "," or thousands = "," in [csv] of the machine file',
        )
    return "."


def thousands_byte(mark: str) -> int:
    """The byte that stands for a thousands separator in the stream; -1 for none.

    A blank that does not break is more than one byte, or none of ASCII: it becomes an apostrophe before it is read.
    """
    return -1 if not mark else ord("'") if mark in NARROW_BLANKS else ord(mark)
