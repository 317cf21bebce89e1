"""Lines of a table that are not plain: rows written in an unusual way, lines to skip and name, errors."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.errors import RecordingError
from cdtool.formats.csv.cells import kind, number, split_line
from cdtool.formats.csv.dialect import Dialect, shown_lines
from cdtool.formats.csv.lines import is_ruler
from cdtool.formats.csv.row_kernel import EMPTY, LEFT, MISSING_STAMP, STAMP, Integers
from cdtool.recording import Finding

if TYPE_CHECKING:
    from cdtool.formats.csv.rows import Rows


@dataclass(frozen=True)
class OddLine:
    """A line of a block (from 0), the row that is kept for it, its bytes; `unfinished`: the file ends in it."""

    line: int
    row: int
    text: bytes
    unfinished: bool = False


@dataclass
class OddLines:
    """What became of the lines that are not plain. With `survey` a column that holds a word is left out, not an error.

    `dropped` are the rows that are none, with their lines; `left_out` the columns that are not numeric, with why;
    `cut_line` is the half-written last line (0: none), `blank` are lines that hold nothing, `words` perhaps a footer.
    """

    path: Path
    dialect: Dialect
    survey: bool
    dropped: dict[int, int] = field(default_factory=dict)
    left_out: dict[int, Finding] = field(default_factory=dict)
    skipped: dict[str, list[int]] = field(default_factory=dict)
    cut_line: int = 0
    blank: list[int] = field(default_factory=list)
    words: list[tuple[int, int, str]] = field(default_factory=list)

    def attach(self, rows: Rows, targets: Integers) -> None:
        """The arrays that the rows go to, and which column goes where."""
        self.rows, self.targets = rows, targets

    def take(self, item: OddLine, first_line: int) -> None:
        """One line, in the file's order; `first_line` is that of its block."""
        line = first_line + item.line
        if self._is_skipped(item, line):
            return
        if item.unfinished and line > self.dialect.first_line:
            self._drop(item, line, "")
            self.cut_line = line
        else:
            self._judge(item, line)

    def findings(self, last_line: int) -> list[Finding]:
        """What was skipped, each kind once; blank lines behind the last row are not worth a word."""
        found = list(self.left_out.values())
        blank = [line for line in self.blank if line < last_line]
        if blank:
            found.append(Finding(f"{shown_lines(blank)} skipped: blank", severity="note"))
        for what, lines in self.skipped.items():
            severity = "loss" if "NUL" in what else "note"
            found.append(Finding(f"{shown_lines(lines)} skipped: {what}", severity=severity))  # type: ignore[arg-type]
        return found

    def _drop(self, item: OddLine, line: int, what: str) -> None:
        self.dropped[item.row] = line
        if what:
            self.skipped.setdefault(what, []).append(line)

    def _is_skipped(self, item: OddLine, line: int) -> bool:
        text = self.dialect.text.decode(item.text).rstrip("\r")
        if self.dialect.comment and text.lstrip().startswith(self.dialect.comment):
            self._drop(item, line, "comments")
        elif text.strip() in {told.strip() for told in self.dialect.header_text}:
            self._drop(item, line, "the header again")
        elif is_ruler(text):
            self._drop(item, line, "drawn lines")
        elif b"\0" in item.text:
            self._drop(item, line, "damaged, they hold NUL bytes")
        else:
            return False
        return True

    def _judge(self, item: OddLine, line: int) -> None:
        text = self.dialect.text.decode(item.text).rstrip("\r")
        if "\r" in text:
            raise RecordingError(
                f"{self.path}: line {line} holds a carriage return: line ends are mixed",
                "save the file anew with one kind of line end",
            )
        if text.count('"') % 2:
            raise RecordingError(
                f"{self.path}: line {line} is no line of a table: a quote is not closed", "are the quotes in pairs?"
            )
        cells = split_line(text, self.dialect.separator)
        if len(cells) != self.dialect.width or self.words:
            self._not_a_row(item, line, cells, text)
            return
        for column, target in enumerate(self.targets.tolist()):
            if target != LEFT:
                self._cell(item, line, column, target, cells[column])

    def _not_a_row(self, item: OddLine, line: int, cells: list[str], text: str) -> None:
        """Words below the rows are a footer, if nothing but words follows; anything else is a row of another width."""
        if len(cells) == 1 and self.dialect.width > 1 and kind(cells[0]) == "X":
            self._drop(item, line, "words below the rows")
            self.words.append((item.row, line, text))
            return
        if self.words:
            self._refuse_footer()
        has = f"the header has {self.dialect.width}" if self.dialect.header else f"the first has {self.dialect.width}"
        raise RecordingError(
            f"{self.path}: line {line} has {len(cells)} cells, {has}",
            "repair or remove the line; the first row sets the width",
        )

    def finish(self, last_row: int) -> None:
        """Raise if a row, the last of which is given, follows the words that would be a footer."""
        if self.words and last_row > self.words[0][0]:
            self._refuse_footer()

    def _refuse_footer(self) -> None:
        _, line, text = self.words[0]
        raise RecordingError(
            f"{self.path}: line {line} has 1 cells, the header has {self.dialect.width}: "
            f"{text.strip()[:40]!r} between the rows",
            "repair or remove the line; pin comment in [csv] if such lines are comments",
        )

    def _cell(self, item: OddLine, line: int, column: int, target: int, cell: str) -> None:
        if target == EMPTY:
            if cell:
                raise RecordingError(
                    f"{self.path}: line {line} has {self.dialect.width} cells, the header has {self.dialect.width - 1}",
                    "the other rows end with a separator; repair the line",
                )
            return
        if target <= STAMP:
            stamp = MISSING_STAMP if cell in ("", *self.dialect.missing) else self._stamp(column, cell)
            if stamp is not None:
                self.rows.stamps[STAMP - target, item.row] = stamp
                return
        else:
            value = self._number(cell)
            if value is not None:
                self.rows.numbers[target, item.row] = value
                return
        name = self.dialect.names[column]
        if not self.survey:
            raise not_a_number(self.path, self.dialect, line, name, cell)
        self.targets[column] = LEFT
        self.left_out[column] = not_numeric(name, line, cell)

    def _number(self, cell: str) -> float | None:
        if cell in self.dialect.missing:
            return float("nan")
        return number(cell, self.dialect.marks.decimal, self.dialect.marks.thousands)

    def _stamp(self, column: int, cell: str) -> int | None:
        return self.dialect.stamped[column].layouts[0].read(cell)


def not_numeric(name: str, line: int, cell: str) -> Finding:
    """A column that is left out of a survey."""
    return Finding(f"column '{name}' is not numeric (line {line} holds {cell[:40]!r}): left out", severity="note")


def not_a_number(path: Path, dialect: Dialect, line: int, name: str, cell: str) -> RecordingError:
    """A cell of a wanted column that cannot be read."""
    return RecordingError(
        f"{path}: line {line}, column '{name}': {cell[:60]!r} is not a number",
        f"decimal mark: {dialect.details['decimal mark']}; empty and nan are missing values",
    )
