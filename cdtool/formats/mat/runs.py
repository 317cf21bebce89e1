"""The elements of an array of structs as runs, one after the other, if each has a clock of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from cdtool.findings import Finding
from cdtool.formats.mat.leaves import Leaf, MatColumn, Section
from cdtool.formats.mat.variables import Numbers


class StructRuns:
    """The array of structs `name`: the arrays and the single numbers of each element.

    The elements are runs if each that has arrays has the same clock and no second one. Elements with equal clocks were
    logged side by side: they are no runs. Structs of single numbers only are the rows of a table. `used` are the
    numbers, from 0, of the elements with rows.
    """

    def __init__(self, name: str, leaves: Sequence[Sequence[Leaf]], numbers: Sequence[Mapping[str, Numbers]]) -> None:
        self.name = name
        self._leaves = [{short_name(leaf.name, name): leaf for leaf in some} for some in leaves]
        self._numbers = [{short_name(key, name): value for key, value in some.items()} for some in numbers]
        with_arrays = [some for some in self._leaves if some]
        clocks = [{key for key, leaf in some.items() if leaf.is_clock and "." not in key} for some in with_arrays]
        common = set.intersection(*clocks) if clocks else set[str]()
        self._clock = next((key for some in with_arrays for key in some if key in common), "")
        known = [some[self._clock] for some in with_arrays if self._clock in some]
        self._rows = [some[self._clock].rows if self._clock in some else int(not with_arrays) for some in self._leaves]
        self.used = [number for number, rows in enumerate(self._rows) if rows]
        has_second = any(
            leaf.is_clock and leaf.rows != rows
            for some, rows in zip(self._leaves, self._rows, strict=True)
            for leaf in some.values()
        )
        if with_arrays:
            self.are_runs = len(known) > 1 and not has_second and not _are_equal(known)
        else:
            self.are_runs = any(self._numbers)

    def columns(self) -> dict[str, MatColumn]:
        """Return the fields of all runs, `name(:).tau`, and the column `name(:)` of the run's number."""
        clock = f"{self.name}(:).{self._clock}" if self._clock else ""
        columns = {}
        if clock:
            numbers = (_constant(number + 1, self._rows[number]) for number in self.used)
            columns[f"{self.name}(:)"] = MatColumn(tuple(numbers), clock)
        fields = [self._fields(number) for number in self.used]
        for key in dict.fromkeys(key for some in fields for key in some):
            missing = (Section("", None, rows=self._rows[number]) for number in self.used)
            sections = tuple(some.get(key, none) for some, none in zip(fields, missing, strict=True))
            columns[f"{self.name}(:).{key}"] = MatColumn(sections, clock)
        return columns

    def single_columns(self) -> dict[str, MatColumn]:
        """Return the fields of each run, `name(2).tau`."""
        leaves = (leaf for some in self._leaves for leaf in some.values())
        return {key: MatColumn((section,)) for leaf in leaves for key, section in leaf.columns()}

    def findings(self) -> list[Finding]:
        """Return what the runs are, and which of their fields are left out."""
        if not self._clock:
            return []
        found = [Finding("runs_of_structs", "", {"array": self.name, "runs": len(self.used), "rows": sum(self._rows)})]
        empty = tuple(number + 1 for number, rows in enumerate(self._rows) if not rows)
        if empty:
            found.append(Finding("runs_without_rows", "", {"array": self.name, "runs": empty}))
        other = {
            key: leaf.rows
            for number in self.used
            for key, leaf in self._leaves[number].items()
            if leaf.rows != self._rows[number]
        }
        return [
            *found,
            *(
                Finding("without_clock", "", {"variable": f"{self.name}(:).{key}", "rows": rows})
                for key, rows in other.items()
            ),
        ]

    def _fields(self, number: int) -> dict[str, Section]:
        """Return the columns of one run: arrays as long as its clock, and single numbers in each of its rows."""
        rows = self._rows[number]
        found = {
            short_name(key, self.name): section
            for leaf in self._leaves[number].values()
            if leaf.rows == rows
            for key, section in leaf.columns()
        }
        return found | {key: Section(key, value, rows=rows) for key, value in self._numbers[number].items()}


def short_name(name: str, array: str) -> str:
    """Return the name of a field inside of an element of an array: `joint(1).q` of `run(3).joint(1).q`."""
    return name[len(array) :].partition(").")[2]


def _constant(number: int, rows: int) -> Section:
    return Section("", Numbers((1, 1), partial(np.full, (1, 1), float(number))), rows=rows)


def _are_equal(clocks: Sequence[Leaf]) -> bool:
    if len({clock.rows for clock in clocks}) > 1:
        return False
    values = (np.asarray(clock.numbers.read()).ravel() for clock in clocks)
    return all(np.array_equal(first, second) for first, second in pairwise(values))
