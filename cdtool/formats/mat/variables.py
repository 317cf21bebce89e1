"""The variables of a MATLAB file as values, the same for versions 5 to 7 and for version 7.3."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.findings import Finding

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


@dataclass(frozen=True)
class Text:
    """A text, or the rows of an array of characters."""

    text: str


@dataclass(frozen=True)
class Structs:
    """An array of structs: the fields of each element, in MATLAB's order. A struct is an array of one element."""

    elements: tuple[Mapping[str, Value], ...]


@dataclass(frozen=True)
class Cells:
    """A cell array: its elements in MATLAB's order."""

    elements: tuple[Value, ...]


@dataclass(frozen=True)
class Opaque:
    """A value without numbers that can be read: an object of the class `what`, a function handle, a sparse matrix."""

    what: str


Value = Numbers | Text | Structs | Cells | Opaque
# The variables of a file by name.
Variables = Mapping[str, Value]


class ValueCount:
    """Counts the values of a file; raises RecordingError if a file has more of them than any log."""

    def __init__(self, place: str) -> None:
        self._place, self._count = place, 0

    def add_all(self, count: int) -> None:
        """Check that there may be so many more values."""
        self.add(0, count)
        self._count -= count

    def add(self, level: int, count: int = 1) -> None:
        """Count values that are inside of `level` others."""
        self._count += count
        if self._count > MOST_VALUES or level > MOST_LEVELS:
            what = f"more than {MOST_VALUES} values" if self._count > MOST_VALUES else f"more than {MOST_LEVELS} levels"
            raise RecordingError(f"{self._place}: {what} of structs and cells: refused", "save fewer variables")


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
