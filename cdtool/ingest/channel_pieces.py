"""The mapped channels of files of messages as `cdtool convert` writes them, piece by piece: as logged, in SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from cdtool.columns import Column, Piece
from cdtool.findings import Finding
from cdtool.formats.groups import Group, Part
from cdtool.formats.pieces import MappedLog
from cdtool.formats.time_order import by_time
from cdtool.ingest.logged_file import LoggedChannel, LoggedFile
from cdtool.ingest.part_gaps import gaps_between
from cdtool.ingest.part_pieces import FoundParts
from cdtool.ingest.parts import not_alike, of_part, overlapping
from cdtool.machine_file import MachineFile
from cdtool.recording import GROUND_TRUTH


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
        self._late = max(file.late for file in self._files)
        clocks: dict[tuple[bytes, ...], list[str]] = {}
        for name in dict.fromkeys(name for file in self._files for name in file.channels):
            self._check(name)
            digests = (file.channels[name].digest.digest() if name in file.channels else b"" for file in self._files)
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

    def _check(self, name: str) -> None:
        """Raise RecordingError where a part lacks the channel, or begins before the one before it ends.

        How far it stands behind other channels of parts before it, is kept.
        """
        end, latest = -np.inf, -np.inf
        for file in self._files:
            shift = file.origin - self.origin
            if name in file.channels:
                first, last = file.channels[name].span
                if first + shift <= end:
                    raise overlapping(str(file.path), name, first + shift, end)
                self._late = max(self._late, latest - (first + shift))
                end = last + shift
            elif name not in GROUND_TRUTH:
                raise not_alike(str(file.path), name, str(self._files[0].path))
            latest = max(latest, file.end + shift)

    def _group(self, name: str, channels: Sequence[str]) -> Group:
        holding = [file for file in self._files if channels[0] in file.channels]
        start = holding[0].channels[channels[0]].span[0] + (holding[0].origin - self.origin)
        rows = sum(file.channels[channels[0]].rows for file in holding)
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
