"""The lines of the sample: numbered, without line ends, and distinguished as blank, comment, ruler or cells."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property

from cdtool.base.errors import RecordingError
from cdtool.formats.csv.cells import kind, split_line
from cdtool.formats.csv.text import SAMPLE_BYTES, Text

COMMENTS = ("#", "%", "//")
_RULER, _DRAWN = re.compile(r"[-=+|\s:]*"), re.compile(r"[-=]{2}")
# Excel's error values of formulas, which are not comments although they start with #.
_ERROR_VALUE = re.compile(r'#(?:(?:N/A|N/D|NV|DIV/0!)(?=[\s,;|"]|$)|[^\s,;|"#]{2,12}[!?](?=[\t,;|"]|$)|#+(?=[\t,;|"]))')
_EXCEL = re.compile(r'"?sep=(?P<separator>.|\\t)?"?[,;\t ]*', re.IGNORECASE)


@dataclass(frozen=True)
class Line:
    """A line of the file: its number (from 1), its text, and the byte of the stream where it starts."""

    number: int
    text: str
    start: int

    @property
    def blank(self) -> bool:
        """Return whether the line is empty or has only blanks."""
        return not self.text.strip()

    @property
    def separator(self) -> str | None:
        """Return the separator that a line `sep=;` of Excel names; None for any other line."""
        match = _EXCEL.fullmatch(self.text.strip("\r\n ")) if self.number < 3 else None
        if match is None:
            return None
        mark = match["separator"] or "\t"
        return "\t" if mark == "\\t" else mark

    def is_comment(self, mark: str) -> bool:
        """Return whether the line is a comment that starts with the mark."""
        return begins_comment(self.text, mark)


@dataclass(frozen=True)
class SplitLine(Line):
    """A line as cells."""

    cells: list[str]

    @cached_property
    def kinds(self) -> str:
        """Return the kind of each cell, as one letter."""
        return "".join(map(kind, self.cells))

    @classmethod
    def of(cls, line: Line, separator: str) -> SplitLine:
        """Return a line split at a separator."""
        return cls(line.number, line.text, line.start, split_line(line.text, separator))


def begins_comment(text: str, mark: str) -> bool:
    """Return whether a line starts with the mark ("": none does) and not with `#N/A` or `#DIV/0!`."""
    text = text.lstrip()
    return bool(mark) and text.startswith(mark) and _ERROR_VALUE.match(text) is None


def is_ruler(text: str) -> bool:
    """Return whether a line is only drawn: `---+---` or `====`."""
    return _DRAWN.search(text) is not None and _RULER.fullmatch(text) is not None


def sample_lines(text: Text, stream: bytes) -> list[Line]:
    """Return the complete lines of the sample; lines that a quoted name in the header spans are joined into one."""
    raw = stream.split(text.line_end)
    whole = text.mark + len(stream) < SAMPLE_BYTES
    if not whole and text.size > SAMPLE_BYTES and len(raw) > 1:
        raw.pop()  # incomplete in the sample, not in the file
    lines: list[Line] = []
    number, start = 1, 0
    while number <= len(raw):
        joined = _joined(raw, number - 1) if number <= 100 else 1  # of a head
        piece = text.line_end.join(raw[number - 1 : number - 1 + joined])
        content = text.decode(piece).rstrip("\r\n")
        lines.append(Line(number, " ".join(content.split()) if joined > 1 else content, start))
        start += len(piece) + 1
        number += joined
    return lines


def refuse_long_line(text: Text, stream: bytes) -> None:
    """Raise RecordingError if a line fills half of the sample and continues after it: the sample may have no row."""
    left = len(stream) - stream.rfind(text.line_end) - 1
    if text.size > SAMPLE_BYTES and 2 * left > SAMPLE_BYTES:
        raise RecordingError(
            f"line {stream.count(text.line_end) + 1} continues after the first {SAMPLE_BYTES >> 10} KB, "
            "which are searched for the head of a table",
            "is it a table? a table with fewer columns can be read",
        )


def comment_mark(lines: list[Line], pinned: str | None) -> str:
    """Return the mark that starts comments: the pinned one, or the first usual mark that starts a line."""
    if pinned is not None:
        return pinned
    for line in lines:
        for mark in COMMENTS:
            if line.is_comment(mark):
                return mark
    return COMMENTS[0]


def _joined(raw: list[bytes], first: int) -> int:
    """Return the number of lines that a quoted name joins; 1 if the quote is closed in its line, or never closed."""
    if raw[first].count(b'"') % 2 == 0:
        return 1
    for more in range(1, min(6, len(raw) - first)):  # more are not one name in quotes
        if raw[first + more].count(b'"') % 2:
            return more + 1 if not raw[first].lstrip()[:1].isdigit() else 1
    return 1
