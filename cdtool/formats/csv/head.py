"""What stands above the rows: preamble, names, units; and in which line the rows begin."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.channels import TablePins
from cdtool.errors import RecordingError
from cdtool.formats.csv.cells import holds_numbers, kind, split_line
from cdtool.formats.csv.head_words import are_numbered, are_types, is_unit
from cdtool.formats.csv.lines import Line, is_ruler
from cdtool.plain_text import counted, shown_lines

_LOOKED_BELOW = 4
_SINGLE_CELL = 1
# A single line of numbers above the names may be a setting; so many are rows.
_ROWS_OF_A_TABLE = 2
# LabVIEW's measurement files name the units of Y in the preamble, below a word of their own instead of that of X.
_LABVIEW_UNITS = "Y_Unit_Label"


@dataclass(frozen=True)
class Head:
    """`names` (None: no header) in `header_line`, `units` in `units_line` (0: none), rows from line `first` on.

    `preamble` are the lines above the rows that are neither, comments apart; `numbers` those of them that hold numbers
    only; `from_comment`: a comment held the names.
    """

    names: tuple[str, ...] | None
    header_line: int
    units: tuple[str, ...]
    units_line: int
    first: Line
    preamble: tuple[int, ...]
    from_comment: bool = False
    numbers: tuple[int, ...] = ()


@dataclass(frozen=True)
class _Cut:
    line: Line
    cells: list[str]
    kinds: str


class HeadFinder:
    """Finds the head of one table, `width` cells wide, of which the columns `numeric` hold numbers or stamps."""

    def __init__(self, path: Path, separator: str, width: int, kinds: str, pins: TablePins) -> None:
        self.path = path
        self.separator = separator
        self.width = width
        self.kinds = kinds
        self.numeric = [i for i, letter in enumerate(kinds) if letter in "NT"]
        self.pins = pins

    def find(self, lines: Sequence[Line], comments: Sequence[Line]) -> Head:
        """The head; `lines` are those that are neither blank nor comments. Raises RecordingError."""
        cut: list[_Cut] = []
        empty: list[int] = []  # cells without anything in them, above the rows
        start = None
        for line in lines:
            if is_ruler(line.text):
                continue
            row = self._cut(line)
            if start is None and not any(row.cells):
                empty.append(line.number)
                continue
            cut.append(row)
            if start is None and self._is_row(cut[-1]):
                start = len(cut) - 1
            if start is not None and len(cut) > start + _LOOKED_BELOW and line.number > int(self.pins.header or 0):
                break
        if start is None:
            raise self._no_rows(cut)
        head = self._pinned(cut, start) if self.pins.header is not None else self._found(cut, start, comments)
        numbers = [row for row in cut if row.line.number in head.preamble and holds_numbers(row.line.text)]
        preamble = tuple(sorted((*head.preamble, *empty)))
        return replace(head, preamble=preamble, numbers=tuple(row.line.number for row in numbers))

    def _found(self, cut: Sequence[_Cut], start: int, comments: Sequence[Line]) -> Head:
        while start and self._is_damaged_row(cut, start - 1):
            start -= 1
        above = cut[:start]
        if not above:
            self._refuse_numbers_that_may_be_names(cut)
            return self._from_comments(cut, comments)
        units = next((row for row in above if row.line.number == self.pins.units), None)
        above = [row for row in above if row is not units]
        names = self._names(above[-1]) if above else None
        if names is None:
            if above:
                self._refuse_other_width(above, cut[start])
            return self._from_comments(cut[start:], comments, above)
        header, types = above[-1], None
        for upper_row in reversed(above[:-1]):  # units and types stand below the names, in either order
            is_types = are_types(header.cells)
            if types if is_types else units or not self._are_units(header):
                break
            upper = self._names(upper_row)
            if upper is None or ("N" in upper_row.kinds and not are_numbered(upper_row.cells)):
                break
            units, types = (units, header) if is_types else (header, types)
            header, names = upper_row, upper
        self._refuse_row_as_names(header, cut[start])
        return self._head(names, header, units or types, cut[start].line, above)

    def _head(self, names: list[str], header: _Cut, units: _Cut | None, first: Line, above: Sequence[_Cut]) -> Head:
        if units is None and self.pins.units is None:
            units = next((row for row in above if row.cells[0] == _LABVIEW_UNITS), None)
        told: Sequence[str] = () if units is None or are_types(units.cells) else units.cells
        if told and told[0] == _LABVIEW_UNITS:
            told = ("", *told[1:])
        line = 0 if units is None else units.line.number
        used = {header.line.number, line}
        preamble = tuple(row.line.number for row in above if row.line.number not in used)
        return Head(tuple(names), header.line.number, tuple(told), line, first, preamble)

    def _cut(self, line: Line) -> _Cut:
        cells = split_line(line.text, self.separator)
        return _Cut(line, cells, "".join(map(kind, cells)))

    def _is_row(self, row: _Cut) -> bool:
        """As wide as the table, with no word where numbers belong, and at least one number."""
        if len(row.cells) != self.width:
            return False
        kinds = [row.kinds[i] for i in self.numeric]
        return "X" not in kinds and ("N" in kinds or "T" in kinds)

    def _is_damaged_row(self, cut: Sequence[_Cut], at: int) -> bool:
        """Numbers with a word among them, below a line of words: a row, to be told with its line."""
        row = cut[at]
        if len(row.cells) == 1 and self.width > 1:
            return False
        mixed = [row.kinds[i] for i in self.numeric if i < len(row.cells)]
        if not ("N" in mixed or "T" in mixed) or self._are_units(row):
            return False
        wide = len(row.cells) == self.width
        if wide and at == 0:
            return False
        return any(self._names(other) is not None and "N" not in other.kinds for other in cut[:at])

    def _names(self, row: _Cut) -> list[str] | None:
        """The cells as names of the columns, or None if there are not as many."""
        cells = row.cells
        if len(cells) == self.width:
            return cells
        last_is_empty = self.kinds[-1] == "M"
        if len(cells) == self.width + 1 and cells[-1].lower() in ("", "comment"):
            return cells[:-1]
        if len(cells) == self.width - 1 and last_is_empty and len(cells) >= 1:
            return [*cells, ""]
        if self.separator == " ":
            apart = [cell for cell in re.split(r"\s{2,}|\t", row.line.text.lstrip("#% ")) if cell]
            return apart if len(apart) == self.width else None
        return None

    def _are_units(self, row: _Cut) -> bool:
        cells = [row.cells[i] for i in self.numeric if i < len(row.cells) and row.cells[i]]
        known = sum(is_unit(cell) for cell in cells)
        if any(kind(cell) in "NT" and cell != "1" for cell in cells):
            return False
        return bool(cells) and len(row.cells) in (self.width, self.width - 1) and 2 * known >= len(cells) and known > 0

    def _from_comments(self, cut: Sequence[_Cut], comments: Sequence[Line], above: Sequence[_Cut] = ()) -> Head:
        """Without a header, names may stand in the last comment above the rows: `# t a b`, `%time,field.data`."""
        preamble = tuple(row.line.number for row in above)
        first = next(row for row in cut if self._is_row(row))
        over = [line for line in comments if line.number < first.line.number][-2:]
        rows = [self._cut(Line(line.number, line.text.lstrip().lstrip("#%/ \t"), line.start)) for line in over]
        fitting = [row for row in rows if self._names(row) is not None and "X" in row.kinds and "N" not in row.kinds]
        if not fitting or above:
            return Head(None, 0, (), 0, first.line, preamble)
        header, units = fitting[-1], None
        if len(fitting) == 2 and self._are_units(fitting[-1]):
            header, units = fitting
        told = tuple(units.cells) if units else ()
        names = self._names(header) or []
        line = units.line.number if units else 0
        return Head(tuple(names), header.line.number, told, line, first.line, preamble, from_comment=True)

    def _pinned(self, cut: Sequence[_Cut], start: int) -> Head:
        number = self.pins.header
        if number is False:
            odd = next((row for row in cut[:start] if len(row.cells) == self.width), None)
            if odd is not None:
                raise RecordingError(
                    f"{self.path}: line {odd.line.number} holds no numbers ({odd.line.text[:40]!r}), "
                    "[csv] header is false",
                    "give the line of the header, or skip_lines",
                )
            preamble = tuple(row.line.number for row in cut[:start])
            return Head(None, 0, (), 0, cut[start].line, preamble)
        header = next((row for row in cut if row.line.number == number), None)
        names = self._names(header) if header else None
        if header is None or names is None:
            width = (
                f"has {counted(len(header.cells), 'cell')}, the rows have {self.width}" if header else "holds no cells"
            )
            raise RecordingError(
                f"{self.path}: line {number}, [csv] header, {width}", "correct or remove header in [csv]"
            )
        below = [i for i, row in enumerate(cut) if row.line.number > header.line.number]
        units = next((cut[i] for i in below if cut[i].line.number == self.pins.units), None)
        types = [i for i in below[:2] if are_types(cut[i].cells)]
        plain = [i for i in below if i not in types]
        if self.pins.units is None and plain and self._are_units(cut[plain[0]]) and not self._is_row(cut[plain[0]]):
            units = cut[plain[0]]
        rows = [i for i in plain if units is None or cut[i].line.number > units.line.number]
        if not rows:
            raise self._no_rows(cut)
        above = [row for row in cut if row.line.number < cut[rows[0]].line.number]
        return self._head(names, header, units, cut[rows[0]].line, above)

    def _no_rows(self, cut: Sequence[_Cut]) -> RecordingError:
        if len(cut) == 1:
            return RecordingError(
                f"{self.path}: holds a header in line {cut[0].line.number} and no row of numbers",
                "was the recording stopped at once?",
            )
        shown = f": line {cut[1].line.number} is {cut[1].line.text[:60]!r}" if cut else ""
        return RecordingError(
            f"{self.path}: holds no row of numbers{shown}",
            "a table with a header line (or none) and rows of numbers is needed",
        )

    def _refuse_other_width(self, above: Sequence[_Cut], first: _Cut) -> None:
        last = above[-1]
        if len(last.cells) <= _SINGLE_CELL or last.line.number + 1 != first.line.number:
            return
        hint = "pin header = false if it is no header, or skip_lines, in [csv]"
        if self.separator == " ":
            hint = "names with blanks need quotes or two blanks between them; or pin header = false in [csv]"
        raise RecordingError(
            f"{self.path}: line {last.line.number} has {counted(len(last.cells), 'name')} or words, "
            f"line {first.line.number} has {counted(self.width, 'cell')}",
            hint,
        )

    def _refuse_row_as_names(self, header: _Cut, first: _Cut) -> None:
        """Names that are numbers: channel numbers in a row are names; others may be a row with a word in it."""
        if "N" not in [header.kinds[i] for i in self.numeric if i < len(header.kinds)] or are_numbered(header.cells):
            return
        number = header.line.number
        raise RecordingError(
            f"{self.path}: line {number} ({header.line.text[:40]!r}) may hold names, or be a row with a word in it",
            f"pin header = {number} or header = false in [csv]; the first sure row is line {first.line.number}",
        )

    def _refuse_numbers_that_may_be_names(self, cut: Sequence[_Cut]) -> None:
        counted = [str(i) for i in range(self.width)]
        below = [cell for row in cut[1:4] for cell in row.cells]
        points = sum("." in cell or "," in cell for cell in below)
        if self.width > 2 and cut[0].cells == counted and 2 * points > len(below):
            raise RecordingError(
                f"{self.path}: line {cut[0].line.number} ({','.join(counted)[:40]}) may number the columns or be a row",
                "pin header = 1 or header = false in [csv]",
            )


def refuse_table_above(path: Path, head: Head, width: int) -> None:
    """Raise RecordingError where rows of another table stand above this one: they would be lost."""
    if len(head.numbers) < _ROWS_OF_A_TABLE:
        return
    below = f"the header in line {head.header_line}" if head.names else f"line {head.first.number}"
    raise RecordingError(
        f"{path}: {shown_lines(head.numbers)} above {below} hold numbers, but not those of its {width} columns: "
        "several tables in one file?",
        f"split the file, or skip the upper table: skip_lines = {head.numbers[-1]} in [csv]",
    )
