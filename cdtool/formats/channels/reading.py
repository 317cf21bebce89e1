"""Read a log: select its format and the section of the machine file; read a file or parts, whole or piece by piece."""

from __future__ import annotations

import codecs
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from cdtool.base.errors import ConfigurationError, RecordingError, naming
from cdtool.base.files.kinds import kind_of
from cdtool.base.findings import Finding
from cdtool.base.log_names import log_suffix
from cdtool.base.remote.remote_path import location
from cdtool.formats import FORMATS
from cdtool.formats.channels.channel_assembly import LoggedRecording, assemble_recording, file_digest
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource
from cdtool.formats.channels.file_beside import add_files_beside
from cdtool.formats.channels.parts import (
    Span,
    join_digests,
    join_parts,
    join_sources,
    loss_findings,
    missing_part_findings,
    named_parts,
)
from cdtool.formats.column_names import OWN_CLOCK, resolve_columns
from cdtool.formats.columns import Piece
from cdtool.formats.csv.gzipped import MAGIC
from cdtool.formats.csv.text import read_sample
from cdtool.formats.machine_file import MachineFile
from cdtool.formats.pieces import PieceRun, Pieces, join_pieces, read_pieces
from cdtool.formats.source import Format, Source
from cdtool.recordings.clock.stamps import epoch_start
from cdtool.recordings.plausible import PlausibleRanges
from cdtool.recordings.recording import Recording, Series

# The parts of a log in a folder; the first kind that is there is read.
_PARTS = ("*.mcap", "*.db3", "*.db3.zstd", "*.db3.zst")
# What a part of a log is that cannot be read.
Unread = Literal["error", "loss"]
# Opens a file of a format, for some or all of its columns.
ReadFile = Callable[[Format, Path, Collection[str] | None], Pieces]

_KNOWN_CONTENTS = {
    b"PK\x03\x04": "a ZIP archive or an Excel workbook",
    b"\x1f\x8b": "gzip-compressed",
    b"(\xb5/\xfd": "zstd-compressed",
    b"\x89HDF": "an HDF5 file",
    b"ARROW1": "a Feather file",
    b"ULog\x01\x12\x35": "a ULog file of PX4",
    b"MDF     ": "an MDF file",
    b"UnFinMF ": "an MDF file",
    b"SQLite format 3": "an SQLite database, but not a ROS 2 bag",
    b"<": "HTML or XML",
    b"{": "JSON",
    b"[": "JSON",
}
_NEXT_STEPS = {
    "a ZIP archive or an Excel workbook": "unpack the archive, or save the sheet as CSV",
    "gzip-compressed": "only text tables are read compressed; unpack it first, e.g. with gunzip",
    "a ULog file of PX4": "write its topics as CSV, with ulog2csv of pyulog",
    "a Feather file": "write it as Parquet, with pandas.read_feather(...).to_parquet(...)",
    "an MDF file": "export it as MAT, CSV or Parquet",
    "zstd-compressed": "unpack it first, e.g. with unzstd",
}


def choose_format(path: Path) -> Format:
    """Return the format of a file, by its suffix if its first bytes agree, else by these; raises RecordingError."""
    with naming(path):
        head = _read_head(path)
        suffix = log_suffix(path).lower()
        if suffix == ".toml" and (kind := kind_of(head)):  # its numbers could be read as a table
            raise RecordingError(f"is not a recording: it is {kind}", "give a log in its place")
        for name in FORMATS.names():  # one by one: usually the first fits, and the others need not be loaded
            likely: Format = FORMATS.load(name)()
            if suffix in likely.suffixes and likely.sniff(path):
                return likely
        is_new = all(suffix not in FORMATS.load(name).suffixes for name in FORMATS.names())
        formats: list[Format] = [FORMATS.load(name)() for name in FORMATS.names(plugins=is_new)]
        by_suffix = [item for item in formats if suffix in item.suffixes]
        for item in [*by_suffix, *formats]:
            if item.sniff(path):
                return item
        start = head.removeprefix(codecs.BOM_UTF8).lstrip()
        content = next((text for magic, text in _KNOWN_CONTENTS.items() if start.startswith(magic)), "")
        content = kind_of(head) or content if content == "JSON" else content
        expected = f", nor a complete {by_suffix[0].name.upper()} file" if by_suffix and not content else ""
        raise RecordingError(
            f"is not a recording{f': it is {content}' if content else expected}",
            _NEXT_STEPS.get(content, f"cdtool reads {', '.join(item.name for item in formats)}"),
        )


def survey(path: Path) -> Source:
    """Return all numeric columns of a log with their rows, and its warnings; raises RecordingError."""
    return join_pieces(log_pieces(path), sort=True) if path.is_dir() else choose_format(path).columns(path)


def log_pieces(log: Path, keys: Collection[str] | None = None, read: ReadFile = read_pieces) -> Pieces:
    """Yield pieces of the numeric columns of a file, or of a folder written by rosbag2.

    The columns are all, or at least `keys`. A part that cannot be read is a loss if another part can be read. Raises
    RecordingError.
    """
    if not log.is_dir():
        return read(choose_format(log), log, keys)
    return _part_pieces(log, keys, read)


def _part_pieces(folder: Path, keys: Collection[str] | None, read: ReadFile) -> Pieces:
    """Yield the pieces of one part after the other; all times count from the start of the first part."""
    log = _LogFolder.of(folder)
    start: float | None = None
    parts: list[tuple[Source, Mapping[str, Span]]] = []
    for part in (*log.filled, *log.empty):
        if not has_topics(chosen := choose_format(part)):
            raise _not_of_topics(part)
        run = PieceRun(read(chosen, part, keys))
        spans: dict[str, Span] = {}
        for piece in run:
            start = piece.origin if start is None else start
            if piece.time is None or not piece.rows:
                continue
            time = piece.time + (piece.origin - start)
            for name in piece.values:
                first, last = spans.get(name, (np.inf, -np.inf))
                spans[name] = min(first, float(time[0])), max(last, float(time[-1]))
            yield replace(piece, time=time, origin=start)
        parts.append((run.source, spans))
    return join_sources(folder, parts, log.unread)


def needs_time_order(log: Path) -> bool:
    """Return True if rows must be sorted by their times, as messages, instead of in the order of the file."""
    return log.is_dir() or has_topics(choose_format(log))


def element_names(path: Path, topic: str) -> tuple[str, ...]:
    """Return the element names in the first message of a topic, such as the joint names of a JointState.

    Empty if the message does not name its elements, or the format has no such names.
    """
    read_names = getattr(choose_format(path), "element_names", None)
    return tuple(read_names(path, topic)) if read_names is not None else ()


def read_recording(path: Path, machine_file: MachineFile, ranges: PlausibleRanges | None = None) -> Recording:
    """Return one log as a recording on the load side; raises RecordingError or ConfigurationError.

    A folder of MCAP or .db3 files, as written by rosbag2, is one log in parts. Values outside of `ranges` are masked.
    """
    return read_as_logged(path, machine_file).on_load_side(machine_file.machine, ranges)


def read_as_logged(path: Path, machine_file: MachineFile, unread: Unread = "error") -> LoggedRecording:
    """Return one log, a file or a folder of parts, as logged; raises RecordingError or ConfigurationError.

    `unread` is the severity of a part that cannot be read: with "error" it raises, with "loss" it is a finding.
    """
    source, channels = mapped_source(path, machine_file, unread)
    with naming(path):
        name = path.name if path.is_dir() else ""
        logged = assemble_recording(source, channels, machine_file.machine, log_digest(path), name)
    if machine_file.columns.beside or machine_file.topics.beside:
        return replace(logged, recording=_with_files_beside(logged.recording, path, machine_file, unread))
    return logged


def _mapped_parts(folder: Path, machine_file: MachineFile, unread: Unread) -> tuple[Source, ChannelMap]:
    """Return what mapped_source returns, of the parts of a log, on one clock."""
    files, lost = _parts_of(folder, unread)
    parts = [mapped_source(file, machine_file) for file in files]
    for part, channels in parts:
        if not channels.topics:
            raise _not_of_topics(part.path)
    with naming(folder):
        source, channels = join_parts(folder, parts)
    return replace(source, findings=(*lost, *source.findings)), channels


def _not_of_topics(part: Path) -> RecordingError:
    return RecordingError(f"{part}: is not a log of topics, as a part of a log has to be", "remove it or its suffix")


def _with_files_beside(recording: Recording, path: Path, machine_file: MachineFile, unread: Unread) -> Recording:
    """Return the recording of a log with the channels in files beside it."""
    by_topics = has_topics(choose_format(log_parts(path)[0]))
    channels = machine_file.topics if by_topics else machine_file.columns

    def read_trigger(name: str | int) -> Series:
        source = ChannelSource("trigger", columns=(name,))
        if by_topics:
            topic, _, field = str(name).rpartition(" ")
            source = ChannelSource("trigger", topic=topic, field=field)
        only = machine_file.with_map(replace(channels, sources=(source,), beside=()))
        return read_as_logged(path, only, unread).recording["trigger"]

    def read_own_file(file: Path, mapped: ChannelMap) -> Recording:
        source, resolved = mapped_source(file, machine_file.with_map(mapped))
        with naming(file):
            return assemble_recording(source, resolved, machine_file.machine, file_digest(file)).recording

    return add_files_beside(recording, path, channels, read_own_file, read_trigger)


def _parts_of(folder: Path, unread: Unread) -> tuple[Sequence[Path], Sequence[Finding]]:
    """Return the files of a folder in the order of their times or names, and the losses; raises RecordingError."""
    if unread == "error":
        parts = log_parts(folder)
        return parts, missing_part_findings(folder, parts)
    log = _LogFolder.of(folder)
    if not log.filled:
        raise RecordingError(f"{folder}: no part of the log contains a message", "was the recording stopped at once?")
    return log.filled, loss_findings(folder, (*log.filled, *log.empty, *log.unread), log.unread)


class _LogFolder(NamedTuple):
    """The parts of a log in a folder: `filled` ones in the order of their first times, and `empty` ones.

    `unread` are those that cannot be read, with the reason.
    """

    filled: tuple[Path, ...]
    empty: tuple[Path, ...]
    unread: Mapping[Path, RecordingError]

    @classmethod
    def of(cls, folder: Path) -> _LogFolder:
        """Return the parts of a folder; raises RecordingError if no part can be read."""
        starts: dict[Path, float] = {}
        unread: dict[Path, RecordingError] = {}
        for part in log_parts(folder):
            try:
                starts[part] = _first_time(part)
            except RecordingError as fault:
                unread[part] = fault
        if not starts:
            raise next(iter(unread.values()))
        known = sorted((start, part.name, part) for part, start in starts.items() if start < np.inf)
        empty = tuple(part for part, start in starts.items() if start == np.inf)
        return cls(tuple(part for _, _, part in known), empty, unread)


def log_digest(log: Path) -> str:
    """Return the SHA-256 of a log; of a folder that of the hexadecimal digests of its parts, in the order of names."""
    return join_digests([file_digest(part) for part in (log_parts(log) if log.is_dir() else [log])])


def log_parts(path: Path) -> list[Path]:
    """Return the files of a log: the file itself, or those in a folder written by rosbag2; raises RecordingError."""
    for pattern in _PARTS if path.is_dir() else ():
        if parts := sorted(part for part in path.glob(pattern) if not part.name.startswith(".")):
            return parts
    if path.is_dir() and (lost := missing_part_findings(path, [])):
        raise RecordingError(f"{path}: {lost[0]}", "copy the complete folder that rosbag2 wrote")
    with naming(path):
        _read_head(path)
    return [path]


def mapped_source(path: Path, machine_file: MachineFile, unread: Unread = "error") -> tuple[Source, ChannelMap]:
    """Return the mapped columns of a log, a file or a folder of parts, and the map for them; raises RecordingError.

    A mapped load cell or label that is not in the file is left out of the map, with a note.
    """
    if path.is_dir():
        return _mapped_parts(path, machine_file, unread)
    file_format = choose_format(path)
    topics = has_topics(file_format)
    channels = machine_file.topics if topics else machine_file.columns
    if not channels.sources:
        section, what = ("[channels.mcap]", "topic and field") if topics else ("[channels]", "column and unit")
        raise ConfigurationError(
            f"{machine_file.path}: no channel in {section}, which {path} needs",
            f"write {section} with the {what} of each channel",
        )
    with naming(path):
        if topics and not channels.topics:
            raise RecordingError("contains topics, but columns are mapped", "give a file of columns")
        if topics:
            asked = replace(channels, sources=tuple(axis for item in channels.sources for axis in item.by_axis))
            source, resolved = resolve_columns(file_format.columns(path, asked), asked)
            return source, _with_vectors(resolved, channels)
        source, resolved = resolve_columns(file_format.columns(path, channels), channels)
        if resolved.time.nanoseconds_key:
            source = with_nanoseconds(source, resolved.time.key, resolved.time.nanoseconds_key, resolved.time.factor)
        return with_one_clock(source, resolved), resolved


def _with_vectors(resolved: ChannelMap, channels: ChannelMap) -> ChannelMap:
    """Return a resolved map in which the axes of a force are one source again; one without all its axes is missing."""
    vectors = [
        replace(item, keys=tuple(axis.described for axis in item.by_axis)) for item in channels.sources if item.fields
    ]
    names = {item.channel for item in vectors}
    present = {key for item in resolved.sources for key in item.keys}
    whole = [item for item in vectors if present.issuperset(item.keys)]
    sources = (*(item for item in resolved.sources if item.channel not in names), *whole)
    return replace(resolved, sources=sources)


def with_nanoseconds(source: Source, seconds: str, nanoseconds: str, factor: float = 1.0) -> Source:
    """Return a table with one clock, `seconds` (of `factor` s), in place of it and of the nanoseconds within each."""
    columns = {key: column for key, column in source.columns.items() if key != nanoseconds}
    clock, rest = columns[seconds], source.columns[nanoseconds].values
    # An epoch is subtracted first: float64 does not represent nanoseconds since 1970.
    start = epoch_start(clock.values, factor)
    values = clock.values - start + rest * (1e-9 / factor)
    columns[seconds] = replace(clock, values=values, unit="s" if factor == 1.0 else clock.unit)
    return replace(source, columns=columns, origin=source.origin + start * factor)


def has_topics(file_format: Format) -> bool:
    """Return True if a format contains messages of topics, mapped by [channels.mcap]; optional for plug-ins."""
    return bool(getattr(file_format, "topics", False))


def is_bag_folder(path: Path) -> bool:
    """Return whether a folder was written by rosbag2: its metadata.yaml names its parts."""
    return path.is_dir() and bool(named_parts(path))


def _first_time(part: Path) -> float:
    """Return the first time of a part [s]; infinite without a message, so that the part is last."""
    pieces = read_pieces(choose_format(part), part)
    try:
        piece: Piece | None = next(pieces, None)
    finally:
        pieces.close()
    return np.inf if piece is None or piece.time is None or not piece.rows else piece.origin + float(piece.time[0])


def _read_head(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise RecordingError("is a folder", "name the recordings in it, e.g. with *.csv")
        if not path.exists():
            whole, mark, _ = str(path).rpartition("#")
            is_run = mark and location(whole).exists()
            hint = f"for a run of {whole}, state how it is cut, as operations=column:NAME" if is_run else ""
            raise RecordingError("no such file", hint or "check the path")
        if not path.is_file():
            raise RecordingError("is not a regular file", "save the stream to a file first")
        with path.open("rb") as file:
            head = file.read(512)
    except OSError as fault:
        raise RecordingError(f"cannot be read: {fault.strerror}", "check the file's permissions") from fault
    if not head or (head.startswith(MAGIC) and not read_sample(path, 1)):
        raise RecordingError("is empty", "was the recording stopped at once, or the copy cut off?")
    return head


def with_one_clock(source: Source, channels: ChannelMap) -> Source:
    """Return a source of columns that have all a clock of their own, as in MDF4, TDMS and HDF5 files, or none has.

    Their own clocks count if the machine file names them. Raises RecordingError if a column has no clock, and
    ConfigurationError if the machine file states another unit than s.
    """
    if all(column.time is None for column in source.columns.values()):
        return source
    if channels.time.column != OWN_CLOCK:  # a column or a rate that the machine file names decides
        return replace(source, columns={name: replace(column, time=None) for name, column in source.columns.items()})
    if channels.time.factor != 1.0:
        raise ConfigurationError(
            "its own clock is in s, but [channels] time states another unit", 'time = { column = "time", unit = "s" }'
        )
    for item in channels.sources:
        for key in item.keys:
            if source.columns[key].time is None:
                raise RecordingError(
                    f"column '{source.columns[key].name}' (channel '{item.channel}') has no clock",
                    "name the column with its clock in [channels] time",
                    channel=item.channel,
                )
    return source
