"""Many rows of one kind in little memory: held column by column, made into rows when they are asked for.

A hundred thousand contacts take 20 MB rather than 80 MB. Numbers with a fraction are stored as such, everything else by
reference to one object for all equal values; a field that holds rows itself is stored in the same way.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from functools import cache, partial
from itertools import islice, pairwise
from typing import Any, Generic, Protocol, TypeVar, get_args, get_origin, get_type_hints, overload

Row = TypeVar("Row")
# Rows that are made at once while iterating.
_AT_ONCE = 1024


class _Column(Protocol):
    """The values of one field."""

    def add(self, value: Any) -> None: ...

    def extend(self, values: Sequence[Any]) -> None: ...

    def at(self, number: int) -> Any: ...

    def between(self, first: int, last: int) -> Sequence[Any]: ...

    def some(self, numbers: Sequence[int]) -> Sequence[Any]: ...


class Rows(Sequence[Row], Generic[Row]):
    """Rows of one dataclass, to which more can be added; it equals any sequence of equal rows.

    Parameters
    ----------
    kind : type
        The class of the rows, a frozen dataclass without code of its own in its creation.
    rows : iterable
        The first rows.

    Examples
    --------
    >>> from cdtool.results.results import Skipped
    >>> rows = Rows(Skipped, [Skipped("a.csv", "empty")])
    >>> rows += [Skipped("b.csv", "empty")]
    >>> rows[1].recording, [row.recording for row in rows], rows == (Skipped("a.csv", "empty"), rows[1])
    ('b.csv', ['a.csv', 'b.csv'], True)
    """

    def __init__(self, kind: type[Row], rows: Iterable[Row] = ()) -> None:
        self.kind = kind
        self.names = tuple(item.name for item in fields(kind))  # type: ignore[arg-type]  # a dataclass
        self._columns: tuple[_Column, ...] = tuple(make() for make in _makers(kind))  # type: ignore[arg-type]  # types are hashable
        self._length = 0
        self.extend(rows)

    def append(self, row: Row) -> None:
        """Add a row."""
        values = row.__dict__
        for name, column in zip(self.names, self._columns, strict=True):
            column.add(values[name])
        self._length += 1

    def extend(self, rows: Iterable[Row]) -> None:
        """Add rows in order."""
        for row in rows:
            self.append(row)

    def extend_columns(self, columns: Sequence[Sequence[Any]]) -> None:
        """Add rows that are given as the values of each field; raises ValueError for columns that do not fit."""
        lengths = {len(values) for values in columns}
        if len(columns) != len(self.names) or len(lengths) != 1:
            raise ValueError(f"{len(columns)} columns of {sorted(lengths)} values for {len(self.names)} fields")
        for column, values in zip(self._columns, columns, strict=True):
            column.extend(values)
        self._length += lengths.pop()

    def blocks(self, size: int = _AT_ONCE) -> Iterator[list[Sequence[Any]]]:
        """Yield all rows in blocks, each as the values of each field."""
        for first in range(0, self._length, size):
            yield [column.between(first, min(first + size, self._length)) for column in self._columns]

    def __iadd__(self, rows: Iterable[Row]) -> Rows[Row]:
        self.extend(rows)
        return self

    def values(self, name: str) -> Sequence[Any]:
        """Return the values of a field, in the order of the rows."""
        return self._columns[self.names.index(name)].between(0, self._length)

    def picked(self, numbers: Sequence[int]) -> Sequence[Row]:
        """Return the rows with these numbers, which are made when they are asked for."""
        return _Picked(self, array("q", numbers))

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, number: int) -> Row: ...

    @overload
    def __getitem__(self, number: slice) -> Sequence[Row]: ...

    def __getitem__(self, number: int | slice) -> Row | Sequence[Row]:
        if isinstance(number, slice):
            return self.picked(range(self._length)[number])
        place = range(self._length)[number]  # raises IndexError
        return _row(self.kind, self.names, [column.at(place) for column in self._columns])

    def __iter__(self) -> Iterator[Row]:
        for columns in self.blocks():
            yield from (_row(self.kind, self.names, values) for values in zip(*columns, strict=True))

    def between(self, first: int, last: int) -> Iterator[Row]:
        """Yield the rows from one number up to another."""
        columns = [column.between(first, last) for column in self._columns]
        return (_row(self.kind, self.names, values) for values in zip(*columns, strict=True))

    def some(self, numbers: Sequence[int]) -> Iterator[Row]:
        """Yield the rows with these numbers."""
        columns = [column.some(numbers) for column in self._columns]
        return (_row(self.kind, self.names, values) for values in zip(*columns, strict=True))

    def values_at(self, name: str, numbers: Sequence[int]) -> Sequence[Any]:
        """Return the values of a field of the rows with these numbers."""
        return self._columns[self.names.index(name)].some(numbers)

    def __eq__(self, other: object) -> Any:
        return _equal(self, other)

    __hash__ = None  # type: ignore[assignment]  # more rows can be added

    def __repr__(self) -> str:
        return f"Rows({self.kind.__name__}, {len(self)} rows)"


class _Picked(Sequence[Row]):
    """Some rows of many."""

    def __init__(self, rows: Rows[Row], numbers: array[int]) -> None:
        self.rows, self.numbers = rows, numbers

    def values(self, name: str) -> Sequence[Any]:
        """Return the values of a field."""
        return self.rows.values_at(name, self.numbers)

    def __len__(self) -> int:
        return len(self.numbers)

    @overload
    def __getitem__(self, number: int) -> Row: ...

    @overload
    def __getitem__(self, number: slice) -> Sequence[Row]: ...

    def __getitem__(self, number: int | slice) -> Row | Sequence[Row]:
        if isinstance(number, slice):
            return _Picked(self.rows, self.numbers[number])
        return self.rows[self.numbers[number]]

    def __iter__(self) -> Iterator[Row]:
        for first in range(0, len(self.numbers), _AT_ONCE):
            yield from self.rows.some(self.numbers[first : first + _AT_ONCE])

    def __eq__(self, other: object) -> Any:
        return _equal(self, other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"{len(self)} of {self.rows!r}"


def values_of(rows: Sequence[Any], name: str) -> Sequence[Any]:
    """Return the values of a field of rows, without making rows that are held as columns.

    Parameters
    ----------
    rows : sequence
        The rows.
    name : str
        The field.

    Returns
    -------
    sequence
        The values, in the order of the rows.

    Examples
    --------
    >>> from cdtool.results.results import Skipped
    >>> values_of((Skipped("a.csv", "empty"),), "reason")
    ['empty']
    """
    if isinstance(rows, Rows | _Picked):
        return rows.values(name)
    return [getattr(row, name) for row in rows]


def picked(rows: Sequence[Row], numbers: Sequence[int]) -> Sequence[Row]:
    """Return some of many rows.

    Parameters
    ----------
    rows : sequence
        The rows.
    numbers : sequence of int
        The positions of those that are wanted.

    Returns
    -------
    sequence
        The rows in the order of the numbers; those of `Rows` are made when they are asked for.

    Examples
    --------
    >>> picked("abc", [2, 0])
    ('c', 'a')
    """
    if isinstance(rows, Rows):
        return rows.picked(numbers)
    if isinstance(rows, _Picked):
        return rows.rows.picked([rows.numbers[number] for number in numbers])
    return tuple(rows[number] for number in numbers)


def grouped(rows: Sequence[Row], *names: str) -> dict[tuple[Any, ...], Sequence[Row]]:
    """Return rows by the values of some fields, in the order of their first rows.

    Parameters
    ----------
    rows : sequence
        The rows.
    *names : str
        The fields.

    Returns
    -------
    dict of tuple to sequence
        The rows by their values of the fields; those of `Rows` are made when they are asked for.

    Examples
    --------
    >>> from cdtool.results.results import Skipped
    >>> of = grouped([Skipped("a", "empty"), Skipped("b", "empty")], "reason")
    >>> {key: len(items) for key, items in of.items()}
    {('empty',): 2}
    """
    numbers: dict[tuple[Any, ...], array[int]] = {}
    for number, key in enumerate(zip(*(values_of(rows, name) for name in names), strict=True)):
        if (known := numbers.get(key)) is None:
            known = numbers[key] = array("q")
        known.append(number)
    return {key: picked(rows, places) for key, places in numbers.items()}


def _row(kind: type[Row], names: Sequence[str], values: Sequence[Any]) -> Row:
    """Return a row; a third of the time that the dataclass takes, which sets its frozen fields one by one."""
    made: Any = object.__new__(kind)
    made.__dict__.update(zip(names, values, strict=True))
    return made  # type: ignore[no-any-return]


def _equal(rows: Sequence[Any], other: object) -> Any:
    if not isinstance(other, Sequence) or isinstance(other, str):
        return NotImplemented
    return len(rows) == len(other) and all(one == another for one, another in zip(rows, other, strict=True))


class _Floats:
    """Floats, and None where there is no value: as numbers, with the places of None beside them."""

    def __init__(self) -> None:
        self.numbers = array("d")
        self.absent = bytearray()

    def add(self, value: float | None) -> None:
        self.numbers.append(0.0 if value is None else value)
        self.absent.append(value is None)

    def extend(self, values: Sequence[float | None]) -> None:
        if None in values:
            self.numbers.extend([0.0 if value is None else value for value in values])
            self.absent.extend([value is None for value in values])
        else:
            self.numbers.extend(values)  # type: ignore[arg-type]  # none of them is None
            self.absent.extend(bytes(len(values)))

    def at(self, number: int) -> float | None:
        return None if self.absent[number] else self.numbers[number]

    def between(self, first: int, last: int) -> Sequence[float | None]:
        numbers, absent = self.numbers[first:last].tolist(), self.absent[first:last]
        if not any(absent):
            return numbers
        return [None if is_absent else value for value, is_absent in zip(numbers, absent, strict=True)]

    def some(self, numbers: Sequence[int]) -> Sequence[float | None]:
        known, absent = self.numbers, self.absent
        return [None if absent[number] else known[number] for number in numbers]


class _Objects:
    """Texts, counts and everything else: one object for all equal texts."""

    def __init__(self) -> None:
        self.items: list[Any] = []

    def add(self, value: Any) -> None:
        self.items.append(sys.intern(value) if type(value) is str else value)

    def extend(self, values: Sequence[Any]) -> None:
        self.items.extend([sys.intern(value) if type(value) is str else value for value in values])

    def at(self, number: int) -> Any:
        return self.items[number]

    def between(self, first: int, last: int) -> Sequence[Any]:
        return self.items[first:last]

    def some(self, numbers: Sequence[int]) -> Sequence[Any]:
        items = self.items
        return [items[number] for number in numbers]


class _Nested:
    """A tuple of rows in each row: all of them in rows of their own."""

    def __init__(self, kind: type[Any]) -> None:
        self.rows: Rows[Any] = Rows(kind)
        self.ends = array("q", [0])

    def add(self, value: tuple[Any, ...]) -> None:
        self.rows.extend(value)
        self.ends.append(len(self.rows))

    def extend(self, values: Sequence[tuple[Any, ...]]) -> None:
        for value in values:
            self.add(value)

    def at(self, number: int) -> tuple[Any, ...]:
        return tuple(self.rows.between(self.ends[number], self.ends[number + 1]))

    def between(self, first: int, last: int) -> Sequence[tuple[Any, ...]]:
        ends = self.ends[first : last + 1]
        rows = self.rows.between(ends[0], ends[-1])
        return [tuple(islice(rows, end - begin)) for begin, end in pairwise(ends)]

    def some(self, numbers: Sequence[int]) -> Sequence[tuple[Any, ...]]:
        spans = [range(self.ends[number], self.ends[number + 1]) for number in numbers]
        rows = self.rows.some([place for span in spans for place in span])
        return [tuple(islice(rows, len(span))) for span in spans]


@cache
def _makers(kind: Any) -> tuple[Callable[[], _Column], ...]:
    """Return what makes the column of each field."""
    hints = get_type_hints(kind)
    return tuple(_maker(hints[item.name]) for item in fields(kind))


def _maker(kind: Any) -> Callable[[], _Column]:
    inner = get_args(kind)
    if kind is float or (inner and set(inner) == {float, type(None)}):
        return _Floats
    if get_origin(kind) is tuple and is_dataclass(inner[0]):
        return partial(_Nested, inner[0])  # type: ignore[arg-type]  # a class, not an instance
    return _Objects
