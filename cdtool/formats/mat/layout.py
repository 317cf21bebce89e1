"""The columns of a MATLAB file: which numbers are a column, on which clock, and what is left out.

A name is what a MATLAB user writes, `log.joint(2).tau`; the columns of a matrix `q` are `q[0]`, `q[1]` and so on.
The elements of an array of structs are runs if each has a clock of its own: `run(:).tau` is a field of all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import numpy as np

from cdtool.base.findings import Finding
from cdtool.formats.containers.clock_beside import is_clock_name
from cdtool.formats.mat.variables import MatColumn, Numbers, Value, Variables, VariableSection, left_out

_DETAIL = 80
# A matrix in a struct with more columns than this is an image or a model.
_WIDEST = 64


@dataclass(frozen=True)
class Leaf:
    """An array of numbers with its name, its last name, and the names of the structs around it, the innermost last."""

    name: str
    last: str
    structs: tuple[str, ...]
    numbers: Numbers

    @property
    def rows(self) -> int:
        """Return the number of rows that it is read as."""
        return max(self.numbers.shape)

    @property
    def is_clock(self) -> bool:
        """Return whether it has the name and the shape of a clock."""
        return bool(is_clock_name(self.last)) and 1 in self.numbers.shape and not self.numbers.is_complex

    def columns(self) -> Iterator[tuple[str, VariableSection]]:
        """Yield the names and sections of its columns."""
        for i in range(min(self.numbers.shape)):
            yield (
                self.name if 1 in self.numbers.shape else f"{self.name}[{i}]",
                VariableSection(self.name, self.numbers, i),
            )


@dataclass
class MatLayout:
    """The columns of a file in its order; `hidden` ones are read only where a machine file names them.

    `leaves` are the arrays of numbers, `numbers` the single numbers, `texts` the texts by name. `with_runs`: arrays of
    structs may be runs.
    """

    with_runs: bool = True
    columns: dict[str, MatColumn] = field(default_factory=dict)
    hidden: dict[str, MatColumn] = field(default_factory=dict)
    leaves: list[Leaf] = field(default_factory=list)
    numbers: dict[str, Numbers] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    @property
    def names(self) -> tuple[str, ...]:
        """All columns of the file."""
        return tuple(dict.fromkeys((*self.columns, *self.hidden)))

    @property
    def own_clocks(self) -> bool:
        """Whether there are several clocks, so that each column needs the one beside it."""
        alone = any(not column.clock and is_clock_name(name) for name, column in self.columns.items())
        return len({column.clock for column in self.columns.values() if column.clock}) + alone > 1

    def add(self, value: Value, name: str, last: str, structs: tuple[str, ...]) -> None:
        """Add a value, or what is inside of it."""
        if isinstance(value, Numbers):
            self._array(value, name, last, structs)
        elif isinstance(value, str):
            if text := " ".join(value.split()):
                self.texts[name] = text[:_DETAIL]
        elif isinstance(value, list):
            self._structs(value, name, structs)
        elif isinstance(value, tuple):
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
            leaf = Leaf(name, last, structs, value)
            self.leaves.append(leaf)
            self.columns |= {key: MatColumn((section,)) for key, section in leaf.columns()}

    def _cells(self, value: tuple[Value, ...], name: str, last: str, structs: tuple[str, ...]) -> None:
        if not any(_has_array(element) for element in value):
            texts = bool(value) and all(isinstance(element, str) for element in value)
            self.findings.append(left_out(name, "cell of texts" if texts else "cell"))
            return
        for number, element in enumerate(value, 1):
            self.add(element, f"{name}{{{number}}}", last, structs)

    def _structs(self, value: list[dict[str, Value]], name: str, structs: tuple[str, ...]) -> None:
        if not value:
            self.findings.append(left_out(name, "empty array of structs"))
        elif len(value) == 1:
            self._fields(value[0], name, structs)
        elif not (self.with_runs and self._runs(value, name)):
            for number, element in enumerate(value, 1):
                self._fields(element, f"{name}({number})", structs)

    def _fields(self, element: Mapping[str, Value], name: str, structs: tuple[str, ...]) -> None:
        for key, part in element.items():
            self.add(part, f"{name}.{key}", key, (*structs, name))

    def _runs(self, value: list[dict[str, Value]], name: str) -> bool:
        """Add the elements of an array of structs as runs, one after the other; False if they are not runs.

        They are runs if each that has arrays has the same clock and no second one. Elements with equal clocks were
        logged side by side: they are no runs. Structs of single numbers only are the rows of a table.
        """
        inside = [MatLayout(with_runs=False) for _ in value]
        for number, (layout, element) in enumerate(zip(inside, value, strict=True), 1):
            layout._fields(element, f"{name}({number})", ())
        leaves = [{_inner_name(leaf.name, name): leaf for leaf in layout.leaves} for layout in inside]
        filled = [some for some in leaves if some]
        clocks = [{key for key, leaf in some.items() if leaf.is_clock and "." not in key} for some in filled]
        common = set.intersection(*clocks) if clocks else set[str]()
        clock = next((key for key in next(iter(filled), {}) if key in common), "")
        rows = [some[clock].rows if clock in some else int(not filled) for some in leaves]
        if clock:
            has_second = any(
                leaf.is_clock and leaf.rows != count
                for some, count in zip(leaves, rows, strict=True)
                for leaf in some.values()
            )
            if len(filled) < 2 or has_second or _are_equal([some[clock] for some in filled]):
                return False
        elif filled or not any(layout.numbers for layout in inside):
            return False
        used = [i for i, count in enumerate(rows) if count]
        fields = [_fields_of_run(leaves[i], inside[i].numbers, name, rows[i]) for i in used]
        if clock:
            other = {key: leaf.rows for i in used for key, leaf in leaves[i].items() if leaf.rows != rows[i]}
            self._add_run_findings(name, rows, other)
            ids = tuple(VariableSection("", _constant(float(i + 1), rows[i])) for i in used)
            self.columns[f"{name}(:)"] = MatColumn(ids, f"{name}(:).{clock}")
        for key in dict.fromkeys(key for some in fields for key in some):
            missing = (VariableSection("", _constant(np.nan, rows[i])) for i in used)
            sections = tuple(some.get(key, none) for some, none in zip(fields, missing, strict=True))
            self.columns[f"{name}(:).{key}"] = MatColumn(sections, f"{name}(:).{clock}" if clock else "")
        self.hidden |= {key: column for layout in inside for key, column in layout.columns.items()}
        self.texts |= {key: text for layout in inside for key, text in layout.texts.items()}
        left = [found for i in used for found in inside[i].findings if found.kind == "variable_left_out"]
        named = {f"{name}(:).{_inner_name(found.numbers['variable'], name)}": found.numbers for found in left}
        self.findings += [
            Finding("variable_left_out", "", {**numbers, "variable": key}) for key, numbers in named.items()
        ]
        return True

    def _add_run_findings(self, name: str, rows: Sequence[int], other: Mapping[str, int]) -> None:
        """Add what the runs are, and which of their fields, with `other` numbers of rows, are left out."""
        used = sum(map(bool, rows))
        self.findings.append(Finding("runs_of_structs", "", {"array": name, "runs": used, "rows": sum(rows)}))
        if empty := tuple(number for number, count in enumerate(rows, 1) if not count):
            self.findings.append(Finding("runs_without_rows", "", {"array": name, "runs": empty}))
        for key, count in other.items():
            self.findings.append(Finding("without_clock", "", {"variable": f"{name}(:).{key}", "rows": count}))


def arrange_columns(variables: Variables) -> MatLayout:
    """Return the layout of the variables of a file."""
    layout = MatLayout()
    for name, value in variables.items():
        layout.add(value, name, name, ())
    clocks = _clocks(layout.leaves)
    for leaf in layout.leaves:
        clock, is_alone = _clock_of(leaf, clocks)
        names = [key for key, _ in leaf.columns()]
        if is_alone:
            layout.findings.append(Finding("without_clock", "", {"variable": leaf.name, "rows": leaf.rows}))
            layout.hidden |= {key: layout.columns.pop(key) for key in names}
        else:
            layout.columns |= {key: replace(layout.columns[key], clock=clock) for key in names}
    return layout


def _has_array(value: Value) -> bool:
    """Return whether a value, or one inside of it, is an array of more than one number."""
    if isinstance(value, Numbers):
        return value.shape != (1, 1) and 0 not in value.shape
    if isinstance(value, list):
        return any(_has_array(part) for element in value for part in element.values())
    return isinstance(value, tuple) and any(_has_array(part) for part in value)


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


def _inner_name(name: str, array: str) -> str:
    """Return the name of a field inside of an element of an array: `joint(1).q` of `run(3).joint(1).q`."""
    return name[len(array) :].partition(").")[2]


def _fields_of_run(
    leaves: Mapping[str, Leaf], numbers: Mapping[str, Numbers], array: str, rows: int
) -> dict[str, VariableSection]:
    """Return the columns of a run: arrays as long as its clock, and single numbers in each of its rows."""
    found = {
        _inner_name(key, array): section
        for leaf in leaves.values()
        if leaf.rows == rows
        for key, section in leaf.columns()
    }
    return found | {_inner_name(key, array): VariableSection(key, each.repeated(rows)) for key, each in numbers.items()}


def _constant(number: float, rows: int) -> Numbers:
    return Numbers((rows, 1), partial(np.full, (rows, 1), number))


def _are_equal(clocks: Sequence[Leaf]) -> bool:
    if len({clock.rows for clock in clocks}) > 1:
        return False
    values = (np.asarray(clock.numbers.read()).ravel() for clock in clocks)
    return all(np.array_equal(first, second) for first, second in pairwise(values))
