"""HDF5: datasets of numbers as columns, by h5py."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.formats.columns import Categories
from cdtool.formats.containers.container_checks import check_chunks, open_hdf5
from cdtool.formats.epoch_clock import EpochClock, with_plausible_unit
from cdtool.formats.slices import Container, SlicedColumn, SlicedFormat
from cdtool.recordings.units import find_unit

# Attributes of the CF conventions by which stored numbers are converted, each with the value that converts nothing.
_CONVERTING = {"scale_factor": 1.0, "add_offset": 0.0, "_FillValue": np.nan, "missing_value": np.nan}
_SINCE = " since "
_MAGIC = b"\x89HDF\r\n\x1a\n"
_UNIT_KEYS = ("unit", "units", "Unit", "Units")
_CLOCK_NAMES = ("time", "t", "timestamp")


@dataclass(frozen=True)
class Hdf5(SlicedFormat):
    """HDF5 files: a column is a dataset's path, `drive/torque`; a matrix `q` is `q[0]`, `q[1]` and so on.

    A dataset `time`, `t` or `timestamp` with a unit of time is the clock of the datasets of equal length in the same
    group.
    """

    name: ClassVar[str] = "hdf5"
    suffixes: ClassVar[tuple[str, ...]] = (".h5", ".hdf5", ".hdf")

    def sniff(self, path: Path) -> bool:
        """Return whether HDF5's signature is at the file's start or after a user block, such as MATLAB 7.3 writes."""
        with path.open("rb") as file:
            for offset in (0, 512, 1024, 2048):
                file.seek(offset)
                if file.read(len(_MAGIC)) == _MAGIC:
                    return True
        return False

    @contextmanager
    def _open(self, container: Container) -> Iterator[None]:
        with open_hdf5(container.path, "an HDF5 file") as (h5py, file):
            datasets = _Datasets(container, h5py, file)
            container.details = {"datasets": str(len(datasets.paths))}
            yield
            container.findings += datasets.clocks_without_unit()


class _Datasets:
    """The datasets of numbers of an open file, and those of texts that the map names."""

    def __init__(self, container: Container, h5py: Any, file: Any) -> None:
        self._container, self._h5py, self._file = container, h5py, file
        self._worded = container.wanted.worded if container.wanted is not None else ()
        self.paths: list[str] = []
        self._clock_at = cache(self._as_clock)
        # Hard links only: a soft or external link may form a cycle, or point to another file.
        file.visititems(self._visit)

    def _visit(self, name: str, node: Any) -> None:
        columns, findings = self._container.columns, self._container.findings
        if not isinstance(node, self._h5py.Dataset):
            return
        if name in self._worded and node.ndim == 1 and self._h5py.check_string_dtype(node.dtype) is not None:
            columns[name] = partial(self._texts, name, node)
            self.paths.append(name)
            return
        reason = _unusable(node)
        if reason:
            self._container.leave_out(name, reason)
            return
        self.paths.append(name)
        is_vector = node.ndim == 1 or 1 in node.shape
        for i in range(1 if is_vector else min(node.shape)):
            columns[name if is_vector else f"{name}[{i}]"] = partial(self._numbers, name, node, i)
        if not is_vector and node.shape[0] < node.shape[1]:
            rows, width = node.shape
            shape = {"thing": "dataset", "name": name, "rows": rows, "columns": width}
            findings.append(Finding("rows_as_columns", "", shape))

    def _numbers(self, name: str, dataset: Any, index: int) -> SlicedColumn:
        """Return a column of a dataset."""
        read = partial(_rows_of, dataset, index)
        return SlicedColumn(max(dataset.shape), read, self._clock(name, dataset), _unit(dataset))

    def _texts(self, name: str, dataset: Any) -> SlicedColumn:
        categories = Categories()

        def codes(start: int, end: int) -> FloatArray:
            texts = dataset.asstr(errors="replace")[start:end]
            return np.array([categories.code(text) if text else np.nan for text in texts])

        return SlicedColumn(len(dataset), codes, self._clock(name, dataset), _unit(dataset), categories)

    def clocks_without_unit(self) -> list[Finding]:
        """Return a warning if several groups have datasets with the name of a clock but without a unit of time."""
        named = (path for path in self.paths if path.rpartition("/")[2] in _CLOCK_NAMES)
        paths = [path for path in named if self._clock_at(path) is None]
        if len({path.rpartition("/")[0] for path in paths}) < 2:
            return []
        return [Finding("clocks_without_unit", "", {"datasets": tuple(paths)})]

    def _clock(self, name: str, dataset: Any) -> EpochClock | None:
        """Return the clock of a dataset; the clock of a clock is itself. None if it has no clock."""
        check_chunks(self._container.path, name, dataset)
        folder, slash, own = name.rpartition("/")
        names = (own, *_CLOCK_NAMES) if own in _CLOCK_NAMES else _CLOCK_NAMES
        paths = [path for clock in names if (path := f"{folder}{slash}{clock}") in self.paths]
        clocks = (self._clock_at(path) for path in paths if self._file[path].size == max(dataset.shape))
        return next(filter(None, clocks), None)

    def _as_clock(self, path: str) -> EpochClock | None:
        """Return a dataset as a clock; None if it has no unit of time."""
        dataset, stated = self._file[path], _unit(self._file[path]) or "?"
        unit = find_unit(stated)
        if unit is None or unit.si != "s":
            return None
        check_chunks(self._container.path, path, dataset)
        clock = EpochClock(partial(_rows_of, dataset, 0), unit.factor)
        return with_plausible_unit(clock, stated, self._container.findings, path)


def _rows_of(dataset: Any, index: int, start: int, end: int) -> Any:
    """Return values of a vector, or of column `index` of a matrix; the rows are along the longer dimension."""
    if dataset.ndim == 1:
        return dataset[start:end]
    return dataset[index, start:end] if dataset.shape[0] < dataset.shape[1] else dataset[start:end, index]


def _unusable(dataset: Any) -> str:
    """Return why a dataset is left out; empty for a column or a matrix of numbers that is stored in this file."""
    if dataset.is_virtual or dataset.external:
        return "stored in other files"
    if dataset.dtype.kind not in "biuf":
        kinds = {"c": "complex", "O": "of texts or references", "V": "a compound"}
        return kinds.get(dataset.dtype.kind, "not numeric")
    if _text(dataset.attrs.get("MATLAB_class")) in ("char", "cell", "struct"):
        return f"a MATLAB {_text(dataset.attrs.get('MATLAB_class'))}"
    if any(_converts(dataset.attrs.get(key, same), same) for key, same in _CONVERTING.items()):
        return "packed by the CF conventions, which are not applied"
    if _SINCE in (_unit(dataset) or ""):  # in any unit: read as a plain clock, its times might be wrong
        return f"in '{_unit(dataset)}' of the CF conventions, which are not applied"
    if dataset.ndim not in (1, 2) or 0 in dataset.shape:
        return f"of shape {dataset.shape}"
    if dataset.size == 1:
        return "a single number"
    return (
        f"{dataset.shape[0]} x {dataset.shape[1]}, too wide"
        if dataset.ndim == 2 and min(dataset.shape) > 64  # an image or a model
        else ""
    )


def _converts(attribute: Any, same: float) -> bool:
    values = np.asarray(attribute).ravel()
    return values.dtype.kind not in "biuf" or not np.array_equal(values, [same], equal_nan=True)


def _unit(dataset: Any) -> str | None:
    return next((text for key in _UNIT_KEYS if (text := _text(dataset.attrs.get(key)))), None)


def _text(value: Any) -> str:
    if isinstance(value, bytes | np.bytes_):
        return bytes(value).decode("utf-8", "replace")
    return value if isinstance(value, str) else ""
