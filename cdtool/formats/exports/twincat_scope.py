"""TwinCAT Scope: text exports of Beckhoff's Scope View, in which channels of different rates are side by side.

Above the rows are lines of keys and values: first about the file (`Starttime of export`), then about each channel. A
channel's line repeats its key above each column of times:

    Name            ActPos   Name            ActTorque  ActCurrent
    SampleTime[ms]  1        SampleTime[ms]  4          4
    0               17,25    0               1,5        0,75

Times are in ms since the start of the export, or in FILETIME ticks of 100 ns since 1601.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, naming
from cdtool.base.plain_text import counted
from cdtool.formats.channels.channel_map import ChannelMap, TablePins
from cdtool.formats.csv import Csv
from cdtool.formats.csv.cells import kind, number, split_line
from cdtool.formats.csv.encoding import HEAD_BYTES, looks_like_text, open_table
from cdtool.formats.csv.text import Text, read_sample
from cdtool.formats.csv_dialect.foreign_heads import NAME, SCOPE_STARTS, is_scope_export, scope_separator
from cdtool.formats.exports.scope_rows import ClockGroup, ScopeRows, dialect_of_rows
from cdtool.formats.source import Source

# The keys of lines about the file: of Scope View in TwinCAT 3 and in TwinCAT 2.
_FILE_KEYS = ("File", *SCOPE_STARTS, "Endtime of export", "EndRecord")
# The keys of lines about the channels. A comment may contain line ends and any word: it shows nothing.
_SYMBOL, _PERIOD, _UNIT = "SymbolName", "SampleTime[ms]", "Unit"
_CHANNEL_KEYS = (
    *(NAME, _SYMBOL, _PERIOD, _UNIT, "Data-Type", "VariableSize", "SymbolBased", "IndexGroup", "IndexOffset"),
    *("NetID", "NetId", "Port", "Offset", "ScaleFactor", "BitMask", "Unit ScaleFactor", "Unit Offset"),
    *("Symbol-Name", "Net-ID", "SampleTime", "StartTime", "EndTime"),
)
# The head of a file may have this many bytes, and its first lines (those about the file) this many lines.
_MOST_HEAD, _MOST_FILE_LINES = 1 << 22, 20
# Ticks of 100 ns, which count from 1601.
_TICKS_PER_S, _TICKS_1970 = 1e7, 116_444_736_000_000_000
# Ticks since 1917 have 18 digits: fewer are damaged. No export is long enough for as many milliseconds.
_FEWEST_TICKS = 10**17
_WORDED_UNIT = re.compile(r"(?P<unit>[^(]*?)\s*\([^()]*\)")


@dataclass(frozen=True)
class TwincatScope:
    """Text exports of TwinCAT Scope: each channel has the times beside it, in s since the start of the export."""

    name: ClassVar[str] = "twincat_scope"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".txt")

    def sniff(self, path: Path) -> bool:
        """Return whether the first lines are those of such an export."""
        head = read_sample(path, HEAD_BYTES)
        return is_scope_export(head) and looks_like_text(head)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all; raises RecordingError.

        Lines that the machine file pins in `[csv]` are those of a table of any kind.
        """
        pins = TablePins() if wanted is None else wanted.pins
        if pins.header is not None or pins.skip_lines > 0:
            return Csv().columns(path, wanted)
        with naming(path):
            return _read_export(path, pins).source(path, self.name, wanted)


@dataclass(frozen=True)
class _ScopeHead:
    """The lines above the rows: about the file by their key, and about the channels with their cells.

    The first row is line `line` (from 1), at byte `start`; `rows` are the cells of the first rows.
    """

    separator: str
    of_file: Mapping[str, list[str]]
    of_channels: Mapping[str, list[str]]
    line: int
    start: int
    rows: list[list[str]]

    @property
    def names(self) -> list[str]:
        """Return the names above each column; a column without a name has an empty one."""
        key = next((key for key in (NAME, _SYMBOL, "Symbol-Name") if key in self.of_channels), None)
        return self.of_channels[key] if key else next(iter(self.of_channels.values()))

    @property
    def clocks(self) -> list[int]:
        """Return the numbers of the columns of times: every key is repeated above them."""
        return [at for at in range(len(self.names)) if all(cells[at] == key for key, cells in self.of_channels.items())]

    def cell(self, keys: Sequence[str], column: int) -> str:
        """Return what the line of one of these keys states about a column."""
        for key in keys:
            cells = self.of_channels.get(key, [])
            if column < len(cells) and cells[column]:
                return cells[column]
        return ""


def _read_export(path: Path, pins: TablePins) -> ScopeRows:
    text, stream = open_table(path, pins.encoding, _MOST_HEAD)
    head = _read_head(text, stream.split(text.line_end))
    # A line in which a cell contains the separator is wider than the others: it would be read in the wrong columns.
    usual = Counter(map(len, head.of_channels.values())).most_common(1)[0][0]
    head = replace(head, of_channels={key: line for key, line in head.of_channels.items() if len(line) == usual})
    clocks, width = head.clocks, len(head.names)
    if not clocks or clocks[0] != 0 or len(head.rows[0]) <= width - len(clocks) or len(clocks) == width:
        raise RecordingError(
            f"line {head.line} has {counted(len(head.rows[0]), 'cell')} for {counted(width, 'name')}: "
            "no columns of times?",
            "export it again with 'Timelines' set to 'For each sampletime' or 'All'",
        )
    columns = _keys(head)
    decimal = pins.decimal or _decimal_mark(text, head)
    named = [columns.get(at, "") for at in range(width)]
    dialect = dialect_of_rows(text, pins, (head.separator, decimal), (head.line, head.start), named, head.rows)
    ticks = [int(row[at]) for row in head.rows for at in clocks if _is_tick(row, at)]
    first, groups = min(ticks, default=0), list[ClockGroup]()

    def times(stamps: npt.NDArray[Any]) -> FloatArray:
        # The difference of ticks is exact before it is rounded; missing ones are negative.
        return np.where(stamps < _FEWEST_TICKS, np.nan, (stamps - first) / _TICKS_PER_S) if ticks else stamps / 1000.0

    for at, end in zip(clocks, [*clocks[1:], width], strict=True):
        members = {columns[i]: i for i in range(at + 1, end) if i in columns}
        stated = {_number(head.cell((_PERIOD, "SampleTime"), i)) for i in members.values()}
        period = max(stated.pop() / 1000.0, 0.0) if len(stated) == 1 else 0.0
        if members:
            groups.append(ClockGroup(members, at, period))
    of_groups = {key: at for group in groups for key, at in group.columns.items()}
    units = {key: _unit(head.cell((_UNIT,), at)) for key, at in of_groups.items()}
    origin = (first - _TICKS_1970) / _TICKS_PER_S if ticks else _start(head)
    return ScopeRows(dialect, groups, units, origin, times, bool(ticks))


def _read_head(text: Text, raw: Sequence[bytes]) -> _ScopeHead:
    separator = scope_separator([text.decode(line).rstrip("\r") for line in raw[:_MOST_FILE_LINES]])
    if separator is None:
        raise RecordingError("is not an export of TwinCAT Scope", "see cdtool list formats")
    if separator == " ":
        raise RecordingError(
            "is separated by blanks, as names, units and empty cells may be",
            "export it again with tabs or semicolons",
        )
    of_file: dict[str, list[str]] = {}
    of_channels: dict[str, list[str]] = {}
    start = 0
    for i, line in enumerate(raw):
        cells = _cells(text.decode(line), separator)
        if of_channels and _is_row(cells):
            # A sample.
            rows = [_cells(text.decode(each), separator) for each in raw[i : i + 50]]
            wide = [row for row in rows[: max(1, len(raw) - i - 1)] if len(row) > 1]
            return _ScopeHead(separator, of_file, of_channels, i + 1, start, wide)
        if cells[0] in _FILE_KEYS and i < _MOST_FILE_LINES:
            of_file[cells[0]] = cells
            of_channels.clear()  # a line Name above is that of the file
        elif cells[0] in _CHANNEL_KEYS and len(cells) > 1 and f"{cells[0]} {cells[1]}" not in _CHANNEL_KEYS:
            of_channels[cells[0]] = cells
        start += len(line) + 1
    if start >= _MOST_HEAD - 4:
        raise RecordingError(f"has no row of numbers in its first {_MOST_HEAD >> 20} MiB", "export it again")
    if not of_channels:
        raise RecordingError(
            "has no line with the names of channels", "export it again with a header that has at least the names"
        )
    raise RecordingError("has no row of numbers", "was the export stopped, or the copy cut off?")


def _keys(head: _ScopeHead) -> dict[int, str]:
    """Return the names of the channels by column; equal names are replaced by the symbols' names, or get a number."""
    clocks = {*head.clocks}
    names = {at: name for at, name in enumerate(head.names) if at not in clocks and name}
    counts = Counter(names.values())
    symbols = {at: head.cell((_SYMBOL, "Symbol-Name"), at) for at in names if counts[names[at]] > 1}
    of_symbols = Counter(symbols.values())
    unique = {
        at: symbol for at, symbol in symbols.items() if symbol and of_symbols[symbol] == 1 and symbol not in counts
    }
    return {at: unique.get(at, f"{name}#{at}" if counts[name] > 1 else name) for at, name in names.items()}


def _start(head: _ScopeHead) -> float:
    """Return the start of the export since 1970 [s]; 0 if it is not stated."""
    stated = next((head.of_file[key] for key in SCOPE_STARTS if key in head.of_file), [])
    ticks = stated[1] if len(stated) > 1 else ""
    return (
        (int(ticks) - _TICKS_1970) / _TICKS_PER_S if ticks.isascii() and ticks.isdigit() and len(ticks) == 18 else 0.0
    )


def _is_tick(row: Sequence[str], at: int) -> bool:
    cell = row[at] if at < len(row) else ""
    return cell.isascii() and cell.isdigit() and len(cell) <= len(str(_TICKS_1970)) and int(cell) >= _FEWEST_TICKS


def _decimal_mark(text: Text, head: _ScopeHead) -> str:
    """Return the decimal mark: the first mark in the rows. Scope writes no thousands separators."""
    if head.separator == ",":
        return "."
    for block in text.blocks(head.start):
        found = {mark: block.find(mark) for mark in (b",", b".")}
        seen = {mark: at for mark, at in found.items() if at >= 0}
        if seen:
            return min(seen, key=lambda mark: seen[mark]).decode()
    return "."


def _number(cell: str) -> float:
    """Return a number of the head, whose decimal mark may not be that of the rows; 0 for any other cell."""
    value = number(cell, "," if "," in cell else ".") if cell else None
    return value if value is not None and np.isfinite(value) else 0.0


def _unit(cell: str) -> str | None:
    """Return the unit in `V (Voltage)`; None for `(None)`."""
    worded = _WORDED_UNIT.fullmatch(cell)
    unit = worded["unit"] if worded else cell
    return unit or None


def _cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line; cells with the separator are in quotes, but not those about channels."""
    if '"' in line:
        return [cell.strip(" \r\n") for cell in split_line(line, separator)]
    return [cell.strip(" \r\n") for cell in line.strip("\r\n").split(separator)]


def _is_row(cells: Sequence[str]) -> bool:
    """Return whether a line has at least two cells, the first without words, and a number."""
    return len(cells) > 1 and kind(cells[0]) in "NM" and any(kind(cell) == "N" for cell in cells[1:])
