"""LabVIEW's measurement files (.lvm): a head of keys, then segments of rows, each with a head of its own.

    LabVIEW Measurement
    Separator       Tab
    X_Columns       One
    ***End_of_Header***

    Channels        2
    Samples         100         100
    X0              0.0         0.0
    Delta_X         0.001       0.001
    ***End_of_Header***
    X_Value         Force       Torque      Comment
    0.000000        1.5         -0.5

The keys are those of the "Specification for the LabVIEW Measurement File" of National Instruments.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import ClassVar

import numpy as np

from cdtool.channels import ChannelMap, TablePins
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.column_names import OWN_CLOCK, requested_keys
from cdtool.formats.container_checks import left_out_finding
from cdtool.formats.csv import Csv
from cdtool.formats.csv.cells import SEPARATORS, kind, number
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.encoding import HEAD_BYTES, detect_text, looks_like_text
from cdtool.formats.csv.foreign_heads import LABVIEW, is_measurement
from cdtool.formats.csv.marks import Marks, SampleCell
from cdtool.formats.csv.text import SAMPLE_BYTES, Text, read_sample, read_small
from cdtool.formats.csv.timed_table import ClockGroup, CountClock, RowCells, StampClock, headers, timed_pieces
from cdtool.formats.pieces import Pieces, PiecewiseFormat
from cdtool.formats.source import Source
from cdtool.recording import FloatArray

_END, _X, _COMMENT = "***End_of_Header***", "X_Value", "Comment"
_SEGMENT_KEYS = {"Channels", "Samples", "Delta_X", "X_Dimension"}
_SEPARATOR_WORDS = {"tab": "\t", "comma": ","}
# No recording has more segments, or more columns in a segment.
_MOST_SEGMENTS, _MOST_COLUMNS = 10_000, 1 << 14
# Statements of more samples are no more precise, but may not fit into 64 bits.
_MOST_SAMPLES = 1 << 40
_DATE = re.compile(r"(?P<year>\d{4})/(?P<month>\d{1,2})/(?P<day>\d{1,2})")
_TIME = re.compile(r"(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2})(?:[.,](?P<fraction>\d+))?")
# Seconds from 1904, where LabVIEW's times begin, to 1970. Later stamps are absolute, others count from the start.
_EPOCH_1904, _ABSOLUTE = 2_082_844_800, 1e9


@dataclass(frozen=True)
class Lvm(PiecewiseFormat):
    """LabVIEW measurement files: each channel has the times of its `X_Value` column, or of its X0 and Delta_X."""

    name: ClassVar[str] = "lvm"
    suffixes: ClassVar[tuple[str, ...]] = (".lvm",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a measurement file."""
        head = read_sample(path, HEAD_BYTES)
        return is_measurement(head) and looks_like_text(head)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all; raises RecordingError.

        If the machine file names a column as the clock, or pins lines in `[csv]`, the file is a table with one clock.
        """
        if wanted is not None and _is_of_table(wanted):
            return Csv().columns(path, wanted)
        return super().columns(path, wanted)

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        log = _read_measurement(path, TablePins() if wanted is None else wanted.pins)
        names = tuple(log.units)
        keys = [key for key in requested_keys(path, wanted, names) if some is None or key in some]
        findings, left_out = [*log.findings], set[str]()
        for segment in log.segments:
            table = yield from timed_pieces(path, segment.dialect, segment.groups, keys, survey=wanted is None)
            findings += table.findings
            left_out |= table.left_out
            if table.rows < segment.stated:
                findings.append(
                    Finding(
                        "segment_cut_off",
                        "",
                        {"line": segment.dialect.first_line, "stated": segment.stated, "rows": table.rows},
                    )
                )
        read = [key for key in keys if key not in left_out]
        if not read:
            raise RecordingError(f"{path}: no channel has numbers", "see cdtool info")
        groups = [group for segment in log.segments for group in segment.groups]
        columns = headers(groups, log.units, read)
        ordered = {key: columns[key] for key in names if key in columns}
        merged = tuple(dict.fromkeys(findings))
        return Source(path, self.name, ordered, log.origin, merged, log.details, names)


def _is_of_table(wanted: ChannelMap) -> bool:
    column = wanted.time.column
    return column not in (None, OWN_CLOCK) or wanted.pins.header is not None or wanted.pins.skip_lines > 0


@dataclass(frozen=True)
class _PacketClock:
    """The times of a channel with fewer samples than the first one, in packets of `rows` rows.

    A packet has `samples` of them, `step` [s] apart, in its first rows. `column` are the times of the first channel,
    `first_step` [s] apart (None: no such column, and the first sample is at `start` [s]); `offset` [s] is added.
    """

    rows: int
    samples: int
    step: float
    first_step: float
    start: float
    offset: float
    column: int | None
    whole: tuple[int, ...] = ()

    @property
    def numbers(self) -> tuple[int, ...]:
        """The column of times."""
        return () if self.column is None else (self.column,)

    def times(self, rows: RowCells) -> FloatArray:
        """Return the times of the rows in which the channel has a sample."""
        packet, row = np.divmod(np.arange(rows.first, rows.first + rows.count), self.rows)
        if self.column is None:
            times = self.start + (packet * self.samples + row) * self.step
        else:
            times = rows.numbers[self.column] + row * (self.step - self.first_step)
        return np.where(row < self.samples, times + self.offset, np.nan)


@dataclass(frozen=True)
class _Segment:
    """A segment: the dialect of its rows, its channels by clock, and the rows that its head states (0: none)."""

    dialect: Dialect
    groups: tuple[ClockGroup, ...]
    stated: int


@dataclass(frozen=True)
class _Measurement:
    """A measurement file: its segments, the units of its channels, its start since 1970 [s], and findings."""

    segments: tuple[_Segment, ...]
    units: Mapping[str, str | None]
    origin: float
    details: Mapping[str, str]
    findings: tuple[Finding, ...]


@dataclass
class _Head:
    """The head of a segment: its keys, the cells of the names, and where its rows are in the stream.

    The first row is line `line` (from 1). `row` are the cells of the first row.
    """

    keys: dict[str, list[str]]
    names: list[str] = field(default_factory=list)
    line: int = 0
    start: int = 0
    end: int = 0
    row: list[str] = field(default_factory=list)

    @property
    def clocks(self) -> list[int]:
        """Return the columns of times."""
        return [at for at, name in enumerate(self.names) if name == _X]

    @property
    def channels(self) -> dict[int, str]:
        """Return the names of the channels by column."""
        last = len(self.names) - 1
        named = {at: name for at, name in enumerate(self.names) if name and name != _X}
        if named.get(last) == _COMMENT:
            del named[last]
        counts = Counter(named.values())
        return {at: f"{name}#{at}" if counts[name] > 1 else name for at, name in named.items()}

    def cell(self, key: str, column: int) -> str:
        """Return what a key states about a column: in that column, or in the order of the channels."""
        cells, columns = self.keys.get(key, []), [*self.channels]
        if column < len(cells) and cells[column]:
            return cells[column]
        values = [cell for cell in cells[1:] if cell]
        return values[columns.index(column)] if len(values) == len(columns) else ""

    def number(self, key: str, column: int, default: float) -> float:
        """Return the number that a key states about a channel."""
        cell = self.cell(key, column)
        value = number(cell, "," if "," in cell else ".") if cell else None
        return value if value is not None and np.isfinite(value) else default

    def samples(self, column: int, default: int = 0) -> int:
        """Return how many samples of a channel are stated."""
        return int(min(self.number("Samples", column, default), _MOST_SAMPLES))

    def started(self, column: int) -> Fraction | None:
        """Return the date and time [s] of a channel since 1970, without a time zone; None if unknown."""
        return _instant(self.cell("Date", column), self.cell("Time", column))


@dataclass(frozen=True)
class _Style:
    """What the head of the file states about all segments: the marks, and whether there are columns of times."""

    separator: str
    decimal: str
    counted: bool
    started: Fraction | None


def _read_measurement(path: Path, pins: TablePins) -> _Measurement:
    content = read_small(path)
    sample = read_sample(path) if content is None else content[:SAMPLE_BYTES]
    if not sample.strip():
        raise RecordingError(f"{path}: is empty", "was the recording stopped immediately, or the copy cut off?")
    text, stream = detect_text(path, sample, pins.encoding, content)
    style = _style(path, text, stream, pins)
    heads, is_cut = _heads(path, text, style)
    if not heads:
        raise RecordingError(f"{path}: has no row of numbers", "was the recording stopped immediately?")
    if len(heads) > 1 and text.recoded:
        raise RecordingError(f"{path}: has several segments in {text.encoding.upper()}", "save it again as UTF-8")
    for head in heads:
        _check_head(path, head)
    findings = [Finding("last_segment_incomplete")] if is_cut else []
    origin, absolute = _origin(heads, style, findings)
    units: dict[str, str | None] = {}
    empty: dict[str, None] = {}
    segments = []
    for head in heads:
        channels = {at: key for at, key in head.channels.items() if head.samples(at, 1) > 0}
        empty |= dict.fromkeys(key for at, key in head.channels.items() if at not in channels)
        for at, key in channels.items():
            units.setdefault(key, head.cell("Y_Unit_Label", at) or None)
        groups = _groups(head, channels, style, origin, absolute, findings)
        stated = max(map(head.samples, channels), default=0)
        segments.append(_Segment(_dialect(text, pins, head, style), tuple(groups), stated))
    findings += [left_out_finding(key, "empty") for key in empty if key not in units]
    details = {
        "separator": SEPARATORS.get(style.separator, repr(style.separator)),
        "decimal mark": "comma" if style.decimal == "," else "point",
        "encoding": text.encoding,
        "segments": str(len(segments)),
    }
    return _Measurement(
        _with_common_clocks(segments),
        units,
        absolute - _EPOCH_1904 if absolute else float(origin),
        details,
        tuple(findings),
    )


def _style(path: Path, text: Text, stream: bytes, pins: TablePins) -> _Style:
    """Return what the head of the file states; raises RecordingError for an unknown separator."""
    lines = []
    for raw in stream.split(text.line_end):
        lines.append(text.decode(raw).strip(" \r\n"))
        if lines[-1].startswith(_END):
            break
    else:
        raise RecordingError(f"{path}: its head has no end ({_END})", "was the copy cut off? copy it again")
    if not lines[0].lstrip("\ufeff").startswith(LABVIEW):
        raise RecordingError(f"{path}: is not a measurement file of LabVIEW", "see cdtool list formats")
    stated = next((line for line in lines if line.startswith("Separator")), "Separator\tTab")
    mark, word = stated[len("Separator") : len("Separator") + 1], stated[len("Separator") + 1 :].strip(" \t,").lower()
    separator = pins.separator or _SEPARATOR_WORDS.get(word, "")
    if not separator or (mark != separator and not pins.separator):
        raise RecordingError(
            f"{path}: states the separator '{word[:20]}', which is not Tab or Comma", "pin separator in [csv]"
        )
    keys = {line.partition(separator)[0]: line.split(separator)[1:] for line in lines}

    def value(key: str) -> str:
        return next(iter(keys.get(key, [])), "").strip()

    decimal = pins.decimal or value("Decimal_Separator") or "."
    if decimal not in (".", ",") or decimal == separator:
        raise RecordingError(f"{path}: states the decimal separator '{decimal}'", "pin decimal in [csv]")
    return _Style(separator, decimal, value("X_Columns").lower() == "no", _instant(value("Date"), value("Time")))


def _heads(path: Path, text: Text, style: _Style) -> tuple[list[_Head], bool]:
    """Return the heads of the segments with the bytes of their rows, and whether the file ends within a head."""
    search = _HeadSearch(path, style.separator)
    lines_before, offset = 0, 0
    for block, size in text.blocks(0):
        data = np.frombuffer(block, dtype=np.uint8, count=size)
        starts = np.concatenate(([0], np.flatnonzero(data == text.line_end[0]) + 1))
        starts = starts[starts < size]
        marked = np.flatnonzero(_BEGINS_HEAD[data[starts]])
        line = 0
        while line < len(starts):
            if search.head is None and not search.keys:  # rows follow, up to the next line that may begin a head
                at = int(np.searchsorted(marked, line))
                if at == len(marked):
                    break
                line = int(marked[at])
            end = int(starts[line + 1]) if line + 1 < len(starts) else size
            cells = _cells(text.decode(bytes(memoryview(block)[int(starts[line]) : end])), style.separator)
            search.add(cells, lines_before + line + 1, offset + int(starts[line]))
            line += 1
        offset += size
        lines_before += len(starts)
    return search.end(offset)


# The letters with which the lines of a head begin, and no row.
_BEGINS_HEAD = np.array(
    [chr(letter).isascii() and (chr(letter).isalpha() or letter == ord("*")) for letter in range(256)]
)


class _HeadSearch:
    """The heads found so far; `head` is the one whose names or first row are still to come."""

    def __init__(self, path: Path, separator: str) -> None:
        self.path, self.separator = path, separator
        self.heads: list[_Head] = []
        self.head: _Head | None = None
        self.keys: dict[str, list[str]] = {}
        self.begin = 0  # of the first line of words below the last row

    def add(self, cells: list[str], line: int, start: int) -> None:
        """Add a line of a head, the line of names below it, or its first row, which starts at byte `start`."""
        if not any(cells):
            return
        if self.head is None and self.heads and _is_row(cells):  # the words above it were no head
            self.keys, self.begin = {}, 0
        elif self.head is None:
            self._add_key(cells, start)
        elif not self.head.names:
            self.head.names = cells
        elif _is_row(cells):
            self.head.line, self.head.start, self.head.row = line, start, cells
            self.heads.append(self.head)
            self.head = None
            if len(self.heads) > _MOST_SEGMENTS:
                raise RecordingError(f"{self.path}: has more than {_MOST_SEGMENTS} segments", "write one heading only")
        elif cells[0] in _SEGMENT_KEYS:  # a segment without rows
            self.head = None
            self._add_key(cells, start)
        else:
            raise RecordingError(
                f"{self.path}: line {line} ({cells[0][:30]!r}) is below the names, but is no row of numbers",
                "repair the line",
            )

    def _add_key(self, cells: list[str], start: int) -> None:
        if not self.keys and not self.begin:
            self.begin = start
        if cells[0] != _END:
            self.keys[cells[0]] = cells
            return
        if self.keys.keys() & _SEGMENT_KEYS:
            self.head = _Head(self.keys)
            if self.heads and not self.heads[-1].end:
                self.heads[-1].end = self.begin
            self.begin = 0
        self.keys = {}

    def end(self, size: int) -> tuple[list[_Head], bool]:
        """Return the heads, and whether another one is cut off; `size` is that of the stream.

        Other words below the last row are left to the reader of the rows.
        """
        is_cut = self.head is not None or bool(self.keys.keys() & _SEGMENT_KEYS)
        if self.heads and not self.heads[-1].end:
            self.heads[-1].end = self.begin if is_cut and self.begin else size
        return self.heads, is_cut


def _check_head(path: Path, head: _Head) -> None:
    count, stated = len(head.channels), head.keys.get("Channels", ["", ""])
    if len(head.names) > _MOST_COLUMNS:
        raise RecordingError(f"{path}: names {len(head.names)} columns, more than {_MOST_COLUMNS}", "split the log")
    if head.names[0] != _X:
        raise RecordingError(
            f"{path}: line {head.line - 1} begins with {head.names[0][:30]!r}, not with {_X}", "repair the line"
        )
    if len(stated) > 1 and stated[1].isdigit() and int(stated[1][:12]) != count:
        raise RecordingError(
            f"{path}: line {head.line - 1} has {count} names, but {stated[1][:12]} channels are stated above it",
            "was the file edited, or the copy damaged?",
        )
    for at in head.channels:
        dimension = head.cell("X_Dimension", at)
        if dimension not in ("", "Time"):
            raise RecordingError(
                f"{path}: the x axis of channel '{head.channels[at]}' is '{dimension[:30]}', not Time",
                "a log of samples over time is needed",
            )


def _origin(heads: Sequence[_Head], style: _Style, findings: list[Finding]) -> tuple[Fraction, float]:
    """Return the start since 1970 [s], and the first stamp [s] if the stamps count from 1904 (0: they do not)."""
    stamps = [
        value
        for head in heads
        for at in head.clocks
        if at < len(head.row)
        and (value := number(head.row[at], style.decimal)) is not None
        and _ABSOLUTE < value < np.inf
    ]
    if stamps and not style.counted:
        return Fraction(0), min(stamps)
    starts = [start for head in heads for at in head.channels if (start := head.started(at)) is not None]
    origin = min(starts, default=style.started or Fraction(0))
    unknown = tuple(
        dict.fromkeys(key for head in heads for at, key in head.channels.items() if head.started(at) is None)
    )
    if starts and unknown:
        findings.append(Finding("start_assumed", "", {"channels": unknown}))
    return origin, 0.0


def _groups(
    head: _Head,
    channels: Mapping[int, str],
    style: _Style,
    origin: Fraction,
    absolute: float,
    findings: list[Finding],
) -> Iterator[ClockGroup]:
    """Yield the channels of a segment by their clocks."""
    starts = {at: head.started(at) for at in channels}
    known = [start for start in starts.values() if start is not None]
    usual = min(known, default=origin)
    offsets = {at: float((starts[at] or usual) - origin) if known else 0.0 for at in channels}
    steps = {at: head.number("Delta_X", at, 0.0) for at in channels}
    firsts = {at: head.number("X0", at, 0.0) for at in channels}
    samples = {at: head.samples(at) for at in channels}
    rows = max(samples.values(), default=0)
    clocks = head.clocks
    alike: dict[tuple[float, ...], list[int]] = {}
    for at in channels:
        if len(clocks) > 1:
            alike.setdefault((float(max(clock for clock in clocks if clock < at)), offsets[at]), []).append(at)
        else:
            alike.setdefault((offsets[at], steps[at], firsts[at], float(samples[at])), []).append(at)
    lead = next(iter(channels), 0)
    for number_of_group, members in enumerate(alike.values()):
        at = members[0]
        columns = {channels[member]: member for member in members}
        offset = -absolute if absolute else offsets[at]
        name = f"{_X} {number_of_group}"
        if len(clocks) > 1:
            column = max(clock for clock in clocks if clock < at)
            yield ClockGroup(name, columns, StampClock(column, 1.0, offset), sparse=True)
        elif style.counted:
            if samples[at] == rows:
                yield ClockGroup(name, columns, CountClock(offset + firsts[at], steps[at] or 1.0), sparse=True)
            else:
                packets = _PacketClock(rows, samples[at], steps[at], 0.0, firsts[at], offset, None)
                yield ClockGroup(name, columns, packets, sparse=True)
        elif number_of_group == 0 or samples[at] == rows == 0:
            yield ClockGroup(name, columns, StampClock(0, 1.0, offset), sparse=True)
        else:
            # The column of times is that of the first channel only.
            findings.append(Finding("derived_times", "", {"channels": tuple(columns)}))
            later = offsets[at] - offsets[lead] - absolute if absolute else offsets[at]
            later += firsts[at] - firsts[lead]
            packets = _PacketClock(max(rows, 1), samples[at] or rows, steps[at], steps[lead], 0.0, later, 0)
            yield ClockGroup(name, columns, packets, sparse=True)


def _with_common_clocks(segments: Sequence[_Segment]) -> tuple[_Segment, ...]:
    """Return segments in which equal names of clocks mean the same channels: otherwise each channel has its own."""
    parts = {frozenset((group.name, *group.columns) for group in segment.groups) for segment in segments}
    if len(parts) == 1:
        return tuple(segments)
    return tuple(
        replace(
            segment,
            groups=tuple(
                replace(group, name=key, columns={key: at})
                for group in segment.groups
                for key, at in group.columns.items()
            ),
        )
        for segment in segments
    )


def _dialect(text: Text, pins: TablePins, head: _Head, style: _Style) -> Dialect:
    width, last = len(head.names), head.end == text.size - text.mark or text.recoded
    row = [*head.row, *[""] * width]
    kinds = "".join("N" if kind(cell) == "N" else "M" for cell in row[:width])
    words = {at: SampleCell(row[at], head.line) for at in head.channels if kind(row[at]) in "XT"}
    return Dialect(
        text=text if last else replace(text, size=text.mark + head.end, padding=0),
        pins=pins,
        separator=style.separator,
        marks=Marks(style.decimal),
        missing=pins.missing,
        header=tuple(head.channels.get(at, str(at)) for at in range(width)),
        first_line=head.line,
        sampled=1,
        offset=head.start,
        width=width,
        kinds=kinds,
        words=words,
        short_rows=True,
    )


def _instant(date: str, time: str) -> Fraction | None:
    """Return a date and a time of day since 1970 [s]; None if unknown: an empty stamp of LabVIEW is in 1903 or 1904."""
    day, clock = _DATE.fullmatch(date.strip()), _TIME.fullmatch(time.strip())
    if day is None or clock is None or int(day["year"]) < 1970:
        return None
    try:
        days = np.datetime64(f"{day['year']}-{int(day['month']):02d}-{int(day['day']):02d}", "D").astype(int)
    except ValueError:
        return None
    seconds = int(days) * 86400 + int(clock["hour"]) * 3600 + int(clock["minute"]) * 60 + int(clock["second"])
    return seconds + Fraction(f"0.{clock['fraction'] or 0}")


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip(" \r\n") for cell in line.lstrip("\ufeff").split(separator)]


def _is_row(cells: Sequence[str]) -> bool:
    """Return whether a line has a number in its first two cells, the first of which may be empty."""
    return kind(cells[0]) in "NM" and any(kind(cell) == "N" for cell in cells)
