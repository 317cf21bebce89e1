"""Text exports of TwinCAT Scope, written as Beckhoff's documentation of the export describes its options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Literal

# 2022-05-02 13:56:24.376 UTC in ticks of 100 ns since 1601.
START = 132_959_733_843_760_000
START_S = 1_651_499_784.376
_KEYS = (
    *("Name", "SymbolComment", "Data-Type", "SampleTime[ms]", "VariableSize", "SymbolBased", "IndexGroup"),
    *("IndexOffset", "SymbolName", "NetID", "Port", "Offset", "ScaleFactor", "BitMask", "Unit", "Unit ScaleFactor"),
    "Unit Offset",
)


@dataclass(frozen=True)
class Channel:
    """A channel: its sample time [ms] as a decimal, its values, and the time [ms] of its first sample."""

    name: str
    period: str
    values: Sequence[float]
    unit: str = ""
    symbol: str = ""
    start: str = "0"

    def time(self, sample: int) -> Fraction:
        """The time [ms] of a sample."""
        return Fraction(self.start) + sample * Fraction(self.period)

    def seconds(self, full_stamps: bool = False) -> list[float]:
        """The times [s] as an export states them: in milliseconds, or in ticks of 100 ns."""
        times = [self.time(i) for i in range(len(self.values))]
        return [int(time * 10_000) / 1e7 if full_stamps else float(time) / 1000.0 for time in times]


@dataclass(frozen=True)
class Options:
    """The options of an export; `shared`: consecutive channels of one sample time share the column of times."""

    separator: str = "\t"
    decimal: str = "."
    shared: bool = True
    interpolation: Literal["none", "shift", "fill"] = "none"
    full_stamps: bool = False
    eof: bool = False
    keys: Sequence[str] = _KEYS
    file_block: bool = True
    version: Literal[2, 3] = 3
    comment: str = ""
    end: str = "\r\n"


def export(channels: Sequence[Channel], options: Options) -> str:
    """Return the text of an export."""
    groups: list[list[Channel]] = []
    for channel in channels:
        joins = (
            options.shared
            and groups
            and (groups[-1][0].period, groups[-1][0].start)
            == (
                channel.period,
                channel.start,
            )
        )
        groups[-1].append(channel) if joins else groups.append([channel])
    lines = [*_file_block(options), *(_key_line(key, groups, options) for key in options.keys), ""]
    lines += _rows(groups, options)
    return options.end.join([*lines, *(["EOF"] if options.eof else [])]) + options.end


def write_export(path: Path, channels: Sequence[Channel], options: Options, encoding: str = "utf-8") -> Path:
    """Write an export."""
    path.write_bytes(export(channels, options).encode(encoding))
    return path


def _file_block(options: Options) -> list[str]:
    if not options.file_block:
        return []
    day = "Montag, 2. Mai 2022"
    quoted = f'"{day}"' if options.separator in ", " else day
    first, last = ("StartRecord", "EndRecord") if options.version == 2 else ("Starttime of export", "Endtime of export")
    stamps = [
        options.separator.join([f'"{key}"' if options.separator in key else key, str(ticks), quoted, "15:56:24.376"])
        for key, ticks in ((first, START), (last, START + 9_990_000))
    ]
    name, file = (f"{key}{options.separator}{value}" for key, value in (("Name", "Scope01"), ("File", "run.csv")))
    return [name, file, *stamps, "", ""]


def _key_line(key: str, groups: list[list[Channel]], options: Options) -> str:
    stated = {
        "Name": lambda channel: channel.name,
        "SymbolName": lambda channel: channel.symbol or f"MAIN.{channel.name}",
        "SampleTime[ms]": lambda channel: channel.period.replace(".", ","),
        "Unit": lambda channel: f"{channel.unit} (Quantity)" if channel.unit else "(None)",
        "SymbolComment": lambda _: options.comment,
        "Data-Type": lambda _: "REAL64",
        "NetID": lambda _: "192.168.178.20.1.1",
        "BitMask": lambda _: "0xffffffffffffffff",
    }
    value = stated.get(key, lambda _: "1")
    return options.separator.join(cell for group in groups for cell in [key, *map(value, group)])


def _rows(groups: list[list[Channel]], options: Options) -> list[str]:
    fastest = min((channel for group in groups for channel in group), key=lambda channel: Fraction(channel.period))
    longest = max(len(group[0].values) for group in groups)
    rows = []
    for row in range(longest):
        cells: list[str] = []
        written = 0
        for group in groups:
            sample, is_written = row, True
            if options.interpolation != "none":
                position = row * Fraction(fastest.period) / Fraction(group[0].period)
                sample = int(position)
                is_written = options.interpolation == "fill" or position == sample
            if is_written and sample < len(group[0].values):
                cells += [_stamp(group[0], sample, options), *(_cell(c.values[sample], options) for c in group)]
                written = len(cells)
            else:
                cells += [" "] * (1 + len(group))
        rows.append(options.separator.join(cells[:written]))
    return rows


def _stamp(channel: Channel, sample: int, options: Options) -> str:
    time = channel.time(sample)
    if options.full_stamps:
        return str(START + int(time * 10_000))
    return _cell(float(time), options)


def _cell(value: float, options: Options) -> str:
    text = repr(float(value))
    return text.removesuffix(".0").replace(".", options.decimal)


def ramp(count: int, step: float = 0.25, start: float = 0.0) -> list[float]:
    """Return `count` values with a constant difference."""
    return [start + i * step for i in range(count)]
