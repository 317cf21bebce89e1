"""HDF5: datasets of numbers as columns, by h5py."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError
from cdtool.formats.container_checks import (
    as_numbers,
    check_chunks,
    check_size,
    left_out,
    library,
    one_line_errors,
    without_epoch,
)
from cdtool.formats.groups import Group, Parts, Written, stored
from cdtool.formats.own_clocks import OWN_CLOCK, asked_keys
from cdtool.formats.pieces import Pieces, joined
from cdtool.formats.slices import Sliced, header_of, side_by_side
from cdtool.formats.source import Column, Source
from cdtool.recording import Finding, FloatArray
from cdtool.units import find_unit

_MAGIC = b"\x89HDF\r\n\x1a\n"
_UNIT_KEYS = ("unit", "units", "Unit", "Units")
_CLOCK_NAMES = ("time", "t", "timestamp")
_WIDEST = 64


@dataclass(frozen=True)
class Hdf5:
    """HDF5 files: a column is a dataset's path, `drive/torque`; a matrix `q` is `q[0]`, `q[1]` and so on.

    A dataset `time`, `t` or `timestamp` with a unit of time is the clock of those beside it that are as long.
    """

    name: ClassVar[str] = "hdf5"
    suffixes: ClassVar[tuple[str, ...]] = (".h5", ".hdf5", ".hdf")

    def sniff(self, path: Path) -> bool:
        """True if the file holds HDF5's magic bytes at its start or behind a user block, as MATLAB 7.3 writes it."""
        with path.open("rb") as file:
            for place in (0, 512, 1024, 2048):
                file.seek(place)
                if file.read(len(_MAGIC)) == _MAGIC:
                    return True
        return False

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The columns that `wanted` names, or all numeric ones; raises RecordingError."""
        return joined(self._read(path, wanted, None), sort=False)

    def pieces(self, path: Path, keys: Collection[str] | None = None) -> Pieces:
        """All numeric columns, or those of `keys`, some MiB at a time; raises RecordingError."""
        return self._read(path, None, keys)

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        h5py = library("h5py", "hdf5", path)
        if not self.sniff(path):
            raise RecordingError(f"{path}: is no HDF5 file", "see cdtool list formats")
        findings: list[Finding] = []
        with one_line_errors(path, "an HDF5 file"), h5py.File(path, "r") as file:
            tree = _Tree(path, h5py, file, findings)
            names = tuple(tree.places)
            keys = [key for key in asked_keys(path, wanted, names) if some is None or key in some]
            if not keys:
                raise RecordingError(f"{path}: holds no dataset of numbers", "see h5dump -n")
            check_size(path, sum(tree.rows(key) for key in keys))
            for name in dict.fromkeys(tree.places[key][0] for key in keys):
                check_chunks(path, name, tree.datasets[name])
            origin = tree.take_epoch(keys)
            columns = [tree.column(key) for key in keys]
            yield from side_by_side(columns)
            origin += float(file.attrs.get("cdtool.origin_s", 0.0))
        headers = {column.name: header_of(column) for column in columns}
        told = {"datasets": str(len(tree.datasets))}
        return Source(path, self.name, headers, origin, tuple(dict.fromkeys(findings)), told, names)


class _Tree:
    """The datasets of numbers of an open file: `places` maps a column to its dataset and its place in it."""

    def __init__(self, path: Path, h5py: Any, file: Any, findings: list[Finding]) -> None:
        self.path, self.h5py, self.findings = path, h5py, findings
        self.datasets: dict[str, Any] = {}
        self.places: dict[str, tuple[str, int | None]] = {}
        self._epoch = 0.0
        # Hard links only: a soft or external one may lead in circles, or out of the file.
        file.visititems(self._visit)

    def _visit(self, name: str, item: Any) -> None:
        if not isinstance(item, self.h5py.Dataset):
            return
        why = _unusable(item)
        if why:
            self.findings.append(left_out(name, why))
            return
        self.datasets[name] = item
        if item.ndim == 1 or 1 in item.shape:
            self.places[name] = (name, None)
            return
        for i in range(min(item.shape)):
            self.places[f"{name}[{i}]"] = (name, i)
        if item.shape[0] < item.shape[1]:
            text = f"dataset '{name}' is {item.shape[0]} x {item.shape[1]}: its rows are taken as columns"
            self.findings.append(Finding(text, severity="note"))

    def rows(self, key: str) -> int:
        """How many values a column has."""
        return int(max(self.datasets[self.places[key][0]].shape))

    def column(self, key: str) -> Sliced:
        """One column with its unit, and its clock where the file knows it."""
        name, place = self.places[key]
        dataset, rows = self.datasets[name], self.rows(key)

        def values(start: int, end: int) -> FloatArray:
            return as_numbers(key, _rows_of(dataset, place, start, end), self.findings)

        clock = self._clock(key)
        if clock is None:
            return Sliced(key, rows, values, unit=_unit(dataset))
        path, factor = clock

        def time(start: int, end: int) -> FloatArray:
            return self._times(path, factor, start, end) - self._epoch

        return Sliced(key, rows, values, path, time, _unit(dataset))

    def take_epoch(self, keys: Sequence[str]) -> float:
        """Where the clocks of these columns count from an epoch: its start [s], which is then taken off; else 0."""
        clocks = {clock for key in keys if (clock := self._clock(key)) is not None}
        starts = [Column(clock[0], np.empty(0), self._times(*clock, 0, 1)) for clock in clocks]
        self._epoch = without_epoch(starts)[1]
        return self._epoch

    def _times(self, path: str, factor: float, start: int, end: int) -> FloatArray:
        times = as_numbers(path, _rows_of(self.datasets[path], None, start, end), self.findings)
        return times if factor == 1.0 else times * factor

    def _clock(self, key: str) -> tuple[str, float] | None:
        """The dataset that is a column's clock, and its factor to seconds."""
        name, count = self.places[key][0], self.rows(key)
        folder, _, own = name.rpartition("/")
        for clock in _CLOCK_NAMES:
            path = f"{folder}/{clock}" if folder else clock
            dataset = self.datasets.get(path)
            if dataset is None or clock == own or dataset.size != count:
                continue
            unit = find_unit(_unit(dataset) or "?")
            if unit is not None and unit.si == "s":
                return path, unit.factor
        return None


def _rows_of(dataset: Any, place: int | None, start: int, end: int) -> Any:
    """Values of a vector, or of one column of a matrix, whose longer side are its rows."""
    if place is None:
        return dataset[start:end] if dataset.ndim == 1 else _long_side(dataset, start, end)
    return dataset[place, start:end] if dataset.shape[0] < dataset.shape[1] else dataset[start:end, place]


def _long_side(dataset: Any, start: int, end: int) -> Any:
    return (dataset[0, start:end] if dataset.shape[0] == 1 else dataset[start:end, 0]).ravel()


def _unusable(dataset: Any) -> str:
    """Why a dataset is left out; empty where it is a column or a matrix of numbers in this very file."""
    if dataset.is_virtual or dataset.external:
        return "kept in other files"
    if dataset.dtype.kind not in "biuf":
        return {"c": "complex", "O": "of texts or references", "V": "a compound"}.get(dataset.dtype.kind, "no number")
    if _text(dataset.attrs.get("MATLAB_class")) in ("char", "cell", "struct"):
        return f"a MATLAB {_text(dataset.attrs.get('MATLAB_class'))}"
    if dataset.ndim not in (1, 2) or 0 in dataset.shape:
        return f"of shape {dataset.shape}"
    if dataset.size == 1:
        return "a single number"
    return (
        f"{dataset.shape[0]} x {dataset.shape[1]}, too wide"
        if dataset.ndim == 2 and min(dataset.shape) > _WIDEST
        else ""
    )


def _unit(dataset: Any) -> str | None:
    return next((text for key in _UNIT_KEYS if (text := _text(dataset.attrs.get(key)))), None)


def _text(value: Any) -> str:
    if isinstance(value, bytes | np.bytes_):
        return bytes(value).decode("utf-8", "replace")
    return value if isinstance(value, str) else ""


def _link(name: str) -> str:
    """A name without the slash that would make a group of it."""
    return name.replace("/", ".")


def write_hdf5(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> Written:
    """Write a dataset a column, units as attributes; several clocks are groups, each with its `time`."""
    h5py = library("h5py", "hdf5", path)
    names: Written = []
    datasets: list[list[Any]] = []
    with h5py.File(path, "w", track_order=True) as file:
        for key, value in stored(provenance).items():
            file.attrs[key] = value
        for group in groups:
            folder = file if len(groups) == 1 else file.create_group(group.name, track_order=True)
            before = "" if len(groups) == 1 else f"{group.name}/"
            columns = [Column(OWN_CLOCK, np.empty(0), unit="s")] if group.own_clock else []
            datasets.append([_dataset(folder, column, group.rows) for column in (*columns, *chain(*group.flat))])
            names.append([[before + _link(part.name) for part in parts] for parts in group.flat])
        done = [0] * len(groups)
        for ready in parts:
            for number, part in enumerate(ready):
                if part is not None:
                    rows = slice(done[number], done[number] + len(part))
                    values = [part.time, *part.flat] if groups[number].own_clock else part.flat
                    for dataset, column in zip(datasets[number], values, strict=True):
                        dataset[rows] = column
                    done[number] = rows.stop
    return names


def _dataset(folder: Any, column: Column, rows: int) -> Any:
    dataset = folder.create_dataset(_link(column.name), (rows,), np.float64)
    if column.unit:
        dataset.attrs["unit"] = column.unit
    return dataset
