"""The variables of a MATLAB file as values, the same for versions 5 to 7 and for version 7.3."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy.typing as npt

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding

# A file with more values, fields and cells than this is refused: no log has as many.
MOST_VALUES = 200_000
# Values may be nested so deep.
MOST_LEVELS = 32
_ADVICE = {
    "table": "save it as a struct: table2struct({name}, 'ToScalar', true)",
    "timetable": "save it as a struct: table2struct(timetable2table({name}), 'ToScalar', true), with its row times as "
    "numbers: seconds({name}.Time - {name}.Time(1))",
    "timeseries": "save it as a struct: struct('time', {name}.Time, 'data', {name}.Data)",
    "datetime": "save it as numbers: posixtime({name})",
    "duration": "save it as numbers: seconds({name})",
    "categorical": "save it as numbers: double({name})",
    "array of structs without vectors": "save it as one struct of vectors: struct('t', [{name}.t])",
    "sparse matrix": "save it as a plain matrix: full({name})",
    "Simulink.SimulationData.Dataset": "save its signals as numbers: {name}{{1}}.Values.Time, {name}{{1}}.Values.Data",
}
_AN = ("a", "e", "i", "o", "u", "8 ", "11 ", "18 ")


@dataclass(frozen=True)
class Numbers:
    """An array of numbers; `read` returns it with MATLAB's shape."""

    shape: tuple[int, ...]
    read: Callable[[], npt.NDArray[Any]]
    is_complex: bool = False

    @property
    def is_across(self) -> bool:
        """Return whether its rows are along the second dimension, because that is the longer one."""
        return 1 < self.shape[0] < self.shape[1]

    @cached_property
    def table(self) -> npt.NDArray[Any]:
        """Return a vector or matrix as a table (n, k), its rows along the longer dimension."""
        return (self.read() if self.shape[0] >= self.shape[1] else self.read().T).reshape(max(self.shape), -1)


@dataclass(frozen=True)
class MatColumn:
    """Column `index` of a variable's table; `clock` is the name of the column that is its clock, empty if unknown."""

    variable: str
    numbers: Numbers
    index: int = 0
    clock: str = ""

    @property
    def rows(self) -> int:
        """Return the number of its values."""
        return max(self.numbers.shape)

    @property
    def values(self) -> npt.NDArray[Any]:
        """Return its values (n,) as the file has them."""
        return self.numbers.table[:, self.index]


@dataclass(frozen=True)
class Opaque:
    """A value without numbers that can be read: an object of the class `what`, a function handle, a sparse matrix."""

    what: str


# Numbers, a text, an array of structs (a struct has one element), the elements of a cell array in MATLAB's order.
Value = Numbers | str | list[dict[str, "Value"]] | tuple["Value", ...] | Opaque
# The variables of a file by name.
Variables = Mapping[str, Value]


class ValueCount:
    """Counts the values of a file; raises RecordingError if it has more of them, or deeper nested, than any log."""

    def __init__(self) -> None:
        self._count = 0

    def add(self, level: int, count: int) -> None:
        """Count values that are inside of `level` others."""
        self._count += count
        if self._count > MOST_VALUES or level > MOST_LEVELS:
            raise RecordingError(
                f"more than {MOST_VALUES} values or {MOST_LEVELS} levels of structs and cells: refused",
                "save fewer variables",
            )


def left_out(name: str, what: str) -> Finding:
    """Return the note on a variable that is left out, with the MATLAB expression that makes it readable."""
    advice = _ADVICE.get(what, "")
    is_object = (not advice and what[:1].isalpha() and "." in what) or what[:1].isupper()
    advice = advice or ("save its properties as a struct of numbers" if is_object else "")
    return Finding(
        "variable_left_out", "", {"variable": name, "what": with_article(what), "advice": advice.format(name=name)}
    )


def with_article(kind: str) -> str:
    """Return a noun with its indefinite article."""
    return f"{'an' if kind.lower().startswith(_AN) else 'a'} {kind}"
