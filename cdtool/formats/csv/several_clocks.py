"""Tables with several clocks, as oscilloscopes write them: time1, force, time2, torque.

One clock counts for all columns: those beside a clock with other times are reported, or refused if they are mapped.

A clock belongs to the columns after it, up to the next clock; if the table starts with another column and ends with a
clock, it belongs to the columns before it. Adjacent clocks belong to the same rows (a date, an epoch, an elapsed time).
"""

from __future__ import annotations

import re
from bisect import bisect
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.formats.csv_dialect.dialect import Dialect, unit_from_header
from cdtool.recordings.units import find_unit

_NAMES = re.compile(r"^(t|ts|time|timestamp|zeit|clock|tempo|temps|x_value)([^a-z]|$)", re.IGNORECASE)
# Ratios of two units of time: clocks whose steps have another ratio differ in their rates.
_FACTORS = tuple(10.0**power for power in (-9, -6, -3, 0, 3, 6, 9)) + tuple(
    factor**sign for factor in (60.0, 3600.0, 86400.0) for sign in (-1, 1)
)
_SAME_FACTOR = 0.01
# At least this share of a clock's steps is forward.
_FORWARD = 0.95


@dataclass(frozen=True)
class Clocks:
    """The clocks of a table by number, in groups of adjacent columns; `of` maps any other column to its group."""

    groups: tuple[tuple[int, ...], ...]
    of: Mapping[int, int]

    @classmethod
    def by_names(cls, dialect: Dialect, stated: str | None = None) -> Clocks:
        """Return the clocks: columns of numbers with a clock's name, and the column `stated` by the machine file."""
        names, count = dialect.names, len(dialect.names)
        numbers = [i for i in range(count) if dialect.kinds[i] == "N" and _NAMES.match(names[i])]
        clock_columns = sorted({*numbers, *(i for i in range(count) if names[i] == stated)})
        starts = [i for i in clock_columns if i - 1 not in clock_columns]
        groups = [tuple(i for i in clock_columns if start <= i < end) for start, end in pairwise([*starts, count])]
        is_after_columns = bool(clock_columns) and clock_columns[0] > 0 and clock_columns[-1] == count - 1
        nearest = {i: bisect(starts, i) - (not is_after_columns) for i in range(count) if i not in clock_columns}
        of = {i: k for i, k in nearest.items() if 0 <= k < len(groups)}
        return cls(tuple(groups), of)

    @property
    def columns(self) -> tuple[int, ...]:
        """Return the numbers of all clocks."""
        return tuple(column for group in self.groups for column in group)

    def beside(self, group: int, names: Sequence[str], keys: Collection[str]) -> tuple[str, ...]:
        """Return the columns `keys` that belong to a group of clocks."""
        return tuple(names[column] for column, k in self.of.items() if k == group and names[column] in keys)


def other_clocks(
    dialect: Dialect, values: Mapping[str, FloatArray], stated: str | None = None, keys: Collection[str] | None = None
) -> list[Finding]:
    """Return a warning on each clock beside which columns are, and whose times differ from those of the first clock.

    `values` are those of the columns that have been read; a clock that has not been read is not compared. `stated`: the
    clock that the machine file names, in place of the first; `keys`: these columns only.
    """
    names, clocks, findings = dialect.names, Clocks.by_names(dialect, stated), list[Finding]()
    if len(clocks.groups) < 2:
        return findings
    first = stated or names[clocks.columns[0]]
    for k, group in enumerate(clocks.groups):
        other = names[group[0]]
        columns = clocks.beside(k, names, names if keys is None else keys)
        if columns and names.index(first) not in group and {first, other} <= values.keys():
            difference = _difference(dialect, values, first, other)
            fact = {"first": first, "difference": difference, "columns": columns}
            findings += [Finding("other_clock", other, fact)] if difference else []
    return findings


def _end_apart(a: FloatArray, b: FloatArray) -> bool:
    """Return whether the stamps of two clocks end in different rows, before which none is missing."""
    counts = []
    for stamps in (a, b):
        known = np.isfinite(stamps)
        counts.append(int(np.count_nonzero(known)))
        if not known[: counts[-1]].all() or np.any(np.diff(stamps[: counts[-1]]) < 0.0):
            return False
    return counts[0] != counts[1] and min(counts) > 2


def _factor(dialect: Dialect, name: str) -> float:
    """Return the factor from the unit in a clock's header to s; NaN if there is no unit of time."""
    unit = find_unit(unit_from_header(dialect, name) or "?")
    return unit.factor if unit is not None and unit.si == "s" else np.nan


def _difference(dialect: Dialect, values: Mapping[str, FloatArray], first: str, other: str) -> dict[str, Any] | None:
    """Return how two clocks differ in the same rows; None if they differ only in unit or start."""
    a, b = values[first], values[other]
    if _end_apart(a, b):
        ends = (int(np.count_nonzero(np.isfinite(stamps))) for stamps in (a, b))
        return dict(zip(("what", "first", "other"), ("length", *ends), strict=True))
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    if len(a) < 3:
        return None
    # A column that does not run forward is not a clock, whatever its name.
    if min(np.mean(np.diff(a) > 0.0), np.mean(np.diff(b) > 0.0)) < _FORWARD:
        return None
    step, other_step = float(np.median(np.diff(a))), float(np.median(np.diff(b)))
    ratio = other_step / step
    stated = _factor(dialect, first) / _factor(dialect, other)
    same_name = re.sub(r"\W*[0-9]+$", "", first) == re.sub(r"\W*[0-9]+$", "", other)
    factors = (stated,) if np.isfinite(stated) else (1.0,) if same_name else _FACTORS
    scale = min(factors, key=lambda factor: abs(np.log(ratio / factor)))
    if abs(ratio / scale - 1.0) > _SAME_FACTOR:
        return {"what": "steps", "first": step, "other": other_step}
    b = b / scale
    offset, length = float(b[0] - a[0]), float(a[-1] - a[0])
    if 0.5 * step < abs(offset) <= length:
        return {"what": "start", "first": float(a[0]), "other": float(b[0])}
    drift = float(np.max(np.abs((b - b[0]) - (a - a[0]))))
    return {"what": "drift", "first": 0.0, "other": drift} if drift > 0.5 * step else None
