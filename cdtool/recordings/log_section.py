"""A part of a log: from and to a time, or a distance travelled."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, UsageError
from cdtool.base.plain_text import digits
from cdtool.recordings.motion import leading_joint
from cdtool.recordings.recording import Contact, Recording
from cdtool.recordings.units import find_unit

_TEXT = re.compile(r"\s*(?P<number>[+-]?(?:\d+(?:\.\d*)?|\.\d+))\s*(?P<unit>[^\d\s.]\S*)\s*", re.ASCII)
_UNITS = ("s", "m", "rad")
# A distance counts as reached after this many consecutive samples: a single wrong value is no motion.
_HELD = 3
MARK_HINT = "give a number with its unit: a time as 3.2s or 250ms, a distance travelled as 0.8m or 1.2rad"


@dataclass(frozen=True)
class Mark:
    """A position in a log: `value` in `unit`, a time on the log's clock (s) or a distance travelled (m, rad).

    The distance is the greatest one so far of the leading joint from its first position: it never falls.
    """

    value: float
    unit: str

    @classmethod
    def parse(cls, text: str) -> Mark:
        """Return the mark that a text such as `3.2s`, `250 ms`, `0.8m` or `90deg` describes; raises UsageError."""
        match = _TEXT.fullmatch(text)
        unit = find_unit(match["unit"]) if match else None
        if match is None or unit is None or unit.si not in _UNITS:
            raise UsageError(f"is '{text[:40]}'", MARK_HINT)
        value = float(match["number"]) * unit.factor
        if not math.isfinite(value) or (unit.si != "s" and not value > 0.0):
            raise UsageError(f"is '{text[:40]}'", f"{MARK_HINT}; a distance is above 0")
        return cls(value, unit.si)

    def __str__(self) -> str:
        return f"{digits(self.value)} {self.unit}{'' if self.unit == 's' else ' of travel'}"

    def time_in(self, recording: Recording) -> float:
        """Return the time [s] at which a recording reaches the mark; infinite if it never does.

        Raises RecordingError if it has neither position nor speed, or if they are in another unit.
        """
        if self.unit == "s":
            return self.value
        time, travel = _travel(recording, self)
        reached = np.flatnonzero(travel >= self.value)
        return float(time[reached[0]]) if len(reached) else math.inf


@dataclass(frozen=True)
class LogSection:
    """The part of a log between two marks; None: from its start, to its end.

    Raises UsageError if the end is not after the begin.

    Examples
    --------
    >>> str(LogSection(Mark.parse("250ms"), Mark.parse("80 cm")))
    'from 0.25 s to 0.8 m of travel'
    """

    begin: Mark | None = None
    end: Mark | None = None

    def __post_init__(self) -> None:
        if self.begin and self.end and self.begin.unit == self.end.unit and self.end.value <= self.begin.value:
            raise UsageError(f"the end, {self.end}, is not after the begin, {self.begin}", "give a later end")

    def __bool__(self) -> bool:
        return self.begin is not None or self.end is not None

    def __str__(self) -> str:
        parts = [f"from {self.begin}"] if self.begin else []
        return " ".join([*parts, f"to {self.end}"] if self.end else parts)

    @classmethod
    def parse(cls, begin: str | None, end: str | None) -> LogSection:
        """Return the section between two texts that `Mark.parse` reads.

        Parameters
        ----------
        begin, end : str or None
            Times or distances with their unit; None: the log's own start or end.

        Returns
        -------
        LogSection
            The section.

        Raises
        ------
        UsageError
            A text is not a mark, or the end is not after the begin.

        Examples
        --------
        >>> LogSection.parse(None, "3.2s")
        LogSection(begin=None, end=Mark(value=3.2, unit='s'))
        """
        return cls(*(None if text is None else Mark.parse(text) for text in (begin, end)))

    def of(self, recording: Recording) -> Recording:
        """Return the part of a recording, on its own clock; the recording itself for the whole log.

        Parameters
        ----------
        recording : Recording
            The recording on the load side.

        Returns
        -------
        Recording
            Its samples in the section, without channels that have none there.

        Raises
        ------
        RecordingError
            The section contains no sample, or the distance cannot be determined.

        Examples
        --------
        >>> from cdtool.recordings.recording import Series
        >>> speed = Series(np.arange(5.0), np.ones(5), "m/s")
        >>> LogSection.parse("1s", "2.5s").of(Recording("run", "", ("axis",), {"speed": speed}))["speed"].time.tolist()
        [1.0, 2.0]
        """
        if not self:
            return recording
        start, end = self.times(recording)
        part = recording.between(start, end)
        if not part.channels:
            raise RecordingError(
                f"{recording.source or recording.name}: no sample {self}: the log is from {digits(recording.start)} "
                f"to {digits(recording.end)} s",
                "change from and to",
            )
        return part

    def contacts_of(self, recording: Recording, contacts: Sequence[Contact]) -> tuple[Contact, ...]:
        """Return the contacts of the whole recording that are in the section.

        Parameters
        ----------
        recording : Recording
            The whole recording.
        contacts : sequence of Contact
            Its contacts, in order of time.

        Returns
        -------
        tuple of Contact
            Those that begin in the section; one that began before it is in progress at its start.

        Raises
        ------
        RecordingError
            The distance cannot be determined.

        Examples
        --------
        >>> run, hits = Recording("run", "", ("axis",), {}), [Contact(1.0, 2.5, 0.001), Contact(4.0, 5.0, 0.001)]
        >>> [(hit.start, hit.in_progress) for hit in LogSection.parse("2s", "3s").contacts_of(run, hits)]
        [(2.0, True)]
        """
        begin, end = self.times(recording)
        inside = [contact for contact in contacts if contact.end >= begin and contact.start <= end]
        return tuple(item if item.start >= begin else replace(item, start=begin, in_progress=True) for item in inside)

    def times(self, recording: Recording) -> tuple[float, float]:
        """Return begin and end [s] of the section in a recording; infinite where it is not limited."""
        begin = self.begin.time_in(recording) if self.begin else -math.inf
        return begin, self.end.time_in(recording) if self.end else math.inf

    def completed_by(self, other: LogSection) -> LogSection:
        """Return this section, with the marks of another one where it has none."""
        return replace(self, begin=self.begin or other.begin, end=self.end or other.end)


def _travel(recording: Recording, mark: Mark) -> tuple[FloatArray, FloatArray]:
    """Return times (n,) [s] and the greatest distance so far (n,) of the leading joint from its first position."""
    channel = "position" if "position" in recording else "speed"
    series = recording[channel]
    wanted = mark.unit if channel == "position" else f"{mark.unit}/s"
    if series.unit not in (wanted, "SI"):
        text = f"{recording.name}: {mark} is not a distance of this machine, whose {channel} is in {series.unit}"
        raise RecordingError(text, MARK_HINT)
    if "speed" in recording:
        joint = leading_joint(recording["speed"])
    else:  # the position varies most
        known = np.isfinite(series.values)
        largest = np.max(series.values, axis=0, initial=-np.inf, where=known)
        joint = int(np.argmax(largest - np.min(series.values, axis=0, initial=np.inf, where=known)))
    present = np.isfinite(series.values[:, joint])
    time, values = series.time[present], series.values[present, joint]
    if channel == "speed":
        values = np.concatenate(([0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))))[: len(values)]
    if channel == "position" and series.unit == "rad":
        values = np.unwrap(values)  # an encoder that starts again at half a turn
    if not len(values):
        raise RecordingError(f"{recording.name}: {channel} has no sample to determine {mark}", "give times instead")
    distance = np.abs(values - np.median(values[:3]))  # the first one alone may be wrong
    held = np.zeros(len(distance))
    if len(distance) >= _HELD:
        held[_HELD - 1 :] = np.lib.stride_tricks.sliding_window_view(distance, _HELD).min(axis=1)
    return time, np.maximum.accumulate(held)
