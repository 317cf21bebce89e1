"""Lines below the rows that are no samples though they are as wide: `Sum;7.5`, `Mean;0.3`, `End of file;`.

Such a line begins with a word where every row begins with a number or a time. A word that comes among the rows too, or
again and again, or that stands for a missing value, is none of a footer: the column holds words, or a row is damaged.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from cdtool.findings import Finding
from cdtool.findings.tables import FooterSkipped
from cdtool.formats.csv.cells import kind, split_line
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.lines import is_ruler
from cdtool.formats.csv.text import SAMPLE_BYTES, TAIL_BYTES, Text

_MOST = 12
_LABEL = re.compile(r"[^\W\d_].*|\u2211.*")  # a letter first, or the sign of a sum
_NO_VALUES = ("na", "n/a", "null", "none", "nil", "missing", "err", "error", "invalid", "ovl", "ol", "overflow")


@dataclass(frozen=True)
class Footer:
    """`lines` are counted from 0 at the first of them; `shown` is that one, `cut` all of the stream from there on."""

    lines: tuple[int, ...]
    shown: str
    cut: bytes

    def finding(self, first_line: int) -> Finding:
        """What is said of a footer that begins in that line of the file."""
        return Finding(FooterSkipped(tuple(first_line + line for line in self.lines), self.shown))

    def without(self, text: Text, stream: bytes) -> tuple[Text, bytes]:
        """The text, and the sample of its stream, up to the footer."""
        size = len(self.cut.decode().encode(text.encoding) if text.recoded else self.cut)
        return replace(text, size=text.size - size), stream.removesuffix(self.cut)


def find_footer(dialect: Dialect) -> Footer | None:
    """The footer of a table whose first column holds numbers or times; None where it has none."""
    if dialect.kinds[0] not in "NT" or dialect.text.padding:  # where the power was lost nobody wrote a sum
        return None
    raw = _last_lines(dialect)
    words: list[tuple[int, list[str]]] = []
    for i in range(len(raw) - 1, -1, -1):  # mostly the last line is a row, and the others are not looked at
        cells = _cells(dialect, raw[i])
        if cells and not _is_words(dialect, cells):
            break
        if cells:
            words.insert(0, (i, cells))
    labels = [cells[0].lower() for _, cells in words if len(cells) == dialect.width]
    if not 0 < len(labels) == len(set(labels)) <= _MOST or not set(labels).isdisjoint(_no_values(dialect)):
        return None
    first = words[0][0]
    above = [cells for line in raw[:first] if len(cells := _cells(dialect, line)) == dialect.width]
    if not above or any(kind(cells[0]) == "X" for cells in above):
        return None
    shown = dialect.text.decode(raw[first]).strip()
    return Footer(tuple(i - first for i, _ in words), shown, dialect.text.line_end.join(raw[first:]))


def _cells(dialect: Dialect, line: bytes) -> list[str]:
    """A line's cells; none of a line that is blank, drawn, a comment or the header again."""
    text = dialect.text.decode(line).strip()
    if not text or is_ruler(text) or (dialect.comment and text.startswith(dialect.comment)):
        return []
    if text in {told.strip() for told in dialect.header_text}:
        return []
    return split_line(text, dialect.separator)


def _is_words(dialect: Dialect, cells: list[str]) -> bool:
    """True for a line that begins with a label, and is as wide as the rows or words only."""
    return len(cells) in (1, dialect.width) and _LABEL.fullmatch(cells[0]) is not None and kind(cells[0]) == "X"


def _no_values(dialect: Dialect) -> set[str]:
    return {*_NO_VALUES, *(text.lower() for text in dialect.missing)}


def _last_lines(dialect: Dialect) -> list[bytes]:
    """The last whole lines of the rows, as the stream has them."""
    text = dialect.text
    most = SAMPLE_BYTES if text.recoded else TAIL_BYTES
    start = text.mark if text.recoded else text.mark + dialect.offset
    whole = text.size - start <= most
    with text.path.open("rb") as file:
        file.seek(start if whole else text.size - most)
        end = file.read(text.size - start if whole else most)
    if text.recoded:
        end = end.decode(text.encoding, errors="replace").encode()
        end = end[dialect.offset :] if whole else end
    return end.split(text.line_end)[not whole :]
