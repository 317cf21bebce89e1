"""A log's mapped channels as logged, held in memory, with what its files tell of themselves: each is read once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.errors import RecordingError
from cdtool.formats.source import Source
from cdtool.ingest.channel_assembly import as_logged
from cdtool.ingest.part_pieces import FoundParts
from cdtool.ingest.parts import joined_recordings
from cdtool.ingest.reading import mapped_source
from cdtool.machine_file import MachineFile
from cdtool.recording import Recording


@dataclass(frozen=True)
class Logged:
    """The recording, not yet referred to the load side; its files in the order of time, without their columns."""

    recording: Recording
    files: tuple[Source, ...]
    speed_low_pass: float


def read_logged(log: Path, machine_file: MachineFile) -> Logged:
    """A file, or a folder of parts, of which those that cannot be read are a loss; raises RecordingError."""
    if not log.is_dir():
        return _of_file(log, machine_file)
    found = FoundParts.of(log)
    if not found.filled:
        raise RecordingError(f"{log}: no part of the log holds a message", "was the recording stopped at once?")
    parts = [_of_file(part, machine_file) for part in found.filled]
    recording = joined_recordings([part.recording for part in parts], log.name)
    recording = replace(recording, source=str(log), findings=(*found.findings, *recording.findings))
    return Logged(recording, tuple(file for part in parts for file in part.files), parts[0].speed_low_pass)


def _of_file(path: Path, machine_file: MachineFile) -> Logged:
    source, channels = mapped_source(path, machine_file)
    recording = as_logged(source, channels, machine_file.machine)
    return Logged(recording, (replace(source, columns={}),), channels.speed_low_pass)
