"""Lines of a table that pandas cannot read: rows with unusual notation, lines to be skipped, errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cdtool.columns import Categories
from cdtool.errors import RecordingError
from cdtool.findings import Finding, lines_of
from cdtool.formats.csv.cells import NULLS, STAMP_LIKE, has_numbers, has_open_quote, kind, number, split_line
from cdtool.formats.csv.dialect import Dialect, quoted
from cdtool.formats.csv.lines import begins_comment, is_ruler
from cdtool.formats.csv.row_arrays import EMPTY, LEFT, STAMP, Rows
from cdtool.formats.csv.stamps import MISSING_STAMP, Integers
from cdtool.plain_text import counted

# A survey reads a column of numbers with up to this many unreadable cells, or up to this share of the rows.
_FEW, _SHARE = 3, 0.05


@dataclass(frozen=True)
class IrregularLine:
    """A line of a block (from 0), the row that is reserved for it, and its bytes; `unfinished`: the file ends in it."""

    line: int
    row: int
    text: bytes
    unfinished: bool = False


@dataclass
class IrregularLines:
    """Reader of the lines that pandas cannot read.

    `targets` (width,) is the destination of each column, shared with `RowReader`: a column that is left out here is
    left out there, too. With `survey` an unreadable cell is a missing value and a loss, and a column with many
    unreadable cells is left out; without it an unreadable cell is an error.

    `unread` are the unreadable cells by column, with their lines. `dropped` are the reserved rows of a block that are
    not rows, with their lines. `left_out` are the columns that are not numeric, with the finding. `cut_line` is the
    incomplete last line (0: none); `ends_skipped`: the last line has no line end but is skipped. `blank` are blank
    lines, `empty` those of them that are rows, and `words` (row, line, text) may be the first line of a footer.
    `categories` are the columns whose texts are categories.
    """

    path: Path
    dialect: Dialect
    survey: bool
    targets: Integers
    dropped: dict[int, int] = field(default_factory=dict)
    left_out: dict[int, Finding] = field(default_factory=dict)
    unread: dict[int, list[tuple[int, str]]] = field(default_factory=dict)
    skipped: dict[str, list[int]] = field(default_factory=dict)
    cut_line: int = 0
    ends_skipped: bool = False
    blank: list[int] = field(default_factory=list)
    empty: list[int] = field(default_factory=list)
    words: tuple[int, int, str] | None = None
    categories: dict[int, Categories] = field(default_factory=dict)

    def read(self, irregular: IrregularLine, first_line: int, rows: Rows) -> None:
        """Read one line into `rows`; lines come in the file's order. `first_line` is the first line of its block."""
        line = first_line + irregular.line
        if self._is_skipped(irregular, line):
            self.ends_skipped = irregular.unfinished
            return
        if irregular.unfinished and line > self.dialect.first_line:
            self._drop(irregular, line)
            self.cut_line = line
        else:
            self._read_row(irregular, line, rows)

    def findings(self, last_line: int) -> list[Finding]:
        """Return the findings on skipped lines, one per kind; blank lines after the last row are not reported."""
        findings = list(self.left_out.values())
        findings += [self._unread(column) for column in self.unread if column not in self.left_out]
        if self.empty:
            findings.append(Finding("blank_rows", "", lines_of(self.empty)))
        blank = [line for line in self.blank if line < last_line]
        if blank and self.dialect.width == 1 and 2 * len(blank) < last_line - self.dialect.first_line:
            findings.append(Finding("blank_samples", "", lines_of(blank)))
        elif blank:
            findings.append(Finding("blank_lines", "", lines_of(blank)))
        for kind_of_lines, lines in self.skipped.items():
            findings.append(Finding(kind_of_lines, "", lines_of(lines)))
        return findings

    def _drop(self, irregular: IrregularLine, line: int, fact: str | None = None) -> None:
        self.dropped[irregular.row] = line
        if fact is not None:
            self.skipped.setdefault(fact, []).append(line)

    def _is_skipped(self, irregular: IrregularLine, line: int) -> bool:
        text = self.dialect.text.decode(irregular.text).rstrip("\r")
        if self._is_comment(text):
            self._drop(irregular, line, "comment_lines")
        elif text.strip() in {header.strip() for header in self.dialect.header_text}:
            self._drop(irregular, line, "header_lines")
        elif is_ruler(text):
            self._drop(irregular, line, "drawn_lines")
        elif b"\0" in irregular.text:
            self._drop(irregular, line, "nul_lines")
        else:
            return False
        return True

    def _is_comment(self, text: str) -> bool:
        """Return whether a line is a comment.

        In a table without comments a line of full width is a row, unless it is a commented row.
        """
        mark = self.dialect.comment
        if not begins_comment(text, mark):
            return False
        rest = text.lstrip()[len(mark) :]
        cells = split_line(rest, self.dialect.separator)
        return self.dialect.commented or len(cells) != self.dialect.width or rest[:1] == " " or kind(cells[0]) != "X"

    def _read_row(self, irregular: IrregularLine, line: int, rows: Rows) -> None:
        text = self.dialect.text.decode(irregular.text).rstrip("\r")
        if "\r" in text:
            raise RecordingError(
                f"{self.path}: line {line} contains a carriage return: line ends are mixed",
                "save the file again with one kind of line end",
            )
        cells = split_line(text, self.dialect.separator)
        other_width = len(cells) != self.dialect.width
        if text.count('"') % 2 and (other_width or has_open_quote(text, self.dialect.separator)):
            raise RecordingError(f"{self.path}: line {line} has a quote that is not closed", "write quotes in pairs")
        if self.dialect.may_end_after(len(cells)) and not irregular.unfinished:
            cells += [""] * (self.dialect.width - len(cells))
        if len(cells) != self.dialect.width or self.words is not None:
            self._skip_footer(irregular, line, cells, text)
            return
        for column, target in enumerate(self.targets.tolist()):
            if target != LEFT:
                self._read_cell(rows, irregular.row, line, column, cells[column])

    def _skip_footer(self, irregular: IrregularLine, line: int, cells: list[str], text: str) -> None:
        """Skip a line of words, which is a footer if only words follow; raise RecordingError for any other line."""
        if len(cells) == 1 and self.dialect.width > 1 and kind(cells[0]) == "X" and not has_numbers(text):
            self._drop(irregular, line, "words_below_rows")
            self.words = self.words or (irregular.row, line, text)
            return
        if self.words is not None:
            self._refuse_words(*self.words[1:])
        has = f"the header has {self.dialect.width}" if self.dialect.header else f"the first has {self.dialect.width}"
        raise RecordingError(
            f"{self.path}: line {line} has {counted(len(cells), 'cell')}, {has}",
            "repair or remove the line; the first row sets the width",
        )

    def end_block(self, rows: range) -> dict[int, int]:
        """Return the dropped rows of a block with their lines, and clear them.

        Raises RecordingError if a row follows words that would be a footer.
        """
        dropped, self.dropped = self.dropped, {}
        if self.words is not None:
            row, line, text = self.words
            if any(other > row and other not in dropped for other in reversed(rows)):
                self._refuse_words(line, text)
            self.words = -1, line, text
        return dropped

    def _refuse_words(self, line: int, text: str) -> None:
        raise RecordingError(
            f"{self.path}: line {line} has 1 cell, the header has {self.dialect.width}: "
            f"{text.strip()[:40]!r} between the rows",
            "repair or remove the line; pin comment in [csv] if such lines are comments",
        )

    def _read_cell(self, rows: Rows, row: int, line: int, column: int, cell: str) -> None:
        target = int(self.targets[column])
        if target == EMPTY:
            if cell:
                raise RecordingError(
                    f"{self.path}: line {line} has {counted(self.dialect.width, 'cell')}, the header has "
                    f"{self.dialect.width - 1}",
                    "the other rows end with a separator; repair the line",
                )
            return
        if target <= STAMP:
            stamp = MISSING_STAMP if cell in ("", *self.dialect.missing) else self._stamp(column, cell)
            if stamp is not None:
                rows.stamps[STAMP - target, row] = stamp
                return
        else:
            value = self.value(column, cell)
            if value is not None:
                rows.numbers[target, row] = value
                return
        if not self.survey:
            raise self._unreadable(line, column, target, cell)
        if target <= STAMP:
            rows.stamps[STAMP - target, row] = MISSING_STAMP
        else:
            rows.numbers[target, row] = math.nan
        unread = self.unread.setdefault(column, [])
        unread.append((line, cell))
        so_far = max(self.dialect.sampled, line - self.dialect.first_line)
        if len(unread) > max(_FEW, _SHARE * so_far):
            self.targets[column] = LEFT
            self.left_out[column] = self._left_out(unread[0][0], column, unread[0][1])

    def _unreadable(self, line: int, column: int, target: int, cell: str) -> RecordingError:
        """Return the error for an unreadable cell of a wanted column."""
        layouts = self.dialect.stamped.get(column)
        problem, hint = "is not a number", self._left_out(line, column, cell).words_for("advice[looks_like]")
        if layouts is not None and target <= STAMP:
            problem = f"is not a time with the layout {layouts.layouts[0].pattern}"
        elif layouts is not None and STAMP_LIKE.fullmatch(cell):
            problem, hint = "is a date or time, not a number", "only the channel time may be a date or time"
        elif STAMP_LIKE.fullmatch(cell):
            problem = "is not a number, nor a date or time with a known layout"
        where = f"line {line}, column '{self.dialect.names[column]}'"
        return RecordingError(f"{self.path}: {where}: {cell[:60]!r} {problem}", hint)

    def _left_out(self, line: int, column: int, cell: str) -> Finding:
        numbers = {"column": self.dialect.names[column], "line": line, "cell": cell}
        return Finding("not_numeric", "", {**numbers, "advice": _advice(self.dialect, cell)}, "warning")

    def _unread(self, column: int) -> Finding:
        cells = self.unread[column]
        first = cells[0][1]
        fact = {**lines_of([line for line, _ in cells]), "cell": first, "advice": _advice(self.dialect, first)}
        return Finding("unread_cells", self.dialect.names[column], fact)

    def _number(self, cell: str) -> float | None:
        if cell in self.dialect.missing:
            return float("nan")
        return number(cell, self.dialect.marks.decimal, self.dialect.marks.thousands)

    def value(self, column: int, cell: str) -> float | None:
        """Return a number, or the code of a text in a column of categories; NaN if missing, None if unreadable.

        There a text such as `None` is a category, unless it is pinned as a missing value: a kind of contact.
        """
        if column not in self.categories:
            return self._number(cell)
        value = None if cell in NULLS and cell not in self.dialect.pins.missing else self._number(cell)
        if value is None and cell != self.dialect.names[column].strip():
            return self.categories[column].code(cell)
        return value

    def _stamp(self, column: int, cell: str) -> int | None:
        return self.dialect.stamped[column].layouts[0].read(cell)


def not_numeric(name: str, line: int, cell: str) -> Finding:
    """Return the note on a column that a survey leaves out."""
    advice = {"looks_like": "time", "text": ""} if STAMP_LIKE.fullmatch(cell) else None
    return Finding("not_numeric", "", {"column": name, "line": line, "cell": cell, "advice": advice})


def _advice(dialect: Dialect, cell: str) -> dict[str, Any]:
    """Return the advice on a cell that cannot be read."""
    if STAMP_LIKE.fullmatch(cell):
        return {"looks_like": "time", "text": ""}
    if any(letter.isdigit() for letter in cell):
        return {"looks_like": "number", "text": dialect.details["decimal mark"]}
    return {"looks_like": "word", "text": quoted(cell[:40])}
