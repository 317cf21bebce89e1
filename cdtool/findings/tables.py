"""Facts about text tables: lines, cells, marks, encodings."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import InitVar, field
from typing import Literal

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted_lines

# Of a cell so many characters are shown, of lines so many numbers.
_SHOWN, _FIRST = 40, 3


@frozen
class CellAdvice:
    """What to do about a cell that cannot be read: it looks like a date, a number, or a word.

    `text` is the table's decimal mark for a number, the cell as TOML writes it for a word.
    """

    looks_like: Literal["time", "number", "word"]
    text: str = ""

    def __str__(self) -> str:
        if self.looks_like == "time":
            return 'repair it, or pin time_format in [csv], e.g. "%d.%m.%Y %H:%M:%S.%f"'
        if self.looks_like == "number":
            return f"decimal mark: {self.text}; empty and nan are missing values"
        return f"if it stands for a missing value, missing = [{self.text}] in [csv] of the machine file says so"


@frozen
class LinesFact(Fact):
    """A fact about lines of the file: how many they are, the first three and the last; a long log may have millions."""

    lines: InitVar[Sequence[int]]
    count: int = field(init=False)
    first: tuple[int, ...] = field(init=False)
    last: int = field(init=False)

    def __post_init__(self, lines: Sequence[int]) -> None:
        """Keep of the lines' numbers what a sentence shows."""
        object.__setattr__(self, "count", len(lines))
        object.__setattr__(self, "first", tuple(lines[:_FIRST]))
        object.__setattr__(self, "last", lines[-1])

    @property
    def shown_lines(self) -> str:
        """The lines in words."""
        return counted_lines(self.count, self.first, self.last)


@frozen
class PinnedLinesSkipped(LinesFact):
    """Lines that [csv] says to skip."""

    def sentence(self) -> str:
        """Return the lines."""
        return f"{self.shown_lines} skipped, as [csv] says"


@frozen
class OtherEncoding(TemplateFact):
    """The text is not UTF-8."""

    encoding: str

    words = "not valid UTF-8, read as {encoding}"


@frozen
class NamedSeparator(TemplateFact):
    """A line names the separator, as Excel writes it."""

    line: int
    text: str

    words = "line {line} ({text}) names the separator"


@frozen
class NumbersAboveRows(LinesFact):
    """Lines with numbers above the rows were skipped."""

    def sentence(self) -> str:
        """Return the lines, and the next step."""
        contains = "it contains" if self.count == 1 else "they contain"
        return (
            f"{self.shown_lines} above the rows skipped although {contains} numbers; "
            "skip_lines in [csv] says that they are no rows"
        )


@frozen
class WordsAboveRows(LinesFact):
    """Lines of words above the rows were skipped."""

    def sentence(self) -> str:
        """Return the lines."""
        return f"{self.shown_lines} above the rows skipped: no names, no numbers"


@frozen
class NamesFromComment(TemplateFact):
    """The columns' names are given in a comment."""

    line: int

    words = "the names are those of the comment in line {line}"


@frozen
class NamesOfSymbols(TemplateFact):
    """Names with blanks, in a table separated by blanks, are replaced by those of the channels' symbols."""

    count: int

    words = "the names of {count} channels cannot be told apart between blanks: those of their symbols are used"


@frozen
class FooterSkipped(LinesFact):
    """Lines below the rows that are no samples; `text` is the first of them."""

    text: str

    def sentence(self) -> str:
        """Return the lines and how they begin."""
        return f"{self.shown_lines} skipped: a footer ({self.text[:_SHOWN]!r}), no sample"


@frozen
class DoubtfulPoint(Fact):
    """A number such as `1.234` is read with a decimal point, though the point might separate thousands."""

    text: str
    line: int

    def sentence(self) -> str:
        """Return both readings, and how to pin one."""
        return (
            f"'{self.text}' (line {self.line}) is read as {self.text}, not as {self.text.replace('.', '')}: "
            "pin decimal and thousands in [csv] if that is wrong"
        )


@frozen
class NotNumeric(Fact):
    """A column that is left out for a cell that is not a number, with the advice on that cell."""

    column: str
    line: int
    cell: str
    advice: CellAdvice | None = None

    subject_field = "column"

    def sentence(self) -> str:
        """Return column and cell."""
        advice = f"; {self.advice}" if self.advice else ""
        return f"column '{self.column}' is not numeric (line {self.line} is {self.cell[:_SHOWN]!r}): left out{advice}"


@frozen
class AmbiguousTimes(TemplateFact):
    """A column of dates that can be read in two ways."""

    column: str
    readings: str

    subject_field = "column"
    words = "column '{column}': {readings}: left out; pin time_format in [csv]"


@frozen
class UnreadCells(LinesFact):
    """Cells of a column that cannot be read; `cell` is the first of them."""

    cell: str
    advice: CellAdvice

    def sentence(self) -> str:
        """Return lines, first cell and advice."""
        return f"{self.shown_lines}: {self.cell[:_SHOWN]!r} cannot be read, taken as missing; {self.advice}"


@frozen
class BlankRows(LinesFact):
    """Blank lines that are rows without values."""

    def sentence(self) -> str:
        """Return the lines."""
        return f"{self.shown_lines} blank: taken as missing samples"


@frozen
class SkippedLines(LinesFact):
    """Lines between the rows that are no rows."""

    @property
    @abstractmethod
    def what(self) -> str:
        """What stands in them."""

    def sentence(self) -> str:
        """Return the lines and what they hold."""
        return f"{self.shown_lines} skipped: {self.what}"


@frozen
class BlankLines(SkippedLines):
    """Lines without anything."""

    what = "blank"


@frozen
class BlankSamples(SkippedLines):
    """Lines without anything in a table of one column, where a missing sample looks the same."""

    what = "blank, perhaps missing samples"


@frozen
class CommentLines(SkippedLines):
    """Lines that begin with the comment mark."""

    what = "comments"


@frozen
class HeaderLines(SkippedLines):
    """Lines that repeat the header."""

    what = "the header again"


@frozen
class DrawnLines(SkippedLines):
    """Lines of dashes."""

    what = "drawn lines"


@frozen
class WordsBelowRows(SkippedLines):
    """Lines of words below the last row."""

    what = "words below the rows"


@frozen
class NulLines(SkippedLines):
    """Lines that contain NUL bytes."""

    what = "damaged, with NUL bytes"


@frozen
class LastLineCut(TemplateFact):
    """The last line is cut off."""

    line: int

    words = "the last line ({line}) is cut off, dropped"


@frozen
class NulBytesAtEnd(TemplateFact):
    """The file ends in NUL bytes."""

    count: int

    words = "the file ends in {count} NUL bytes: was the power lost?"


@frozen
class TotalRow(TemplateFact):
    """The last row has the sums of the rows above it, and no label."""

    line: int

    words = "the last row (line {line}) has the sums of the rows above: if it is a total and no sample, remove it"


@frozen
class LastLineKept(TemplateFact):
    """The last line has no line end, and its last cell looks whole."""

    line: int
    cell: str

    words = "the last line ({line}) has no line end: its last cell '{cell}' is taken to be whole"


@frozen
class LastLineDropped(TemplateFact):
    """The last line has no line end, and its last cell may be cut off."""

    line: int
    cell: str

    words = "the last line ({line}) has no line end, and '{cell}' may be cut off, dropped"
