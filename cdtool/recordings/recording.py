"""Measured data: Series, Recording, Contact. Frozen, SI, with separate times for each channel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.derived import StoresDerived
from cdtool.base.errors import RecordingError, nearest
from cdtool.base.findings import Finding
from cdtool.base.plain_text import counted

if TYPE_CHECKING:
    import pandas as pd


MEASURED = ("torque", "speed", "position", "acceleration")
REFERENCES = ("reference_position", "reference_speed", "reference_torque")
# Of what is measured, what the mechanics of the machine can contradict.
CHECKED = ("torque", "speed", "acceleration")
# What shows where a contact is; and all that is known from outside: a pressure only shows how hard it was.
SHOWS_CONTACTS = ("force", "label", "event")
CONTACT_PRESSURE = "contact_pressure"
GROUND_TRUTH = (*SHOWS_CONTACTS, CONTACT_PRESSURE)
TRIGGER = ("trigger",)
# What a test rig measures, in the same unit on every machine.
RIG_UNITS = {"force": "N", CONTACT_PRESSURE: "Pa"}
# High or low, or one sample per event: without a unit.
UNITLESS = ("label", "event", "trigger")
CHANNELS = (*MEASURED, *REFERENCES, *GROUND_TRUTH, *TRIGGER)


@dataclass(frozen=True, eq=False, repr=False)
class Series(StoresDerived):
    """One channel: `time` (n,) s strictly increasing, `values` (n, J) float64 in `unit`; NaN = no sample.

    Raises RecordingError if the shapes do not match or the time does not increase.
    """

    time: FloatArray
    values: FloatArray
    unit: str

    def __post_init__(self) -> None:
        time = _frozen(self.time)
        values = _table(self.values, time)
        if not np.all(np.isfinite(time)) or (len(time) > 1 and not np.all(time[1:] > time[:-1])):
            raise RecordingError("time does not strictly increase", "clean it with cdtool.recordings.clock.clean_time")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "values", values)

    def with_values(self, values: npt.ArrayLike, unit: str) -> Series:
        """Return a channel with the same times, which are neither checked nor copied; raises RecordingError."""
        return self._with(self.time, _table(values, self.time), unit, with_period=True)

    def _with(self, time: FloatArray, values: FloatArray, unit: str, *, with_period: bool = False) -> Series:
        """Return a channel of read-only arrays that are known to be valid."""
        made = object.__new__(type(self))
        vars(made).update(time=time, values=values, unit=unit)
        if with_period and "period" in vars(self):
            vars(made)["period"] = self.period
        return made

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a series that was sent from another process: its arrays are read-only as before."""
        for name in ("time", "values"):
            state[name].flags.writeable = False
        self.__dict__.update(state)

    def __repr__(self) -> str:
        return f"Series({len(self)} samples, {counted(self.joint_count, 'column')}, unit={self.unit!r})"

    def __len__(self) -> int:
        return len(self.time)

    @property
    def joint_count(self) -> int:
        """Return J, the number of joints."""
        return int(self.values.shape[1])

    @cached_property
    def period(self) -> float:
        """Return the median sample period [s]; NaN below two samples, where that of a `Signal` is 0."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else float("nan")

    def between(self, start: float, end: float) -> Series:
        """Return the samples with start <= time <= end [s]."""
        first = int(np.searchsorted(self.time, start, side="left"))
        last = int(np.searchsorted(self.time, end, side="right"))
        return self._with(self.time[first:last], self.values[first:last], self.unit)


@dataclass(frozen=True, eq=False)
class TableRows:
    """The rows of a table on its clock: `time` (n,) [s] of those that are kept; `kept` (m,), None if all are."""

    time: FloatArray
    kept: BoolArray | None = None

    @property
    def count(self) -> int:
        """Return the number of rows."""
        return len(self.time) if self.kept is None else len(self.kept)

    def time_of(self, row: int) -> tuple[float, float]:
        """Return the time of a row [s], twice; of one that was dropped, those of the next row and of the one before.

        NaN for a row that does not exist, or after which none is kept.
        """
        if not 0 <= row < self.count:
            return math.nan, math.nan
        at = row if self.kept is None else int(np.count_nonzero(self.kept[:row]))
        if at >= len(self.time):
            return math.nan, math.nan
        is_kept = self.kept is None or bool(self.kept[row]) or at == 0
        return float(self.time[at]), float(self.time[at if is_kept else at - 1])


@dataclass(frozen=True, eq=False, repr=False)
class Recording(StoresDerived):
    """One log: its channels as Series, on the load side, each at its own rate.

    `origin` is added to every time to obtain the source's own clock [s] (0 unless that is an epoch). A missing channel
    is missing, never zeros. `rows` are those of its table; None without a table with one clock. `beside`: the
    name and the SHA-256 of each file beside the log with a channel; `truth_clock` [s]: how far its clock may be off.
    `label_kinds` are the values of the label channel that are contacts, each with its kind; empty: all above 0.5 are.
    """

    name: str
    source: str
    joints: tuple[str, ...]
    channels: Mapping[str, Series]
    origin: float = 0.0
    findings: tuple[Finding, ...] = ()
    digest: str = ""
    rows: TableRows | None = None
    beside: tuple[tuple[str, str], ...] = ()
    truth_clock: float = 0.0
    label_kinds: tuple[tuple[float, str], ...] = ()

    def __post_init__(self) -> None:
        for name, series in self.channels.items():
            if name not in CHANNELS:
                raise RecordingError(f"{self.name}: unknown channel '{name}'", nearest(name, CHANNELS))
            expected = (1,) if name in (*GROUND_TRUTH, *TRIGGER) else (len(self.joints),)
            # A load cell measures up to three axes, whatever the number of joints.
            if series.joint_count not in expected and not (name == "force" and series.joint_count <= 3):
                raise RecordingError(
                    f"{self.name}: channel '{name}' has {series.joint_count} columns for {len(self.joints)} joints",
                    "give one column per joint in [channels], in the order of machine.joints",
                    channel=name,
                )

    def __getattr__(self, name: str) -> Any:
        """Raise AttributeError, which says how to read a channel."""
        hint = f"; use recording['{name}']" if name in vars(self).get("channels", ()) else ""
        raise AttributeError(f"Recording has no attribute '{name}'{hint}")

    def __repr__(self) -> str:
        channels = ", ".join(self.channels)
        return f"Recording({self.name!r}, {self.duration:.3g} s, joints {', '.join(self.joints)}: {channels})"

    def __contains__(self, channel: str) -> bool:
        return channel in self.channels

    def __getitem__(self, channel: str) -> Series:
        try:
            return self.channels[channel]
        except KeyError:
            raise RecordingError(
                f"{self.name}: no channel '{channel}'",
                f"map it in [channels] of the machine file; mapped here: {', '.join(self.channels) or 'none'}",
                channel=channel,
            ) from None

    @property
    def start(self) -> float:
        """Return the time of the first sample of any channel [s]."""
        return min((float(s.time[0]) for s in self.channels.values() if len(s)), default=float("nan"))

    @property
    def end(self) -> float:
        """Return the time of the last sample of any channel [s]."""
        return max((float(s.time[-1]) for s in self.channels.values() if len(s)), default=float("nan"))

    @property
    def duration(self) -> float:
        """Return the time from the first sample to the last [s]."""
        return self.end - self.start

    @property
    def began(self) -> float | None:
        """Return the time of the first sample since 1970 [s]; None if the log's clock does not count from there."""
        began = self.origin + self.start
        return began if 1e9 <= began < 4.1e9 else None  # from 2001 to 2100

    def between(self, start: float, end: float) -> Recording:
        """Return the recording cut to start <= time <= end [s], without channels that have no sample there."""
        parts = {name: series.between(start, end) for name, series in self.channels.items()}
        return replace(self, channels={name: series for name, series in parts.items() if len(series)})

    def section(self, start: float, end: float) -> Recording:
        """Return the recording cut to start <= time <= end [s] with all its channels, even those without a sample.

        The same times return the same object.
        """
        return self.derived(("section", start, end), lambda: self._section(start, end))

    def _section(self, start: float, end: float) -> Recording:
        return replace(self, channels={name: series.between(start, end) for name, series in self.channels.items()})

    def without_ground_truth(self) -> Recording:
        """Return what a detector or threshold may use: no load cell, pressure or label; each time the same object."""
        if not any(name in GROUND_TRUTH for name in self.channels):
            return self
        return self.derived("without ground truth", self._without_ground_truth)

    def _without_ground_truth(self) -> Recording:
        seen = {name: series for name, series in self.channels.items() if name not in GROUND_TRUTH}
        return replace(self, channels=seen)

    def to_frame(self, channels: str | Sequence[str] = ()) -> pd.DataFrame:
        """Return channels as a DataFrame with a row for each time at which one of them has a sample.

        A value is NaN where the channel has no sample at that time: nothing is interpolated, and `frame.ffill()` holds
        the last sample. The index is `time_s`; the columns are named as `cdtool convert` names them: `speed [m/s]`,
        with several joints `speed arm [rad/s]`. `channels` is a name or several; without it: all of them. Raises
        RecordingError for a channel that the recording does not have.
        """
        import pandas as pd

        names = (channels,) if isinstance(channels, str) else channels
        shown = {name: self[name] for name in names or self.channels}
        time = np.unique(np.concatenate([np.empty(0), *(series.time for series in shown.values())]))
        columns: dict[str, FloatArray] = {}
        for name, series in shown.items():
            values = np.full((len(time), series.joint_count), np.nan)
            values[np.searchsorted(time, series.time)] = series.values
            columns |= dict(zip(self._headings(name), values.T, strict=True))
        return pd.DataFrame(columns, index=pd.Index(time, name="time_s"))

    def _headings(self, name: str) -> Iterator[str]:
        """Yield the heading of each column of a channel, as `cdtool convert` writes it."""
        series, unit = self.channels[name], f" [{self.channels[name].unit}]" if self.channels[name].unit else ""
        of_joints = series.joint_count == len(self.joints) and name not in (*GROUND_TRUTH, *TRIGGER)
        parts = self.joints if of_joints else [str(number) for number in range(1, series.joint_count + 1)]
        for part in parts:
            yield f"{name} {part}{unit}" if series.joint_count > 1 else f"{name}{unit}"

    def own_clock(self, clock: FloatArray) -> FloatArray | None:
        """Return the times of the first channel whose times equal those of `clock` [s]; None without such a channel.

        Equal clocks have the same object, so that it identifies results on this clock. The speed counts as the first.
        """
        # By the identity of the channels' times, which exist as long as the recording.
        known: dict[int, FloatArray] = self.derived("own clocks", dict)
        own = known.get(id(clock))
        if own is None:
            own = self._first_equal(clock)
            if own is not None and any(series.time is clock for series in self.channels.values()):
                known[id(clock)] = own
        return own

    def _first_equal(self, clock: FloatArray) -> FloatArray | None:
        names = sorted(self.channels, key=lambda name: name != "speed")
        times = (self.channels[name].time for name in names)
        return next((time for time in times if time is clock or np.array_equal(time, clock)), None)


@dataclass(frozen=True)
class Contact:
    """A true impact: onset and end [s], the onset's uncertainty [s], its peak force [N] and how it was found.

    `kind` is its name in a label file or by a label channel. From a load cell: `rest`, the reading at rest just before
    the onset [N], `drift` of that level [N/s], its shift since the log began [N], and the resolution of the onset,
    `resolution` [s]: from clock, noise, drift and slope. `hole` [s]: how long load-cell samples are missing where the
    contact may have begun; 0: never longer than a force meter would allow. A contact that is `in_progress` at the start
    of the recording has no onset: `start` is the first sample.
    """

    start: float
    end: float
    uncertainty: float
    peak_force: float = float("nan")
    found_by: str = "load cell"
    kind: str = ""
    rest: float = math.nan
    drift: float = 0.0
    shift: float = 0.0
    resolution: float = math.nan
    in_progress: bool = False
    hole: float = 0.0


def _table(values: npt.ArrayLike, time: FloatArray) -> FloatArray:
    """Return read-only values (n, J) with a row for each time; raises RecordingError."""
    table = np.asarray(values, dtype=np.float64)
    if table.ndim == 1:
        table = table[:, np.newaxis]
    if time.ndim != 1 or table.ndim != 2 or len(table) != len(time):
        raise RecordingError(f"time has shape {time.shape}, values {table.shape}; expected (n,) and (n, J)")
    return _frozen(table)


def _frozen(values: npt.ArrayLike) -> FloatArray:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    return array
