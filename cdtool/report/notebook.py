"""What a notebook shows of a result: its verdict in its colour, and a table below it."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any

from cdtool.report.number_text import NOTHING, short
from cdtool.report.table import Table

if TYPE_CHECKING:
    import pandas as pd

    from cdtool.report.table import Table

# Legible beside a white and a black background.
_COLOURS = {"good": "#1f9254", "bad": "#d93a2f", "unknown": "#c98500"}


def notebook_table(verdict: str, frame: pd.DataFrame, about: str, tone: str = "") -> str:
    """Return a frame as HTML below its verdict, which a notebook shows; of many rows the first and the last ten.

    `about` is a line below the verdict. Texts are escaped; NaN is a dash, a time has milliseconds.

    >>> import pandas as pd
    >>> notebook_table("All <2> limits are met", pd.DataFrame({"latency_ms": [31.0]}), "gate", "good")[:60]
    '<p style="border-left: 6px solid #1f9254; padding-left: 8px">'
    """
    formats: dict[str, Callable[[Any], str]] = {
        name: "{:.3f}".format if name.endswith("_s") else short for name in map(str, frame.select_dtypes("float"))
    }
    hides = len(frame) > 20
    table = frame.to_html(index=False, na_rep=NOTHING, formatters=formats, max_rows=20, show_dimensions=hides)
    style = f"border-left: 6px solid {_COLOURS.get(tone, '#888')}; padding-left: 8px"
    sentence = escape(verdict[:1].upper() + verdict[1:])
    return f'<p style="{style}"><strong>{sentence}</strong><br>{escape(about)}</p>{table}'


def as_frame(table: Table) -> pd.DataFrame:
    """Return a table of the report as a DataFrame of its texts; the heading of a part is a row of its own."""
    import pandas as pd

    names = [column.heading for column in table.columns]
    rows = [[cell.line for cell in row] for row in table.rows]
    for place, part in [*table.parts.items()][::-1]:
        rows.insert(place, [part.line, *[""] * (len(names) - 1)])
    return pd.DataFrame(rows, columns=names)
