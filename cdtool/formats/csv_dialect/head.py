"""Find the head of a table (preamble, names, units) and the line of its first row."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from cdtool.base.errors import RecordingError
from cdtool.base.plain_text import counted, shown_lines
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv.cells import has_numbers, kind
from cdtool.formats.csv.lines import Line, SplitLine, is_ruler
from cdtool.formats.csv_dialect.head_words import are_numbered, are_types, is_unit
from cdtool.recordings.units import find_unit

# R's write.table writes the number of each row in quotes.
_ROW_OF_R = re.compile(r'"1"[^"]+')


@dataclass(frozen=True, kw_only=True)
class Head:
    """The head of a table: its names (`header`; None: no header) in `header_line`, `units` in `units_line` (0: none).

    Rows start in line `first_line` (from 1), at byte `offset`. `preamble` are the other lines above the rows, except
    comments; `numbers` are those of them that have only numbers. `from_comment`: the names are in a comment.
    """

    first_line: int
    offset: int
    header: tuple[str, ...] | None = None
    header_line: int = 0
    units: tuple[str, ...] = ()
    units_line: int = 0
    preamble: tuple[int, ...] = ()
    from_comment: bool = False
    numbers: tuple[int, ...] = ()


class HeadFinder:
    """Finds the head of a table with rows of `width` cells; `kinds` has one letter per column (see `Dialect`)."""

    def __init__(self, separator: str, width: int, kinds: str, pins: TablePins) -> None:
        self.separator = separator
        self.width = width
        self.kinds = kinds
        self.numeric = [i for i, letter in enumerate(kinds) if letter in "NT"]
        self.pins = pins

    def find(self, lines: Sequence[SplitLine], comments: Sequence[Line]) -> Head:
        """Return the head; `lines` are all lines except blank lines and comments. Raises RecordingError."""
        lines = [line for line in lines if not is_ruler(line.text)]
        first = next((line.number for line in lines if self._is_row(line)), None)
        empty = [line.number for line in lines if not any(line.cells) and (first is None or line.number < first)]
        rows = [line for line in lines if line.number not in empty]
        if first is None:
            raise self._no_rows(rows)
        start = next(i for i, row in enumerate(rows) if row.number == first)
        pinned = sum(row.number <= int(self.pins.header or 0) for row in rows)
        cut = rows[: max(start + 4, pinned) + 1]  # as far below as a head reaches
        head = self._search(cut, start, comments) if self.pins.header is None else self._find_by_pins(cut, start)
        numbers = [row.number for row in cut if row.number in head.preamble and has_numbers(row.text)]
        return replace(head, preamble=tuple(sorted((*head.preamble, *empty))), numbers=tuple(numbers))

    def _search(self, cut: Sequence[SplitLine], start: int, comments: Sequence[Line]) -> Head:
        while start and self._is_damaged_row(cut, start - 1):
            start -= 1
        above = cut[:start]
        if not above:
            self._refuse_numbers_that_may_be_names(cut)
            return self._find_in_comments(cut, comments)
        units = next((row for row in above if row.number == self.pins.units), None)
        above = [row for row in above if row is not units]
        names = self._names(above[-1]) if above else None
        if above and len(above[-1].cells) == self.width - 1 and _ROW_OF_R.fullmatch(cut[start].text):
            raise RecordingError(
                f"line {above[-1].number} names all columns but the first, as R does",
                "write.table(..., col.names = NA) names that, too",
            )
        if names is None:
            if above:
                self._refuse_other_width(above, cut[start])
            return self._find_in_comments(cut[start:], comments, above)
        header, types = above[-1], None
        for upper_row in reversed(above[:-1]):  # units and types may be below the names, in either order
            is_types = are_types(header.cells)
            if types if is_types else units or not self._are_units(header):
                break
            upper = self._names(upper_row)
            if upper is None or ("N" in upper_row.kinds and not are_numbered(upper_row.cells)):
                break
            units, types = (units, header) if is_types else (header, types)
            header, names = upper_row, upper
        self._refuse_row_as_names(header, cut[start])
        units = units or types or self._units_in_comment(header, comments)
        if units is None and self.pins.units is None:
            units = self._units_above(
                names, header, [*(SplitLine.of(line, self.separator) for line in comments), *above]
            )
        return self._make_head(cut[start], above, names, header, units)

    def _uncommented(self, comments: Sequence[Line], below: Line) -> list[SplitLine]:
        """Return the comments above a line without their marks, as cells."""
        texts = [(line, line.text.lstrip().lstrip("#%/ \t")) for line in comments if line.number < below.number]
        return [SplitLine.of(replace(line, text=text), self.separator) for line, text in texts]

    def _units_in_comment(self, header: Line, comments: Sequence[Line]) -> SplitLine | None:
        """Return the comment directly above the names if it has their units: `# s,mm,mm/s`."""
        rows = self._uncommented(comments, header)[-1:] if self.pins.units is None else []
        width = (self.width, self.width - 1) if self.kinds[-1] == "M" else (self.width,)
        fitting = [row for row in rows if row.number == header.number - 1 and len(row.cells) in width]
        return next((row for row in fitting if self._are_units(row)), None)

    def _units_above(self, names: Sequence[str], header: SplitLine, above: Sequence[SplitLine]) -> SplitLine | None:
        """Return the row of units above the names; or, of a clock and one channel, that of a line `Einheit: kN`."""
        stated = re.compile(rf"\W*(?:einheit|unit|{re.escape(names[-1])})\b.*[\W_](\w+)\W*", re.IGNORECASE)
        for row in above:
            if row is not header and self._are_units(row) and all(map(is_unit, row.cells)):
                return row
            found = stated.fullmatch(row.text) if self.width == 2 else None
            if found and (unit := find_unit(found[1])) and unit.si != "s":
                return SplitLine(row.number, row.text, row.start, ["", found[1]])
        return None

    def _make_head(
        self,
        first: Line,
        above: Sequence[SplitLine],
        names: Sequence[str] | None = None,
        header: SplitLine | None = None,
        units: SplitLine | None = None,
    ) -> Head:
        texts: Sequence[str] = () if units is None or are_types(units.cells) else units.cells
        used = [row.number if row is not None else 0 for row in (header, units)]
        return Head(
            first_line=first.number,
            offset=first.start,
            header=None if names is None else tuple(names),
            header_line=used[0],
            units=tuple(texts),
            units_line=used[1],
            preamble=tuple(row.number for row in above if row.number not in used),
        )

    def _is_row(self, row: SplitLine) -> bool:
        """Return whether a line is as wide as the table, with numbers and without words in columns of numbers."""
        if len(row.cells) != self.width:
            return False
        kinds = [row.kinds[i] for i in self.numeric]
        return "X" not in kinds and ("N" in kinds or "T" in kinds)

    def _is_damaged_row(self, cut: Sequence[SplitLine], at: int) -> bool:
        """Return whether a line is a row with a word in a column of numbers; the error of reading it names the line."""
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

    def _names(self, row: SplitLine) -> list[str] | None:
        """Return the cells as names of the columns; None if their number does not match."""
        cells = row.cells
        if len(cells) == self.width:
            return cells
        last_is_empty = self.kinds[-1] == "M"
        if len(cells) == self.width + 1 and cells[-1].lower() in ("", "comment"):
            return cells[:-1]
        if len(cells) == self.width - 1 and last_is_empty and len(cells) >= 1:
            return [*cells, ""]
        if self.separator == " ":
            names = [cell for cell in re.split(r"\s{2,}|\t", row.text.lstrip("#% ")) if cell]
            return names if len(names) == self.width else None
        return None

    def _are_units(self, row: SplitLine) -> bool:
        cells = [row.cells[i] for i in self.numeric if i < len(row.cells) and row.cells[i]]
        known = sum(is_unit(cell) for cell in cells)
        if any(kind(cell) in "NT" and cell != "1" for cell in cells):
            return False
        return bool(cells) and len(row.cells) in (self.width, self.width - 1) and 2 * known >= len(cells) and known > 0

    def _find_in_comments(
        self, cut: Sequence[SplitLine], comments: Sequence[Line], above: Sequence[SplitLine] = ()
    ) -> Head:
        """Return the head of a table without header, with the names of a comment above the rows: `# t a b`."""
        first = next(row for row in cut if self._is_row(row))
        rows = self._uncommented(comments, first)[-2:]
        fitting = [row for row in rows if self._names(row) is not None and "X" in row.kinds and "N" not in row.kinds]
        if not fitting or above:
            return self._make_head(first, above)
        units = fitting.pop() if len(fitting) == 2 and self._are_units(fitting[-1]) else None
        header = fitting[-1]
        return replace(self._make_head(first, (), self._names(header), header, units), from_comment=True)

    def _find_by_pins(self, cut: Sequence[SplitLine], start: int) -> Head:
        number = self.pins.header
        if number is False:
            words = next((row for row in cut[:start] if len(row.cells) == self.width), None)
            if words is not None:
                raise RecordingError(
                    f"line {words.number} has no numbers ({words.text[:40]!r}), but [csv] header is false",
                    "set header to the line of the names, or use skip_lines",
                )
            return self._make_head(cut[start], cut[:start])
        header = next((row for row in cut if row.number == number), None)
        names = self._names(header) if header else None
        if header is None or names is None:
            width = (
                f"has {counted(len(header.cells), 'cell')}, the rows have {self.width}" if header else "has no cells"
            )
            raise RecordingError(f"line {number}, the header, {width}", "repair the line, or correct header in [csv]")
        below = [i for i, row in enumerate(cut) if row.number > header.number]
        units = next((cut[i] for i in below if cut[i].number == self.pins.units), None)
        types = [i for i in below[:2] if are_types(cut[i].cells)]
        plain = [i for i in below if i not in types]
        if self.pins.units is None and plain and self._are_units(cut[plain[0]]) and not self._is_row(cut[plain[0]]):
            units = cut[plain[0]]
        rows = [i for i in plain if units is None or cut[i].number > units.number]
        if not rows:
            raise self._no_rows(cut)
        above = [row for row in cut if row.number < cut[rows[0]].number]
        return self._make_head(cut[rows[0]], above, names, header, units)

    def _no_rows(self, cut: Sequence[SplitLine]) -> RecordingError:
        if len(cut) == 1:
            return RecordingError(
                f"contains a header in line {cut[0].number} and no row of numbers",
                "was the recording stopped immediately?",
            )
        shown = f": line {cut[1].number} is {cut[1].text[:60]!r}" if cut else ""
        return RecordingError(
            f"contains no row of numbers{shown}", "a table with a header line (or none) and rows of numbers is needed"
        )

    def _refuse_other_width(self, above: Sequence[SplitLine], first: SplitLine) -> None:
        last = above[-1]
        if len(last.cells) <= 1 or last.number + 1 != first.number:
            return
        hint = "pin header = false if it is not a header, or skip_lines, in [csv]"
        if self.separator == " ":
            hint = "write names with blanks in quotes or separate them by two blanks; or pin header = false in [csv]"
        raise RecordingError(
            f"line {last.number} has {counted(len(last.cells), 'name')} or words, "
            f"line {first.number} has {counted(self.width, 'cell')}",
            hint,
        )

    def _refuse_row_as_names(self, header: SplitLine, first: SplitLine) -> None:
        """Raise RecordingError if names are numbers but not consecutive channel numbers: they may be a damaged row."""
        if "N" not in [header.kinds[i] for i in self.numeric if i < len(header.kinds)] or are_numbered(header.cells):
            return
        number = header.number
        raise RecordingError(
            f"line {number} ({header.text[:40]!r}) may be the names, or a row with a word in it",
            f"pin header = {number} or header = false in [csv]; the first unambiguous row is line {first.number}",
        )

    def _refuse_numbers_that_may_be_names(self, cut: Sequence[SplitLine]) -> None:
        numbered = [str(i) for i in range(self.width)]
        below = [cell for row in cut[1:4] for cell in row.cells]
        points = sum("." in cell or "," in cell for cell in below)
        if self.width > 2 and cut[0].cells == numbered and 2 * points > len(below):
            raise RecordingError(
                f"line {cut[0].number} ({','.join(numbered)[:40]}) may number the columns or be a row",
                "pin header = 1 or header = false in [csv]",
            )


def refuse_table_above(head: Head, width: int) -> None:
    """Raise RecordingError if rows of another table are above this one: they would be lost."""
    # A single line of numbers above the names may be a setting; two lines are rows of another table.
    if len(head.numbers) < 2:
        return
    below = f"the header in line {head.header_line}" if head.header else f"line {head.first_line}"
    raise RecordingError(
        f"{shown_lines(head.numbers)} above {below} have numbers, but not in {width} columns: "
        "does the file contain several tables?",
        f"split the file, or skip the upper table: skip_lines = {head.numbers[-1]} in [csv]",
    )
