"""MATLAB .mat files: arrays of numbers, in structs and cells too, as columns. Version 7.3 (HDF5) by h5py."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from itertools import islice
from pathlib import Path
from typing import ClassVar

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.containers.container_checks import library, open_hdf5
from cdtool.formats.epoch_clock import EpochClock
from cdtool.formats.mat import version_5, version_73
from cdtool.formats.mat.clock_beside import assumed_clock, is_clock_name
from cdtool.formats.mat.datenum import DAY_1970, is_datenum, since_first
from cdtool.formats.mat.layout import MatLayout, arrange_columns
from cdtool.formats.mat.variables import MatColumn, Variables
from cdtool.formats.slices import Container, SlicedColumn, SlicedFormat, rows_of
from cdtool.recordings.units import DAY_S


@dataclass(frozen=True)
class Mat(SlicedFormat):
    """MATLAB files: a vector is a column, a matrix the columns `name[0]`, `name[1]`; a field is `log.joint(2).tau`.

    Columns of structs with several clocks are on the clock of their own struct that is as long.
    """

    name: ClassVar[str] = "mat"
    suffixes: ClassVar[tuple[str, ...]] = (".mat",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a MATLAB file of version 5 to 7.3."""
        with path.open("rb") as file:
            return file.read(len(version_5.MAGIC)) == version_5.MAGIC or version_73.is_version_73(path)

    @contextmanager
    def _open(self, container: Container) -> Iterator[None]:
        with _variables(container.path) as variables:
            layout = arrange_columns(variables)
            container.findings += layout.findings
            container.details = _details(layout)
            own_clocks = layout.own_clocks and container.has_own_clocks
            clock_of = cache(partial(_clock, container, layout)) if own_clocks else None
            shown = layout.columns if container.wanted is None else {**layout.hidden, **layout.columns}
            for name in layout.names:
                container.columns[name] = partial(_column, container, name, shown.get(name), clock_of)
            yield


def _column(
    container: Container, name: str, column: MatColumn | None, clock_of: Callable[[str], EpochClock] | None
) -> SlicedColumn | None:
    """Return a column, with its own clock if it has one; a clock that counts days is read in seconds."""
    if column is None:  # read only where a machine file names it
        return None
    variable, numbers = column.variable, column.numbers
    if numbers.is_complex and container.wanted is not None:
        raise RecordingError(f"column '{name}' is complex", "save its real part")
    if numbers.is_complex:
        fact = {"variable": variable, "what": "complex", "advice": ""}
        container.findings.append(Finding("variable_left_out", "", fact))
        return None
    if numbers.is_across:
        rows, width = numbers.shape
        shape = {"thing": "variable", "name": variable, "rows": rows, "columns": width}
        container.findings.append(Finding("rows_as_columns", "", shape))
    clock = clock_of(column.clock) if clock_of is not None and column.clock else None
    if not is_clock_name(name.rpartition(".")[2]) or not is_datenum(column.values):
        return SlicedColumn(column.rows, lambda start, end: column.values[start:end], clock)
    seconds, first = since_first(column.values)
    container.findings.append(Finding("days_of_matlab", name, {"start": str(np.datetime64(round(first * 1000), "ms"))}))
    if clock_of is None:
        container.origin = container.origin or first
    return SlicedColumn.of(seconds, clock, "s")


def _clock(container: Container, layout: MatLayout, name: str) -> EpochClock:
    stamps = layout.columns[name].values
    if is_datenum(stamps):
        return EpochClock(partial(rows_of, stamps), DAY_S, Fraction(-DAY_1970 * int(DAY_S)))
    return assumed_clock(name, stamps, container.findings)


def _details(layout: MatLayout) -> dict[str, str]:
    """Return the first single numbers and texts of a file, and how many more there are."""
    shown = list(islice((*layout.numbers, *layout.texts), 60))
    numbers = {name: f"{layout.numbers[name].read().ravel()[0]:g}" for name in shown if name in layout.numbers}
    texts = {name: layout.texts[name] for name in shown if name in layout.texts}
    more = len(layout.numbers) + len(layout.texts) - len(shown)
    return {**numbers, **texts, **({"more numbers and texts": str(more)} if more else {})}


@contextmanager
def _variables(path: Path) -> Iterator[Variables]:
    """Yield the variables of a file, whose numbers can be read as long as it is open."""
    if not version_73.is_version_73(path):
        yield version_5.read_variables(path)
        return
    try:
        library("h5py", "hdf5")
    except RecordingError as fault:
        raise RecordingError(
            "is a MATLAB 7.3 (HDF5) file, and h5py is not installed",
            f"{fault.hint}; or save it in MATLAB with save(name, ..., '-v7')",
        ) from fault
    with open_hdf5(path, "a MATLAB 7.3 file") as (h5py, file):
        yield version_73.read_variables(path, h5py, file)
