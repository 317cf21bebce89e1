"""The mapped channels of a log as `cdtool convert` writes them: as logged, in SI units, in memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.formats.groups import Group, Part
from cdtool.formats.pieces import MappedLog, open_mapped_log
from cdtool.ingest.channel_pieces import ChannelPieces
from cdtool.ingest.reading import LogFolder, choose_format, read_as_logged
from cdtool.machine_file import MachineFile
from cdtool.recording import FloatArray, Series

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


def channel_rows(log: Path, machine_file: MachineFile) -> ChannelRows | ChannelPieces:
    """Return the channels of a log or of its folder of parts: in pieces if the format supports it, else in memory.

    Four cases are also read into memory: a coarse clock, which is fitted as one straight line, the torque of a duty
    cycle, which needs the speed, a force of several fields, and one in a file beside the log. Raises RecordingError or
    ConfigurationError.
    """
    folder = LogFolder.of(log) if log.is_dir() else None
    files = (log,) if folder is None else folder.filled
    mapped = machine_file.topics.sources
    plain = bool(mapped) and not (machine_file.topics.beside or any(item.duty or item.fields for item in mapped))
    logs = _mapped_logs(files, machine_file.topics) if plain else {}
    if logs:
        pieces = ChannelPieces(logs, machine_file, folder)
        if not pieces.is_coarse:
            return pieces
    return ChannelRows(log, machine_file)


def _mapped_logs(files: Sequence[Path], channels: ChannelMap) -> dict[Path, MappedLog]:
    """Return the mapped fields of each file; empty if the format of one file cannot read mapped fields in pieces."""
    logs: dict[Path, MappedLog] = {}
    for path in files:
        log = open_mapped_log(choose_format(path), path, channels)
        if log is None:
            return {}
        logs[path] = log
    return logs


def _header(name: str, series: Series) -> Column:
    shape = (0, series.joint_count) if series.joint_count > 1 else (0,)
    return Column(name, np.empty(shape), None, None if series.unit == "1" else series.unit)


def _values(series: Series, rows: slice) -> FloatArray:
    return series.values[rows] if series.joint_count > 1 else series.values[rows, 0]
