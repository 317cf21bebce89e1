"""All columns of a log as `cdtool convert` writes them: groups, and their rows in order of time, piece by piece."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.formats.channels.clock_guess import find_clock
from cdtool.formats.channels.log_statistics import ClockStatistics, LogStatistics
from cdtool.formats.channels.reading import log_pieces, needs_time_order
from cdtool.formats.column_names import split_unit
from cdtool.formats.columns import Column, Piece
from cdtool.formats.groups import Group, Part
from cdtool.formats.pieces import Pieces, read_pieces
from cdtool.formats.source import Format
from cdtool.formats.time_order import by_time, values_of


@dataclass(frozen=True)
class _Pick:
    """A column to write, with the log's column that it is, or (`element`) of which it is one element."""

    column: Column
    source: Column
    element: int | None = None

    def of(self, piece: Piece) -> FloatArray:
        """Return its values in a piece."""
        values = values_of(piece, self.source)
        return values if self.element is None else np.ascontiguousarray(values[:, self.element])


class ColumnRows:
    """A log, in one file or in parts, read piece by piece: its groups and their rows; `parts` can be called repeatedly.

    The clock of a table is guessed, since some containers need one. Topics with bit-identical times form one group.
    """

    def __init__(self, path: Path) -> None:
        self._statistics = LogStatistics(partial(log_pieces, path, read=_opened), needs_time_order(path))
        source = self._statistics.source
        self.origin, self.findings = source.origin, source.findings
        self.groups: list[Group] = []
        self._picks: dict[str, list[_Pick]] = {}  # by group
        self._clock = find_clock(source, self._statistics.columns, self._statistics.values_of)
        picks = [pick for column in _without_units(source.columns.values()) for pick in _split(*column)]
        self._add_groups(_each_once(picks))

    def parts(self, groups: Sequence[Group]) -> Iterator[list[Part | None]]:
        """Yield the rows of these groups from the beginning."""
        clocks = {group.name: [self._clock_name(pick) for pick in self._picks[group.name]] for group in groups}
        columns: dict[str, list[Column]] = {}
        for group in groups:
            for pick, clock in zip(self._picks[group.name], clocks[group.name], strict=True):
                if group.timed:
                    columns.setdefault(clock, []).append(pick.source)
        # A guessed clock has no known position among the columns of the file.
        late = np.inf if len(groups) > 1 and any(group.is_table for group in groups) else self._statistics.late
        if columns:
            pieces = by_time(self._timed(columns), columns, late, self._statistics.sorted)
            for ready in pieces:
                yield [
                    self._part(group, [ready[clock] for clock in clocks[group.name]])
                    if group.timed and clocks[group.name][0] in ready
                    else None
                    for group in groups
                ]
        for i, group in enumerate(groups):
            if not group.timed:
                for piece in self._statistics.pieces({pick.source.name for pick in self._picks[group.name]}):
                    if piece.clock == clocks[group.name][0]:
                        part = self._part(group, [piece] * len(clocks[group.name]))
                        yield [part if j == i else None for j in range(len(groups))]

    def _part(self, group: Group, pieces: Sequence[Piece]) -> Part:
        picks = self._picks[group.name]
        return Part(pieces[0].time, tuple(pick.of(piece) for pick, piece in zip(picks, pieces, strict=True)))

    def _timed(self, columns: dict[str, list[Column]]) -> Iterator[Piece]:
        """Yield the log's pieces; those of a table get the times of its clock."""
        clock = self._clock
        keys = {column.name for some in columns.values() for column in some}
        for piece in self._statistics.pieces(keys if clock is None else {*keys, clock.column}):
            if piece.time is None and clock is not None and clock.column in piece.values:
                yield replace(piece, time=(piece.values[clock.column] - clock.origin) * clock.factor)
            else:
                yield piece

    def _add_groups(self, picks: Sequence[_Pick]) -> None:
        clocks: dict[bytes, list[_Pick]] = {}
        for pick in picks:
            if pick.source.time is not None:
                clocks.setdefault(self._clock_of(pick).digest.digest(), []).append(pick)
        for members in clocks.values():
            self._add(members, self._clock_of(members[0]), is_table=False)
        digests = self._statistics.digests
        # A column that is the clock of others is written together with them.
        rest = [p for p in picks if p.source.time is None and digests[p.source.name].digest() not in clocks]
        for rows in dict.fromkeys(self._clock_of(pick).rows for pick in rest):
            members = [pick for pick in rest if self._clock_of(pick).rows == rows]
            known = self._clock is not None and self._clock.statistics.rows == rows
            self._add(
                members, self._clock.statistics if self._clock and known else ClockStatistics(rows), is_table=True
            )

    def _add(self, members: list[_Pick], clock: ClockStatistics, is_table: bool) -> None:
        name = f"clock_{len(self.groups) + 1}"
        timed = not np.isnan(clock.first)
        columns = tuple(pick.column for pick in members)
        rows = self._clock_of(members[0]).rows
        self.groups.append(Group(name, columns, rows, timed, clock.lowest if timed else 0.0, is_table=is_table))
        self._picks[name] = members

    def _clock_name(self, pick: _Pick) -> str:
        return self._statistics.clock_of.get(pick.source.name, "")

    def _clock_of(self, pick: _Pick) -> ClockStatistics:
        return self._statistics.clocks.get(self._clock_name(pick), ClockStatistics())


def _opened(found: Format, path: Path, keys: Collection[str] | None) -> Pieces:
    """Return a file's pieces; times are exact if cdtool converted the file, even if the format rounds them."""
    exact: Callable[[Path], Pieces] | None = getattr(found, "exact_pieces", None)
    return read_pieces(found, path, keys) if exact is None else exact(path)


def _without_units(columns: Collection[Column]) -> list[tuple[Column, Column]]:
    """Rename `torque [N m]` to `torque` if no other column has that name; the unit is stored separately."""
    count = Counter(split_unit(column.name)[0] for column in columns)
    short = {column.name: split_unit(column.name)[0] for column in columns if column.unit is not None}
    plain = {name: name if count[base] > 1 else base for name, base in short.items()}
    return [(replace(column, name=plain.get(column.name, column.name)), column) for column in columns]


def _each_once(picks: Sequence[_Pick]) -> list[_Pick]:
    """Give each column a unique name: `a/b` next to `a.b` becomes `a.b (2)`, since a container would store only one."""
    taken = {pick.column.name for pick in picks}
    found: dict[str, _Pick] = {}
    for pick in picks:
        name, number = pick.column.name, 2
        while name in found or (number > 2 and name in taken):
            name, number = f"{pick.column.name} ({number})", number + 1
        found[name] = replace(pick, column=replace(pick.column, name=name))
    return list(found.values())


def _split(column: Column, source: Column) -> list[_Pick]:
    """Split a topic's array into one column per element, with names that no container treats as groups or numbers."""
    name = column.name.lstrip("/").replace("/", ".")
    name = f"column_{name}" if name.isdigit() else name
    if column.values.ndim == 1:
        return [_Pick(replace(column, name=name, time=None), source)]
    base = name.removesuffix("[:]")
    elements = range(column.values.shape[1])
    return [_Pick(Column(f"{base}[{i}]", np.empty(0), None, column.unit), source, i) for i in elements]
