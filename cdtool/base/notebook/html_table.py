"""A small table as HTML, which a notebook shows for a result: escaped, with a caption and headings."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

# A notebook is no place for a long table: `to_frame` and the frames of a result have all rows.
_MOST_ROWS = 20


def html_table(caption: str, headings: Sequence[str], rows: Sequence[Sequence[object]], note: str = "") -> str:
    """Return a table as HTML.

    Parameters
    ----------
    caption : str
        What the table shows: one line above it, which a screen reader reads first.
    headings : sequence of str
        The heading of each column.
    rows : sequence of sequence of object
        The cells of each row; the first one is the heading of its row. A float is written with four digits, NaN and
        None as a dash. More than 20 rows are cut, and their number is stated.
    note : str, optional
        A sentence below the table.

    Returns
    -------
    str
        The table; every text in it is escaped.

    Examples
    --------
    >>> html_table("Logs of <gate>", ["log", "alarms"], [["a.csv", 1]])
    '<table><caption>Logs of &lt;gate&gt;</caption><thead>...<th scope="row">a.csv</th><td>1</td>...</table>'
    """
    head = "".join(f'<th scope="col">{escape(heading)}</th>' for heading in headings)
    body = "".join(f"<tr>{_row(row)}</tr>" for row in rows[:_MOST_ROWS])
    more = len(rows) - _MOST_ROWS
    notes = [*([f"{more} more rows"] if more > 0 else []), *([note] if note else [])]
    foot = "".join(f"<p>{escape(text)}</p>" for text in notes)
    table = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    return f"<table><caption>{escape(caption)}</caption>{table}</table>{foot}"


def _row(cells: Sequence[object]) -> str:
    first, *others = map(_text, cells)
    return f'<th scope="row">{first}</th>{"".join(f"<td>{text}</td>" for text in others)}'


def _text(cell: object) -> str:
    if cell is None or (isinstance(cell, float) and cell != cell):
        return "–"
    return escape(f"{cell:.4g}" if isinstance(cell, float) else str(cell))
