"""HDF5: datasets of numbers as columns, by h5py."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import requested_keys
from cdtool.formats.columns import Categories, as_float64
from cdtool.formats.containers.container_checks import (
    check_chunks,
    check_size,
    left_out_finding,
    library,
    one_line_errors,
)
from cdtool.formats.epoch_clock import EpochClock, common_origin, with_plausible_unit
from cdtool.formats.large_integers import rounded_integers, rounding_finding
from cdtool.formats.pieces import Pieces, PiecewiseFormat
from cdtool.formats.slices import SlicedColumn, header_of, interleave
from cdtool.formats.source import Source
from cdtool.recordings.units import find_unit

_KEYS = ("scale_factor", "add_offset")
_MISSING = ("_FillValue", "missing_value")
# Units of a time since a date, without a plural, that are in no table of units.
_UNITS = {"nsec": 1e-9, "usec": 1e-6, "msec": 1e-3, "min": 60.0, "hr": 3600.0, "d": 86400.0, "day": 86400.0}
_SINCE = re.compile(r"\s*(?P<unit>[a-z]+)\s+since\s+(?P<date>.+?)\s*", re.IGNORECASE)
# A single digit, to which ISO 8601 has a zero; what it has not between date and zone; decimals of a second.
_DIGIT, _ZONE = re.compile(r"(?<![0-9.])[0-9](?![0-9])"), re.compile(r"\s+(?=[+-])|\s*(UTC|GMT|Z)$")
_DECIMALS = re.compile(r"[.,]([0-9]*)")
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

    def unpacked(self, raw: npt.NDArray[Any]) -> FloatArray:
        """Return the unpacked numbers; NaN where a number is missing."""
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
    date, decimals = " ".join(match["date"].split()), _DECIMALS.search(match["date"])
    try:
        moment = datetime.fromisoformat(_DIGIT.sub(r"0\g<0>", _ZONE.sub("", _DECIMALS.sub("", date))))
        since_1970 = moment.replace(tzinfo=moment.tzinfo or UTC) - datetime(1970, 1, 1, tzinfo=UTC)
    except (ValueError, OverflowError):
        raise ValueError(f"the date of '{unit}' cannot be read") from None
    if calendar.lower() not in _CALENDARS:
        raise ValueError(f"its calendar '{calendar}' is not the Gregorian calendar")
    return factor, since_1970 // timedelta(seconds=1) + Fraction(f"0.{decimals[1]}" if decimals else 0)


def _numbers(attributes: Mapping[str, Any], key: str) -> tuple[float, ...]:
    if key not in attributes:
        return ()
    values = np.asarray(attributes[key]).ravel()
    if values.dtype.kind not in "biuf" or not 0 < len(values) <= 8 or (key in _KEYS and not np.isfinite(values).all()):
        raise ValueError(f"its attribute {key} is not a number")
    return tuple(values.tolist())


@dataclass(frozen=True)
class Hdf5(PiecewiseFormat):
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

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        h5py = library("h5py", "hdf5")
        findings: list[Finding] = []
        with one_line_errors("an HDF5 file"), h5py.File(path, "r") as file:
            tree = _Datasets(path, h5py, file, findings, wanted.worded if wanted is not None else ())
            names = tuple(tree.locations)
            keys = [key for key in requested_keys(wanted, names) if some is None or key in some]
            if not keys:
                raise RecordingError("has no dataset of numbers", "list its contents with h5dump -n")
            check_size(path, sum(tree.rows(key) for key in keys))
            for name in dict.fromkeys(tree.locations[key][0] for key in keys):
                check_chunks(path, name, tree.datasets[name])
            origin = tree.set_origin(keys)
            columns = [tree.column(key) for key in keys]
            yield from interleave(columns)
            findings += [finding for key in keys for finding in rounding_finding(key, tree.rounded[key])]
            findings += tree.clocks_without_unit()
            origin += float(file.attrs.get("cdtool.origin_s", 0.0))
        words = {key: each.words for key, each in tree.categories.items()}
        headers = {column.name: replace(header_of(column), words=words.get(column.name, {})) for column in columns}
        details = {"datasets": str(len(tree.datasets))}
        return Source(path, self.name, headers, origin, tuple(dict.fromkeys(findings)), details, names)


class _Datasets:
    """The datasets of numbers of an open file.

    `locations` maps a column to its dataset and to the index of the column in it. The datasets `worded` may contain
    texts, which are read as `categories`.
    """

    def __init__(
        self, path: Path, h5py: Any, file: Any, findings: list[Finding], worded: Collection[str | int] = ()
    ) -> None:
        self.path, self.h5py, self.findings = path, h5py, findings
        self.categories: dict[str, Categories] = {}
        self._worded = worded
        self.datasets: dict[str, Any] = {}
        self.packings: dict[str, Packing] = {}
        self.locations: dict[str, tuple[str, int]] = {}
        self.rounded: Counter[str] = Counter()
        self._clocks: dict[str, EpochClock | None] = {}
        self._origin = Fraction(0)
        # Hard links only: a soft or external link may form a cycle, or point to another file.
        file.visititems(self._visit)

    def _visit(self, name: str, node: Any) -> None:
        if not isinstance(node, self.h5py.Dataset):
            return
        if name in self._worded and node.ndim == 1 and self.h5py.check_string_dtype(node.dtype) is not None:
            self.datasets[name], self.packings[name], self.locations[name] = node, Packing(), (name, 0)
            self.categories[name] = Categories()
            return
        reason = _unusable(node)
        try:
            packing = Packing() if reason else Packing.of(node.attrs)
        except ValueError as fault:
            reason = f"packed, but {fault}"
        if reason:
            self.findings.append(left_out_finding(name, reason))
            return
        self.datasets[name], self.packings[name] = node, packing
        self.findings += packing.finding(name)
        if node.ndim == 1 or 1 in node.shape:
            self.locations[name] = (name, 0)
            return
        for i in range(min(node.shape)):
            self.locations[f"{name}[{i}]"] = (name, i)
        if node.shape[0] < node.shape[1]:
            rows, columns = node.shape
            shape = {"thing": "dataset", "name": name, "rows": rows, "columns": columns}
            self.findings.append(Finding("rows_as_columns", "", shape))

    def rows(self, key: str) -> int:
        """Return the number of values of a column."""
        return int(max(self.datasets[self.locations[key][0]].shape))

    def column(self, key: str) -> SlicedColumn:
        """Return one column with its unit, and with its clock if the file has one for it."""
        name, index = self.locations[key]
        dataset, rows = self.datasets[name], self.rows(key)

        def values(start: int, end: int) -> FloatArray:
            if key in self.categories:
                texts = dataset.asstr(errors="replace")[start:end]
                return np.array([self.categories[key].code(text) if text else np.nan for text in texts])
            numbers = self.packings[name].unpacked(_rows_of(dataset, index, start, end))
            self.rounded[key] += rounded_integers(numbers) if dataset.dtype.kind in "iu" else 0
            return numbers

        own = self._clock(key)
        if own is None:
            return SlicedColumn(key, rows, values, unit=_unit(dataset))
        path, clock = own

        def time(start: int, end: int) -> FloatArray:
            return clock.times(start, end, self._origin)

        return SlicedColumn(key, rows, values, path, time, _unit(dataset))

    def set_origin(self, keys: Sequence[str]) -> float:
        """Let the times of these columns start at 0 if they count from an epoch; return the subtracted time [s]."""
        clocks = dict(clock for key in keys if (clock := self._clock(key)) is not None)
        self._origin = common_origin(clocks.values())
        return float(self._origin)

    def clocks_without_unit(self) -> list[Finding]:
        """Return a warning if several groups have datasets with the name of a clock but without a unit of time."""
        named = (path for path in self.datasets if path.rpartition("/")[2] in _CLOCK_NAMES)
        paths = [path for path in named if self._clock_at(path) is None]
        if len({path.rpartition("/")[0] for path in paths}) < 2:
            return []
        return [Finding("clocks_without_unit", "", {"datasets": tuple(paths)})]

    def _clock(self, key: str) -> tuple[str, EpochClock] | None:
        """Return path and clock of a column; the clock of a clock is itself. None if the column has no clock."""
        name, count = self.locations[key][0], self.rows(key)
        folder, _, own = name.rpartition("/")
        for clock_name in (own, *_CLOCK_NAMES) if own in _CLOCK_NAMES else _CLOCK_NAMES:
            path = f"{folder}/{clock_name}" if folder else clock_name
            clock = self._clock_at(path) if path in self.datasets and self.datasets[path].size == count else None
            if clock is not None:
                return path, clock
        return None

    def _clock_at(self, path: str) -> EpochClock | None:
        """Return a dataset as a clock; None if it has no unit of time."""
        if path not in self._clocks:
            self._clocks[path] = self._as_clock(path)
        return self._clocks[path]

    def _as_clock(self, path: str) -> EpochClock | None:
        dataset, packing = self.datasets[path], self.packings[path]
        stated = _unit(dataset) or "?"
        try:
            since = times_since(stated, _text(dataset.attrs.get("calendar")))
        except ValueError as fault:
            self.findings.append(Finding("unusable_clock", path, {"reason": str(fault)}))
            return None
        unit = find_unit(stated)
        if since is None and (unit is None or unit.si != "s"):
            return None
        factor, base = since or (unit.factor if unit is not None else 1.0, Fraction(0))

        def read(start: int, end: int) -> Any:
            return _rows_of(dataset, 0, start, end)

        base += Fraction(packing.offset) * Fraction(repr(factor))
        clock = EpochClock(read, factor * packing.scale, base, packing.missing)
        return with_plausible_unit(clock, stated, self.findings, path)


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
