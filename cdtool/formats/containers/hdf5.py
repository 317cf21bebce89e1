"""HDF5: datasets of numbers as columns, by h5py."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pandas as pd

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.formats.columns import Categories, as_float64
from cdtool.formats.containers.container_checks import (
    check_chunks,
    library,
    one_line_errors,
)
from cdtool.formats.epoch_clock import EpochClock, with_plausible_unit
from cdtool.formats.slices import Container, SlicedColumn, SlicedFormat
from cdtool.recordings.units import find_unit

_KEYS = ("scale_factor", "add_offset")
_MISSING = ("_FillValue", "missing_value")
# Units of a time since a date, without a plural, that are in no table of units.
_UNITS = {"nsec": 1e-9, "usec": 1e-6, "msec": 1e-3, "min": 60.0, "hr": 3600.0, "d": 86400.0, "day": 86400.0}
_SINCE = re.compile(r"\s*(?P<unit>[a-z]+)\s+since\s+(?P<date>.+?)\s*", re.IGNORECASE)
# A year and a month; a zone that pandas does not know.
_DATE, _ZONE = re.compile(r"[0-9]{4}-[0-9]"), re.compile(r"\s*(UTC|GMT|Z)$")
_CALENDARS = ("", "standard", "gregorian", "proleptic_gregorian")
_MAGIC = b"\x89HDF\r\n\x1a\n"
_UNIT_KEYS = ("unit", "units", "Unit", "Units")
_CLOCK_NAMES = ("time", "t", "timestamp")
_WIDEST = 64


@dataclass(frozen=True)
class Packing:
    """How the numbers of a dataset are packed; `missing` are the raw values of missing numbers.

    CF Metadata Conventions 1.11, sections 2.5.1 (missing data), 4.4 (time) and 8.1 (packed data): a number is
    raw * scale_factor + add_offset; raw values equal to _FillValue or missing_value are missing.
    """

    scale: float = 1.0
    offset: float = 0.0
    missing: tuple[float, ...] = ()

    @classmethod
    def of(cls, attributes: Mapping[str, Any]) -> Packing:
        """Return the packing that a dataset's attributes state; raises ValueError if one of them is not a number."""
        scale, offset = (
            _numbers(attributes, key) or (default,) for key, default in zip(_KEYS, (1.0, 0.0), strict=True)
        )
        return cls(scale[0], offset[0], tuple(value for key in _MISSING for value in _numbers(attributes, key)))

    def unpacked(self, raw: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the unpacked numbers; NaN where a number is missing."""
        if self == Packing():
            return raw
        values = as_float64(raw)
        values = values.copy() if np.may_share_memory(values, raw) else values
        if self.scale != 1.0:
            values *= self.scale
        if self.offset != 0.0:
            values += self.offset
        if self.missing:
            # Compared in the file's own type: 0.1 in 32 bits differs from 0.1 in 64 bits.
            missing = self.missing if raw.dtype.kind != "f" else np.array(self.missing).astype(raw.dtype)
            values[np.isin(as_float64(raw), as_float64(missing))] = np.nan
        return values

    def finding(self, column: str) -> list[Finding]:
        """Return the note on a packed column; empty if the column is not packed."""
        if (self.scale, self.offset) == (1.0, 0.0):
            return []
        return [Finding("packed_values", column, {"scale": self.scale, "offset": self.offset})]


def times_since(unit: str, calendar: str) -> tuple[float, Fraction] | None:
    """Return the factor to s and the date [s] since 1970 of a unit such as `milliseconds since 2024-01-01 12:00`.

    The result is None for any other unit. Raises ValueError if the date or the calendar is not supported: the dates of
    a calendar of 360 days are not Gregorian dates.
    """
    match = _SINCE.fullmatch(unit)
    factor = _UNITS.get(match["unit"].lower().removesuffix("s")) if match else None
    if match and factor is None and (known := find_unit(match["unit"].lower())) is not None and known.si == "s":
        factor = known.factor
    if match is None or factor is None:
        return None
    try:
        if _DATE.match(match["date"]) is None:  # pandas would also read the day or the month of today
            raise ValueError
        moment = pd.Timestamp(_ZONE.sub("", match["date"].replace(",", ".")))
        utc = moment.tz_localize("UTC") if moment.tz is None else moment
    except ValueError:
        raise ValueError(f"the date of '{unit}' cannot be read") from None
    if calendar.lower() not in _CALENDARS:
        raise ValueError(f"its calendar '{calendar}' is not the Gregorian calendar")
    seconds = int(utc.asm8.astype("M8[s]").astype(np.int64))
    return factor, seconds + Fraction(utc.microsecond * 1000 + utc.nanosecond, 10**9)


def _numbers(attributes: Mapping[str, Any], key: str) -> tuple[float, ...]:
    if key not in attributes:
        return ()
    values = np.asarray(attributes[key]).ravel()
    if values.dtype.kind not in "biuf" or not 0 < len(values) <= 8 or (key in _KEYS and not np.isfinite(values).all()):
        raise ValueError(f"its attribute {key} is not a number")
    return tuple(values.tolist())


@dataclass(frozen=True)
class Hdf5(SlicedFormat):
    """HDF5 files: a column is a dataset's path, `drive/torque`; a matrix `q` is `q[0]`, `q[1]` and so on.

    A dataset `time`, `t` or `timestamp` with a unit of time (`s`, `seconds since 2024-01-01`) is the clock of the
    datasets of equal length in the same group. Numbers are unpacked by the CF conventions.
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
        h5py = library("h5py", "hdf5")
        with one_line_errors("an HDF5 file"), h5py.File(container.path, "r") as file:
            datasets = _Datasets(container, h5py, file)
            container.details = {"datasets": str(len(datasets.packings))}
            yield
            container.findings += datasets.clocks_without_unit()


class _Datasets:
    """The datasets of numbers of an open file, each with its packing, and those of texts that the map names."""

    def __init__(self, container: Container, h5py: Any, file: Any) -> None:
        self._container, self._h5py, self._file = container, h5py, file
        self._worded = container.wanted.worded if container.wanted is not None else ()
        self.packings: dict[str, Packing] = {}
        self._clock_at = cache(self._as_clock)
        # Hard links only: a soft or external link may form a cycle, or point to another file.
        file.visititems(self._visit)

    def _visit(self, name: str, node: Any) -> None:
        columns, findings = self._container.columns, self._container.findings
        if not isinstance(node, self._h5py.Dataset):
            return
        if name in self._worded and node.ndim == 1 and self._h5py.check_string_dtype(node.dtype) is not None:
            self.packings[name], columns[name] = Packing(), partial(self._texts, name, node)
            return
        reason = _unusable(node)
        try:
            packing = Packing() if reason else Packing.of(node.attrs)
        except ValueError as fault:
            reason = f"packed, but {fault}"
        if reason:
            self._container.leave_out(name, reason)
            return
        self.packings[name] = packing
        findings += packing.finding(name)
        is_vector = node.ndim == 1 or 1 in node.shape
        for i in range(1 if is_vector else min(node.shape)):
            columns[name if is_vector else f"{name}[{i}]"] = partial(self._numbers, name, node, i)
        if not is_vector and node.shape[0] < node.shape[1]:
            rows, width = node.shape
            shape = {"thing": "dataset", "name": name, "rows": rows, "columns": width}
            findings.append(Finding("rows_as_columns", "", shape))

    def _numbers(self, name: str, dataset: Any, index: int) -> SlicedColumn:
        """Return a column of a dataset."""

        def read(start: int, end: int) -> npt.NDArray[Any]:
            return self.packings[name].unpacked(_rows_of(dataset, index, start, end))

        return SlicedColumn(max(dataset.shape), read, self._clock(name, dataset), _unit(dataset))

    def _texts(self, name: str, dataset: Any) -> SlicedColumn:
        categories = Categories()

        def codes(start: int, end: int) -> FloatArray:
            texts = dataset.asstr(errors="replace")[start:end]
            return np.array([categories.code(text) if text else np.nan for text in texts])

        return SlicedColumn(len(dataset), codes, self._clock(name, dataset), _unit(dataset), categories)

    def clocks_without_unit(self) -> list[Finding]:
        """Return a warning if several groups have datasets with the name of a clock but without a unit of time."""
        named = (path for path in self.packings if path.rpartition("/")[2] in _CLOCK_NAMES)
        paths = [path for path in named if self._clock_at(path) is None]
        if len({path.rpartition("/")[0] for path in paths}) < 2:
            return []
        return [Finding("clocks_without_unit", "", {"datasets": tuple(paths)})]

    def _clock(self, name: str, dataset: Any) -> EpochClock | None:
        """Return the clock of a dataset; the clock of a clock is itself. None if it has no clock."""
        check_chunks(self._container.path, name, dataset)
        folder, slash, own = name.rpartition("/")
        names = (own, *_CLOCK_NAMES) if own in _CLOCK_NAMES else _CLOCK_NAMES
        paths = [path for clock in names if (path := f"{folder}{slash}{clock}") in self.packings]
        clocks = (self._clock_at(path) for path in paths if self._file[path].size == max(dataset.shape))
        return next(filter(None, clocks), None)

    def _as_clock(self, path: str) -> EpochClock | None:
        """Return a dataset as a clock; None if it has no unit of time."""
        dataset, packing, findings = self._file[path], self.packings[path], self._container.findings
        stated = _unit(dataset) or "?"
        try:
            since = times_since(stated, _text(dataset.attrs.get("calendar")))
        except ValueError as fault:
            findings.append(Finding("unusable_clock", path, {"reason": str(fault)}))
            return None
        unit = find_unit(stated)
        if since is None and (unit is None or unit.si != "s"):
            return None
        check_chunks(self._container.path, path, dataset)
        factor, base = since or (unit.factor if unit is not None else 1.0, Fraction(0))
        base += Fraction(packing.offset) * Fraction(repr(factor))
        read = partial(_rows_of, dataset, 0)
        clock = EpochClock(read, factor * packing.scale, base, packing.missing, dated=since is not None)
        return with_plausible_unit(clock, stated, findings, path)


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
