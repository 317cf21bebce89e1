"""Reading a log: which format, which section of the machine file, one file or parts, as a whole or piece by piece."""

from __future__ import annotations

import codecs
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from cdtool.channels import ChannelMap, ChannelSource
from cdtool.columns import Column, Piece
from cdtool.errors import ConfigurationError, RecordingError
from cdtool.file_kinds import kind_of
from cdtool.findings import Finding
from cdtool.formats import FORMATS
from cdtool.formats.column_names import OWN_CLOCK, resolve_columns
from cdtool.formats.csv.text import read_sample
from cdtool.formats.pieces import PieceRun, Pieces, join_pieces, read_pieces
from cdtool.formats.source import Format, Source, in_words
from cdtool.ingest.channel_assembly import as_logged
from cdtool.ingest.header_units import unit_findings
from cdtool.ingest.parts import (
    Span,
    joined_details,
    joined_recordings,
    joined_sources,
    joined_topics,
    lost_findings,
    lost_parts,
)
from cdtool.logged_recording import LoggedRecording
from cdtool.machine_file import MachineFile
from cdtool.plausible import PlausibleRanges
from cdtool.recording import Recording

# Opens a file of a format, for some of its columns or all.
ReadFile = Callable[[Format, Path, Collection[str] | None], Pieces]

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
_NEXT_STEPS = {
    "a ZIP archive or an Excel workbook": "unpack the archive, or save the sheet as CSV",
    "gzip-compressed": "unpack it first, e.g. with gunzip",
    "zstd-compressed": "unpack it first, e.g. with unzstd",
}
# UTF-32 first: its mark begins with that of UTF-16.
_WIDE = {
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
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
    claimed = by_suffix and not any(_sniffs_any_text(item) for item in by_suffix)
    for item in [*by_suffix, *formats]:
        if item.sniff(path) and not (claimed and _sniffs_any_text(item) and not _is_table(item, path)):
            return item
    wide = next((encoding for mark, encoding in _WIDE.items() if head.startswith(mark)), "")
    start = (head.decode(wide, errors="replace").encode() if wide else head).removeprefix(codecs.BOM_UTF8).lstrip()
    seen = next((text for magic, text in _KNOWN_CONTENTS.items() if start.startswith(magic)), "")
    seen = kind_of(head) or seen if seen == "JSON" else seen
    if wide and not seen and _is_damaged_text(path, wide):
        raise RecordingError(
            f"{path}: begins as {wide.upper()} does, but does not go on as it", "copy it again from where it was made"
        )
    expected = f", nor a whole {by_suffix[0].name.upper()} file" if by_suffix and not seen else ""
    raise RecordingError(
        f"{path}: is not a recording{f': it is {seen}' if seen else expected}",
        _NEXT_STEPS.get(seen, f"cdtool reads {', '.join(item.name for item in formats)}"),
    )


def survey(path: Path) -> Source:
    """Return all numeric columns of a log, its rows in memory, and its warnings; raises RecordingError."""
    return join_pieces(log_pieces(path), sort=True) if path.is_dir() else choose_format(path).columns(path)


def log_pieces(log: Path, keys: Collection[str] | None = None, read: ReadFile = read_pieces) -> Pieces:
    """Yield all numeric columns of a file, or of the folder that rosbag2 made, or at least `keys`.

    A part that cannot be read is a loss, as long as another one can. Raises RecordingError.
    """
    if not log.is_dir():
        return read(choose_format(log), log, keys)
    return _of_parts(log, keys, read)


def _of_parts(folder: Path, keys: Collection[str] | None, read: ReadFile) -> Pieces:
    """Yield the parts one after the other, all times from the start of the first."""
    found = FoundParts.of(folder)
    start: float | None = None
    parts: list[tuple[Source, Mapping[str, Span]]] = []
    for part in (*found.filled, *found.empty):
        run = PieceRun(read(choose_format(part), part, keys))
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
    return joined_sources(folder, parts, found.unread)


def in_time_order(log: Path) -> bool:
    """Return True where rows are to be in the order of their times, as messages are, and not as they stand."""
    return log.is_dir() or has_topics(choose_format(log))


def element_names(path: Path, topic: str) -> tuple[str, ...]:
    """Return how the first message of a topic names the elements of its arrays, as a JointState names its joints.

    Empty where it does not, or the format cannot tell.
    """
    tell = getattr(choose_format(path), "element_names", None)
    return tuple(tell(path, topic)) if tell is not None else ()


def read_recording(path: Path, machine_file: MachineFile, ranges: PlausibleRanges | None = None) -> Recording:
    """One log as a recording on the load side; raises RecordingError or ConfigurationError.

    A folder of MCAP or .db3 files, as rosbag2 writes it, is one log in parts. Values outside of `ranges` are masked.
    """
    return read_as_logged(path, machine_file).on_load_side(machine_file.machine, ranges)


def read_as_logged(
    path: Path, machine_file: MachineFile, unread: Literal["error", "loss"] = "error"
) -> LoggedRecording:
    """Return one log, or a folder of its parts, as it is logged; raises RecordingError or ConfigurationError.

    `unread` says what a part is that cannot be read.
    """
    if not path.is_dir():
        return read_parts([path], machine_file, path.stem)
    if unread == "loss":
        found = FoundParts.of(path)
        parts, lost = list(found.filled), list(found.findings)
        if not parts:
            raise RecordingError(f"{path}: no part of the log holds a message", "was the recording stopped at once?")
    else:
        parts = log_parts(path)
        lost = lost_parts(path, parts)
    logged = read_parts(parts, machine_file, path.name)
    findings = (*lost, *logged.recording.findings)
    return replace(logged, recording=replace(logged.recording, source=str(path), findings=findings))


@dataclass(frozen=True)
class FoundParts:
    """The parts of a log in a folder: those that hold something in the order of their first times, and the others.

    `unread` are those that cannot be read at all, with the reason.
    """

    folder: Path
    filled: tuple[Path, ...]
    empty: tuple[Path, ...]
    unread: Mapping[Path, RecordingError]

    @classmethod
    def of(cls, folder: Path) -> FoundParts:
        """Look into each part; raises RecordingError where none can be read."""
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
        return cls(folder, tuple(part for _, _, part in known), empty, unread)

    @property
    def every(self) -> tuple[Path, ...]:
        """All files of the log."""
        return (*self.filled, *self.empty, *self.unread)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is lost: parts that are not there, and those that cannot be read."""
        return lost_findings(self.folder, self.every, self.unread)


def log_parts(path: Path) -> list[Path]:
    """The files of a log: itself, or those in the folder that rosbag2 made; raises RecordingError."""
    for pattern in ("*.mcap", "*.db3") if path.is_dir() else ():
        if parts := sorted(part for part in path.glob(pattern) if not part.name.startswith(".")):
            return parts
    if path.is_dir() and (lost := lost_parts(path, [])):
        raise RecordingError(f"{path}: {lost[0]}", "copy the whole folder that rosbag2 made")
    _head(path)
    return [path]


def mapped_source(path: Path, machine_file: MachineFile) -> tuple[Source, ChannelMap]:
    """One file's columns that the machine file maps, and the map that fits them; raises RecordingError.

    A load cell or label that is mapped and not in the file is left out of the map, with a note.
    """
    found = choose_format(path)
    channels = _map(found, machine_file, path)
    source, resolved = resolve_columns(found.columns(path, channels), channels)
    return with_own_clocks(source, resolved)


def has_topics(found: Format) -> bool:
    """True where a format holds messages of topics, so that [channels.mcap] maps it; a plug-in need not tell."""
    return bool(getattr(found, "topics", False))


def read_parts(paths: Sequence[Path], machine_file: MachineFile, name: str) -> LoggedRecording:
    """Return files that are parts of one log as one recording, in the order of their times; raises RecordingError."""
    parts: list[Recording] = []
    headers: list[Source] = []
    factors: dict[str, tuple[float, ...]] = {}
    for path in paths:
        source, channels = mapped_source(path, machine_file)
        factors |= {item.channel: item.factor for item in channels.sources if item.duty is None}
        parts.append(as_logged(source, channels, machine_file.machine))
        headers.append(replace(source, columns={}))
    whole = parts[0] if len(parts) == 1 and parts[0].name == name else joined_recordings(parts, name)
    details = in_words(joined_details(headers), joined_topics(headers))
    return LoggedRecording(whole, factors, channels.speed_low_pass, source.format, details, source.dialect)


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


def _sniffs_any_text(found: Format) -> bool:
    return bool(getattr(found, "sniffs_any_text", False))


def _is_table(found: Format, path: Path) -> bool:
    try:
        return bool(found.columns(path).columns)
    except RecordingError:
        return False


def _suffixes() -> set[str]:
    return {suffix for name in FORMATS.names() for suffix in FORMATS.load(name).suffixes}


def _is_damaged_text(path: Path, encoding: str) -> bool:
    try:
        codecs.getincrementaldecoder(encoding)().decode(read_sample(path))
    except UnicodeError:
        return True
    return False


def _first_time(part: Path) -> float:
    """When a part begins [s]; parts without any message come last."""
    pieces = read_pieces(choose_format(part), part)
    try:
        piece: Piece | None = next(pieces, None)
    finally:
        pieces.close()
    return np.inf if piece is None or piece.time is None or not piece.rows else piece.origin + float(piece.time[0])


def _head(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise RecordingError(f"{path}: is a folder", "name the recordings in it, e.g. with *.csv")
        if not path.exists():
            raise RecordingError(f"{path}: no such file", "check the path")
        if not path.is_file():
            raise RecordingError(f"{path}: is not a regular file", "save the stream to a file first")
        with path.open("rb") as file:
            head = file.read(512)
    except OSError as fault:
        raise RecordingError(f"{path}: cannot be read: {fault.strerror}", "check the file's permissions") from fault
    if not head:
        raise RecordingError(f"{path}: is empty", "was the recording stopped at once, or the copy cut off?")
    return head


def with_own_clocks(source: Source, channels: ChannelMap) -> tuple[Source, ChannelMap]:
    """Return a source whose columns bring times, and its map, so that each channel becomes one column with a clock.

    MDF4, TDMS and HDF5 files have such columns.
    The map's columns are resolved (resolve_columns). A table comes back as it is. Raises RecordingError where a
    channel's columns have different clocks or none, and ConfigurationError where the machine file gives the clock
    another unit than s.
    """
    if channels.topics or not any(column.time is not None for column in source.columns.values()):
        return source, channels
    if channels.time.column != OWN_CLOCK:  # a column or a rate that the machine file names decides
        plain = {name: replace(column, time=None) for name, column in source.columns.items()}
        return replace(source, columns=plain), channels
    if channels.time.factor != 1.0:
        raise ConfigurationError(
            f"{source.path}: its own clock is in s, [channels] time says another unit",
            'time = { column = "time", unit = "s" }',
        )
    joined = {item.channel: _joined(source, item) for item in channels.sources}
    sources = tuple(replace(item, columns=(item.channel,), keys=(item.channel,)) for item in channels.sources)
    names = tuple(joined)
    # What each column says of its unit: the joined ones have none.
    findings = (*source.findings, *unit_findings(source, channels))
    source = replace(source, columns=joined, names=names, findings=findings)
    return source, replace(channels, sources=sources, topics=True)


def _joined(source: Source, item: ChannelSource) -> Column:
    parts = [source.columns[key] for key in item.keys]
    time = parts[0].time
    for part in parts:
        if part.time is None or time is None:
            raise RecordingError(
                f"{source.path}: column '{part.name}' (channel '{item.channel}') has no clock of its own",
                "name the column that is its clock in [channels] time",
                channel=item.channel,
            )
        if not np.array_equal(part.time, time):
            raise RecordingError(
                f"{source.path}: '{parts[0].name}' and '{part.name}' of channel '{item.channel}' have different clocks",
                "the joints of one channel are logged together",
                channel=item.channel,
            )
    return Column(item.channel, np.column_stack([part.values for part in parts]), time)
