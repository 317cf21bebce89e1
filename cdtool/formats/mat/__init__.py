"""MATLAB .mat files: arrays of numbers, in structs and cells too, as columns. Version 7.3 (HDF5) by h5py."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, naming
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import OWN_CLOCK, requested_keys
from cdtool.formats.columns import Column, as_float64
from cdtool.formats.containers.clock_beside import assumed_clock, is_clock_name
from cdtool.formats.containers.container_checks import check_size, library, one_line_errors
from cdtool.formats.epoch_clock import EpochClock, common_origin
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.mat import version_5, version_73
from cdtool.formats.mat.datenum import DAY_1970, DAY_S, is_datenum, since_first
from cdtool.formats.mat.layout import MatLayout, arrange_columns
from cdtool.formats.mat.variables import MatColumn, Variables
from cdtool.formats.source import Source

# So many single numbers and texts of a file are shown.
_MOST_DETAILS = 60


@dataclass(frozen=True)
class Mat:
    """MATLAB files: a vector is a column, a matrix the columns `name[0]`, `name[1]`; a field is `log.joint(2).tau`.

    Columns of structs with several clocks are on the clock of their own struct that is as long.
    """

    name: ClassVar[str] = "mat"
    suffixes: ClassVar[tuple[str, ...]] = (".mat",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a MATLAB file of version 5 to 7.3."""
        with path.open("rb") as file:
            return file.read(len(version_5.MAGIC)) == version_5.MAGIC or version_73.is_version_73(path)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all columns; raises RecordingError."""
        with naming(path), _variables(path) as variables:
            layout = arrange_columns(variables)
            names = layout.names
            keys = list(layout.columns) if wanted is None else requested_keys(wanted, names)
            reader = _Reader(path, layout)
            # A machine file that names a clock reads it as it is.
            own_clocks = layout.own_clocks and (wanted is None or wanted.time.column == OWN_CLOCK)
            columns = reader.columns(keys, own_clocks)
            if wanted is not None and reader.complex:
                raise RecordingError(f"column '{reader.complex[0]}' is complex", "save its real part")
            if not columns:
                raise RecordingError("has no vector or matrix of numbers", "list its variables with `whos`")
            details = _details(layout)
        findings = tuple(dict.fromkeys((*layout.findings, *reader.findings)))
        return Source(path, self.name, columns, reader.origin, findings, details, names)


def _details(layout: MatLayout) -> dict[str, str]:
    """Return the first single numbers and texts of a file, and how many more there are."""
    shown = list(islice((*layout.numbers, *layout.texts), _MOST_DETAILS))
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
        h5py = library("h5py", "hdf5")
    except RecordingError as fault:
        raise RecordingError(
            "is a MATLAB 7.3 (HDF5) file, and h5py is not installed",
            f"{fault.hint}; or save it in MATLAB with save(name, ..., '-v7')",
        ) from fault
    with one_line_errors("a MATLAB 7.3 file"), h5py.File(path, "r") as file:
        yield version_73.read_variables(path, h5py, file)


class _Reader:
    """Reads columns of a file; `complex` are those that are complex."""

    def __init__(self, path: Path, layout: MatLayout) -> None:
        self._path, self._layout = path, layout
        self.findings: list[Finding] = []
        self.complex: list[str] = []
        self.origin = 0.0

    def columns(self, keys: list[str], own_clocks: bool) -> dict[str, Column]:
        """Return these columns; with `own_clocks`, each with its times [s] after `origin`."""
        found = {**self._layout.hidden, **self._layout.columns}
        self._check_sizes([found[key] for key in keys])
        times = self._times(dict.fromkeys(found[key].clock for key in keys if found[key].clock)) if own_clocks else {}
        values = {key: self._values(key, found[key]) for key in keys}
        return {
            key: self._column(key, column, times.get(found[key].clock))
            for key, column in values.items()
            if column is not None
        }

    def _check_sizes(self, columns: list[MatColumn]) -> None:
        """Raise RecordingError if the columns are far larger than the file: it is a decompression bomb."""
        whole = {id(section.numbers): section.numbers for column in columns for section in column.sections}
        check_size(self._path, sum(math.prod(each.shape) * (1 + each.is_complex) for each in whole.values()))

    def _column(self, key: str, values: npt.NDArray[Any], time: FloatArray | None) -> Column:
        """Return a column; a clock that counts days is read in seconds."""
        if not is_clock_name(key.rpartition(".")[2]) or not is_datenum(values):
            return Column(key, as_float64(values), time)
        seconds, start = since_first(values)
        self.findings.append(Finding("days_of_matlab", key, {"start": str(np.datetime64(round(start * 1000), "ms"))}))
        self.origin = self.origin or start
        return Column(key, seconds, time, "s")

    def _times(self, names: Iterable[str]) -> dict[str, FloatArray]:
        """Return the times of these clocks; they start at 0 if they count from an epoch."""
        read = ((name, self._values(name, self._layout.columns[name])) for name in names)
        stamps = {name: raw for name, raw in read if raw is not None and len(raw)}
        clocks = {name: self._clock(name, raw) for name, raw in stamps.items()}
        origin = common_origin(clocks, self.findings)
        self.origin = float(origin)
        return {name: clock.times(0, len(stamps[name]), origin) for name, clock in clocks.items()}

    def _clock(self, name: str, stamps: npt.NDArray[Any]) -> EpochClock:
        if is_datenum(stamps):
            return EpochClock(lambda start, end: stamps[start:end], DAY_S, Fraction(-DAY_1970 * int(DAY_S)))
        return assumed_clock(name, stamps, self.findings)

    def _values(self, key: str, column: MatColumn) -> npt.NDArray[Any] | None:
        """Return the values of a column as the file has them; None for a complex column."""
        for section in column.sections:
            if section.numbers.is_complex:
                self.complex.append(key)
                fact = {"variable": section.variable, "what": "complex", "advice": ""}
                self.findings.append(Finding("variable_left_out", "", fact))
                return None
            if section.numbers.is_across:
                rows, columns = section.numbers.shape
                shape = {"thing": "variable", "name": section.variable, "rows": rows, "columns": columns}
                self.findings.append(Finding("rows_as_columns", "", shape))
        parts = [section.values() for section in column.sections]
        values = parts[0] if len(parts) == 1 else np.concatenate(parts)
        if values.dtype.kind in "iu":
            self.findings += rounding_finding(key, rounded_integers(as_float64(values)))
        return values
