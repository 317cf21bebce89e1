"""What is written to a container: columns that share a clock, rows after rows, and where the log comes from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Protocol

import numpy as np

from cdtool.columns import Column
from cdtool.errors import UsageError
from cdtool.recording import FloatArray

# What the metadata of a converted file begin with.
PREFIX = "cdtool."
# Of the provenance: how much of the log no checksum covers; only there where that is so.
UNVERIFIED = "unverified"


@dataclass(frozen=True)
class Group:
    """Columns of one clock, without their rows: `rows` of them follow as Part.

    A column's values are (n,), or (n, J): one a joint, called as `joints`. `timed`: the times are known; `start` [s] is
    the earliest. `is_table`: the clock is one of the columns, as it was logged, and needs no other.
    """

    name: str
    columns: tuple[Column, ...]
    rows: int
    timed: bool
    start: float = 0.0
    joints: tuple[str, ...] = ()
    is_table: bool = False

    @property
    def own_clock(self) -> bool:
        """A column of its own has to hold the times."""
        return self.timed and not self.is_table

    @property
    def flat(self) -> list[list[Column]]:
        """Each column as columns of (n,) values: `torque shoulder`, `torque elbow`."""
        return [
            [column]
            if column.values.ndim == 1
            else [Column(f"{column.name} {joint}", np.empty(0), None, column.unit) for joint in self.joints]
            for column in self.columns
        ]


@dataclass(frozen=True)
class Part:
    """The next rows of a group: `time` (n,) [s] where it is known, `values` (n,) or (n, J) of its columns in order."""

    time: FloatArray | None
    values: tuple[FloatArray, ...]

    def __len__(self) -> int:
        return len(self.values[0])

    @property
    def flat(self) -> list[FloatArray]:
        """The values of the group's flat columns."""
        return list(chain(*([item] if item.ndim == 1 else list(np.ascontiguousarray(item.T)) for item in self.values)))


# The next rows of each group; None: none now. No row is later than one of the parts that follow.
Parts = Iterable[Sequence[Part | None]]

# Names as [channels] takes them: group by group, column by column, one a joint (a topic's array: one in all).
Written = list[list[list[str]]]


class Writer(Protocol):
    """Writes groups with their provenance to a file; gives, column by column, how the machine file names it there."""

    def __call__(self, path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> Written:
        """Names as [channels] takes them, group by group, column by column, joint by joint."""
        ...


def one_table(path: Path, groups: Sequence[Group]) -> Group:
    """The only group; raises UsageError where there are several."""
    if len(groups) != 1:
        raise UsageError(f"{path}: {len(groups)} clocks do not go into one table", "one file a clock")
    return groups[0]


def need_clocks(path: Path, groups: Sequence[Group]) -> None:
    """Raise UsageError where the container needs times and those of a group are not known."""
    if not all(group.timed for group in groups):
        raise UsageError(
            f"{path}: no column of the log looks like its clock, and this container needs one",
            "name the clock in a machine file, and give it with -m",
        )


def stored(provenance: Mapping[str, str]) -> dict[str, str]:
    """Provenance under the keys that it has in a file."""
    return {f"{PREFIX}{key}": value for key, value in provenance.items()}
