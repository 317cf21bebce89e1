"""What a layout of logs is: a file that it writes, and the truth about each column."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.random import Generator

FloatArray = np.ndarray


@dataclass(frozen=True)
class Truth:
    """What a column is.

    `channel` is a channel of cdtool, "current" (accepted as torque), "time", or "" for one that must not be mapped.
    `joint` is the joint's name or number as text where there are several. `unit` is that of the values, "" if unknown.
    """

    channel: str = ""
    joint: str = ""
    unit: str = ""


@dataclass(frozen=True)
class Layout:
    """A kind of log: who writes such files, how a small look-alike is written, and the truth by column name.

    `machine` is "linear axis", "rotary axis" or "robot". `accept` are further channels that are right for a column, and
    "" if it may also stay unmapped: a set value has the channel "" and accepts `reference_position`. Where the reader
    has other names for the columns (a header of several lines), the truth is that of the columns in order.
    """

    name: str
    source: str
    suffix: str
    machine: str
    write: Callable[[Path, Generator], None]
    truth: Mapping[str, Truth]
    accept: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


Columns = Mapping[str, tuple[Truth, FloatArray]]


@dataclass(frozen=True)
class Table:
    """How a text table is written: separator, decimal mark, lines before the names, and whether it has names."""

    separator: str = ","
    decimal: str = "."
    before: Sequence[str] = ()
    header: bool = True
    digits: int = 7
    encoding: str = "utf-8"
    units: Sequence[str] = ()

    def write(self, path: Path, columns: Mapping[str, FloatArray]) -> None:
        """Write the columns, one line per sample."""
        lines = list(self.before)
        if self.header:
            lines.append(self.separator.join(columns))
        if self.units:
            lines.append(self.separator.join(self.units))
        rows = np.column_stack(list(columns.values()))
        if np.all(np.abs(rows) < 1e8):  # and finite
            line = self.separator.join([f"%.{self.digits}g"] * rows.shape[1])
            text = [(line % tuple(row)) for row in rows.tolist()]
            if self.decimal != ".":
                text = [row.replace(".", self.decimal) for row in text]
        else:
            text = [self.separator.join(self._cell(value) for value in row) for row in rows.tolist()]
        path.write_text("\n".join([*lines, *text]) + "\n", encoding=self.encoding)

    def _cell(self, value: float) -> str:
        if not np.isfinite(value):
            return ""
        # Time stamps of an epoch have more digits before the decimal mark than a measured value has altogether.
        text = f"{value:.6f}" if abs(value) >= 1e8 else f"{value:.{self.digits}g}"
        return text.replace(".", self.decimal)


def table_layout(
    name: str, source: str, machine: str, columns: Callable[[Generator], Columns], table: Table | None = None
) -> Layout:
    """Return a layout whose file is a text table with these columns."""
    style = table or Table()

    def write(path: Path, generator: Generator) -> None:
        style.write(path, {column: values for column, (_, values) in columns(generator).items()})

    known = [truth for truth, _ in columns(np.random.default_rng(0)).values()]
    names = list(columns(np.random.default_rng(0)))
    keys = names if style.header else [str(i) for i in range(len(names))]
    return Layout(name, source, ".csv", machine, write, dict(zip(keys, known, strict=True)))
