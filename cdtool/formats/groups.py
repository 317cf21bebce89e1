"""What a recording is written from: columns in groups, each group on one clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from cdtool.errors import UsageError
from cdtool.formats.source import Column
from cdtool.recording import FloatArray

# What the metadata of a converted file begin with.
PREFIX = "cdtool."


@dataclass(frozen=True)
class Group:
    """Columns of one clock: `time` (n,) s, None where it is not known.

    `is_table`: the clock is one of the columns, as it was logged, and needs no other. A column's values are (n,), or
    (n, J): one a joint, called as `joints`.
    """

    name: str
    time: FloatArray | None
    columns: tuple[Column, ...]
    joints: tuple[str, ...] = ()
    is_table: bool = False

    @property
    def rows(self) -> int:
        """n."""
        return len(self.columns[0].values)

    @property
    def flat(self) -> list[list[Column]]:
        """Each column as columns of (n,) values: `torque shoulder`, `torque elbow`."""
        return [
            [column]
            if column.values.ndim == 1
            else [
                Column(f"{column.name} {joint}", np.ascontiguousarray(column.values[:, j]), None, column.unit)
                for j, joint in enumerate(self.joints)
            ]
            for column in self.columns
        ]


# Names as [channels] takes them: group by group, column by column, one a joint (a topic's array: one in all).
Written = list[list[list[str]]]


class Writer(Protocol):
    """Writes groups with their provenance to a file; gives, column by column, how the machine file names it there."""

    def __call__(self, path: Path, groups: Sequence[Group], provenance: Mapping[str, str]) -> Written:
        """Names as [channels] takes them, group by group, column by column, joint by joint."""
        ...


def one_table(path: Path, groups: Sequence[Group]) -> Group:
    """The only group; raises UsageError where there are several."""
    if len(groups) != 1:
        raise UsageError(f"{path}: {len(groups)} clocks do not go into one table", "one file a clock")
    return groups[0]


def clock_of(path: Path, group: Group) -> FloatArray:
    """The group's times; raises UsageError where they are not known and the container needs them."""
    if group.time is None:
        raise UsageError(
            f"{path}: no column of the log looks like its clock, and {path.suffix} needs one",
            "name the clock in a machine file, and give it with -m",
        )
    return group.time


def stored(provenance: Mapping[str, str]) -> dict[str, str]:
    """Provenance under the keys that it has in a file."""
    return {f"{PREFIX}{key}": value for key, value in provenance.items()}
