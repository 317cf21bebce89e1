"""Tables with several clocks, as oscilloscopes and LabVIEW write them: time1, force, time2, torque.

A clock belongs to the columns after it, up to the next clock; if the table starts with another column and ends with a
clock, it belongs to the columns before it. Adjacent clocks belong to the same rows (a date, an epoch, an elapsed time).
"""

from __future__ import annotations

import re
from bisect import bisect
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.formats.columns import Piece
from cdtool.formats.csv_dialect.dialect import Dialect, unit_from_header
from cdtool.formats.pieces import PieceRun, Pieces
from cdtool.recordings.clock import THREE_YEARS
from cdtool.recordings.units import find_unit

_NAMES = re.compile(r"^(t|ts|time|timestamp|zeit|clock|tempo|temps|x_value)([^a-z]|$)", re.IGNORECASE)
# Ratios of two units of time: clocks whose steps have another ratio differ in their rates.
_FACTORS = tuple(10.0**power for power in (-9, -6, -3, 0, 3, 6, 9)) + tuple(
    factor**sign for factor in (60.0, 3600.0, 86400.0) for sign in (-1, 1)
)
OWN = 'time = { column = "time", unit = "s" }'
HINT = f"write {OWN}: each channel then has the clock beside it, in the unit of its header ('time2 [ms]')"


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
    dialect: Dialect, clocks: Clocks, first: str, keys: Collection[str], values: Mapping[str, FloatArray]
) -> list[Finding]:
    """Return a warning on each clock beside which `keys` are, and whose times differ from those of the clock `first`.

    `values` are the values of the columns that have been read; a clock that has not been read is not compared.
    """
    names, findings = dialect.names, []
    for k, group in enumerate(clocks.groups):
        other = names[group[0]]
        columns = clocks.beside(k, names, keys)
        if columns and names.index(first) not in group and {first, other} <= values.keys():
            difference = _difference(dialect, values, first, other)
            fact = {"first": first, "difference": difference, "columns": columns}
            findings += [Finding("other_clock", other, fact)] if difference else []
    return findings


def have_other_rates(dialect: Dialect, clocks: Clocks, values: Mapping[str, FloatArray]) -> bool:
    """Return whether columns are beside clocks of different steps or lengths, and each column is beside a clock.

    Then no clock is that of all channels, and only the clock beside it can be a channel's own.
    """
    names, columns = dialect.names, [i for i, letter in enumerate(dialect.kinds[: len(dialect.names)]) if letter == "N"]
    used = sorted({clocks.of[column] for column in columns if column in clocks.of})
    if len(used) < 2 or not {*clocks.columns, *clocks.of}.issuperset(columns):
        return False
    first, *others = (names[clocks.groups[k][0]] for k in used)
    if not {first, *others} <= values.keys():
        return False
    return any(
        ((difference := _difference(dialect, values, first, other)) is not None and difference["what"] == "steps")
        or _end_apart(values[first], values[other])
        for other in others
    )


def _end_apart(a: FloatArray, b: FloatArray) -> bool:
    """Return whether the stamps of two clocks end in different rows, before which none is missing."""
    counts = []
    for stamps in (a, b):
        known = np.isfinite(stamps)
        counts.append(int(np.count_nonzero(known)))
        if not known[: counts[-1]].all() or np.any(np.diff(stamps[: counts[-1]]) < 0.0):
            return False
    return counts[0] != counts[1] and min(counts) > 2


def pieces_by_own_clock(
    dialect: Dialect, clocks: Clocks, pieces: Pieces, keys: Collection[str] | None, stated: bool = False
) -> Pieces:
    """Yield the pieces of a table unchanged or, if its clocks have other rates, by clock with their times [s].

    The first piece decides, unless it is `stated` that each column has the clock beside it. A clock without a unit in
    the header is in s. A shorter clock ends with empty cells: rows without a time are left out of its columns.
    """
    piece = next(pieces)
    if not stated and not have_other_rates(dialect, clocks, piece.values):
        first = dialect.names[clocks.columns[0]] if clocks.columns else ""
        findings = other_clocks(dialect, clocks, first, dialect.names, piece.values)
        yield piece
        table = yield from pieces
        return replace(table, findings=(*table.findings, *findings))
    names = dialect.names
    of_group = {k: clocks.beside(k, names, names if keys is None else keys) for k in range(len(clocks.groups))}
    clock_names = {k: names[clocks.groups[k][0]] for k, members in of_group.items() if members}
    factors = {k: _factor(dialect, name, 1.0) for k, name in clock_names.items()}
    origin = _epoch_origin(piece.values[name] * factors[k] for k, name in clock_names.items())
    lost: Counter[str] = Counter()
    steps = {name: _step(piece.values[name]) for name in clock_names.values()}
    run = PieceRun(pieces)
    for each in chain([piece], run):
        for k, name in clock_names.items():
            time = each.values[name] * factors[k]
            timed = np.isfinite(time)
            values = {key: each.values[key] for key in of_group[k] if key in each.values}
            lost.update({key: int(np.count_nonzero(np.isfinite(column[~timed]))) for key, column in values.items()})
            rows = int(np.count_nonzero(timed))
            yield Piece(name, time[timed] - origin, {key: column[timed] for key, column in values.items()}, rows)
    times = {names[column] for column in clocks.columns}
    kept = [key for key in run.source.columns if key not in times and (keys is None or key in keys)]
    return replace(
        run.source,
        columns={key: replace(run.source.columns[key], time=np.empty(0)) for key in kept},
        findings=(*run.source.findings, *_own_clock_findings(dialect, steps, lost, stated)),
        origin=origin or dialect.origin,
        first_row=0,
    )


def _epoch_origin(clocks: Iterable[FloatArray]) -> float:
    """Return the earliest first time [s] of clocks that count from an epoch; 0 for other clocks."""
    starts = [float(time[np.isfinite(time)][0]) for time in clocks if np.isfinite(time).any()]
    return min(starts) if starts and min(starts) > THREE_YEARS else 0.0


def _step(stamps: FloatArray) -> float:
    known = stamps[np.isfinite(stamps)]
    return float(np.median(np.diff(known))) if len(known) > 1 else 0.0


def _own_clock_findings(
    dialect: Dialect, steps: Mapping[str, float], lost: Mapping[str, int], stated: bool
) -> list[Finding]:
    """Return the findings on a table whose channels have the clocks beside them; `steps` are those of each clock."""
    findings = [Finding("own_clocks", "time", {"clocks": tuple(steps)})]
    assumed = {name: step for name, step in steps.items() if not np.isfinite(_factor(dialect, name, np.nan))}
    if assumed and not stated:
        findings.append(
            Finding("clock_unit_assumed", "time", {"clocks": tuple(assumed), "step": next(iter(assumed.values()))})
        )
    return findings + [Finding("values_without_time", key, {"count": count}) for key, count in lost.items() if count]


def _factor(dialect: Dialect, name: str, default: float) -> float:
    """Return the factor from the unit in a clock's header to s; the default if there is no unit of time."""
    unit = find_unit(unit_from_header(dialect, name) or "?")
    return unit.factor if unit is not None and unit.si == "s" else default


def _difference(dialect: Dialect, values: Mapping[str, FloatArray], first: str, other: str) -> dict[str, Any] | None:
    """Return how two clocks differ in the same rows; None if they differ only in unit or start."""
    a, b = values[first], values[other]
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    if len(a) < 3:
        return None
    # A column that does not run forward is not a clock, whatever its name.
    if min(np.mean(np.diff(a) > 0.0), np.mean(np.diff(b) > 0.0)) < 0.95:
        return None
    step, other_step = float(np.median(np.diff(a))), float(np.median(np.diff(b)))
    ratio = other_step / step
    stated = _factor(dialect, first, np.nan) / _factor(dialect, other, np.nan)
    same_name = re.sub(r"\W*[0-9]+$", "", first) == re.sub(r"\W*[0-9]+$", "", other)
    factors = (stated,) if np.isfinite(stated) else (1.0,) if same_name else _FACTORS
    scale = min(factors, key=lambda factor: abs(np.log(ratio / factor)))
    if abs(ratio / scale - 1.0) > 0.01:  # no two factors of units are so close, and no clock is so wrong
        return {"what": "steps", "first": step, "other": other_step}
    b = b / scale
    offset, length = float(b[0] - a[0]), float(a[-1] - a[0])
    if 0.5 * step < abs(offset) <= length:
        return {"what": "start", "first": float(a[0]), "other": float(b[0])}
    drift = float(np.max(np.abs((b - b[0]) - (a - a[0]))))
    return {"what": "drift", "first": 0.0, "other": drift} if drift > 0.5 * step else None
