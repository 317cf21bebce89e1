"""Columns of dates and times of day: detect their layout from all cells in the sample, and read them.

A layout is written as for `strptime`: `%d.%m.%Y %H:%M:%S.%f`, with `%f` for any number of digits and `%z` for a zone.
`03.04.2025` is the third of April, because dates with points start with the day; `03/04/2025` and `03-04-2025` may be
the fourth of March and are refused unless a day above 12 decides. Also refused are `00:05`, which may be five minutes
or five seconds, and `:9`, `:10` after the seconds, which may be parts of a second or milliseconds.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from functools import cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.formats.csv.cells import MISSING, STAMP_LIKE

Integers = npt.NDArray[np.int64]
MISSING_STAMP = np.int64(-(2**63))
# What a field matches; never less than it can, so that `202412` is not January.
_FIELDS = {
    "%Y": "(?P<year>[0-9]{4})",
    "%y": "(?P<short>[0-9]{2})",
    "%m": "(?P<month>[0-9]{1,2}+)",
    "%d": "(?P<day>[0-9]{1,2}+)",
    "%H": "(?P<hour>[0-9]{1,2}+)",
    "%I": "(?P<hour>[0-9]{1,2}+)",
    "%M": "(?P<minute>[0-9]{2})",
    "%S": "(?P<second>[0-9]{2})",
    "%f": "(?P<fraction>[0-9]++)",
    ".%f": "(?:[.,](?P<fraction>[0-9]++))?",
    ",%f": "(?:[.,](?P<fraction>[0-9]++))?",
    "%z": " ?(?:[Zz]|UTC|(?P<sign>[+-])(?P<zone>[0-9]{2})(?::?(?P<minutes>[0-9]{2}))?)",
    "%b": "(?P<name>[A-Za-z]{3})",
    "%p": " ?(?P<half>[AaPp])[Mm]",
}
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DATES = (
    *("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y", "%m-%d-%Y"),
    *("%d-%b-%Y", "%d/%b/%Y", "%d.%m.%y", "%d/%m/%y", "%m/%d/%y", "%Y%m%d"),
)
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S:%f", "%H:%M:%S;%f", "%H:%M", "%I:%M:%S.%f %p", "%I:%M %p")
_MINUTES = "%M:%S.%f"
_FRACTION = re.compile(r"(?P<before>.*[0-9]:[0-9]{2}:[0-9]{2}[.,:;])(?P<digits>[0-9]+)(?P<after>.*)")
NS = 1_000_000_000  # per second
_MINUTE, _HOUR, _HALF_DAY, _DAY = 60 * NS, 3600 * NS, 43200 * NS, 86400 * NS
# Nanoseconds in 64 bits reach from 1677 to 2262.
_YEARS = (1680, 2260)


@dataclass(frozen=True)
class StampLayout:
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

    def read(self, text: str) -> int | None:
        """Return the nanoseconds since 1970 (for a time of day since midnight); None if the layout does not match."""
        match = _pattern(self.pattern).fullmatch(text.strip(" \t\r"))
        return None if match is None else _nanoseconds(match.groupdict())

    def read_all(self, cells: Sequence[str]) -> Integers:
        """Return `read` of each cell, with MISSING_STAMP where the layout does not match."""
        stamps = {cell: self.read(cell) for cell in set(cells)}
        known = {cell: int(MISSING_STAMP) if stamp is None else stamp for cell, stamp in stamps.items()}
        return np.array([known[cell] for cell in cells], dtype=np.int64)


def _nanoseconds(found: Mapping[str, str | None]) -> int | None:
    """Return the stamp of the fields of a layout; None for a day or a time that does not exist."""

    def number(field: str, otherwise: int) -> int:
        return int(found.get(field) or otherwise)

    year, month, hour = number("year", 1970), number("month", 1), number("hour", 0)
    if found.get("short"):
        year = number("short", 0)
        year += 2000 if year < 69 else 1900
    if name := found.get("name"):
        month = _MONTHS.index(name.lower()) + 1 if name.lower() in _MONTHS else 0
    if half := found.get("half"):
        hour = hour % 12 + (12 if half in "pP" else 0) if 1 <= hour <= 12 else 24
    try:
        moment = datetime(year, month, number("day", 1), hour, number("minute", 0), number("second", 0))
    except ValueError:
        return None
    east = (3600 * number("zone", 0) + 60 * number("minutes", 0)) * (-1 if found.get("sign") == "-" else 1)
    seconds = (moment - datetime(1970, 1, 1)) // timedelta(seconds=1) - east
    nano = int((found.get("fraction") or "")[:9].ljust(9, "0"))
    return seconds * NS + nano if _YEARS[0] <= year <= _YEARS[1] else None


@cache
def _pattern(pattern: str) -> re.Pattern[str]:
    """Return the expression for a layout; raises ValueError if it has a field that is not supported."""
    parts = []
    for part in re.findall(r"[.,]%f|%.|T| +|.", pattern):
        if part in _FIELDS:
            parts.append(_FIELDS[part])
        elif (part.startswith("%") and part != "%%") or (len(part.encode()) > 1 and part.strip()):
            raise ValueError(f"'{part}' is not supported")
        elif part == "T" or not part.strip():
            parts.append("(?: ++|[Tt])")
        else:
            parts.append(re.escape(part[-1]))
    try:
        return re.compile("".join(parts))
    except re.error:
        raise ValueError("a field is repeated") from None


def check_pattern(pattern: str) -> str:
    """Return the problem of a pinned layout; empty if it has none."""
    try:
        _pattern(pattern)
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

    layouts: tuple[StampLayout, ...]
    example: str = ""
    doubt: str = ""

    @property
    def layout(self) -> StampLayout | None:
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
    possible = [StampLayout(pinned)] if pinned else [x for x in _known() if (x.read_all(likely) != MISSING_STAMP).any()]
    # All days are needed to decide between two orders of day and month; for times of day some cells are sufficient.
    first_of_day = {text.split()[0]: text for text in texts} if len(possible) > 1 else {}
    # 200 cells show the layout.
    checked = list(dict.fromkeys((*texts[:: max(1, len(texts) // 200)], texts[-1], *first_of_day.values())))
    stamps = {layout: layout.read_all(checked) for layout in possible}
    counts = {layout: int(np.count_nonzero(read != MISSING_STAMP)) for layout, read in stamps.items()}
    most = max(counts.values(), default=0)
    matching = [layout for layout in possible if counts[layout] == most and 2 * most >= len(checked)]
    different: dict[bytes, StampLayout] = {}
    for layout in matching:
        different.setdefault(stamps[layout].tobytes(), layout)
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
def _known() -> tuple[StampLayout, ...]:
    patterns = [*_TIMES, _MINUTES, *(date for date in _DATES if date != "%Y%m%d")]
    for date in _DATES:
        for time in _TIMES:
            patterns += [f"{date} {time}", f"{date} {time}%z"]
    return tuple(StampLayout(pattern) for pattern in patterns)


def unwrap(stamps: Integers, period: int = _DAY) -> int:
    """Add `period` [ns] in place each time that stamps without a day start again; return how often they do.

    Stamps start again, such as at midnight, where they step back by more than half a period; smaller backward steps
    stay and are reported with the clock. A pause of a whole period or more cannot be detected from the stamps.
    """
    passed = np.cumsum(np.diff(stamps, prepend=stamps[:1]) < -(period // 2))
    stamps += passed * period
    return int(passed[-1]) if len(passed) else 0


def seconds_since(stamps: Integers, known: npt.NDArray[np.bool_], origin: int) -> FloatArray:
    """Return seconds after `origin` [ns], computed from whole nanoseconds; NaN where the stamp is missing."""
    values = np.full(len(stamps), np.nan)
    values[known] = (stamps[known] - origin) / NS
    return values
