"""The mapped channels of a log as `cdtool convert` writes them: as logged, in SI units, in memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.columns import Column
from cdtool.formats.groups import Group, Part
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.recording import Series

# Rows of the longest clock per part.
_ROWS = 1 << 16


class ChannelRows:
    """The groups of a recording (the channels of one clock) and their rows; `parts` can be called repeatedly."""

    def __init__(self, log: Path, machine_file: MachineFile) -> None:
        self._recording = read_as_logged(log, machine_file, unread="loss").recording
        self.origin, self.findings = self._recording.origin, self._recording.findings
        clocks: dict[bytes, list[str]] = {}
        for name, series in self._recording.channels.items():
            clocks.setdefault(series.time.tobytes(), []).append(name)
        self.groups = [self._group(f"clock_{i}", names) for i, names in enumerate(clocks.values(), start=1)]

    def parts(self, groups: Sequence[Group]) -> Iterator[list[Part | None]]:
        """Yield the rows of these groups, part by part along the longest clock."""
        series = [[self._recording[column.name] for column in group.columns] for group in groups]
        times = [channels[0].time for channels in series]
        before = [0] * len(times)
        for end in (*max(times, key=len)[_ROWS::_ROWS].tolist(), np.inf):
            to = [int(np.searchsorted(time, end, side="left")) for time in times]
            yield [
                Part(channels[0].time[a:b], tuple(_values(item, slice(a, b)) for item in channels)) if b > a else None
                for channels, a, b in zip(series, before, to, strict=True)
            ]
            before = to

    def _group(self, name: str, channels: Sequence[str]) -> Group:
        first = self._recording[channels[0]]
        columns = tuple(_header(channel, self._recording[channel]) for channel in channels)
        return Group(name, columns, len(first), True, float(first.time[0]), self._recording.joints)


def _header(name: str, series: Series) -> Column:
    shape = (0, series.joint_count) if series.joint_count > 1 else (0,)
    return Column(name, np.empty(shape), None, None if series.unit == "1" else series.unit)


def _values(series: Series, rows: slice) -> FloatArray:
    return series.values[rows] if series.joint_count > 1 else series.values[rows, 0]
