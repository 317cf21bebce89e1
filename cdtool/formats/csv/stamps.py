"""Columns of dates and times of day: detect their layout from all cells in the sample.

A layout is written as for `strptime`: `%d.%m.%Y %H:%M:%S.%f`, with `%f` for any number of digits and `%z` for a zone.
`03.04.2025` is the third of April, because dates with points start with the day; `03/04/2025` and `03-04-2025` may be
the fourth of March and are refused unless a day above 12 decides. Also refused are `00:05`, which may be five minutes
or five seconds, and `:9`, `:10` after the seconds, which may be parts of a second or milliseconds.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np

from cdtool.formats.csv import stamp_kernel as steps
from cdtool.formats.csv.cells import MISSING, STAMP_LIKE
from cdtool.recording import FloatArray

_FIELDS = {
    "%Y": steps.YEAR,
    "%y": steps.SHORT_YEAR,
    "%m": steps.MONTH,
    "%d": steps.DAY,
    "%H": steps.HOUR,
    "%I": steps.HOUR,
    "%M": steps.MINUTE,
    "%S": steps.SECOND,
    "%f": steps.FRACTION,
    "%z": steps.ZONE,
    "%b": steps.MONTH_NAME,
    "%p": steps.HALF_DAY,
}
_DATES = (
    *("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y", "%m-%d-%Y"),
    *("%d-%b-%Y", "%d/%b/%Y", "%d.%m.%y", "%d/%m/%y", "%m/%d/%y", "%Y%m%d"),
)
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S:%f", "%H:%M:%S;%f", "%H:%M", "%I:%M:%S.%f %p", "%I:%M %p")
_MINUTES = "%M:%S.%f"
_FRACTION = re.compile(r"(?P<before>.*[0-9]:[0-9]{2}:[0-9]{2}[.,:;])(?P<digits>[0-9]+)(?P<after>.*)")
_LOOKED = 200
NS = 1_000_000_000
_MINUTE, _HOUR, _HALF_DAY, _DAY = 60 * NS, 3600 * NS, 43200 * NS, 86400 * NS


@dataclass(frozen=True)
class Layout:
    """A layout of time stamps; `dated` if it has a day, `timed` if it has an hour."""

    pattern: str

    @property
    def dated(self) -> bool:
        """Return whether the stamps have a day."""
        return "%d" in self.pattern

    @property
    def timed(self) -> bool:
        """Return whether the stamps have a time of day."""
        return "%H" in self.pattern or "%I" in self.pattern

    @property
    def wraps(self) -> tuple[int, str]:
        """Return the period [ns] after which stamps without a day start again, and the name of that moment."""
        if "%H" in self.pattern or ("%I" in self.pattern and "%p" in self.pattern):
            return _DAY, "midnight"
        if "%I" in self.pattern:
            return _HALF_DAY, "noon or midnight"
        return (_HOUR, "the full hour") if "%M" in self.pattern else (_MINUTE, "the full minute")

    @property
    def program(self) -> list[int]:
        """Return the steps of the kernel's program, ended by 0; raises ValueError if the pattern is not supported."""
        return _program(self.pattern)

    def read(self, text: str) -> int | None:
        """Return the nanoseconds since 1970 (for a time of day since midnight); None if the layout does not match."""
        raw = text.strip(" \t\r").encode("utf-8", errors="replace")
        data = np.frombuffer(raw + bytes(16), dtype=np.uint8)
        value, end = steps.read_stamp(data, 0, _compiled(self.pattern))
        return int(value) if end == len(raw) else None


@cache
def _compiled(pattern: str) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.array(_program(pattern), dtype=np.int64)


@cache
def _program(pattern: str) -> list[int]:
    program: list[int] = []
    for part in re.findall(r"[.,]%f|%.|T| +|.", pattern):
        if part in (".%f", ",%f"):
            program.append(steps.POINT_FRACTION)
        elif part in _FIELDS:
            program.append(_FIELDS[part])
        elif (part.startswith("%") and part != "%%") or (len(part.encode()) > 1 and part.strip()):
            raise ValueError(f"'{part}' is not supported")
        elif part == "T" or not part.strip():
            program.append(steps.DATE_GAP)
        else:
            program.append(ord(part[-1]))
    if len(program) >= steps.STEPS:
        raise ValueError("too long")
    return program + [0] * (steps.STEPS - len(program))


def check_pattern(pattern: str) -> str:
    """Return the problem of a pinned layout; empty if it has none."""
    try:
        _program(pattern)
    except ValueError as fault:
        return str(fault)
    fields = re.findall(r"%.", pattern)
    missing = [name for name in ("%m", "%d") if "%b" not in fields and name not in fields] if "%Y" in fields else []
    return f"{missing[0]} is missing" if missing else "" if fields else "has no field"


@dataclass(frozen=True)
class StampLayouts:
    """The layouts that match the cells of a column: none (words), one, or two that mean different times.

    `doubt` is the reason why the fraction of a second can be read in two ways; empty if it is unambiguous.
    """

    layouts: tuple[Layout, ...]
    example: str = ""
    doubt: str = ""

    @property
    def layout(self) -> Layout | None:
        """Return the layout if it is unambiguous, otherwise None."""
        return self.layouts[0] if len(self.layouts) == 1 and not self.doubt else None

    @property
    def readings(self) -> str:
        """Return the two readings as part of a message."""
        if self.doubt:
            return self.doubt
        times = [np.datetime64((layout.read(self.example) or 0) // NS, "s") for layout in self.layouts]
        days = [time.astype("datetime64[D]") for time in times]
        texts = days if len(set(days)) > 1 else [str(time)[-8:] for time in times]
        readings = [f"{text} ({layout.pattern})" for text, layout in zip(texts, self.layouts, strict=True)]
        return f"'{self.example}' may be {' or '.join(readings)}"

    def next_to_days(self) -> StampLayouts:
        """Return the layouts of a column next to a column of days: there `12:05` is a time of day."""
        hours = tuple(layout for layout in self.layouts if layout.pattern != _MINUTES)
        return replace(self, layouts=hours or self.layouts)


def find_layout(cells: Sequence[str], pinned: str = "") -> StampLayouts:
    """Return the layouts of a column: those that match all cells, or most cells, so that the others can be reported."""
    texts = [cell for cell in dict.fromkeys(cells) if cell not in MISSING]
    likely = [
        texts[i] for i in sorted({0, len(texts) // 2, len(texts) - 1}) if texts and STAMP_LIKE.fullmatch(texts[i])
    ]
    if not texts or not (pinned or likely):
        return StampLayouts(())
    possible = [Layout(pinned)] if pinned else [x for x in _known() if any(x.read(text) is not None for text in likely)]
    # All days are needed to decide between two orders of day and month; for times of day some cells are sufficient.
    first_of_day = {text.split()[0]: text for text in texts} if len(possible) > 1 else {}
    checked = list(dict.fromkeys((*texts[:: max(1, len(texts) // _LOOKED)], texts[-1], *first_of_day.values())))
    matching = possible
    for text in checked:
        matching = [layout for layout in matching if layout.read(text) is not None]
    if not matching:
        read = {layout: sum(layout.read(text) is not None for text in checked) for layout in possible}
        most = max(read.values(), default=0)
        matching = [layout for layout in possible if read[layout] == most and 2 * most >= len(checked)]
    different: dict[tuple[int | None, ...], Layout] = {}
    for layout in matching:
        different.setdefault(tuple(layout.read(text) for text in checked), layout)
    example = next((text for text in checked if len({item.read(text) for item in different.values()}) > 1), texts[0])
    return StampLayouts(tuple(different.values()), example, "" if pinned or not different else _fraction_doubt(texts))


def _fraction_doubt(texts: Sequence[str]) -> str:
    """Return why `:9`, `:10` after the seconds may be milliseconds: as fractions they would run backward; or empty."""
    parts = [match for text in texts if (match := _FRACTION.fullmatch(text))]
    if len({len(part["digits"]) for part in parts}) < 2:
        return ""
    backward: tuple[str, str] | None = None
    for part, after in pairwise(parts):
        if (part["before"], part["after"]) != (after["before"], after["after"]):
            continue
        if int(part["digits"]) > int(after["digits"]):
            return ""
        if backward is None and part["digits"].ljust(9, "0") > after["digits"].ljust(9, "0"):
            backward = part[0], after["digits"]
    if backward is None:
        return ""
    before, digits = backward
    return f"'{digits}' after '{before}' may be 0.{digits} s or {digits} ms: write each with three digits"


@cache
def _known() -> tuple[Layout, ...]:
    patterns = [*_TIMES, _MINUTES, *(date for date in _DATES if date != "%Y%m%d")]
    for date in _DATES:
        for time in _TIMES:
            patterns += [f"{date} {time}", f"{date} {time}%z"]
    return tuple(Layout(pattern) for pattern in patterns)


def unwrap(
    stamps: np.ndarray[tuple[int], np.dtype[np.int64]],
    known: np.ndarray[tuple[int], np.dtype[np.bool_]],
    period: int = _DAY,
) -> int:
    """Add `period` [ns] in place each time that stamps without a day start again; return how often they do.

    Stamps start again, such as at midnight, where they step back by more than half a period; smaller backward steps
    stay and are reported with the clock. A pause of a whole period or more cannot be detected from the stamps.
    """
    rows = np.flatnonzero(known)
    passed = np.cumsum(np.diff(stamps[rows], prepend=stamps[rows[:1]]) < -(period // 2))
    stamps[rows] += passed * period
    return int(passed[-1]) if len(passed) else 0


def seconds_since(
    stamps: np.ndarray[tuple[int], np.dtype[np.int64]], known: np.ndarray[tuple[int], np.dtype[np.bool_]], origin: int
) -> FloatArray:
    """Return seconds after `origin` [ns], computed from whole nanoseconds; NaN where the stamp is missing."""
    values = np.full(len(stamps), np.nan)
    values[known] = (stamps[known] - origin) / NS
    return values
