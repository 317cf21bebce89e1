"""Candidates for channels in a log: single columns, columns that differ only by a number, fields of topics."""

from __future__ import annotations

import dataclasses
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.init.names.joint_names import MOST_JOINTS, families_by_name
from cdtool.commands.init.stream import Stream, joined
from cdtool.formats.column_names import split_unit
from cdtool.formats.source import Source
from cdtool.recordings.clock.lower_rate import sampled_rows

_NUMBER = re.compile(r"\d+")


@dataclass(frozen=True)
class Found:
    """A stream guessed to be a channel, the reason, and what to check (empty: certain by its name)."""

    stream: Stream
    why: str
    check: str = ""


@dataclass
class Channels:
    """The channels found so far, of a machine with `joints` joints, and the streams that are still free.

    `streams` are all that the log contains.
    """

    joints: int
    free: list[Stream]
    found: dict[str, Found] = dataclasses.field(default_factory=dict)
    streams: tuple[Stream, ...] = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        self.streams = tuple(self.free)

    def take(self, channel: str, stream: Stream, why: str, check: str = "") -> None:
        """Record a guess; streams that share a column with it are no longer free."""
        self.found[channel] = Found(stream, why, check)
        used = set(stream.columns)
        self.free = [
            other
            for other in self.free
            if other is not stream
            and not used & set(other.columns)
            and not (stream.topic and (other.topic, other.field) == (stream.topic, stream.field))
        ]

    def is_of_family(self, stream: Stream) -> bool:
        """Whether a single column belongs to a family of columns, free or not."""
        families = [other.columns for other in self.streams if len(other.columns) > 1]
        return any(set(stream.columns) & set(family) for family in families)

    def of_joints(self) -> list[Stream]:
        """Return the free streams with one column per joint whose values change."""
        return [stream for stream in self.free if stream.width == self.joints and stream.moves]


def streams_of(source: Source, table_time: FloatArray | None, clock: str | None, topics: bool) -> list[Stream]:
    """Return every column with its times, families of columns first; without the clock itself.

    A table without a clock gets sample numbers as times, so its rates are per sample.
    """
    if topics:
        return [_of_topic(name, source) for name in source.columns if source.columns[name].values.shape[0] > 1]
    singles: dict[str, Stream] = {}
    for name, column in source.columns.items():
        if name == clock or column.values.ndim != 1 or len(column.values) < 2:
            continue
        time = column.time if column.time is not None else table_time
        if time is None or len(time) != len(column.values):
            time = np.arange(len(column.values), dtype=np.float64)
        rows = sampled_rows(column.values) if column.time is None else None
        if rows is not None:
            time, column = time[rows], dataclasses.replace(column, values=column.values[rows])
        singles[name] = Stream(name, (name,), column.unit, time, _possible(column.values)[:, np.newaxis])
    return [*_families(singles), *_named_families(singles), *singles.values()]


def column_key(name: str) -> str | int:
    """Return the name of a column, or its number in a table without a header."""
    return int(name) if name.isdigit() else name


def _of_topic(name: str, source: Source) -> Stream:
    column = source.columns[name]
    topic, _, field = name.partition(" ")
    time = column.time if column.time is not None else np.arange(len(column.values), dtype=np.float64)
    values = _possible(column.values).reshape(len(column.values), -1)
    return Stream(name, (), column.unit, time, values, topic, field)


def _possible(values: FloatArray) -> FloatArray:
    """Return values with NaN in place of those that no sensor delivers and whose squares would overflow."""
    wrong = ~(np.abs(values) < 1e100) & ~np.isnan(values)
    return np.where(wrong, np.nan, values) if wrong.any() else values


def _families(singles: Mapping[str, Stream]) -> list[Stream]:
    """Find families: `tau_1, tau_2`, `q[0] ... q[5]`, `axis1_speed, axis2_speed`: names with one consecutive number.

    Other numbers, as in `LOAD|1, LOAD|2, LOAD|6`, are joints if several families have the same.
    """
    if all(name.isdigit() for name in singles):
        return []  # a table without a header: its names are column numbers
    members: dict[tuple[str, str], dict[int, Stream]] = {}
    for name, stream in singles.items():
        for number in _NUMBER.finditer(split_unit(name)[0]):
            key = (name[: number.start()], name[number.end() :])
            members.setdefault(key, {})[int(number[0])] = stream
    shared = Counter(frozenset(parts) for parts in members.values())
    found = []
    for (before, after), parts in members.items():
        numbers = sorted(parts)
        first = next(iter(parts.values())).time
        alike = all(stream.time is first or np.array_equal(stream.time, first) for stream in parts.values())
        if (
            2 <= len(numbers) <= MOST_JOINTS
            and numbers[0] in (0, 1)
            and (
                numbers == list(range(numbers[0], numbers[0] + len(numbers)))
                # Numbers with gaps are joints if at least three families have the same.
                or (len(numbers) > 2 and shared[frozenset(numbers)] >= 3)
            )
            and alike
        ):
            found.append(joined([parts[number] for number in numbers], f"{before}#{after}"))
    return found


def _named_families(singles: Mapping[str, Stream]) -> list[Stream]:
    """Find families whose names differ by the name of a joint: `elbow_joint/position, wrist_1_joint/position`."""
    found = families_by_name(list(singles))
    return [
        joined([singles[name] for name in names], template, joints)
        for template, (joints, names) in found.items()
        if len({len(singles[name].time) for name in names}) == 1
    ]
