"""What a writer receives: columns that share a clock, their rows in parts, and the provenance of the log."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Protocol

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.formats.channels.channel_map import AXES
from cdtool.formats.columns import Column

# Prefix of the metadata keys in a converted file.
PREFIX = "cdtool."
# Key of the provenance: how much of the log no checksum covers. Absent if checksums cover all of it.
UNVERIFIED = "unverified"


@dataclass(frozen=True)
class Group:
    """Columns of one clock, without their rows: `rows` rows follow as Part.

    A column's values are (n,), or (n, J) with one value per joint; `joints` are the names. `timed`: the times are
    known, and `start` [s] is the earliest. `is_table`: the logged clock is one of the columns; no other is needed.
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
        """Return whether the times need a column of their own."""
        return self.timed and not self.is_table

    def _parts(self, column: Column) -> tuple[str, ...]:
        """Return the names of a column's values: its joints, or the axes of a force."""
        return AXES[: column.values.shape[1]] if column.name == "force" else self.joints

    @property
    def flat(self) -> list[list[Column]]:
        """Return each column as columns of (n,) values: `torque shoulder`, `force x`."""
        return [
            [column]
            if column.values.ndim == 1
            else [Column(f"{column.name} {part}", np.empty(0), None, column.unit) for part in self._parts(column)]
            for column in self.columns
        ]


@dataclass(frozen=True)
class Part:
    """The next rows of a group: `time` (n,) [s] if known, and `values` (n,) or (n, J) of its columns in order."""

    time: FloatArray | None
    values: tuple[FloatArray, ...]

    def __len__(self) -> int:
        return len(self.values[0])

    @property
    def flat(self) -> list[FloatArray]:
        """Return the values of the group's flat columns."""
        return list(chain(*([item] if item.ndim == 1 else list(np.ascontiguousarray(item.T)) for item in self.values)))


# The next rows of each group; None if a group has no rows in this step. No row is later than a row of a later step.
Parts = Iterable[Sequence[Part | None]]

# Names for [channels]: group by group, column by column, one name per joint (an array of a topic has one name).
WrittenNames = list[list[list[str]]]


class GroupWriter(Protocol):
    """Write groups with their provenance to a file; return the name of each column for the machine file."""

    def __call__(
        self, path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]
    ) -> WrittenNames:
        """Return the names for [channels], group by group, column by column, joint by joint."""
        ...


def single_group(groups: Sequence[Group]) -> Group:
    """Return the only group; raises UsageError if there are several."""
    if len(groups) != 1:
        raise UsageError(f"a table has one clock, but there are {len(groups)}", "write one file per clock")
    return groups[0]


def require_clocks(groups: Sequence[Group]) -> None:
    """Raise UsageError if the times of a group are not known; for containers that need times."""
    if not all(group.timed for group in groups):
        raise UsageError(
            "no column of the log is recognised as its clock, and this container needs a clock",
            "name the clock in a machine file, and pass the file with -m",
        )


def prefix_keys(provenance: Mapping[str, str]) -> dict[str, str]:
    """Return the provenance under the keys that are written to a file."""
    return {f"{PREFIX}{key}": value for key, value in provenance.items()}
