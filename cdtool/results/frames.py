"""Rows as pandas DataFrames: one column per field, with its unit in its name, typed, also without any row.

pandas is imported only here and where a value is converted: no command needs it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, get_type_hints

from cdtool.results.results import Results, scalar_of, tables

if TYPE_CHECKING:
    import pandas as pd

# The order of the outcomes, from detected to what could not be scored.
OUTCOMES = ("detected", "missed", "not_assessable", "in_progress")
# What is looked at first of a contact; its row has 25 columns.
FIRST_OF_CONTACT = [
    *("recording", "group", "detector", "contact", "outcome", "latency_ms", "onset_s", "alarm_s"),
    *("force_at_alarm_n", "peak_force_n", "reason"),
]


def rows_as_frame(
    kind: type[Any], rows: Sequence[Any], categories: Mapping[str, Sequence[str]] | None = None
) -> pd.DataFrame:
    """Return rows of one dataclass as a DataFrame.

    Parameters
    ----------
    kind : type
        The class of the rows.
    rows : sequence
        The rows.
    categories : mapping of str to sequence of str, optional
        Columns of few different texts, and these in their order.

    Returns
    -------
    DataFrame
        A column per field. Numbers that are not known are NaN, texts that are not known `pandas.NA`.

    Examples
    --------
    >>> from cdtool.results.results import Skipped
    >>> frame = rows_as_frame(Skipped, [Skipped("a.csv", "empty")])
    >>> frame.columns.tolist(), frame.reason[0], len(rows_as_frame(Skipped, []))
    (['recording', 'reason'], 'empty', 0)
    """
    import pandas as pd

    hints, known = get_type_hints(kind), categories or {}
    columns: dict[str, Any] = {}
    for item in fields(kind):
        values = [getattr(row, item.name) for row in rows]
        if item.name in known:
            columns[item.name] = pd.Categorical(values, categories=list(dict.fromkeys(known[item.name])))
        else:
            columns[item.name] = pd.Series(values, dtype=_dtype_of(hints[item.name]))
    return pd.DataFrame(columns)


def results_as_frame(results: Results, table: str) -> pd.DataFrame:
    """Return one kind of rows of a benchmark as a DataFrame.

    Parameters
    ----------
    results : Results
        The results.
    table : str
        The field of `Results`, such as "contacts".

    Returns
    -------
    DataFrame
        Detectors and groups are categories in the order of the benchmark file.

    Examples
    --------
    >>> empty = Results(provenance={}, detectors=("pt",), groups=(), contacts=(), false_alarms=(), exposure=())
    >>> frame = results_as_frame(empty, "contacts")
    >>> len(frame), str(frame.latency_ms.dtype), frame.detector.cat.categories.tolist()
    (0, 'float64', ['pt'])
    """
    kind, rows = tables()[table], getattr(results, table)
    known: dict[str, Sequence[str]] = {"detector": results.detectors, "group": results.every_group}
    if table == "contacts":
        known["outcome"] = OUTCOMES
    # A limit may be about all detectors or about a kind of contacts, whose names are not among these.
    complete = {
        name: values
        for name, values in known.items()
        if name in {item.name for item in fields(kind)} and {getattr(row, name) for row in rows} <= set(values)
    }
    return rows_as_frame(kind, rows, complete)


def _dtype_of(hint: Any) -> str:
    """Return the type of a column for the type of a field; other values than texts and numbers are objects."""
    scalar = scalar_of(hint)
    if scalar is int and hint is not int:
        return "Int64"
    return {float: "float64", int: "int64", bool: "bool", str: "string"}[scalar] if scalar else "object"
