"""Containers whose columns bring their own times (MDF4, TDMS, HDF5): each channel then keeps its own clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdtool.channels import ChannelMap, ChannelSource
from cdtool.columns import Column
from cdtool.errors import ConfigurationError, RecordingError
from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.source import Source
from cdtool.ingest.header_units import unit_findings


def with_own_clocks(source: Source, channels: ChannelMap) -> tuple[Source, ChannelMap]:
    """A source whose columns bring times, and its map, so that each channel becomes one column with a clock.

    The map's columns are resolved (resolve_columns). A table comes back as it is. Raises RecordingError where a
    channel's columns have different clocks or none, and ConfigurationError where the machine file gives the clock
    another unit than s.
    """
    if channels.topics or not any(column.time is not None for column in source.columns.values()):
        return source, channels
    if channels.time.column != OWN_CLOCK:  # a column or a rate that the machine file names decides
        plain = {name: replace(column, time=None) for name, column in source.columns.items()}
        return replace(source, columns=plain), channels
    if channels.time.factor != 1.0:
        raise ConfigurationError(
            f"{source.path}: its own clock is in s, [channels] time says another unit",
            'time = { column = "time", unit = "s" }',
        )
    joined = {item.channel: _joined(source, item) for item in channels.sources}
    sources = tuple(replace(item, columns=(item.channel,), keys=(item.channel,)) for item in channels.sources)
    names = tuple(joined)
    # What each column says of its unit: the joined ones have none.
    findings = (*source.findings, *unit_findings(source, channels))
    source = replace(source, columns=joined, names=names, findings=findings)
    return source, replace(channels, sources=sources, topics=True)


def _joined(source: Source, item: ChannelSource) -> Column:
    parts = [source.columns[key] for key in item.keys]
    time = parts[0].time
    for part in parts:
        if part.time is None or time is None:
            raise RecordingError(
                f"{source.path}: column '{part.name}' (channel '{item.channel}') has no clock of its own",
                "name the column that is its clock in [channels] time",
                channel=item.channel,
            )
        if not np.array_equal(part.time, time):
            raise RecordingError(
                f"{source.path}: '{parts[0].name}' and '{part.name}' of channel '{item.channel}' have different clocks",
                "the joints of one channel are logged together",
                channel=item.channel,
            )
    return Column(item.channel, np.column_stack([part.values for part in parts]), time)
