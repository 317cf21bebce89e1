"""A table of a report as plain values, which every renderer shows: headings, cells with their sort keys, and marks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from cdtool.report.number_text import NOTHING, number, spoken, value_and_interval
from cdtool.statistics.interval import Interval

Item = TypeVar("Item")
# A recording's group and name.
Log = tuple[str, str]

# Sorts after every number.
_LAST = 1e300
_TONES = {"met": "good", "pass": "good", "violated": "bad", "fail": "bad", "not_assessable": "unknown"}
_JOINTS = " ,;:"


@dataclass(frozen=True)
class Heading:
    """A column; `numeric` columns are right-aligned and begin with their largest number when sorted.

    `choice`: readers may select one of its values. `names_row`: its cells can be the heading of their row, as a name
    can and an outcome cannot.
    """

    heading: str
    numeric: bool = False
    choice: bool = False
    names_row: bool = True


@dataclass(frozen=True)
class Cell:
    """The text of a cell, and `details` for small print, each with the punctuation that joins it to the text before it.

    `key` sorts the cell, by default its text does. `tone` is good, bad or unknown.
    """

    text: str
    details: tuple[str, ...] = ()
    key: float | None = None
    tone: str = ""

    @property
    def line(self) -> str:
        """All of it in one line."""
        return "".join((self.text, *self.details))

    @property
    def lines(self) -> tuple[str, ...]:
        """The text, and the details without their punctuation."""
        return (self.text, *(detail.lstrip(_JOINTS) for detail in self.details))


Row = Sequence[Cell]
Fields = Sequence[tuple[Heading, Callable[[Item], Cell]]]


@dataclass(frozen=True)
class Table:
    """A table under its title; `source` names its rows in results.json.

    `marks`: by a property that readers may select, whether each row has it. `logs`: the recording of each row.
    `more` rows are not shown, because there are too many. `parts`: the heading of each part, by its first row.
    """

    name: str
    title: str
    columns: Sequence[Heading]
    rows: Sequence[Row]
    source: str = ""
    marks: Mapping[str, Sequence[bool]] = field(default_factory=dict)
    logs: Sequence[Log] = ()
    more: int = 0
    parts: Mapping[int, Cell] = field(default_factory=dict)

    @property
    def counted_title(self) -> str:
        """The title with the number of rows, also those that are not shown."""
        return f"{self.title} ({len(self.rows) + self.more})"

    @property
    def row_heading(self) -> int:
        """The column whose cells are the headings of the rows: the first one that can be."""
        return next((place for place, column in enumerate(self.columns) if column.names_row), 0)

    def cells(self, heading: str) -> list[Cell]:
        """Return the cells below a heading."""
        place = [column.heading for column in self.columns].index(heading)
        return [row[place] for row in self.rows]


def tabulate(
    name: str,
    title: str,
    fields: Fields[Item],
    items: Sequence[Item],
    source: str = "",
    logs: Sequence[Log] = (),
    most: int | None = None,
) -> Table:
    """Return the table with a row per item, up to `most`, and a column per field."""
    rows = [[make(item) for _, make in fields] for item in items[:most]]
    columns = [column for column, _ in fields]
    return Table(name, title, columns, rows, source, logs=logs[:most], more=len(items) - len(rows))


def count_cell(count: int, tone: str = "") -> Cell:
    """Return the cell of a count, with a tone unless it is zero."""
    return Cell(str(count), key=count, tone=tone if count else "")


def number_cell(value: float | None, error: float | None = None) -> Cell:
    """Return the cell of a number without an interval, with no digit finer than its error."""
    return Cell(number(value, error=error), key=key_of(value))


def interval_cell(interval: Interval, error: float | None = None) -> Cell:
    """Return the cell of a value with its interval, if it has one; without an upper end it takes two small lines."""
    value, *details = value_and_interval(interval, error)
    return Cell(value, tuple(details), key_of(interval.value))


def name_cell(name: object) -> Cell:
    """Return the cell of a name from a file."""
    return Cell(shown(name))


def outcome_cell(outcome: str) -> Cell:
    """Return the cell of an outcome or verdict in words, with its tone."""
    return Cell(spoken(outcome), tone=tone_of(outcome))


def empty_cell() -> Cell:
    """Return the cell of a value that does not exist."""
    return Cell(NOTHING, key=key_of(None))


def key_of(value: float | None) -> float:
    """Return what sorts a number: infinite ones follow all others, missing ones are last."""
    if value is None or math.isnan(value):
        return _LAST
    return max(min(value, 0.5 * _LAST), -0.5 * _LAST)


def tone_of(outcome: str) -> str:
    """Return whether an outcome or verdict is good, bad or unknown."""
    return _TONES.get(outcome, "")


def shown(name: object) -> str:
    """Return a name from a file as a text that is never empty; the group `holdout` as texts call it."""
    return {"": "(no name)", "holdout": "hold-out"}.get(str(name), str(name))
