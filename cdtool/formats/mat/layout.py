"""The columns of a MATLAB file: which numbers are a column, on which clock, and what is left out.

A name is what a MATLAB user writes, `log.joint(2).tau`; the columns of a matrix `q` are `q[0]`, `q[1]` and so on.
The elements of an array of structs are runs if each has a clock of its own: `run(:).tau` is a field of all of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy.typing as npt

from cdtool.findings import Finding
from cdtool.formats.clock_beside import is_clock_name
from cdtool.formats.mat.leaves import Leaf, MatColumn, Section
from cdtool.formats.mat.runs import StructRuns, short_name
from cdtool.formats.mat.variables import Cells, Numbers, Structs, Text, Value, Variables, left_out

_DETAIL = 80
# A matrix in a struct with more columns than this is an image or a model.
_WIDEST = 64


@dataclass
class Layout:
    """The columns of a file in its order; `hidden` ones are read only where a machine file names them.

    `numbers` are the single numbers, `texts` the texts of a file by name; `own_clocks`: several clocks are logged.
    """

    columns: dict[str, MatColumn] = field(default_factory=dict)
    hidden: dict[str, MatColumn] = field(default_factory=dict)
    numbers: dict[str, Numbers] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    @property
    def names(self) -> tuple[str, ...]:
        """All columns of the file."""
        return tuple(dict.fromkeys((*self.columns, *self.hidden)))

    @property
    def clocks(self) -> dict[str, MatColumn]:
        """The clocks of columns by name."""
        return {column.clock: self.columns[column.clock] for column in self.columns.values() if column.clock}

    @property
    def own_clocks(self) -> bool:
        """Whether there are several clocks, so that each column needs the one beside it."""
        alone = [name for name, column in self.columns.items() if not column.clock and is_clock_name(name)]
        return len(self.clocks) + bool(alone) > 1


def arrange_columns(variables: Variables) -> Layout:
    """Return the layout of the variables of a file."""
    layout, walk = Layout(), _Walk(runs=True)
    for name, value in variables.items():
        walk.value(value, name, name, ())
    layout.findings += walk.findings
    layout.numbers, layout.texts = walk.numbers, walk.texts
    layout.columns.update(walk.runs)
    layout.hidden.update(walk.single_runs)
    clocks = _clocks(walk.leaves)
    for leaf in walk.leaves:
        clock, is_alone = _clock_of(leaf, clocks)
        into = layout.hidden if is_alone else layout.columns
        if is_alone:
            layout.findings.append(Finding("without_clock", "", {"variable": leaf.name, "rows": leaf.rows}))
        into.update({name: MatColumn((section,), clock) for name, section in leaf.columns()})
    layout.columns = {name: layout.columns[name] for name in _in_file_order(layout.columns, variables)}
    return layout


def as_table(section: Section, whole: npt.NDArray[Any], findings: list[Finding]) -> npt.NDArray[Any]:
    """Return an array as a table (n, k), its rows along the longer dimension; a note is added if it is read across."""
    table = whole.reshape(-1, 1) if 1 in whole.shape else whole
    if table.shape[0] >= table.shape[1]:
        return table
    rows, columns = whole.shape
    shape = {"thing": "variable", "name": section.name, "rows": rows, "columns": columns}
    findings.append(Finding("rows_as_columns", "", shape))
    return table.T


class _Walk:
    """Collects what is in values: arrays of numbers, single numbers, texts, runs, and what is left out."""

    def __init__(self, runs: bool) -> None:
        self._with_runs = runs
        self.leaves: list[Leaf] = []
        self.numbers: dict[str, Numbers] = {}
        self.texts: dict[str, str] = {}
        self.runs: dict[str, MatColumn] = {}
        self.single_runs: dict[str, MatColumn] = {}
        self.findings: list[Finding] = []

    def value(self, value: Value, name: str, last: str, structs: tuple[str, ...]) -> None:
        """Add a value, or what is inside of it."""
        if isinstance(value, Numbers):
            self._array(value, name, last, structs)
        elif isinstance(value, Text):
            if text := " ".join(value.text.split()):
                self.texts[name] = text[:_DETAIL]
        elif isinstance(value, Structs):
            self._structs(value, name, structs)
        elif isinstance(value, Cells):
            self._cells(value, name, last, structs)
        else:
            self.findings.append(left_out(name, value.what))

    def _array(self, value: Numbers, name: str, last: str, structs: tuple[str, ...]) -> None:
        shape = value.shape
        if len(shape) != 2 or 0 in shape:
            self.findings.append(left_out(name, f"{' x '.join(map(str, shape))} array"))
        elif shape == (1, 1):
            self.numbers[name] = value
        elif structs and min(shape) > _WIDEST:
            self.findings.append(left_out(name, f"{shape[0]} x {shape[1]} matrix, too wide for a log"))
        else:
            self.leaves.append(Leaf(name, last, structs, value))

    def _cells(self, value: Cells, name: str, last: str, structs: tuple[str, ...]) -> None:
        if not any(_has_array(element) for element in value.elements):
            texts = bool(value.elements) and all(isinstance(element, Text) for element in value.elements)
            self.findings.append(left_out(name, "cell of texts" if texts else "cell"))
            return
        for number, element in enumerate(value.elements, 1):
            self.value(element, f"{name}{{{number}}}", last, structs)

    def _structs(self, value: Structs, name: str, structs: tuple[str, ...]) -> None:
        if not value.elements:
            self.findings.append(left_out(name, "empty array of structs"))
        elif len(value.elements) == 1:
            self._fields(value.elements[0], name, structs)
        elif not (self._with_runs and self._runs(value, name)):
            for number, element in enumerate(value.elements, 1):
                self._fields(element, f"{name}({number})", structs)

    def _fields(self, element: Mapping[str, Value], name: str, structs: tuple[str, ...]) -> None:
        for key, part in element.items():
            self.value(part, f"{name}.{key}", key, (*structs, name))

    def _runs(self, value: Structs, name: str) -> bool:
        """Add the elements of an array of structs as runs; False if they are not runs."""
        walks = []
        for number, element in enumerate(value.elements, 1):
            walk = _Walk(runs=False)
            walk._fields(element, f"{name}({number})", ())
            walks.append(walk)
        runs = StructRuns(name, [walk.leaves for walk in walks], [walk.numbers for walk in walks])
        if not runs.are_runs:
            return False
        self.runs |= runs.columns()
        self.single_runs |= runs.single_columns()
        self.findings += runs.findings()
        for walk in walks:
            self.texts |= walk.texts
        left = (
            finding.numbers
            for number in runs.used
            for finding in walks[number].findings
            if finding.kind == "variable_left_out"
        )
        kinds = {f"{name}(:).{short_name(numbers['variable'], name)}": numbers for numbers in left}
        self.findings += [
            Finding("variable_left_out", "", {**numbers, "variable": key}) for key, numbers in kinds.items()
        ]
        return True


def _has_array(value: Value) -> bool:
    """Return whether a value, or one inside of it, is an array of more than one number."""
    if isinstance(value, Numbers):
        return value.shape != (1, 1) and 0 not in value.shape
    if isinstance(value, Structs):
        return any(_has_array(part) for element in value.elements for part in element.values())
    return isinstance(value, Cells) and any(_has_array(part) for part in value.elements)


def _clocks(leaves: Sequence[Leaf]) -> dict[str, dict[int, str]]:
    """Return the clocks inside of each struct by their number of rows; those of the file are under an empty name."""
    clocks: dict[str, dict[int, str]] = {}
    for leaf in leaves:
        if leaf.is_clock:
            clocks.setdefault(leaf.structs[-1] if leaf.structs else "", {}).setdefault(leaf.rows, leaf.name)
    return clocks


def _clock_of(leaf: Leaf, clocks: Mapping[str, Mapping[int, str]]) -> tuple[str, bool]:
    """Return the clock of an array in a struct, and whether the structs around it have clocks, but none as long.

    The clock is the one in the innermost struct; it is empty for a variable that is in no struct: variables of the file
    are a table, whose clock the machine file names.
    """
    if not leaf.structs:
        return "", False
    around = [clocks[name] for name in (*reversed(leaf.structs), "") if name in clocks]
    for of_struct in around:
        if leaf.rows in of_struct:
            own = of_struct[leaf.rows]
            return ("" if of_struct is clocks.get("") else own), False
    return "", bool(around)


def _in_file_order(columns: Mapping[str, MatColumn], variables: Variables) -> list[str]:
    """Return the names of the columns in the order of the variables that they are from."""
    order = {name: number for number, name in enumerate(variables)}
    return sorted(columns, key=lambda name: order[_variable(name, order)])


def _variable(name: str, variables: Mapping[str, int]) -> str:
    return next(name[:end] for end in range(len(name), 0, -1) if name[:end] in variables)
