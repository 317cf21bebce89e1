"""Tables in narrow terminals: columns that do not fit beside each other follow below; no name or figure is broken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

# Between two columns [characters].
GAP = 2
# Sentences are wrapped at words, but to no less than this where they are longer [characters].
_LEAST_SENTENCE = 30


@dataclass(frozen=True)
class ColumnWidth:
    """One column: `needed` characters, which words alone keep of a sentence, `natural` ones of its longest cell."""

    is_name: bool
    needed: int
    natural: int


def column_width(heading: str, side: str, cells: Sequence[str], leading: bool) -> ColumnWidth:
    """Return the width of a column; a left one that is not `leading` holds sentences."""
    lines = [*heading.split("\n"), *cells]
    natural = max(map(len, lines), default=0)
    if side == "right" or leading:
        return ColumnWidth(leading, natural, natural)
    words = max((len(word) for line in lines for word in line.split()), default=0)
    return ColumnWidth(False, max(words, min(natural, _LEAST_SENTENCE)), natural)


def blocks(columns: Sequence[ColumnWidth], width: int) -> list[list[int]]:
    """Return the columns of each table to print below another: the names first in each, then as many as fit."""
    names = [i for i, column in enumerate(columns) if column.is_name]
    base = sum(columns[i].needed + GAP for i in names)
    made: list[list[int]] = []
    room = 0
    for i, column in enumerate(columns):
        if i in names:
            continue
        if not made or column.needed + GAP > room:
            made.append(list(names))
            room = width - base
        made[-1].append(i)
        room -= column.needed + GAP
    return made or [list(names)]
