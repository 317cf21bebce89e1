"""The formats of containers: a library opens a file, and its columns are read slice by slice, each with its clock."""

from __future__ import annotations

from abc import abstractmethod
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import OWN_CLOCK, requested_keys
from cdtool.formats.columns import Categories, Column, Piece, as_float64
from cdtool.formats.containers.container_checks import check_size, left_out_finding
from cdtool.formats.epoch_clock import EpochClock, common_origin
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.pieces import VALUES_PER_PIECE, Pieces, PiecewiseFormat
from cdtool.formats.source import Source

# Read the rows from `start` to before `end`, as the file has them.
ReadRows = Callable[[int, int], npt.NDArray[Any]]


@dataclass(frozen=True)
class SlicedColumn:
    """A column of `rows` values (n,). `clock` is the clock of its rows, None for a column of a table.

    `categories` are the texts of a column that may contain some.
    """

    rows: int
    read: ReadRows
    clock: EpochClock | None = None
    unit: str | None = None
    categories: Categories | None = None

    @classmethod
    def of(cls, values: Any, clock: EpochClock | None, unit: str | None = None) -> SlicedColumn:
        """Return a column of values (n,) in memory, or of a library's object that is sliced like them."""
        return cls(len(values), partial(rows_of, values), clock, unit)


def rows_of(values: Any, start: int, end: int) -> Any:
    """Return the rows from `start` to before `end`."""
    return values[start:end]


@dataclass
class Container:
    """A file of columns as it is read: `columns` opens each by its name; None, with a finding, if it has no numbers.

    `wanted` is the channel map (None: all columns); `origin` [s] and `details` are statements of the file.
    """

    path: Path
    wanted: ChannelMap | None
    columns: dict[str, Callable[[], SlicedColumn | None]] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    details: dict[str, str] = field(default_factory=dict)
    origin: float = 0.0

    @property
    def has_own_clocks(self) -> bool:
        """Return whether its columns have its own clocks: a clock that a machine file names is that of all columns."""
        return self.wanted is None or self.wanted.time.column == OWN_CLOCK

    def leave_out(self, column: str, kind: str) -> None:
        """Add the note on a column that is left out because its values are not numbers."""
        self.findings.append(left_out_finding(column, kind))


class SlicedFormat(PiecewiseFormat):
    """A format of files whose columns a library reads slice by slice."""

    name: ClassVar[str]

    @abstractmethod
    def _open(self, container: Container) -> AbstractContextManager[None]:
        """Open the file and add its columns; findings also as it is closed. Raises RecordingError."""

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        container = Container(path, wanted)
        with self._open(container):
            names = tuple(container.columns)
            keys = requested_keys(wanted, names)
            opened = {key: container.columns[key]() for key in keys}
            columns = {key: column for key, column in opened.items() if column is not None}
            if wanted is not None and len(columns) < len(keys):
                left_out = next(key for key in keys if key not in columns)
                raise RecordingError(f"column '{left_out}' is not numeric", "map another column")
            if not columns:
                raise RecordingError("has no column of numbers", str(next(iter(container.findings), "is it a log?")))
            if not container.has_own_clocks:
                columns = {key: replace(column, clock=None) for key, column in columns.items()}
            clocks = {key: column.clock for key, column in columns.items() if column.clock is not None}
            origin = common_origin(clocks, container.findings)
            columns = {key: column for key, column in columns.items() if some is None or key in some}
            check_size(path, sum(column.rows for column in columns.values()))
            rounded = Counter[str]()
            yield from _interleave(columns, origin, rounded)
            container.findings += [note for key in columns for note in rounding_finding(key, rounded[key])]
        headers = {key: _header(key, column) for key, column in columns.items()}
        findings = tuple(dict.fromkeys(container.findings))
        return Source(path, self.name, headers, float(origin) + container.origin, findings, container.details, names)


def _header(name: str, column: SlicedColumn) -> Column:
    """Return a column without its rows."""
    time = None if column.clock is None else np.empty(0)
    return Column(name, np.empty(0), time, column.unit, column.categories.words if column.categories else {})


def _interleave(columns: Mapping[str, SlicedColumn], origin: Fraction, rounded: Counter[str]) -> Iterator[Piece]:
    """Yield the same share of each clock's rows in turn, so that clocks that run in parallel advance together.

    Table columns of equal length form one table. The integers that float64 rounds are counted by column.
    """
    clocks: dict[tuple[int, int], list[str]] = {}
    for name, column in columns.items():
        clocks.setdefault((id(column.clock), column.rows), []).append(name)
    cuts = max(1, -(-sum(column.rows for column in columns.values()) // VALUES_PER_PIECE))
    for cut in range(cuts):
        for number, ((_, rows), names) in enumerate(clocks.items()):
            start, end = rows * cut // cuts, rows * (cut + 1) // cuts
            values: dict[str, FloatArray] = {}
            for name in names:
                raw = columns[name].read(start, end)
                rounded[name] += rounded_integers(raw) if raw.dtype.kind in "iu" else 0
                values[name] = as_float64(raw)
                if len(raw) < end - start:
                    raise RecordingError(f"column '{name}' ends before row {end}, its last one", "copy the file again")
            clock = columns[names[0]].clock
            time = None if clock is None else clock.times(start, end, origin)
            yield Piece(str(number), time, values, end - start)
