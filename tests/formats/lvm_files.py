"""LabVIEW's measurement files, written as the specification of National Instruments describes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

START = "12:00:00.25"
# 2024-03-05 12:00:00.25, without a time zone.
START_S = 1_709_640_000.25


@dataclass(frozen=True)
class Channel:
    """A channel of a segment: its values and its keys."""

    name: str
    values: Sequence[float]
    step: float = 0.001
    first: float = 0.0
    unit: str = ""
    date: str = "2024/03/05"
    time: str = START

    @property
    def seconds(self) -> list[float]:
        """The times [s] after the date and time of the channel, as the column of times has them."""
        return [round(self.first + i * self.step, 6) for i in range(len(self.values))]


@dataclass(frozen=True)
class Style:
    """The keys of the head of the file."""

    separator: str = "\t"
    decimal: str = "."
    x_columns: Literal["One", "Multi", "No"] = "One"
    headings: Literal["Yes", "No"] = "No"
    preference: Literal["Relative", "Absolute"] = "Relative"
    comment: str = ""
    end: str = "\r\n"
    states_decimal: bool = True


def measurement(style: Style, *segments: Sequence[Channel]) -> str:
    """Return the text of a file with these segments."""
    tail = style.separator
    word = "Tab" if style.separator == "\t" else "Comma"
    head = [
        f"LabVIEW Measurement{tail}",
        f"Writer_Version{tail}2",
        f"Reader_Version{tail}2",
        f"Separator{tail}{word}",
        *([f"Decimal_Separator{tail}{style.decimal}"] if style.states_decimal else []),
        f"Multi_Headings{tail}{style.headings}",
        f"X_Columns{tail}{style.x_columns}",
        f"Time_Pref{tail}{style.preference}",
        f"Operator{tail}lab",
        f"Date{tail}2024/03/05",
        f"Time{tail}{START.replace('.', style.decimal)}",
        f"***End_of_Header***{tail}",
    ]
    lines = [line for segment in segments for line in _segment(style, segment)]
    return style.end.join([*head, *lines]) + style.end


def _segment(style: Style, channels: Sequence[Channel]) -> list[str]:
    def line(key: str, cells: Sequence[str]) -> str:
        gap = style.separator * 2 if style.x_columns == "Multi" else style.separator
        return key + style.separator + gap.join(cells) + style.separator

    def shown(value: float) -> str:
        return f"{value:.16E}".replace(".", style.decimal)

    keys = [
        style.separator,
        f"Channels{style.separator}{len(channels)}{style.separator}",
        line("Samples", [str(len(channel.values)) for channel in channels]),
        line("Date", [channel.date for channel in channels]),
        line("Time", [channel.time.replace(".", style.decimal) for channel in channels]),
        line("Y_Unit_Label", [channel.unit for channel in channels]),
        line("X_Dimension", ["Time"] * len(channels)),
        line("X0", [shown(channel.first) for channel in channels]),
        line("Delta_X", [shown(channel.step) for channel in channels]),
        f"***End_of_Header***{style.separator}",
    ]
    names = [channel.name for channel in channels]
    if style.x_columns == "Multi":
        names = [cell for name in names for cell in ("X_Value", name)]
    else:
        names.insert(0, "X_Value")
    return [*keys, style.separator.join([*names, "Comment"]), *_rows(style, channels)]


def _rows(style: Style, channels: Sequence[Channel]) -> list[str]:
    def shown(value: float) -> str:
        return f"{value:.6f}".replace(".", style.decimal)

    rows = []
    for row in range(max(len(channel.values) for channel in channels)):
        cells = [[] if style.x_columns == "Multi" else [_x(style, channels[0], row)]]
        for channel in channels:
            is_written = row < len(channel.values)
            stamp = [_x(style, channel, row) if is_written else ""] if style.x_columns == "Multi" else []
            cells.append([*stamp, shown(channel.values[row]) if is_written else ""])
        comment = [style.comment] if style.comment and row == 0 else []
        rows.append(style.separator.join(cell for part in [*cells, comment] for cell in part))
    return rows


def _x(style: Style, channel: Channel, row: int) -> str:
    if style.x_columns == "No":
        return ""
    return f"{channel.first + row * channel.step:.6f}".replace(".", style.decimal)
