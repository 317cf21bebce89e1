"""The lines of the sample: numbered, without their ends, and told apart: blank, comment, ruler, cells."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cdtool.errors import RecordingError
from cdtool.formats.csv.text import SAMPLE_BYTES, Text

COMMENTS = ("#", "%", "//")
_RULER, _DRAWN = re.compile(r"[-=+|\s:]*"), re.compile(r"[-=]{2}")
# What Excel writes where a formula has no value: no comment, though it begins with the mark of one.
_ERROR_VALUE = re.compile(r'#(?:(?:N/A|N/D|NV|DIV/0!)(?=[\s,;|"]|$)|[^\s,;|"#]{2,12}[!?](?=[\t,;|"]|$)|#+(?=[\t,;|"]))')
_EXCEL = re.compile(r'"?sep=(?P<separator>.|\\t)?"?[,;\t ]*', re.IGNORECASE)
_HEAD_LINES, _MOST_JOINED = 100, 6


@dataclass(frozen=True)
class Line:
    """A line of the file: its number from 1, its text, the byte of the stream where it starts."""

    number: int
    text: str
    start: int

    @property
    def blank(self) -> bool:
        """True for a line that holds nothing."""
        return not self.text.strip()

    @property
    def separator(self) -> str | None:
        """What a line `sep=;`, as Excel reads and writes it, says; None for any other line."""
        found = _EXCEL.fullmatch(self.text.strip("\r\n ")) if self.number < 3 else None
        if found is None:
            return None
        mark = found["separator"] or "\t"
        return "\t" if mark == "\\t" else mark

    def is_comment(self, mark: str) -> bool:
        """True for a line that starts with the mark."""
        return begins_comment(self.text, mark)


def begins_comment(text: str, mark: str) -> bool:
    """True for a line that starts with the mark ("": none does) and not with `#N/A` or `#DIV/0!`."""
    text = text.lstrip()
    return bool(mark) and text.startswith(mark) and _ERROR_VALUE.match(text) is None


def is_ruler(text: str) -> bool:
    """True for a line that only draws: `---+---` or `====`."""
    return _DRAWN.search(text) is not None and _RULER.fullmatch(text) is not None


def sample_lines(text: Text, stream: bytes) -> list[Line]:
    """The whole lines of the sample. A quoted name of a header may run over several: they are one."""
    raw = stream.split(text.line_end)
    whole = text.mark + len(stream) < SAMPLE_BYTES and not text.recoded
    if not whole and text.size > SAMPLE_BYTES and len(raw) > 1:
        raw.pop()  # cut by the sample, not by the file
    lines: list[Line] = []
    number, start = 1, 0
    while number <= len(raw):
        joined = _joined(raw, number - 1) if number <= _HEAD_LINES else 1
        piece = text.line_end.join(raw[number - 1 : number - 1 + joined])
        content = text.decode(piece).rstrip("\r\n")
        lines.append(Line(number, " ".join(content.split()) if joined > 1 else content, start))
        start += len(piece) + 1
        number += joined
    return lines


def refuse_long_line(text: Text, stream: bytes) -> None:
    """Raise RecordingError for a line that fills half of the sample and goes on behind it: no row may be seen."""
    left = len(stream) - stream.rfind(text.line_end) - 1
    if text.size > SAMPLE_BYTES and 2 * left > SAMPLE_BYTES:
        raise RecordingError(
            f"{text.path}: line {stream.count(text.line_end) + 1} goes on beyond the {SAMPLE_BYTES >> 10} KB in which "
            "the head of a table is looked for",
            "is it a table? one of fewer columns can be read",
        )


def comment_mark(lines: list[Line], pinned: str | None) -> str:
    """The mark that begins comment lines; the first of the usual ones that begins a line."""
    if pinned is not None:
        return pinned
    for line in lines:
        for mark in COMMENTS:
            if line.is_comment(mark):
                return mark
    return COMMENTS[0]


def _joined(raw: list[bytes], first: int) -> int:
    """How many lines an open quote joins, 1 if it is closed or never closed."""
    if raw[first].count(b'"') % 2 == 0:
        return 1
    for more in range(1, min(_MOST_JOINED, len(raw) - first)):
        if raw[first + more].count(b'"') % 2:
            return more + 1 if not raw[first].lstrip()[:1].isdigit() else 1
    return 1
