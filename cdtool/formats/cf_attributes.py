"""What the attributes of the CF conventions say of a dataset: packed numbers, missing ones, times since a date.

CF Metadata Conventions 1.11, sections 2.5.1 (missing data), 4.4 (time) and 8.1 (packed data): a number is
raw * scale_factor + add_offset; raw values equal to _FillValue or missing_value are none.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.findings import Finding
from cdtool.findings.containers import PackedValues
from cdtool.recording import FloatArray

_KEYS = ("scale_factor", "add_offset")
_MISSING = ("_FillValue", "missing_value")
_UNITS = {
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanosecond", "nanoseconds"), 1e-9),
    **dict.fromkeys(("us", "usec", "usecs", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ms", "msec", "msecs", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours"), 3600.0),
    **dict.fromkeys(("d", "day", "days"), 86400.0),
}
_SINCE = re.compile(r"\s*(?P<unit>[a-z]+)\s+since\s+(?P<date>.+?)\s*", re.IGNORECASE)
_DATE = re.compile(
    r"(?P<day>[0-9]{4}-[0-9]{1,2}-[0-9]{1,2})(?:[T ]+(?P<hour>[0-9]{1,2}):(?P<minute>[0-9]{2})"
    r"(?::(?P<second>[0-9]{1,2}(?:\.[0-9]*)?))?)?\s*"
    r"(?:Z|UTC|GMT|(?P<sign>[+-])(?P<zone>[0-9]{1,2}):?(?P<part>[0-9]{2})?)?"
)
_CALENDARS = ("", "standard", "gregorian", "proleptic_gregorian")


@dataclass(frozen=True)
class Packing:
    """How the numbers of a dataset are packed; `missing` are raw values that stand for none."""

    scale: float = 1.0
    offset: float = 0.0
    missing: tuple[float, ...] = ()

    @classmethod
    def of(cls, attributes: Mapping[str, Any]) -> Packing:
        """By a dataset's attributes; raises ValueError for one that is no number."""
        scale, offset = (
            _numbers(attributes, key) or (default,) for key, default in zip(_KEYS, (1.0, 0.0), strict=True)
        )
        return cls(scale[0], offset[0], tuple(value for key in _MISSING for value in _numbers(attributes, key)))

    def unpacked(self, raw: npt.NDArray[Any]) -> FloatArray:
        """The numbers that are meant; NaN where there is none."""
        values = np.array(raw, dtype=np.float64)
        if self.scale != 1.0:
            values *= self.scale
        if self.offset != 0.0:
            values += self.offset
        if self.missing:
            # As the file's own type has them: 0.1 of 32 bits is not that of 64.
            missing = self.missing if raw.dtype.kind != "f" else np.array(self.missing).astype(raw.dtype)
            values[np.isin(raw.astype(np.float64), np.array(missing, dtype=np.float64))] = np.nan
        return values

    def finding(self, column: str) -> list[Finding]:
        """What is said of a column that is packed."""
        if (self.scale, self.offset) == (1.0, 0.0):
            return []
        return [Finding(PackedValues(self.scale, self.offset), column, "note")]


def times_since(unit: str, calendar: str) -> tuple[float, Fraction] | None:
    """`milliseconds since 2024-01-01 12:00`: the factor to s, and the date in s since 1970; None of any other unit.

    Raises ValueError where the date or the calendar is not known: days of 360 to a year have no date.
    """
    told = _SINCE.fullmatch(unit)
    if told is None or told["unit"].lower() not in _UNITS:
        return None
    date = _DATE.fullmatch(told["date"])
    if date is None:
        raise ValueError(f"the date of '{unit}' is not understood")
    if calendar.lower() not in _CALENDARS:
        raise ValueError(f"its calendar '{calendar}' has other days than ours")
    year, month, day = (int(part) for part in date["day"].split("-"))
    days = int((np.datetime64(f"{year:04d}-{month:02d}-{day:02d}") - np.datetime64(0, "D")).astype(np.int64))
    seconds = 3600 * int(date["hour"] or 0) + 60 * int(date["minute"] or 0) + Fraction(date["second"] or 0)
    east = 3600 * int(date["zone"] or 0) + 60 * int(date["part"] or 0)
    return _UNITS[told["unit"].lower()], 86400 * days + seconds + (east if date["sign"] == "-" else -east)


def _numbers(attributes: Mapping[str, Any], key: str) -> tuple[float, ...]:
    if key not in attributes:
        return ()
    values = np.asarray(attributes[key]).ravel()
    if values.dtype.kind not in "biuf" or not 0 < len(values) <= 8 or (key in _KEYS and not np.isfinite(values).all()):
        raise ValueError(f"its attribute {key} is no number")
    return tuple(values.tolist())
