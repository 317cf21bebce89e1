"""Tables in the HTML page: styles of cells for the template, and long tables as JSON that the script pages through."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cdtool.base.plain_text import plain
from cdtool.report.table import Cell, Heading, Log, Table


@dataclass(frozen=True)
class PageTable:
    """A table of the page. `traces`: the numbers of the traces of each log, which a click on its row shows."""

    table: Table
    traces: Mapping[Log, Sequence[int]]

    @property
    def name(self) -> str:
        """The id of the table in the page."""
        return f"{self.table.name.replace('_', '-')}-table"

    @property
    def paged(self) -> bool:
        """Whether the script pages through it; without script all rows are shown."""
        # A browser needs long to lay out more rows.
        return bool(self.table.logs) or (len(self.table.rows) > 150 and not self.table.parts)

    @property
    def opens(self) -> dict[int, list[int]]:
        """The traces that each row shows when clicked; rows without traces are left out."""
        return {i: list(self.traces[log]) for i, log in enumerate(self.table.logs) if self.traces.get(log)}

    def values(self) -> dict[str, Any]:
        """Return JSON values, column by column."""
        table = self.table
        marks = {name: [i for i, marked in enumerate(rows) if marked] for name, rows in table.marks.items()}
        return {
            "name": self.name,
            "caption": table.title,
            "columns": [_values(column, [row[i] for row in table.rows]) for i, column in enumerate(table.columns)],
            "row_heading": table.row_heading,
            "rows": len(table.rows),
            "marks": {**marks, "with a trigger plot": list(self.opens)} if marks else {},
            "opens": {str(i): traces for i, traces in self.opens.items()},
        }


def classes(cell: Cell, column: Heading) -> str:
    """Return the classes of the style sheet; long texts may be broken anywhere."""
    # A usual name of a log or detector is shorter.
    number, long = "number" if column.numeric else "", "long" if len(cell.text) > 28 else ""
    return " ".join(name for name in (number, cell.tone, long) if name)


def visible(text: str) -> str:
    """Return the text, plain; unchanged if every character of it is visible."""
    return text if text.isprintable() else plain(text)


def short(value: float | None) -> float | int | None:
    """Return a number with few digits, for compact JSON; null for a number that is not finite."""
    if value is None or not math.isfinite(value):
        return None
    rounded = float(f"{value:.6g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded


def _values(column: Heading, cells: Sequence[Cell]) -> dict[str, Any]:
    """Return a column as JSON values; each text is stored once."""
    texts: dict[str, int] = {}
    at = [texts.setdefault("\n".join(map(visible, cell.lines)), len(texts)) for cell in cells]
    tones = [cell.tone for cell in cells]
    return {
        "heading": visible(column.heading),
        "numeric": column.numeric,
        "choice": column.choice,
        "texts": list(texts),
        "at": at,
        "keys": [short(cell.key) for cell in cells] if any(cell.key is not None for cell in cells) else None,
        "tones": tones if any(tones) else None,
    }
