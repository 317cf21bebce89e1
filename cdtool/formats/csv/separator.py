"""Which character parts the cells: the one that cuts the lines into equally many cells, most of them numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cdtool.errors import RecordingError
from cdtool.formats.csv.cells import SEPARATORS, kind, split_line
from cdtool.formats.csv.lines import Line

_SCORED = 150
# A separator that stands in this share of the lines, as often in each, is one whatever else the cells hold.
_CONSISTENT = 0.9
_STRONG = "\t;|"


@dataclass(frozen=True)
class Split:
    """What a separator makes of the lines: cells a line, the share of lines so wide, the share of numbers in them."""

    separator: str
    width: int
    consistent: float
    numeric: float


def find_separator(path: Path, lines: Sequence[Line], pinned: str = "", decimal: str = "") -> Split:
    """The separator of lines that hold cells; raises RecordingError where a pinned one cuts none of them.

    A pinned separator beside a pinned decimal comma may cut none: the table has one column.
    """
    body = lines[len(lines) // 3 :] if len(lines) >= 6 else lines[1:] or lines
    texts = [line.text for line in body]
    scored = texts if len(texts) <= 2 * _SCORED else texts[:_SCORED] + texts[-_SCORED:]
    if pinned:
        split = _split(scored, pinned)
        if split.width < 2 and any(
            _split(scored, other).width > 1 for other in SEPARATORS if other not in (pinned, decimal)
        ):
            raise RecordingError(
                f"{path}: line {body[0].number} has one cell by the separator {pinned!r}: {body[0].text[:40]!r}",
                "correct or remove separator in [csv], or the line sep= of the file",
            )
        return split
    splits = [_split(scored, separator) for separator in SEPARATORS]
    possible = [split for split in splits if split.width > 1 and split.numeric > 0.0]
    if not possible:
        return _split(scored, ",")
    best = max(possible, key=lambda split: (round(split.numeric * split.consistent, 2), round(split.consistent, 2)))
    stronger = [
        split
        for split in possible
        if split.separator in _STRONG
        and best.separator not in _STRONG
        and split.consistent >= _CONSISTENT
        and split.numeric > best.numeric / 3.0
    ]
    return stronger[0] if stronger else best


def _split(texts: Sequence[str], separator: str) -> Split:
    rows = [split_line(text, separator) for text in texts]
    if separator == " ":
        rows = [_no_blank_separator(text, row) for text, row in zip(texts, rows, strict=True)]
    widths = Counter(map(len, rows))
    width, count = widths.most_common(1)[0]
    if width < 2 and len(widths) > 1:  # a preamble of single words does not decide
        wider, seen = next(item for item in widths.most_common(2) if item[0] > 1)
        if 2 * seen >= count:
            width, count = wider, seen
    if width < 2:
        return Split(separator, 1, 1.0, 0.0)
    shares = [sum(_is_number(cell, separator) for cell in row) / len(row) for row in rows if len(row) == width]
    missing = [sum(kind(cell) == "M" for cell in row) / len(row) for row in rows if len(row) == width]
    numeric = sum(share / max(1.0 - lost, 1.0 / width) for share, lost in zip(shares, missing, strict=True))
    return Split(separator, width, count / len(rows), numeric / len(shares))


def _no_blank_separator(text: str, row: list[str]) -> list[str]:
    """Blanks beside another separator are only blanks: `0, 1.5` is cut by its comma."""
    if any(cell[-1:] in ",;|" or cell[:1] in ",;|" for cell in row) or "\t" in text.strip():
        return [text]
    return row


def _is_number(cell: str, separator: str) -> bool:
    # `1,500 200,5` is no row of `500 200` between commas, though that may be written so between semicolons.
    found = kind(cell)
    return found == "T" or (found == "N" and not (separator == "," and " " in cell))
