"""Split the lines of a table into cells: rows; lines to be skipped, such as comments; errors."""

from __future__ import annotations

from cdtool.errors import RecordingError
from cdtool.findings import Finding, lines_of
from cdtool.formats.csv.cell_values import CellValues
from cdtool.formats.csv.cells import has_numbers, has_open_quote, kind, split_line
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.lines import begins_comment, is_ruler
from cdtool.plain_text import counted

# Blank lines, comments and repeated headers, of which there may be more only beside as many rows.
_MOST_SKIPPED = 20_000


class TableLines:
    """Reader of the lines of a table, in the file's order: `line` is the number of the next one, after `rows` rows.

    `cut_line` is the incomplete last line (0: none); `ends_skipped`: the last line has no line end but is skipped.
    """

    def __init__(self, dialect: Dialect, values: CellValues) -> None:
        self.dialect, self.values = dialect, values
        self.line, self.rows = dialect.first_line, 0
        self.cut_line, self.ends_skipped = 0, False
        self._blank: list[int] = []
        self._skipped: dict[str, list[int]] = {}
        self._words: tuple[int, str] | None = None  # the first line of what may be a footer
        self._headers = {text.strip() for text in dialect.header_text}
        self._blanks = " \r\n" if dialect.separator == "\t" else " \t\r\n"

    @property
    def only_rows(self) -> bool:
        """Return whether all lines so far were rows."""
        return self.line - self.dialect.first_line == self.rows

    @property
    def may_go_on(self) -> bool:
        """Return whether the next line may be a row: no footer has begun."""
        return self._words is None

    def cells(self, text: str, unfinished: bool) -> list[str] | None:
        """Return the cells of the next line; None if it is not a row. Raises RecordingError with the line.

        `unfinished`: the file ends in this line.
        """
        self.line += 1
        if not text.strip(self._blanks):
            self._blank.append(self.line - 1)
            self.rows += self.dialect.blank_is_missing
            self._check_count()
            return [""] if self.dialect.blank_is_missing else None
        kind_of_line = self._kind(text)
        self.ends_skipped = unfinished and bool(kind_of_line)
        cells = [] if kind_of_line else split_line(text, self.dialect.separator)
        if unfinished and not kind_of_line and self.line > self.dialect.first_line + 1 and self._is_cut(text, cells):
            self.cut_line = self.line - 1
            return None
        kind_of_line = kind_of_line or self._check_row(text, cells, unfinished)
        if kind_of_line:
            self._skipped.setdefault(kind_of_line, []).append(self.line - 1)
            self._check_count()
            return None
        self.rows += 1
        return cells

    def _kind(self, text: str) -> str:
        """Return the finding on a line that is skipped whatever its cells are; empty for any other line."""
        if self._is_comment(text):
            return "comment_lines"
        if text.strip() in self._headers:
            return "header_lines"
        return "drawn_lines" if is_ruler(text) else "nul_lines" if "\0" in text else ""

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

    def _is_cut(self, text: str, cells: list[str]) -> bool:
        """Return whether the last line of the file is not a whole row."""
        whole = (
            len(cells) == self.dialect.width
            and not (self.dialect.trailing and cells[-1])
            and "\r" not in text.rstrip("\r\n")
        )
        return not whole or text.count('"') % 2 > 0 or not self.values.are_readable(cells)

    def _check_row(self, text: str, cells: list[str], unfinished: bool) -> str:
        """Return the finding on words below the rows, which are a footer if only words follow; empty for a row.

        Raises RecordingError for any other line.
        """
        path, width, line = self.dialect.text.path, self.dialect.width, self.line - 1
        if "\r" in text.rstrip("\r\n"):
            raise RecordingError(
                f"{path}: line {line} contains a carriage return: line ends are mixed",
                "save the file again with one kind of line end",
            )
        fits = len(cells) == width or (self.dialect.may_end_after(len(cells)) and not unfinished)
        if text.count('"') % 2 and (len(cells) != width or has_open_quote(text, self.dialect.separator)):
            raise RecordingError(f"{path}: line {line} has a quote that is not closed", "write quotes in pairs")
        if len(cells) == 1 < width and not fits and kind(cells[0]) == "X" and not has_numbers(text):
            self._words = self._words or (line, text)
            return "words_below_rows"
        if self._words is not None:
            at, words = self._words
            raise RecordingError(
                f"{path}: line {at} has 1 cell, the header has {width}: {words.strip()[:40]!r} between the rows",
                "repair or remove the line; pin comment in [csv] if such lines are comments",
            )
        stated = f"the {'header' if self.dialect.header else 'first'} has"
        if not fits:
            raise RecordingError(
                f"{path}: line {line} has {counted(len(cells), 'cell')}, {stated} {width}",
                "repair or remove the line; the first row sets the width",
            )
        if self.dialect.trailing and any(cells[width - 1 :]):
            raise RecordingError(
                f"{path}: line {line} has {counted(width, 'cell')}, {stated} {width - 1}",
                "the other rows end with a separator; repair the line",
            )
        return ""

    def _check_count(self) -> None:
        """Raise RecordingError if a file has many more lines of other kinds than rows."""
        skipped = len(self._blank) + sum(map(len, self._skipped.values()))
        if skipped > max(_MOST_SKIPPED, 2 * (self.rows - len(self._blank) * self.dialect.blank_is_missing)):
            raise RecordingError(
                f"{self.dialect.text.path}: more than {_MOST_SKIPPED} lines are not rows", "is it a table?"
            )

    def findings(self, last_line: int) -> list[Finding]:
        """Return the findings on skipped lines, one per kind; blank lines after the last row are not reported."""
        findings = []
        if self.dialect.blank_is_missing:
            findings = [Finding("blank_rows", "", lines_of(self._blank))] if self._blank else []
        elif blank := [line for line in self._blank if line < last_line]:
            samples = self.dialect.width == 1 and 2 * len(blank) < last_line - self.dialect.first_line
            findings = [Finding("blank_samples" if samples else "blank_lines", "", lines_of(blank))]
        return findings + [Finding(each, "", lines_of(lines)) for each, lines in self._skipped.items()]
