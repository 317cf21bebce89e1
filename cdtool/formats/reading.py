"""Reading a recording: which format, which section of the machine file, one file or the parts of one log."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import ConfigurationError, RecordingError, UsageError
from cdtool.formats import FORMATS
from cdtool.formats.channel_assembly import as_logged, assemble
from cdtool.formats.own_clocks import with_own_clocks
from cdtool.formats.source import Format, Source
from cdtool.machine_file import MachineFile
from cdtool.recording import Recording, Series

_KNOWN_CONTENTS = {
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"GIF8": "a GIF image",
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a ZIP archive or an Excel workbook",
    b"\x1f\x8b": "gzip-compressed",
    b"(\xb5/\xfd": "zstd-compressed",
    b"\x89HDF": "an HDF5 file",
    b"SQLite format 3": "an SQLite database, but no ROS 2 bag",
    b"<": "HTML or XML",
    b"{": "JSON",
    b"[": "JSON",
}


def choose_format(path: Path) -> Format:
    """The format of a file, by its suffix if its first bytes agree, else by these; raises RecordingError."""
    head = _head(path)
    suffix = path.suffix.lower()
    for name in FORMATS.names():  # one by one: mostly the first fits, and the others need not be loaded
        likely: Format = FORMATS.load(name)()
        if suffix in likely.suffixes and likely.sniff(path):
            return likely
    formats: list[Format] = [FORMATS.load(name)() for name in FORMATS.names(plugins=suffix not in _suffixes())]
    by_suffix = [item for item in formats if suffix in item.suffixes]
    # Almost any text can pass for a table: one that claims to be of another format must hold numbers.
    claimed = by_suffix and all(item.name != "csv" for item in by_suffix)
    for item in [*by_suffix, *formats]:
        if item.sniff(path) and not (claimed and item.name == "csv" and not _is_table(item, path)):
            return item
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise RecordingError(f"{path}: is written in UTF-16", "save it as UTF-8")
    seen = next((text for magic, text in _KNOWN_CONTENTS.items() if start.startswith(magic)), "")
    expected = f", nor a whole {by_suffix[0].name.upper()} file" if by_suffix and not seen else ""
    raise RecordingError(
        f"{path}: is not a recording{f': it is {seen}' if seen else expected}",
        f"cdtool reads {', '.join(item.name for item in formats)}",
    )


def survey(path: Path) -> Source:
    """All numeric columns of a file, with what is odd about it; raises RecordingError."""
    return choose_format(path).columns(path)


def read_recording(path: Path, machine_file: MachineFile) -> Recording:
    """One log as a recording on the load side; raises RecordingError or ConfigurationError.

    A folder of MCAP or .db3 files, as rosbag2 writes it, is one log in parts.
    """
    if path.is_dir():
        return replace(read_parts(log_parts(path), machine_file, path.name), source=str(path))
    source, channels = mapped_source(path, machine_file)
    return assemble(source, channels, machine_file.machine)


def log_parts(path: Path) -> list[Path]:
    """The files of a log: itself, or those in the folder that rosbag2 made; raises RecordingError."""
    for pattern in ("*.mcap", "*.db3") if path.is_dir() else ():
        if parts := sorted(path.glob(pattern)):
            return parts
    _head(path)
    return [path]


def mapped_source(path: Path, machine_file: MachineFile) -> tuple[Source, ChannelMap]:
    """One file's columns that the machine file maps, and the map that fits them; raises RecordingError."""
    found = choose_format(path)
    channels = _map(found, machine_file, path)
    return with_own_clocks(found.columns(path, channels), channels)


def has_topics(found: Format) -> bool:
    """True where a format holds messages of topics, so that [channels.mcap] maps it; a plug-in need not tell."""
    return bool(getattr(found, "topics", False))


def read_parts(paths: Sequence[Path], machine_file: MachineFile, name: str) -> Recording:
    """Files that are parts of one log as one recording, in the order of their times; raises RecordingError."""
    if not paths:
        raise UsageError(f"{name}: no file is given", "name the parts of the log")
    parts: list[Recording] = []
    low_pass = 0.0
    for path in paths:
        source, channels = mapped_source(path, machine_file)
        low_pass = channels.speed_low_pass
        parts.append(as_logged(source, channels, machine_file.machine))
    parts.sort(key=lambda part: part.origin + part.start)
    recording: Recording = machine_file.machine.referred_to_load(_joined(parts, name), low_pass)
    return recording


def _joined(parts: Sequence[Recording], name: str) -> Recording:
    first = parts[0]
    joined: dict[str, Series] = {}
    for channel in first.channels:
        pieces: list[Series] = []
        for part in parts:
            if channel not in part or part[channel].unit != first[channel].unit:
                raise RecordingError(
                    f"{part.source}: channel '{channel}' is not logged as in {first.source}",
                    "parts of one log are alike",
                )
            shift = part.origin - first.origin
            series = part[channel]
            if pieces and series.time[0] + shift <= pieces[-1].time[-1]:
                raise RecordingError(
                    f"{part.source}: overlaps the part before it ({channel}: starts at {series.time[0] + shift:g} s, "
                    f"before {pieces[-1].time[-1]:g} s)",
                    "parts of one log share one clock and follow one another",
                )
            pieces.append(Series(series.time + shift, series.values, series.unit))
        time = np.concatenate([piece.time for piece in pieces])
        joined[channel] = Series(time, np.concatenate([piece.values for piece in pieces]), pieces[0].unit)
    findings = tuple(
        replace(found, message=f"{Path(part.source).name}: {found.message}")
        for part in parts
        for found in part.findings
    )
    digest = hashlib.sha256("".join(part.digest for part in parts).encode()).hexdigest()
    source = ", ".join(part.source for part in parts)
    return Recording(name, source, first.joints, joined, first.origin, findings, digest)


def _map(found: Format, machine_file: MachineFile, path: Path) -> ChannelMap:
    topics = has_topics(found)
    channels = machine_file.topics if topics else machine_file.columns
    if not channels.sources:
        section = "[channels.mcap]" if topics else "[channels]"
        what = "topic and field" if topics else "column and unit"
        raise ConfigurationError(
            f"{machine_file.path}: no channel in {section}, which {path} needs", f"write {section} with {what} of each"
        )
    return channels


def _is_table(found: Format, path: Path) -> bool:
    try:
        return bool(found.columns(path).columns)
    except RecordingError:
        return False


def _suffixes() -> set[str]:
    return {suffix for name in FORMATS.names() for suffix in FORMATS.load(name).suffixes}


def _head(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise RecordingError(f"{path}: is a folder", "name the recordings in it, e.g. with *.csv")
        if not path.exists():
            raise RecordingError(f"{path}: no such file", "check the path")
        if not path.is_file():
            raise RecordingError(f"{path}: is not a regular file", "save the stream to a file first")
        with path.open("rb") as file:
            head = file.read(64)
    except OSError as fault:
        raise RecordingError(f"{path}: cannot be read: {fault.strerror}", "check the file's permissions") from fault
    if not head:
        raise RecordingError(f"{path}: is empty", "was the recording stopped at once, or the copy cut off?")
    return head
