"""Shorten the sample of a table to the lines that determine its dialect.

Most tables have a head, and then rows of one shape: a number in each cell, one separator, one decimal mark. The head
and the first rows determine their dialect. Any other sample is not shortened.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv.cells import NULLS, kind, split_line
from cdtool.formats.csv.lines import COMMENTS
from cdtool.formats.csv.text import SAMPLE_BYTES, Text
from cdtool.formats.csv_dialect.dialect import Dialect
from cdtool.formats.csv_dialect.marks import Marks

# Samples with more lines above the rows are not shortened: they need most of it.
_MOST_ABOVE = 40
# The bytes of numbers; a sign is at the start of a number or of its exponent.
_PLAIN = b"0123456789.+-eEnaNA\r\n"
# A number whose mark cannot separate thousands.
_DECIMAL = re.compile(rb"[+-]?(?:0[.,][0-9]+|[0-9]+[.,](?:[0-9]{1,2}|[0-9]{4,})|[0-9]{4,}[.,][0-9]+)(?![0-9.,])")


@dataclass(frozen=True)
class ShorterSample:
    """A `stream` with fewer rows but the same dialect: `left_out` of the rows, which start in line `first` (from 1)."""

    stream: bytes
    first: int
    left_out: int
    separator: str
    width: int

    def plain(self, text: Text) -> Dialect | None:
        """Return the dialect of the whole sample, without pins, if names are all that is above the rows; else None.

        With two columns a line of names may also state a unit.
        """
        line, *rows = text.decode(self.stream).replace("\r", "").split("\n")[:-1]
        names, cells = split_line(line, self.separator), {cell for row in rows for cell in row.split(self.separator)}
        if self.first != 2 or not 2 < len({*names}) == self.width == len(names) or text.encoding != "utf-8":
            return None
        if {*map(kind, cells)} != {"N"} or '"' in line:
            return None
        if not all(name[:1].isalpha() and kind(name) == "X" for name in names):
            return None
        mark = "," if self.separator != "," and any("," in cell for cell in cells) else "."
        return Dialect(
            text=text,
            pins=TablePins(),
            separator=self.separator,
            marks=Marks(mark, sure=any(mark in cell for cell in cells)),
            comment=COMMENTS[0],
            missing=NULLS,
            header=tuple(names),
            header_line=1,
            header_text=(line,),
            first_line=self.first,
            sampled=self.left_out + len(rows),
            offset=self.stream.index(b"\n") + 1,
            width=self.width,
            kinds="N" * self.width,
            words={},
        )

    def whole(self, dialect: Dialect) -> Dialect | None:
        """Return the dialect of the whole sample, given that of `stream`; None if the two may differ."""
        if (dialect.separator, dialect.width) != (self.separator, self.width) or dialect.first_line > self.first:
            return None
        if not {*dialect.kinds} <= {*"NM"}:
            return None
        if dialect.header is None and dialect.separator == ",":
            return None
        return replace(dialect, sampled=dialect.sampled + self.left_out)


def shorter_sample(text: Text, stream: bytes, pins: TablePins) -> ShorterSample | None:
    """Return the shortened sample; None if its rows are not alike or are few."""
    pinned_line = max(pins.skip_lines, int(pins.header or 0), int(pins.units or 0))
    may_begin_rows = bool(pins.comment) and str(pins.comment)[0] in "+-.,;|\t nN0123456789"
    if text.line_end != b"\n" or pinned_line > _MOST_ABOVE or may_begin_rows:
        return None
    if text.size > SAMPLE_BYTES or stream.endswith(b"\n"):
        stream = stream[: stream.rfind(b"\n") + 1]
    else:
        stream += b"\n"
    separator = _separator(stream)
    if separator is None:
        return None
    others = {*stream.translate(None, _PLAIN + separator + b",")}
    begin = stream.find(b"\n", max(map(stream.rfind, others), default=-1)) + 1 if others else 0
    above, rows = stream.count(b"\n", 0, begin), stream[begin:]
    # Six rows, and twice as many as lines above: the lower two thirds, from which the separator is found, then contain
    # rows only, as in the whole sample. With fewer than 100 rows nothing is gained.
    count, width = 6 + 2 * above, rows.partition(b"\n")[0].count(separator) + 1
    lines = _alike(rows, separator, width)
    if lines < max(100, count) or above > _MOST_ABOVE:
        return None
    *first, _ = stream.split(b"\n", above + count)
    if not _is_clear(b"\n".join(first[above:]), rows, separator):
        return None
    return ShorterSample(b"\n".join([*first, b""]), above + 1, lines - count, separator.decode(), width)


def _alike(rows: bytes, separator: bytes, width: int) -> int:
    """Return the number of rows if each cell of all rows is a number; 0 if there may be other rows.

    After the last cell there may be another separator, in all rows or in none.
    """
    data = np.frombuffer(b"\n" + rows, dtype=np.uint8)
    before_signs = bytes(data[np.flatnonzero(data == ord("-")) - 1])
    places = np.flatnonzero((data == separator[0]) | (data == ord("\n")))
    is_end = data[places[1:]] == ord("\n")
    lines = int(np.count_nonzero(is_end))
    if len(is_end) != lines * width or not is_end[width - 1 :: width].all():
        return 0
    filled = np.diff(places).reshape(lines, width) > 1
    filled[:, -1] = np.diff(places)[width - 1 :: width] > 1 + rows.endswith(b"\r\n")
    alike = filled[:, :-1].all() and filled[:, -1].all() == filled[:, -1].any()
    return lines if alike and not before_signs.translate(None, b"\neE" + separator) else 0


def _separator(stream: bytes) -> bytes | None:
    """Return the separator in a line in the middle; None if the line has no separator, or several."""
    middle = stream.rfind(b"\n", 0, len(stream) // 2) + 1
    line = stream[middle : stream.find(b"\n", middle)]
    strong = [letter for letter in (b"\t", b";", b"|") if letter in line]
    if len(strong) > 1:
        return None
    return strong[0] if strong else b"," if b"," in line else None


def _is_clear(first: bytes, rows: bytes, separator: bytes) -> bool:
    """Return whether the rows have one decimal mark or none, and the first of them show that it is one."""
    marks = [mark for mark in (b".", b",") if mark in rows and mark != separator]
    return not marks or (len(marks) == 1 and any(map(_DECIMAL.match, first.replace(separator, b"\n").split())))
