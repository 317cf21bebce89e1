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

    `about` is below the verdict. Texts are escaped; NaN is a dash, a time has milliseconds.

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
    sentence, lines = escape(verdict[:1].upper() + verdict[1:]), escape(about).replace("\n", "<br>")
    return f'<p style="{style}"><strong>{sentence}</strong><br>{lines}</p>{table}'


def as_frame(table: Table) -> pd.DataFrame:
    """Return a table of the report as a DataFrame of its texts; its first column has the heading of a row's part."""
    import pandas as pd

    rows, part = list[list[str]](), ""
    for place, row in enumerate(table.rows):
        part = table.parts[place].text if place in table.parts else part
        rows.append([part, *(cell.line for cell in row)])
    return pd.DataFrame(rows, columns=["group", *(column.heading for column in table.columns)])
