"""The axes of a force vector whose columns or topics have clocks of their own: joined on one clock, causally."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelSource
from cdtool.formats.columns import Column
from cdtool.recordings.clock import HOLD_PERIODS, clean_time, previous_value
from cdtool.recordings.recording import Series


def on_one_clock(item: ChannelSource, parts: Sequence[Column], findings: list[Finding]) -> Column:
    """Return the columns of a channel, which have clocks of their own, as one column; a finding on axes is added.

    If the axes of a force have different clocks, theirs is that of the axis with the longest period; of every other
    axis, each time has the last sample at or before it, NaN if that is older than 5 of its periods. Raises
    RecordingError if an axis has no sample, or the joints of another channel have different clocks.
    """
    first = parts[0]
    if len(parts) == 1:
        return first
    other = next((part for part in parts if not _same(part.time, first.time)), None)
    if other is None:
        return Column(item.channel, np.column_stack([part.values for part in parts]), first.time)
    if not item.axes:
        raise RecordingError(
            f"'{first.name}' and '{other.name}' of channel '{item.channel}' have different clocks",
            "all joints of a channel must have the same clock",
            channel=item.channel,
        )
    clean = [_cleaned(item, axis) for axis in parts]
    slowest = max(range(len(parts)), key=lambda k: clean[k].period if np.isfinite(clean[k].period) else 0.0)
    clock = clean[slowest].time
    held = np.column_stack([previous_value(series, clock)[:, 0] for series in clean])
    ages = [_longest_age(series, clock) for k, series in enumerate(clean) if k != slowest]
    findings.append(Finding("axes_held", item.channel, {"slowest": parts[slowest].name, "age": max(ages, default=0.0)}))
    return Column(item.channel, held, clock)


def _same(time: FloatArray | None, other: FloatArray | None) -> bool:
    return time is other or (time is not None and other is not None and np.array_equal(time, other))


def _cleaned(item: ChannelSource, axis: Column) -> Series:
    clean = clean_time(np.empty(0) if axis.time is None else axis.time)
    if axis.values.ndim != 1 or not len(clean.time):
        problem = "is not one number per sample" if axis.values.ndim != 1 else "has no sample with a time"
        raise RecordingError(
            f"'{axis.name}' (channel '{item.channel}') {problem}",
            "name one element per axis, each with a clock",
            channel=item.channel,
        )
    return Series(clean.time, axis.values[clean.keep], "1")


def _longest_age(series: Series, clock: FloatArray) -> float:
    """Return the largest age of the samples that are held [s], among those that are not too old."""
    at = np.searchsorted(series.time, clock, side="right") - 1
    age = (clock - series.time[np.maximum(at, 0)])[at >= 0]
    age = age[age <= HOLD_PERIODS * series.period] if np.isfinite(series.period) else age
    return float(age.max(initial=0.0))
