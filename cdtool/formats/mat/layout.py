"""The columns of a MATLAB file: which numbers are a column, on which clock, and what is left out.

A name is what a MATLAB user writes, `log.joint(2).tau`; the columns of a matrix `q` are `q[0]`, `q[1]` and so on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from cdtool.base.findings import Finding
from cdtool.formats.mat.clock_beside import is_clock_name
from cdtool.formats.mat.variables import MatColumn, Numbers, Value, Variables, left_out


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

    def columns(self) -> Iterator[tuple[str, MatColumn]]:
        """Yield its columns with their names."""
        for i in range(min(self.numbers.shape)):
            name = self.name if 1 in self.numbers.shape else f"{self.name}[{i}]"
            yield name, MatColumn(self.name, self.numbers, i)


@dataclass
class MatLayout:
    """The columns of a file in its order; `hidden` ones are read only where a machine file names them.

    `leaves` are the arrays of numbers, `numbers` the single numbers, `texts` the texts by name.
    """

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
                self.texts[name] = text[:80]
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
        # A larger matrix in a struct is an image or a model.
        elif structs and min(shape) > 64:
            self.findings.append(left_out(name, f"{shape[0]} x {shape[1]} matrix, too wide for a log"))
        else:
            leaf = Leaf(name, last, structs, value)
            self.leaves.append(leaf)
            self.columns |= dict(leaf.columns())

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
        elif len(value) > 1 and not _has_array(value):
            self.findings.append(left_out(name, "array of structs without vectors"))
        for number, element in enumerate(value, 1):
            place = name if len(value) == 1 else f"{name}({number})"
            for key, part in element.items():
                self.add(part, f"{place}.{key}", key, (*structs, place))


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
