"""Determine decimal mark and thousands separator from all numbers of the sample.

`1,5`, `0,250` and `1234,567` can only have a decimal comma; `1.234,5` shows both marks, `1,234,567` the groups. `1,234`
without other evidence is ambiguous and refused, and so is `1.234` among whole numbers (ambiguous_marks.py).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from cdtool.base.errors import RecordingError
from cdtool.formats.csv.cells import MINUS_SIGN

_DIGITS = re.compile(r"[0-9.,'\u00a0\u202f ]*")
_GROUPS = re.compile(r"[1-9][0-9]{0,2}(?P<mark>[.,'\u00a0\u202f ])[0-9]{3}(?:(?P=mark)[0-9]{3})*")


@dataclass(frozen=True)
class SampleCell:
    """The text of a cell, and its line."""

    text: str
    line: int

    def __str__(self) -> str:
        return f"'{self.text}' (line {self.line})"


@dataclass(frozen=True)
class Marks:
    """The decimal mark, and the thousands separator ("" for none).

    `sure` is False if no number has a decimal mark; then a point is assumed.
    """

    decimal: str
    thousands: str = ""
    sure: bool = True


class _Evidence:
    """For each mark the first cell in which it is a decimal mark, a thousands separator, or either of them."""

    def __init__(self) -> None:
        self.decimal: dict[str, SampleCell] = {}
        self.thousands: dict[str, SampleCell] = {}
        self.either: dict[str, SampleCell] = {}
        self.blank_groups = 0

    def add(self, text: str, line: int) -> None:
        bare = text.lstrip("+-" + MINUS_SIGN)
        digits = _DIGITS.match(bare)
        body = digits[0] if digits else ""
        rest = bare[len(body) :]
        marks = [letter for letter in body if not letter.isdigit()]
        if not marks or (rest and rest[0] not in "eE"):
            return
        cell = SampleCell(text, line)
        last = marks[-1]
        if len(set(marks)) > 1:
            whole, _, _ = body.rpartition(last)
            if last in ".," and marks.count(last) == 1 and _GROUPS.fullmatch(whole):
                self.decimal.setdefault(last, cell)
                self._grouped(marks[0], cell)
            return
        if not _GROUPS.fullmatch(body):
            if len(marks) == 1 and last in ".,":
                self.decimal.setdefault(last, cell)
            return
        if last not in ".," or (len(marks) > 1 and not rest):
            self._grouped(last, cell)
        elif rest:
            self.decimal.setdefault(last, cell)
        else:
            self.either.setdefault(last, cell)

    def _grouped(self, mark: str, cell: SampleCell) -> None:
        self.blank_groups += mark == " "
        self.thousands.setdefault(mark, cell)


def find_marks(
    cells: Iterable[tuple[str, int]], separator: str, decimal: str = "", thousands: str | None = None
) -> Marks:
    """Return the marks of (cell, line) pairs; `decimal` and `thousands` are pinned marks.

    Raises RecordingError if the cells can be read in two ways.
    """
    evidence = _Evidence()
    for text, line in cells:
        evidence.add(text, line)
    # A single cell with a blank may be two cells without a separator.
    if evidence.blank_groups < 2 or separator == " ":
        evidence.thousands.pop(" ", None)
    mark = decimal or {",": ".", ".": ","}.get(thousands or "") or _decimal(evidence)
    if thousands is not None:
        return Marks(mark, thousands)
    other = "." if mark == "," else ","
    # Numbers in quotes, in a table separated by commas, usually have a comma as thousands separator.
    assumed = evidence.either.get(other) if decimal or (separator == "," and mark == ".") else None
    groups = {group: cell for group, cell in evidence.thousands.items() if group != mark}
    if assumed and other not in groups:
        groups[other] = assumed
    ambiguous = evidence.either.get(other)
    if ambiguous and other not in groups:
        sure = evidence.decimal.get(mark)
        raise RecordingError(
            f"{ambiguous} next to {sure}: '{other}' may separate thousands, or be a decimal mark, too",
            "pin decimal and thousands in [csv] of the machine file",
        )
    if len(groups) > 1:
        shown = " and ".join(str(cell) for cell in groups.values())
        raise RecordingError(f"two thousands separators: {shown}", "pin thousands in [csv]")
    group_mark = next(iter(groups), "")
    return Marks(mark, group_mark, sure=bool(decimal or evidence.decimal or groups))


def _decimal(evidence: _Evidence) -> str:
    comma, point = evidence.decimal.get(","), evidence.decimal.get(".")
    if comma and point:
        raise RecordingError(
            f"{comma} has a decimal comma, {point} a decimal point",
            "pin decimal in [csv], and repair the lines with the other mark",
        )
    if comma or point:
        return "," if comma else "."
    if "," in evidence.thousands and "." in evidence.thousands:
        raise RecordingError(
            f"two thousands separators: {evidence.thousands[',']} and {evidence.thousands['.']}",
            "pin thousands in [csv]",
        )
    if "." in evidence.thousands:
        return ","
    if "," in evidence.thousands:
        return "."
    ambiguous = evidence.either.get(",")
    if ambiguous and "." in evidence.either:
        raise RecordingError(
            f"{ambiguous} and {evidence.either['.']}: which is the decimal mark?", "pin decimal in [csv]"
        )
    if ambiguous:
        text = ambiguous.text
        raise RecordingError(
            f"line {ambiguous.line}: '{text}' may be {text.replace(',', '.')} (decimal comma) or "
            f"{text.replace(',', '')} (thousands)",
            'pin decimal = "," or thousands = "," in [csv] of the machine file',
        )
    return "."
