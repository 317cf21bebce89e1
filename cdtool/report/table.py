"""A table of the HTML report: drawn by the template, or, where it is long, handed to the script to page through."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cdtool.plain_text import plain
from cdtool.report.number_text import NOTHING, number

# A browser lays out more rows than this only slowly.
_MOST_ROWS_AT_ONCE = 150
# A name of a sensible log or detector is shorter.
_LONGEST_WORD = 28
# What is sorted after every figure.
_LAST = 1e300


@dataclass(frozen=True)
class Column:
    """A column; `numeric` ones are aligned to the right and begin with their largest figure when sorted.

    `choice`: readers may pick one of its values.
    """

    heading: str
    numeric: bool = False
    choice: bool = False


@dataclass(frozen=True)
class Cell:
    """What stands in a cell: `text`, below it lines in small print; `key` sorts it, by default its text.

    `tone` is good, bad or unknown, and shown by colour beside the word.
    """

    text: str
    rest: tuple[str, ...] = ()
    key: float | None = None
    tone: str = ""

    @property
    def lines(self) -> str:
        """All of its text, plain, line by line."""
        return "\n".join(seen(line) for line in (self.text, *self.rest))

    def classes(self, column: Column) -> str:
        """What the style sheet has to know of it; long texts may be broken anywhere."""
        number, long = "number" if column.numeric else "", "long" if len(self.text) > _LONGEST_WORD else ""
        return " ".join(name for name in (number, self.tone, long) if name)


Row = Sequence[Cell]


@dataclass(frozen=True)
class Table:
    """`name` is its id in the page. `marks`: by a name that readers may pick, whether each row has it.

    `opens`: for each row the numbers of the traces that it shows when clicked.
    """

    name: str
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Row]
    marks: Mapping[str, Sequence[bool]] | None = None
    opens: Sequence[Sequence[int]] | None = None

    @property
    def paged(self) -> bool:
        """Whether the script pages through it; without script all rows are there."""
        return self.opens is not None or len(self.rows) > _MOST_ROWS_AT_ONCE

    def values(self) -> dict[str, Any]:
        """JSON values, column by column."""
        return {
            "name": self.name,
            "caption": self.caption,
            "columns": [_column_values(column, [row[i] for row in self.rows]) for i, column in enumerate(self.columns)],
            "rows": len(self.rows),
            "marks": {
                name: [i for i, marked in enumerate(rows) if marked] for name, rows in (self.marks or {}).items()
            },
            "opens": {str(i): list(traces) for i, traces in enumerate(self.opens or ()) if traces},
        }


def key_of(value: float | None) -> float:
    """What a figure is sorted by: one that is not reached after all others, none at all last."""
    if value is None or math.isnan(value):
        return _LAST
    return max(min(value, 0.5 * _LAST), -0.5 * _LAST)


def count_cell(count: int) -> Cell:
    """A count."""
    return Cell(str(count), key=count)


def figure_cell(value: float | None) -> Cell:
    """A figure without an interval."""
    return Cell(number(value), key=key_of(value))


def nothing() -> Cell:
    """Where there is no figure."""
    return Cell(NOTHING, key=key_of(None))


def seen(text: str) -> str:
    """The text, plain; at once where every character of it can be seen."""
    return text if text.isprintable() else plain(text)


def shown(name: object) -> str:
    """A name from a file as text that can be seen."""
    return seen(str(name)) or "(no name)"


def _column_values(column: Column, cells: Sequence[Cell]) -> dict[str, Any]:
    """Texts that come again and again are stored once."""
    texts: dict[str, int] = {}
    at = [texts.setdefault(cell.lines, len(texts)) for cell in cells]
    tones = [cell.tone for cell in cells]
    return {
        "heading": column.heading,
        "numeric": column.numeric,
        "choice": column.choice,
        "texts": list(texts),
        "at": at,
        "keys": [short(cell.key) for cell in cells] if any(cell.key is not None for cell in cells) else None,
        "tones": tones if any(tones) else None,
    }


def short(value: float | None) -> float | int | None:
    """A number with few digits, for compact JSON; null for what is no finite number."""
    if value is None or not math.isfinite(value):
        return None
    rounded = float(f"{value:.6g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded
