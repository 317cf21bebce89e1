"""The axes of a force vector whose columns or topics have clocks of their own: joined on one clock, causally."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource
from cdtool.formats.columns import Column
from cdtool.formats.source import Source
from cdtool.recordings.clock import HOLD_PERIODS, clean_time, previous_value
from cdtool.recordings.recording import Series


def fields_by_axis(channels: ChannelMap) -> ChannelMap:
    """Return a map of topics in which every axis of a force is a source of its own; any other map is unchanged."""
    if not any(item.fields for item in channels.sources):
        return channels
    return replace(channels, sources=tuple(axis for item in channels.sources for axis in item.by_axis))


def join_fields(source: Source, resolved: ChannelMap, wanted: ChannelMap) -> tuple[Source, ChannelMap]:
    """Return a source in which the fields of a force vector are one column, and its map; the inverse of fields_by_axis.

    `wanted` is the map of the machine file. A vector without one of its axes is missing. Raises RecordingError.
    """
    vectors = [item for item in wanted.sources if item.fields]
    if not vectors:
        return source, resolved
    present = {key for item in resolved.sources for key in item.keys}
    sources = [item for item in resolved.sources if item.channel not in {vector.channel for vector in vectors}]
    columns, findings = dict(source.columns), list(source.findings)
    for vector in vectors:
        keys = [axis.described for axis in vector.by_axis]
        if not present.issuperset(keys):
            continue
        column, notes = join_axes(vector, [source.columns[key] for key in keys])
        columns[vector.channel] = column
        findings += notes
        sources.append(replace(vector, keys=(vector.channel,)))
    return replace(source, columns=columns, findings=tuple(findings)), replace(resolved, sources=tuple(sources))


def join_axes(item: ChannelSource, axes: Sequence[Column]) -> tuple[Column, list[Finding]]:
    """Return the axes of a force as one column (n, axes), and a note if they have different clocks.

    The clock is then that of the axis with the longest period; of every other axis, each time has the last sample at or
    before it, NaN if that is older than 5 of its periods. Raises RecordingError if an axis has no sample.
    """
    for axis in axes:
        if axis.time is None or axis.values.ndim != 1 or not len(axis.values):
            problem = "is not one number per sample" if axis.values.ndim != 1 else "has no sample with a time"
            raise RecordingError(
                f"'{axis.name}' (channel '{item.channel}') {problem}",
                "name one element per axis, each with a clock",
                channel=item.channel,
            )
    first = axes[0].time
    if all(axis.time is first or np.array_equal(axis.time, first) for axis in axes):  # type: ignore[arg-type]
        return Column(item.channel, np.column_stack([axis.values for axis in axes]), first), []
    clean = [_cleaned(item, axis) for axis in axes]
    slowest = max(range(len(axes)), key=lambda k: clean[k].period if np.isfinite(clean[k].period) else 0.0)
    clock = clean[slowest].time
    held = np.column_stack([previous_value(series, clock)[:, 0] for series in clean])
    ages = [_longest_age(series, clock) for k, series in enumerate(clean) if k != slowest]
    fact = {"slowest": axes[slowest].name, "age": max(ages, default=0.0)}
    return Column(item.channel, held, clock), [Finding("axes_held", item.channel, fact)]


def _cleaned(item: ChannelSource, axis: Column) -> Series:
    clean = clean_time(axis.time)  # type: ignore[arg-type]
    if not len(clean.time):
        raise RecordingError(f"'{axis.name}' has no sample with a time", channel=item.channel)
    return Series(clean.time, axis.values[clean.keep], "1")


def _longest_age(series: Series, clock: np.ndarray) -> float:
    """Return the largest age of the samples that are held [s], among those that are not too old."""
    at = np.searchsorted(series.time, clock, side="right") - 1
    age = (clock - series.time[np.maximum(at, 0)])[at >= 0]
    age = age[age <= HOLD_PERIODS * series.period] if np.isfinite(series.period) else age
    return float(age.max(initial=0.0))
