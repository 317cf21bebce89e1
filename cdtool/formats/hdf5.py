"""HDF5: datasets of numbers as columns, by h5py."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError
from cdtool.formats.container_checks import (
    as_numbers,
    check_size,
    left_out,
    library,
    one_line_errors,
    without_epoch,
)
from cdtool.formats.groups import Group, Written, stored
from cdtool.formats.own_clocks import OWN_CLOCK, asked_keys
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
        h5py = library("h5py", "hdf5", path)
        if not self.sniff(path):
            raise RecordingError(f"{path}: is no HDF5 file", "see cdtool list formats")
        findings: list[Finding] = []
        with one_line_errors(path, "an HDF5 file"), h5py.File(path, "r") as file:
            tree = _Tree(path, h5py, file, findings)
            names = tuple(tree.places)
            keys = asked_keys(path, wanted, names)
            if not keys:
                raise RecordingError(f"{path}: holds no dataset of numbers", "see h5dump -n")
            check_size(path, sum(tree.rows(key) for key in keys))
            columns, origin = without_epoch([tree.column(key) for key in keys])
            origin += float(file.attrs.get("cdtool.origin_s", 0.0))
        return Source(path, self.name, columns, origin, tuple(findings), {"datasets": str(len(tree.datasets))}, names)


class _Tree:
    """The datasets of numbers of an open file: `places` maps a column to its dataset and its place in it."""

    def __init__(self, path: Path, h5py: Any, file: Any, findings: list[Finding]) -> None:
        self.path, self.h5py, self.findings = path, h5py, findings
        self.datasets: dict[str, Any] = {}
        self.places: dict[str, tuple[str, int | None]] = {}
        self._clocks: dict[str, FloatArray] = {}
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

    def column(self, key: str) -> Column:
        """One column with its unit, and its clock where the file knows it."""
        name, place = self.places[key]
        dataset = self.datasets[name]
        if place is None:
            raw = dataset[()].ravel()
        else:
            raw = dataset[place, :] if dataset.shape[0] < dataset.shape[1] else dataset[:, place]
        return Column(key, as_numbers(key, raw, self.findings), self._clock(name, len(raw)), _unit(dataset))

    def _clock(self, name: str, count: int) -> FloatArray | None:
        folder, _, own = name.rpartition("/")
        for clock in _CLOCK_NAMES:
            path = f"{folder}/{clock}" if folder else clock
            dataset = self.datasets.get(path)
            if dataset is None or clock == own or dataset.size != count:
                continue
            unit = find_unit(_unit(dataset) or "?")
            if unit is None or unit.si != "s":
                continue
            if path not in self._clocks:
                values = as_numbers(path, dataset[()].ravel(), self.findings)
                self._clocks[path] = values if unit.factor == 1.0 else values * unit.factor
            return self._clocks[path]
        return None


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


def write_hdf5(path: Path, groups: Sequence[Group], provenance: Mapping[str, str]) -> Written:
    """Write a dataset a column, units as attributes; several clocks are groups, each with its `time`."""
    h5py = library("h5py", "hdf5", path)
    names = []
    with h5py.File(path, "w", track_order=True) as file:
        for key, value in stored(provenance).items():
            file.attrs[key] = value
        for group in groups:
            folder = file if len(groups) == 1 else file.create_group(group.name, track_order=True)
            before = "" if len(groups) == 1 else f"{group.name}/"
            if group.time is not None and not group.is_table:
                folder.create_dataset(OWN_CLOCK, data=group.time).attrs["unit"] = "s"
            for column in chain(*group.flat):
                dataset = folder.create_dataset(_link(column.name), data=column.values)
                if column.unit:
                    dataset.attrs["unit"] = column.unit
            names.append([[before + _link(part.name) for part in parts] for parts in group.flat])
    return names
