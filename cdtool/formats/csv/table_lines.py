"""Split the lines of a table into cells: rows; lines to be skipped, such as comments; errors."""

from __future__ import annotations

import re

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, lines_of
from cdtool.base.plain_text import counted
from cdtool.formats.csv.cell_values import CellValues
from cdtool.formats.csv.cells import has_numbers, has_open_quote, kind, split_line
from cdtool.formats.csv.lines import SplitLine, begins_comment, is_ruler
from cdtool.formats.csv_dialect.dialect import Dialect

# Blank lines, comments and repeated headers, of which there may be more only beside as many rows.
_MOST_SKIPPED = 20_000
_LABEL = re.compile(r"[^\W\d_].*|\u2211.*")  # a letter first, or the sign of a sum
_MISSING_WORDS = ("na", "n/a", "null", "none", "nil", "missing", "err", "error", "invalid", "ovl", "ol", "overflow")


class TableLines:
    """Reader of the lines of a table, in the file's order: `line` is the number of the next one, after `rows` rows.

    Some lines are rows only if a row follows: blank lines in a table of one column, and lines that start with a word
    where each row starts with a number or a time. At the end of the file these are a footer: `Sum;7.5`, `End of file`.
    `cut_line` is the incomplete last line (0: none); `ends_skipped`: the last line has no line end but is skipped.
    """

    def __init__(self, dialect: Dialect, values: CellValues) -> None:
        self.dialect, self.values = dialect, values
        self.line, self.rows = dialect.first_line, 0
        self.cut_line, self.ends_skipped = 0, False
        self._blank: list[int] = []
        self._skipped: dict[str, list[int]] = {}
        self._pending: list[SplitLine] = []  # rows only if a row follows
        # Whether a row above starts with a word: then lines that do are no footer.
        self._words_above = dialect.kinds[0] not in "NT" or dialect.text.padding > 0
        self._headers = {text.strip() for text in dialect.header_text}
        self._blanks = " \r\n" if dialect.separator == "\t" else " \t\r\n"
        self._missing = {*_MISSING_WORDS, *(text.lower() for text in dialect.missing)}

    @property
    def only_rows(self) -> bool:
        """Return whether all lines so far were rows, apart from the footer."""
        return self.line - len(self._pending) - self.dialect.first_line == self.rows

    @property
    def may_end(self) -> bool:
        """Return whether the last lines are rows only if a row follows."""
        return bool(self._pending)

    def read(self, text: str, unfinished: bool) -> list[tuple[int, list[str]]]:
        """Return the rows that end with the next line, with their lines; raises RecordingError with the line.

        `unfinished`: the file ends in this line.
        """
        line, self.line = self.line, self.line + 1
        if not text.strip(self._blanks):
            self._blank.append(line)
            self._pending += [SplitLine(line, text, 0, [""])] if self.dialect.blank_is_missing else []
            self._check_count()
            return []
        kind_of_line = self._kind(text)
        self.ends_skipped = unfinished and bool(kind_of_line)
        if kind_of_line:
            self._skipped.setdefault(kind_of_line, []).append(line)
            self._check_count()
            return []
        cells = split_line(text, self.dialect.separator)
        if self._may_be_footer(line, cells, text, unfinished):
            self.ends_skipped = unfinished
            self._pending.append(SplitLine(line, text, 0, cells))
            return []
        if unfinished and line > self.dialect.first_line and self._is_cut(text, cells):
            self.cut_line = line
            return []
        self._check_row(line, text, cells, unfinished)
        rows = [*((each.number, each.cells) for each in self._pending), (line, cells)]
        self._words_above |= any(kind(row[0]) == "X" for _, row in rows)
        self._pending = []
        self.rows += len(rows)
        return rows

    def _may_be_footer(self, line: int, cells: list[str], text: str, unfinished: bool) -> bool:
        """Return whether a line may be one of a footer; below a blank line it may have any number of cells.

        A word that is repeated, or that marks a missing value, does not start such a line: a row is damaged.
        """
        width, label = self.dialect.width, cells[0].lower()
        if kind(cells[0]) != "X":
            return False
        if len(cells) == 1 < width and not has_numbers(text) and not (unfinished and not self._footer):
            return True
        fits = len(cells) == width or (self._apart(line) and 1 < len(cells) < width)
        known = {each.cells[0].lower() for each in self._footer if len(each.cells) > 1 or width == 1}
        is_label = _LABEL.fullmatch(cells[0]) is not None and label not in known and label not in self._missing
        # A footer has at most twelve lines that start with a label and have other cells.
        return self.rows > 0 and fits and is_label and len(known) < 12 and not self._words_above

    @property
    def _footer(self) -> list[SplitLine]:
        return [each for each in self._pending if each.text.strip()]

    def _apart(self, line: int) -> bool:
        """Return whether a blank line is above the footer that starts in a line, or earlier."""
        first = self._footer[0].number if self._footer else line
        return bool(self._blank) and any(each == first - 1 for each in self._blank)

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

    def _check_row(self, line: int, text: str, cells: list[str], unfinished: bool) -> None:
        """Raise RecordingError if a line is no row, or if a line above is neither a row nor the footer."""
        width = self.dialect.width
        if "\r" in text.rstrip("\r\n"):
            raise RecordingError(
                f"line {line} contains a carriage return: line ends are mixed",
                "save the file again with one kind of line end",
            )
        fits = len(cells) == width or (len(cells) in self.dialect.short_rows and not unfinished)
        if text.count('"') % 2 and (len(cells) != width or has_open_quote(text, self.dialect.separator)):
            raise RecordingError(
                f"line {line} has a quote that is not closed", "write quotes in pairs, and no line break in a cell"
            )
        words = next((each for each in self._footer if len(each.cells) != width), None)
        if words is not None:
            raise RecordingError(
                f"line {words.number} has {counted(len(words.cells), 'cell')}, the header has {width}: "
                f"{words.text.strip()[:40]!r} between the rows",
                "repair or remove the line; pin comment in [csv] if such lines are comments",
            )
        stated = f"the {'header' if self.dialect.header else 'first'} has"
        if not fits:
            raise RecordingError(
                f"line {line} has {counted(len(cells), 'cell')}, {stated} {width}",
                "repair or remove the line; the first row sets the width",
            )
        if self.dialect.trailing and any(cells[width - 1 :]):
            raise RecordingError(
                f"line {line} has {counted(width, 'cell')}, {stated} {width - 1}",
                "the other rows end with a separator; repair the line",
            )

    def _check_count(self) -> None:
        """Raise RecordingError if a file has many more lines of other kinds than rows."""
        skipped = len(self._blank) + sum(map(len, self._skipped.values()))
        if skipped > max(_MOST_SKIPPED, 2 * (self.line - self.dialect.first_line - skipped)):
            raise RecordingError(f"more than {_MOST_SKIPPED} lines are not rows", "is it a table?")

    def findings(self, last_line: int) -> list[Finding]:
        """Return the findings on skipped lines, one per kind; blank lines after the last row are not reported."""
        findings, dialect, footer = [], self.dialect, self._footer
        if blank := [line for line in self._blank if line < last_line]:
            samples = dialect.width == 1 and 2 * len(blank) < last_line - dialect.first_line
            skipped = "blank_samples" if samples else "blank_lines"
            findings = [Finding("blank_rows" if dialect.blank_is_missing else skipped, "", lines_of(blank))]
        findings += [Finding(each, "", lines_of(lines)) for each, lines in self._skipped.items()]
        if footer:
            fact = lines_of([each.number for each in footer])
            words = dialect.width > 1 and all(len(each.cells) == 1 for each in footer)
            text = {} if words else {"text": footer[0].text.strip()}
            findings.append(Finding("words_below_rows" if words else "footer_skipped", "", fact | text))
        return findings
