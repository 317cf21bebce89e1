"""Tables of several clocks side by side, as scopes and LabVIEW write them: time1, force, time2, torque.

A clock is the one of the columns behind it, up to the next; where the table begins with another column and ends with a
clock, of those before it. Clocks that stand side by side are of the same rows (a date, an epoch, the time since then).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from cdtool.clock import EPOCH
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.clocks import ClockDifference, OtherClock, OwnClocks, ValuesWithoutTime
from cdtool.formats.column_names import split_unit
from cdtool.formats.csv.dialect import Dialect
from cdtool.recording import FloatArray
from cdtool.units import find_unit

_NAMES = re.compile(r"^(t|ts|time|timestamp|zeit|clock|tempo|temps|x_value)([^a-z]|$)", re.IGNORECASE)
# What lies between two units of time: of clocks whose steps differ by another factor the rates differ.
_FACTORS = tuple(10.0**power for power in (-9, -6, -3, 0, 3, 6, 9)) + tuple(
    factor**sign for factor in (60.0, 3600.0, 86400.0) for sign in (-1, 1)
)
_SAME_FACTOR = 0.01
# A clock goes forward at this share of its steps at least.
_FORWARD = 0.95
OWN = 'time = { column = "time", unit = "s" }'
HINT = f"write {OWN}, and each channel gets the clock beside it, in the unit of its header ('time2 [ms]')"


@dataclass(frozen=True)
class Clocks:
    """The clocks of a table by their numbers, in groups side by side; `of` maps any other column to its group."""

    groups: tuple[tuple[int, ...], ...]
    of: Mapping[int, int]

    @classmethod
    def by_names(cls, dialect: Dialect, said: str | None = None) -> Clocks:
        """Columns of numbers that are called as clocks are, and the one that is said to be it; no dates beside that."""
        names, count = dialect.names, len(dialect.names)
        numbers = [i for i in range(count) if dialect.kinds[i] == "N" and _NAMES.match(names[i])]
        found = sorted({*numbers, *(i for i in range(count) if names[i] == said)})
        starts = [i for i in found if i - 1 not in found]
        groups = [tuple(i for i in found if start <= i < end) for start, end in pairwise([*starts, count])]
        behind = bool(found) and found[0] > 0 and found[-1] == count - 1
        of = {}
        for column in range(count):
            before = [k for k, group in enumerate(groups) if group[0] < column]
            after = [k for k, group in enumerate(groups) if group[0] > column]
            nearest = after[:1] if behind else before[-1:]
            if column not in found and nearest:
                of[column] = nearest[0]
        return cls(tuple(groups), of)

    @property
    def columns(self) -> tuple[int, ...]:
        """All of them."""
        return tuple(column for group in self.groups for column in group)

    def group(self, column: int) -> int | None:
        """That of a clock or of any other column; None where no clock is beside it."""
        return next((k for k, group in enumerate(self.groups) if column in group), self.of.get(column))


def other_clock(
    dialect: Dialect, clocks: Clocks, clock: str, keys: Sequence[str], values: Mapping[str, FloatArray]
) -> str:
    """The first wanted column beside another clock than the one that is said to be its, and in what they differ.

    Empty where there is none. `clock` is the column that the machine file names, `keys` are all that it asks for,
    `values` theirs and the clocks'.
    """
    names = dialect.names
    said = clocks.group(names.index(clock))
    for key in keys:
        group = clocks.group(names.index(key))
        if group is None or said is None or group == said or key == clock:
            continue
        other = names[clocks.groups[group][0]]
        apart = _apart(dialect, values, clock, other)
        if apart:
            return f"column '{key}' stands beside the clock '{other}', the machine file says '{clock}': {apart}"
    return ""


def clock_findings(dialect: Dialect, clocks: Clocks, values: Mapping[str, FloatArray]) -> list[Finding]:
    """A warning on each clock whose times are not those of the first one in the same rows."""
    names, found = dialect.names, []
    for k, group in enumerate(clocks.groups[1:], 1):
        columns = [names[column] for column, its in clocks.of.items() if its == k]
        first, other = names[clocks.groups[0][0]], names[group[0]]
        apart = _apart(dialect, values, first, other) if columns and {first, other} <= values.keys() else None
        if apart:
            found.append(Finding(OtherClock(first, apart, tuple(columns)), other))
    return found


def own_clocks(
    path: Path, dialect: Dialect, clocks: Clocks, keys: Sequence[str], values: Mapping[str, FloatArray]
) -> tuple[dict[str, Column], float, list[Finding]]:
    """The wanted columns, each with its times [s] by the clock beside it; what was taken off them [s]; what is told.

    A clock without a unit in the header is in s. A shorter one ends in empty cells: rows without a time are none of its
    columns'. Raises RecordingError where no clock is beside a column.
    """
    times: dict[int, FloatArray] = {}
    for key in keys:
        group = clocks.group(dialect.names.index(key))
        if group is None:
            raise RecordingError(f"{path}: no clock stands before column '{key}'", "name its clock in [channels] time")
        name = dialect.names[clocks.groups[group][0]]
        times.setdefault(group, values[name] * _factor(dialect, name, 1.0))
    starts = [float(time[np.isfinite(time)][0]) for time in times.values() if np.isfinite(time).any()]
    origin = min(starts) if starts and min(starts) > EPOCH else 0.0
    used = OwnClocks(tuple(dialect.names[clocks.groups[group][0]] for group in times))
    columns, findings = {}, [Finding(used, "time", "note")]
    for key in keys:
        time = times[clocks.group(dialect.names.index(key)) or 0]
        timed = np.isfinite(time)
        columns[key] = Column(key, values[key][timed], time[timed] - origin, told_unit(dialect, key))
        lost = int(np.count_nonzero(np.isfinite(values[key][~timed])))
        if lost:
            findings.append(Finding(ValuesWithoutTime(lost), key, "loss"))
    return columns, origin, findings


def told_unit(dialect: Dialect, name: str) -> str | None:
    """What the header, or the row of units below it, says of a column."""
    column = dialect.names.index(name)
    text = dialect.units[column].strip() if column < len(dialect.units) else ""
    if text[:1] + text[-1:] in ("[]", "()"):
        text = text[1:-1].strip()
    return split_unit(name.partition("#")[0])[1] or (text if text not in ("", "-") else None)


def _factor(dialect: Dialect, name: str, default: float) -> float:
    """What leads from a clock's unit to s, as its header says; else the default."""
    unit = find_unit(told_unit(dialect, name) or "?")
    return unit.factor if unit is not None and unit.si == "s" else default


def _apart(dialect: Dialect, values: Mapping[str, FloatArray], first: str, other: str) -> ClockDifference | None:
    """In what two clocks differ in the same rows; None where they are one clock in two units or from two starts."""
    a, b = values[first], values[other]
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    if len(a) < 3:
        return None
    if min(np.mean(np.diff(a) > 0.0), np.mean(np.diff(b) > 0.0)) < _FORWARD:  # a name alone makes no clock
        return None
    step, other_step = float(np.median(np.diff(a))), float(np.median(np.diff(b)))
    ratio = other_step / step
    told = _factor(dialect, first, np.nan) / _factor(dialect, other, np.nan)
    alike = re.sub(r"\W*[0-9]+$", "", first) == re.sub(r"\W*[0-9]+$", "", other)
    factors = (told,) if np.isfinite(told) else (1.0,) if alike else _FACTORS
    scale = min(factors, key=lambda factor: abs(np.log(ratio / factor)))
    if abs(ratio / scale - 1.0) > _SAME_FACTOR:
        return ClockDifference("steps", step, other_step)
    b = b / scale
    offset, length = float(b[0] - a[0]), float(a[-1] - a[0])
    if 0.5 * step < abs(offset) <= length:
        return ClockDifference("start", float(a[0]), float(b[0]))
    drift = float(np.max(np.abs((b - b[0]) - (a - a[0]))))
    return ClockDifference("drift", 0.0, drift) if drift > 0.5 * step else None
