"""Lines of a table that are not plain: rows written in an unusual way, lines to skip and name, errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.tables import (
    BlankLines,
    BlankRows,
    BlankSamples,
    CellAdvice,
    CommentLines,
    DrawnLines,
    HeaderLines,
    NotNumeric,
    NulLines,
    SkippedLines,
    UnreadCells,
    WordsBelowRows,
)
from cdtool.formats.csv.cells import STAMP_LIKE, holds_numbers, kind, number, split_line
from cdtool.formats.csv.dialect import Dialect, quoted
from cdtool.formats.csv.lines import begins_comment, is_ruler
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_kernel import EMPTY, LEFT, MISSING_STAMP, STAMP, Integers
from cdtool.plain_text import counted

# A survey keeps a column of numbers with so many cells that are none, or with this share of the rows.
_FEW, _SHARE = 3, 0.05


@dataclass(frozen=True)
class OddLine:
    """A line of a block (from 0), the row that is kept for it, its bytes; `unfinished`: the file ends in it."""

    line: int
    row: int
    text: bytes
    unfinished: bool = False


@dataclass
class OddLines:
    """What became of the lines that are not plain.

    `targets` (width,) is which column goes where, as the loop over the plain ones has it: a column that is left out
    later is left out there too.
    With `survey` a cell that cannot be read is missing, and a loss; a column with many of them is left out, no error.
    `unread` are these cells by column, each with its line. `dropped` are the rows of a block that are not rows, with
    their lines; `left_out` the columns that are not numeric, with why; `cut_line` is the half-written last line (0:
    none); `ends_skipped`: the last line, which has no line end, is skipped and no row. `blank` are lines that hold
    nothing, `empty` those of them that are rows, `words` (row, line, text) are perhaps a footer.
    """

    path: Path
    dialect: Dialect
    survey: bool
    targets: Integers
    dropped: dict[int, int] = field(default_factory=dict)
    left_out: dict[int, Finding] = field(default_factory=dict)
    unread: dict[int, list[tuple[int, str]]] = field(default_factory=dict)
    skipped: dict[type[SkippedLines], list[int]] = field(default_factory=dict)
    cut_line: int = 0
    ends_skipped: bool = False
    blank: list[int] = field(default_factory=list)
    empty: list[int] = field(default_factory=list)
    words: tuple[int, int, str] | None = None

    def take(self, item: OddLine, first_line: int, rows: Rows) -> None:
        """Read one line into `rows`, in the file's order; `first_line` is that of its block."""
        line = first_line + item.line
        if self._is_skipped(item, line):
            self.ends_skipped = item.unfinished
            return
        if item.unfinished and line > self.dialect.first_line:
            self._drop(item, line)
            self.cut_line = line
        else:
            self._judge(item, line, rows)

    def findings(self, last_line: int) -> list[Finding]:
        """What was skipped, each kind once; blank lines behind the last row are not worth a word."""
        found = list(self.left_out.values())
        found += [self._unread(column) for column in self.unread if column not in self.left_out]
        if self.empty:
            found.append(Finding(BlankRows(tuple(self.empty))))
        blank = [line for line in self.blank if line < last_line]
        if blank and self.dialect.width == 1 and 2 * len(blank) < last_line - self.dialect.first_line:
            found.append(Finding(BlankSamples(tuple(blank)), severity="loss"))
        elif blank:
            found.append(Finding(BlankLines(tuple(blank)), severity="note"))
        for kind_of_lines, lines in self.skipped.items():
            is_loss = kind_of_lines is NulLines
            found.append(Finding(kind_of_lines(tuple(lines)), severity="loss" if is_loss else "note"))
        return found

    def _drop(self, item: OddLine, line: int, as_what: type[SkippedLines] | None = None) -> None:
        self.dropped[item.row] = line
        if as_what is not None:
            self.skipped.setdefault(as_what, []).append(line)

    def _is_skipped(self, item: OddLine, line: int) -> bool:
        text = self.dialect.text.decode(item.text).rstrip("\r")
        if self._is_comment(text):
            self._drop(item, line, CommentLines)
        elif text.strip() in {told.strip() for told in self.dialect.header_text}:
            self._drop(item, line, HeaderLines)
        elif is_ruler(text):
            self._drop(item, line, DrawnLines)
        elif b"\0" in item.text:
            self._drop(item, line, NulLines)
        else:
            return False
        return True

    def _is_comment(self, text: str) -> bool:
        """A line of full width in a table without comments is a row, unless it is one that was made a comment."""
        mark = self.dialect.comment
        if not begins_comment(text, mark):
            return False
        rest = text.lstrip()[len(mark) :]
        cells = split_line(rest, self.dialect.separator)
        return self.dialect.commented or len(cells) != self.dialect.width or rest[:1] == " " or kind(cells[0]) != "X"

    def _judge(self, item: OddLine, line: int, rows: Rows) -> None:
        text = self.dialect.text.decode(item.text).rstrip("\r")
        if "\r" in text:
            raise RecordingError(
                f"{self.path}: line {line} holds a carriage return: line ends are mixed",
                "save the file again with one kind of line end",
            )
        if text.count('"') % 2:
            raise RecordingError(
                f"{self.path}: line {line} is no line of a table: a quote is not closed", "are the quotes in pairs?"
            )
        cells = split_line(text, self.dialect.separator)
        if len(cells) != self.dialect.width or self.words is not None:
            self._not_a_row(item, line, cells, text)
            return
        for column, target in enumerate(self.targets.tolist()):
            if target != LEFT:
                self._cell(rows, item.row, line, column, cells[column])

    def _not_a_row(self, item: OddLine, line: int, cells: list[str], text: str) -> None:
        """Words below the rows are a footer, if nothing but words follows; anything else is a row of another width."""
        if len(cells) == 1 and self.dialect.width > 1 and kind(cells[0]) == "X" and not holds_numbers(text):
            self._drop(item, line, WordsBelowRows)
            self.words = self.words or (item.row, line, text)
            return
        if self.words is not None:
            self._refuse_words(*self.words[1:])
        has = f"the header has {self.dialect.width}" if self.dialect.header else f"the first has {self.dialect.width}"
        raise RecordingError(
            f"{self.path}: line {line} has {counted(len(cells), 'cell')}, {has}",
            "repair or remove the line; the first row sets the width",
        )

    def end_block(self, rows: range) -> dict[int, int]:
        """Return those of a block's rows that are dropped, with their lines, and forget them.

        Raises RecordingError where a row follows words that would be a footer.
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

    def _cell(self, rows: Rows, row: int, line: int, column: int, cell: str) -> None:
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
            value = self._number(cell)
            if value is not None:
                rows.numbers[target, row] = value
                return
        name = self.dialect.names[column]
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
            self.left_out[column] = Finding(NotNumeric(name, *unread[0], _advice(self.dialect, unread[0][1])))

    def _unreadable(self, line: int, column: int, target: int, cell: str) -> RecordingError:
        """A cell of a wanted column that cannot be read."""
        found = self.dialect.stamped.get(column)
        what, hint = "is not a number", str(_advice(self.dialect, cell))
        if found is not None and target <= STAMP:
            what = f"is no time written as {found.layouts[0].pattern}"
        elif found is not None and STAMP_LIKE.fullmatch(cell):
            what, hint = "is a date or time, not a number", "of the channels only time may be one"
        elif STAMP_LIKE.fullmatch(cell):
            what = "is not a number, nor a date or time in a layout that is known"
        where = f"line {line}, column '{self.dialect.names[column]}'"
        return RecordingError(f"{self.path}: {where}: {cell[:60]!r} {what}", hint)

    def _unread(self, column: int) -> Finding:
        cells = self.unread[column]
        first = cells[0][1]
        fact = UnreadCells(tuple(line for line, _ in cells), first, _advice(self.dialect, first))
        return Finding(fact, self.dialect.names[column], "loss")

    def _number(self, cell: str) -> float | None:
        if cell in self.dialect.missing:
            return float("nan")
        return number(cell, self.dialect.marks.decimal, self.dialect.marks.thousands)

    def _stamp(self, column: int, cell: str) -> int | None:
        return self.dialect.stamped[column].layouts[0].read(cell)


def not_numeric(name: str, line: int, cell: str) -> Finding:
    """A column that is left out of a survey."""
    advice = CellAdvice("time") if STAMP_LIKE.fullmatch(cell) else None
    return Finding(NotNumeric(name, line, cell, advice), severity="note")


def _advice(dialect: Dialect, cell: str) -> CellAdvice:
    """What to do about a cell that cannot be read."""
    if STAMP_LIKE.fullmatch(cell):
        return CellAdvice("time")
    if any(letter.isdigit() for letter in cell):
        return CellAdvice("number", dialect.details["decimal mark"])
    return CellAdvice("word", quoted(cell[:40]))
