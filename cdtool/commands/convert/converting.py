"""`cdtool convert`: write a log's channels or all its columns to another file format, bit for bit, with provenance.

The mapped channels of a log as `cdtool convert` writes them: as logged, in SI units, in memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, UsageError
from cdtool.base.files.writing import replaced
from cdtool.base.findings import Finding
from cdtool.base.remote.remote_path import location
from cdtool.base.version import __version__
from cdtool.commands.convert.log_rows import ColumnRows
from cdtool.formats.channels.channel_assembly import file_digest
from cdtool.formats.channels.parts import join_digests
from cdtool.formats.channels.reading import log_parts, read_as_logged
from cdtool.formats.columns import Column
from cdtool.formats.groups import UNVERIFIED, Group, Part, Parts
from cdtool.formats.machine_file import MachineFile, fingerprint, read_machine_file
from cdtool.formats.written_files import files_of, machine_text, writer_of
from cdtool.recordings.recording import Series

if TYPE_CHECKING:
    from cdtool.execution.workers import Progress


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


@dataclass(frozen=True)
class Converted:
    """The files written, the machine files for them, the amount of data, and the findings."""

    source: str
    files: tuple[str, ...]
    machine_files: tuple[str, ...]
    columns: int
    clocks: int
    findings: tuple[Finding, ...]


def convert(
    source: str | Path,
    output: str | Path,
    *,
    machine: str | Path | MachineFile | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> Converted:
    """Write the mapped channels of a log, or without a machine file all its numeric columns, to another container.

    Parameters
    ----------
    source : str or Path
        The log, or a folder with its parts, as rosbag2 writes it.
    output : str or Path
        The file to write; its suffix selects the container. A CSV table has only one clock: if there are several, each
        is written to its own file, with `.1`, `.2` before the suffix.
    machine : str, Path or MachineFile, optional
        Maps the channels; they are written as logged, in SI units, with a machine file for each file written.
    force : bool, optional
        Replace existing files.
    progress : callable, optional
        Called with the number of rows written and the total.

    Returns
    -------
    Converted
        The files written, the number of columns and clocks, and the findings. Values are float64, bit for bit; each
        channel keeps its own clock.

    Raises
    ------
    UsageError
        The suffix is unknown, or a file already exists.
    RecordingError
        The log cannot be read, or has none of the mapped channels.

    Examples
    --------
    >>> import cdtool
    >>> machine = "sample_logs/gate/machine.toml"
    >>> converted = cdtool.convert("sample_logs/gate/stiff/03.csv", "stiff-03.mcap", machine=machine)
    >>> converted.files, converted.columns
    (('stiff-03.mcap',), 7)
    """
    log, target = location(source), location(output)
    writer = writer_of(target)
    parts = log_parts(log)
    _check_apart(target, log, parts)
    machine_file = (
        None if machine is None else machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    )
    rows: ChannelRows | ColumnRows = ChannelRows(log, machine_file) if machine_file else ColumnRows(log)
    if not rows.groups:
        raise RecordingError(f"{log}: contains none of the mapped channels", "see cdtool info for its content")
    pieces = files_of(target, rows.groups)
    names = [path for path, _ in pieces]
    companions = [path.with_name(f"{path.name}.machine.toml") for path in names] if machine_file else []
    beside = [path for path in machine_file.files_beside(log) if path.is_file()] if machine_file else []
    _check_free([*names, *companions], [*parts, *beside], force)
    provenance = _provenance(log, parts, rows, machine_file)
    if beside:
        provenance |= {"load_cell": "; ".join(f"{path.name} {file_digest(path)}" for path in beside)}
    row_progress = _RowProgress(log, sum(group.rows for group in rows.groups), progress)
    with replaced(*names, *companions) as temporary:  # all or none
        for i, (path, part) in enumerate(pieces):
            written = writer(temporary[i], part, row_progress.of(rows.parts(part)), provenance)
            if machine_file is not None:
                text = machine_text(machine_file, path, part, written, companions[i])
                temporary[len(names) + i].write_text(text, encoding="utf-8", newline="\n")
    width = sum(len(parts) for group in rows.groups for parts in group.flat)
    made = tuple(map(str, names)), tuple(map(str, companions))
    return Converted(str(log), *made, width, len(rows.groups), tuple(rows.findings))


@dataclass
class _RowProgress:
    """Passes the parts of a log to the writer and reports the progress; `rows` is the number of all its rows."""

    log: Path
    rows: int
    progress: Progress | None
    _done: int = 0

    def of(self, parts: Parts) -> Parts:
        """Yield the parts; a read error is reported for the source, not for the file being written."""
        try:
            for ready in parts:
                yield ready
                self._done += sum(len(part) for part in ready if part is not None)
                if self.progress:
                    self.progress(self._done, self.rows)
        except OSError as fault:
            text = f"{self.log}: cannot be read: {fault.strerror or fault}"
            raise RecordingError(text, "check its disk") from fault


def _check_apart(target: Path, log: Path, parts: Sequence[Path]) -> None:
    """Raise UsageError if the new file would become a part of the log."""
    alike = target.suffix.lower() == parts[0].suffix.lower()
    if log.is_dir() and alike and target.parent.is_dir() and target.parent.samefile(log):
        raise UsageError(f"{target}: would be a part of the log", "write it to another folder")


def _check_free(paths: Sequence[Path], parts: Sequence[Path], force: bool) -> None:
    for path in paths:
        if path.exists() and any(path.samefile(part) for part in parts):
            raise UsageError(f"{path}: is the log itself, or its load cell", "choose another name")
        if path.exists() and not force:
            raise UsageError(f"{path}: already exists", "choose another name, or overwrite it with --force")


def _provenance(
    log: Path, parts: Sequence[Path], rows: ChannelRows | ColumnRows, machine_file: MachineFile | None
) -> dict[str, str]:
    """Return the provenance; for a log in parts with each part's name and SHA-256, `sha256` being that of these."""
    digests = {part.name: file_digest(part) for part in parts}
    told = {
        "source": log.name or log.resolve().name,
        "sha256": join_digests(list(digests.values())),
        "version": __version__,
        "origin_s": repr(rows.origin),
    }
    if log.is_dir():
        told["parts"] = "; ".join(f"{name} {digest}" for name, digest in digests.items())
    if lost := [str(finding) for finding in rows.findings if finding.severity == "loss"]:
        told["lost"] = "; ".join(lost)
    if unverified := [finding.message for finding in rows.findings if finding.kind == "unverified"]:
        told[UNVERIFIED] = "; ".join(unverified)
    if machine_file is not None:
        told |= {"machine": machine_file.machine.name, "machine_fingerprint": fingerprint(machine_file.machine)}
    return told
