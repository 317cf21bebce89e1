"""The mapped channels of files of messages as `cdtool convert` writes them, piece by piece: as logged, in SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from cdtool.columns import Column, Piece
from cdtool.formats.groups import Group, Part
from cdtool.formats.pieces import MappedLog
from cdtool.formats.time_order import by_time
from cdtool.ingest.logged_file import LoggedChannel, LoggedFile
from cdtool.ingest.parts import check_parts, gaps_between, of_part
from cdtool.ingest.reading import FoundParts
from cdtool.machine_file import MachineFile
from cdtool.recording import Finding


class ChannelPieces:
    """The channels of a file of messages, or of those that are parts of one log, which need not fit into memory.

    `logs` give the mapped fields of each file, `folder` is where parts are. They become what joined_recordings makes of
    them; raises RecordingError as it does.
    """

    def __init__(
        self, logs: Mapping[Path, MappedLog], machine_file: MachineFile, folder: FoundParts | None = None
    ) -> None:
        files = [LoggedFile(path, machine_file, log) for path, log in logs.items()]
        self._files = sorted(files, key=lambda file: file.origin + file.start)
        self._folder, self._joints = folder, machine_file.topics.joints
        self.origin = self._files[0].origin
        self.is_coarse = any(file.is_coarse for file in self._files)
        check_parts([file.spanned for file in self._files])
        self._late = max(file.late for file in self._files)
        latest = -np.inf  # how far a part's channels stand behind any of those before it is lateness, too
        for file in self._files:
            shift = file.origin - self.origin
            self._late = max(self._late, latest - (file.start + shift))
            latest = max(latest, file.end + shift)
        clocks: dict[tuple[bytes, ...], list[str]] = {}
        for name in dict.fromkeys(name for file in self._files for name in file.channels):
            held = (file.channels.get(name) for file in self._files)
            digests = (b"" if channel is None else channel.clock.digest.digest() for channel in held)
            clocks.setdefault(tuple(digests), []).append(name)
        self.groups = [self._group(f"clock_{i}", names) for i, names in enumerate(clocks.values(), start=1)]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is odd; gaps are among it once the rows have been run through."""
        if self._folder is None:
            return self._files[0].findings
        of_parts = (item for file in self._files for item in of_part(file.path, file.findings))
        gaps = gaps_between([file.spanned for file in self._files])
        return (*self._folder.findings, *of_parts, *gaps)

    def parts(self, groups: Sequence[Group]) -> Iterator[list[Part | None]]:
        """The rows of these groups, from the first on."""
        columns = {column.name: [column] for group in groups for column in group.columns}
        for ready in by_time(self._pieces(columns), columns, self._late, sort=False):
            yield [_part(group, ready) for group in groups]

    def _pieces(self, names: dict[str, list[Column]]) -> Iterator[Piece]:
        for file in self._files:
            yield from file.pieces(names, file.origin - self.origin)

    def _group(self, name: str, channels: Sequence[str]) -> Group:
        holding = [file for file in self._files if channels[0] in file.channels]
        start = holding[0].channels[channels[0]].span[0] + (holding[0].origin - self.origin)
        rows = sum(file.channels[channels[0]].clock.rows for file in holding)
        columns = tuple(_header(holding[0].channels[channel]) for channel in channels)
        return Group(name, columns, rows, True, start, self._joints)


def _header(channel: LoggedChannel) -> Column:
    shape = (0, channel.joints) if channel.joints > 1 else (0,)
    unit = channel.item.unit
    return Column(channel.item.channel, np.empty(shape), None, None if unit == "1" else unit)


def _part(group: Group, ready: dict[str, Piece]) -> Part | None:
    names = [column.name for column in group.columns]
    first = ready.get(names[0])
    return None if first is None else Part(first.time, tuple(ready[name].values[name] for name in names))
