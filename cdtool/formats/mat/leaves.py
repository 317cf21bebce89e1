"""Arrays of numbers in a MATLAB file, and the columns that they are parts of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.formats.clock_beside import is_clock_name
from cdtool.formats.mat.variables import Numbers


@dataclass(frozen=True)
class Section:
    """The rows of a column that one variable contains: column `index` of its matrix, or (`rows`) one number repeated.

    Without a variable the rows are missing.
    """

    name: str
    numbers: Numbers | None
    index: int = 0
    rows: int = 0

    def values(self) -> npt.NDArray[Any]:
        """Return its values (n,)."""
        if self.numbers is None:
            return np.full(self.rows, np.nan)
        return np.repeat(self.numbers.table[:1, 0], self.rows) if self.rows else self.numbers.table[:, self.index]


@dataclass(frozen=True)
class MatColumn:
    """A column: its sections, one after the other, and the name of the column that is its clock; empty if unknown."""

    sections: tuple[Section, ...]
    clock: str = ""


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

    def columns(self) -> Iterator[tuple[str, Section]]:
        """Yield the names and sections of its columns."""
        if 1 in self.numbers.shape:
            yield self.name, Section(self.name, self.numbers)
        else:
            for i in range(min(self.numbers.shape)):
                yield f"{self.name}[{i}]", Section(self.name, self.numbers, i)
