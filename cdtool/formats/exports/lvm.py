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

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, naming
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap, TablePins
from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.containers.container_checks import left_out_finding
from cdtool.formats.csv import Csv
from cdtool.formats.csv.cells import kind, number
from cdtool.formats.csv.encoding import HEAD_BYTES, looks_like_text, open_table
from cdtool.formats.csv.text import BLOCK_BYTES, Text, read_sample
from cdtool.formats.csv_dialect.foreign_heads import is_measurement
from cdtool.formats.exports.timed_text import (
    ClockGroup,
    Segment,
    TimedText,
    details_of,
    dialect_of_rows,
    number_in_head,
)
from cdtool.formats.source import Source

_END, _X, _COMMENT = "***End_of_Header***", "X_Value", "Comment"
_SEGMENT_KEYS = {"Channels", "Samples", "Delta_X", "X_Dimension"}
_SEPARATOR_WORDS = {"tab": "\t", "comma": ","}
# No recording has more segments.
_MOST_SEGMENTS = 10_000
# Statements of more samples are no more precise, but may not fit into 64 bits.
_MOST_SAMPLES = 1 << 40
# Seconds from 1904, where LabVIEW's times begin, to 1970. Later stamps are absolute, others count from the start.
_EPOCH_1904, _ABSOLUTE = 2_082_844_800, 1e9


@dataclass(frozen=True)
class Lvm:
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
        pins, clock = (TablePins(), None) if wanted is None else (wanted.pins, wanted.time.column)
        if clock not in (None, OWN_CLOCK) or pins.header is not None or pins.skip_lines > 0:
            return Csv().columns(path, wanted)
        with naming(path):
            return _read_heads(path, pins).source(path, self.name, wanted)


@dataclass(frozen=True)
class _Line:
    """The cells of a line, its number (from 1), and the byte of the stream where it starts."""

    cells: list[str]
    number: int
    start: int


@dataclass(frozen=True)
class _Head:
    """The head of a segment, which begins at byte `start`: its keys, the line of names, and the first row."""

    keys: Mapping[str, list[str]]
    start: int
    names: _Line
    row: _Line

    @property
    def clocks(self) -> list[int]:
        """Return the columns of times."""
        return [at for at, name in enumerate(self.names.cells) if name == _X]

    @property
    def channels(self) -> dict[int, str]:
        """Return the names of the channels by column."""
        named = {at: name for at, name in enumerate(self.names.cells) if name and name != _X}
        if named.get(len(self.names.cells) - 1) == _COMMENT:
            del named[len(self.names.cells) - 1]
        counts = Counter(named.values())
        return {at: f"{name}#{at}" if counts[name] > 1 else name for at, name in named.items()}

    def cell(self, key: str, column: int) -> str:
        """Return what a key states about a column: in that column, or in the order of the channels."""
        cells, columns = self.keys.get(key, []), [*self.channels]
        if column < len(cells) and cells[column]:
            return cells[column]
        values = [cell for cell in cells[1:] if cell]
        return values[columns.index(column)] if len(values) == len(columns) else ""

    def number(self, key: str, column: int, default: float = 0.0) -> float:
        """Return the number that a key states about a channel."""
        value = number_in_head(self.cell(key, column))
        return default if value is None else value

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


def _read_heads(path: Path, pins: TablePins) -> TimedText:
    text, stream = open_table(path, pins.encoding, BLOCK_BYTES)
    style = _style([text.decode(line).strip(" \r\n") for line in stream.split(text.line_end)], pins)
    heads, end = _heads(text, style)
    if not heads:
        raise RecordingError("has no row of numbers", "was the recording stopped immediately?")
    for head in heads:
        _check_head(head)
    findings = [] if end is None else [Finding("last_segment_incomplete")]
    origin, absolute = _origin(heads, style, findings)
    units: dict[str, str | None] = {}
    empty: dict[str, None] = {}
    segments = []
    for head, below in zip(heads, [*(each.start for each in heads[1:]), end], strict=True):
        channels = {at: key for at, key in head.channels.items() if head.samples(at, 1) > 0}
        empty |= dict.fromkeys(key for at, key in head.channels.items() if at not in channels)
        for at, key in channels.items():
            units.setdefault(key, head.cell("Y_Unit_Label", at) or None)
        rows = text if below is None else replace(text, size=text.mark + below, padding=0)
        names = [head.channels.get(at, "") for at in range(len(head.names.cells))]
        place = head.row.number, head.row.start
        dialect = dialect_of_rows(rows, pins, (style.separator, style.decimal), place, names, [head.row.cells])
        groups = tuple(_groups(head, channels, style, origin, absolute, findings))
        segments.append(Segment(dialect, groups, max(map(head.samples, channels), default=0)))
    findings += [left_out_finding(key, "empty") for key in empty if key not in units]
    details = details_of(text, style.separator, style.decimal) | {"segments": str(len(segments))}
    start = absolute - _EPOCH_1904 if absolute else float(origin)
    return TimedText(tuple(segments), units, start, details, tuple(findings))


def _style(lines: Sequence[str], pins: TablePins) -> _Style:
    """Return what the head of the file states; raises RecordingError for an unknown separator."""
    end = next((i for i, line in enumerate(lines) if line.startswith(_END)), None)
    if end is None:
        raise RecordingError(f"its head has no end ({_END})", "was the copy cut off? copy it again")
    stated = next((line for line in lines[:end] if line.startswith("Separator")), "Separator\tTab")
    mark, word = stated[len("Separator") : len("Separator") + 1], stated[len("Separator") + 1 :].strip(" \t,").lower()
    separator = pins.separator or _SEPARATOR_WORDS.get(word, "")
    if not separator or (mark != separator and not pins.separator):
        raise RecordingError(f"states the separator '{word[:20]}', which is not Tab or Comma", "pin separator in [csv]")
    keys = {cells[0]: (cells[1:] or [""])[0].strip() for cells in (line.split(separator) for line in lines[:end])}
    decimal = pins.decimal or keys.get("Decimal_Separator") or "."
    if decimal not in (".", ",") or decimal == separator:
        raise RecordingError(f"states the decimal separator '{decimal}'", "pin decimal in [csv]")
    started = _instant(keys.get("Date", ""), keys.get("Time", ""))
    return _Style(separator, decimal, keys.get("X_Columns", "").lower() == "no", started)


def _heads(text: Text, style: _Style) -> tuple[list[_Head], int | None]:
    """Return the heads of the segments, and the byte of one that the file's end cuts off (None: no head is).

    Other words between and below the rows are left to the reader of the rows.
    """
    heads: list[_Head] = []
    for lines, row in _lines_of_words(text, style.separator):
        ends = [i for i, line in enumerate(lines) if line.cells[0] == _END]
        before, end = ([-1, -1, *ends])[-2:]
        keys = {line.cells[0]: line.cells for line in lines[before + 1 : end]} if ends else {}
        is_head = bool(keys.keys() & _SEGMENT_KEYS)
        below = lines[end + 1 :]
        if row is None:
            is_cut = is_head or any(line.cells[0] in _SEGMENT_KEYS for line in below)
            return heads, lines[0].start if is_cut else None
        if is_head and len(below) > 1:
            wrong = below[1]
            raise RecordingError(
                f"line {wrong.number} ({wrong.cells[0][:30]!r}) is below the names, but not a row of numbers",
                "repair the line",
            )
        if is_head and below:
            heads.append(_Head(keys, lines[0].start, below[0], row))
        if len(heads) > _MOST_SEGMENTS:
            raise RecordingError(f"has more than {_MOST_SEGMENTS} segments", "write one heading only")
    return heads, None


def _lines_of_words(text: Text, separator: str) -> Iterator[tuple[list[_Line], _Line | None]]:
    """Yield the lines from one that begins with a letter, as no row does, to the next row, and that row."""
    lines: list[_Line] = []
    number, start = 1, 0
    for block in text.blocks(0):
        for raw in block.removesuffix(text.line_end).split(text.line_end):
            if lines or raw[:1].isalpha() or raw[:1] == b"*":
                line = _Line(_cells(text.decode(raw), separator), number, start)
                if lines and _is_row(line.cells):
                    yield lines, line
                    lines = []
                elif any(line.cells):
                    lines.append(line)
            start += len(raw) + 1
            number += 1
    if lines:
        yield lines, None


def _check_head(head: _Head) -> None:
    """Raise RecordingError if a head contradicts its names, or is not of samples over time."""
    names, stated = head.names, head.keys.get("Channels", ["", ""])[1:]
    if names.cells[0] != _X:
        raise RecordingError(
            f"line {names.number} begins with {names.cells[0][:30]!r}, not with {_X}", "repair the line"
        )
    if stated and stated[0].isdigit() and int(stated[0][:12]) != len(head.channels):
        raise RecordingError(
            f"line {names.number} has {len(head.channels)} names, but {stated[0][:12]} channels are stated above it",
            "was the file edited, or the copy damaged?",
        )
    for at, key in head.channels.items():
        if (dimension := head.cell("X_Dimension", at)) not in ("", "Time"):
            raise RecordingError(
                f"the x axis of channel '{key}' is '{dimension[:30]}', not Time", "a log of samples over time is needed"
            )


def _origin(heads: Sequence[_Head], style: _Style, findings: list[Finding]) -> tuple[Fraction, float]:
    """Return the start since 1970 [s], and the first stamp [s] if the stamps count from 1904 (0: they do not)."""
    cells = [head.row.cells[at] for head in heads for at in head.clocks if at < len(head.row.cells)]
    values = [value for cell in cells if (value := number(cell, style.decimal)) is not None]
    stamps = [value for value in values if _ABSOLUTE < value < np.inf]
    if stamps and not style.counted:
        return Fraction(0), min(stamps)
    starts = [(key, head.started(at)) for head in heads for at, key in head.channels.items()]
    known = [start for _, start in starts if start is not None]
    unknown = tuple(dict.fromkeys(key for key, start in starts if start is None))
    if known and unknown:
        findings.append(Finding("start_assumed", "", {"channels": unknown}))
    return min(known, default=style.started or Fraction(0)), 0.0


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
    offsets = {at: float((starts[at] or min(known)) - origin) if known else 0.0 for at in channels}
    samples = {at: head.samples(at) for at in channels}
    rows, clocks = max(samples.values(), default=0), head.clocks
    alike: dict[tuple[float, ...], dict[str, int]] = {}
    for at, key in channels.items():
        beside = max(clock for clock in clocks if clock < at)
        stated = (head.number("Delta_X", at), head.number("X0", at), samples[at]) if len(clocks) < 2 else (0.0, 0.0, 0)
        alike.setdefault((beside, offsets[at], *stated), {})[key] = at
    lead = next(iter(channels), 0)
    for i, ((column, offset, step, first, _), columns) in enumerate(alike.items()):
        of_packet = samples[next(iter(columns.values()))]
        clock: int | None = int(column)
        times = partial(np.add, -absolute if absolute else offset)
        if style.counted and len(clocks) < 2:
            clock, times = None, partial(_counted, rows or 1, of_packet or rows or 1, step or 1.0, offset + first)
        elif len(clocks) < 2 and i and rows:  # the column of times is that of the first channel only
            findings.append(Finding("derived_times", "", {"channels": tuple(columns)}))
            start = (offset - offsets[lead] - absolute if absolute else offset) + first - head.number("X0", lead)
            clock, times = 0, partial(_derived, rows, of_packet or rows, step - head.number("Delta_X", lead), start)
        yield ClockGroup(columns, clock, times, sparse=True)


def _counted(rows: int, samples: int, step: float, start: float, numbers: npt.NDArray[Any]) -> FloatArray:
    """Return the times of rows, by their numbers: packets of `rows` rows, in the first of which are `samples`."""
    packet, row = np.divmod(numbers, rows)
    return np.where(row < samples, start + (packet * samples + row) * step, np.nan)


def _derived(rows: int, samples: int, longer: float, start: float, stamps: npt.NDArray[Any]) -> FloatArray:
    """Return the times of rows from the stamps of another channel, whose step is shorter by `longer` [s]."""
    row = np.arange(len(stamps)) % rows
    return np.where(row < samples, stamps + row * longer + start, np.nan)


def _instant(date: str, time: str) -> Fraction | None:
    """Return a date and a time of day since 1970 [s]; None if unknown: an empty stamp of LabVIEW is in 1903 or 1904."""
    second, _, decimals = time.strip().replace(",", ".").partition(".")
    try:
        moment = datetime.strptime(f"{date.strip()} {second}", "%Y/%m/%d %H:%M:%S").replace(tzinfo=UTC)
        seconds = int(moment.timestamp()) + Fraction(f"0.{decimals or 0}")
    except ValueError:
        return None
    return seconds if seconds >= 0 else None


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip(" \r\n") for cell in line.lstrip("\ufeff").split(separator)]


def _is_row(cells: Sequence[str]) -> bool:
    """Return whether a line has a number in its first two cells, the first of which may be empty."""
    return kind(cells[0]) in "NM" and any(kind(cell) == "N" for cell in cells)
