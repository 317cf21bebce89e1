"""TDMS files of LabVIEW and DIAdem, by npTDMS."""

from __future__ import annotations

import logging
import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from io import StringIO
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.base.findings import Finding
from cdtool.formats.containers.container_checks import library, messages_of, one_line_errors
from cdtool.formats.epoch_clock import EpochClock, with_plausible_unit
from cdtool.formats.slices import Container, SlicedColumn, SlicedFormat, rows_of
from cdtool.recordings.units import find_unit

_MAGIC = b"TDSm"
_UNIT_KEYS = ("unit_string", "NI_UnitDescription", "unit")
_CLOCK_NAMES = ("time", "t", "timestamp")


@dataclass(frozen=True)
class Tdms(SlicedFormat):
    """TDMS files: a column is a channel, prefixed with its group if several groups have a channel of that name.

    The clock of a channel is its waveform's (`wf_increment`), or the channel `time` of its group with a unit of time.
    """

    name: ClassVar[str] = "tdms"
    suffixes: ClassVar[tuple[str, ...]] = (".tdms",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a TDMS file."""
        with path.open("rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC

    @contextmanager
    def _open(self, container: Container) -> Iterator[None]:
        nptdms = library("nptdms", "tdms")
        with (
            one_line_errors("a TDMS file"),
            _printed(nptdms) as printed,
            nptdms.TdmsFile.open(os.fspath(container.path)) as file,
        ):
            _add_channels(container, file)
            container.details = {key: str(value)[:80] for key, value in file.properties.items()}
            yield
            incomplete = getattr(file.file_status, "incomplete_final_segment", False)
            if incomplete:
                container.findings.append(Finding("last_segment_incomplete"))
            container.findings += messages_of("npTDMS", printed.getvalue(), "note" if incomplete else "warning")


@contextmanager
def _printed(nptdms: Any) -> Iterator[StringIO]:
    """Yield what the library prints within the context: its warnings about files that are read at the same time too."""
    console, printed = nptdms.log.log_manager.console_handler, StringIO()
    console.setFormatter(logging.Formatter())
    before = console.setStream(printed)
    try:
        yield printed
    finally:
        console.setStream(before)


def _add_channels(container: Container, file: Any) -> None:
    """Add the channels of numbers."""
    candidates = [channel for group in file.groups() for channel in group.channels()]
    count = Counter(channel.name for channel in candidates)
    channels = list[Any]()
    waveform_of, clock_of = cache(_waveform), cache(partial(_stated_clock, container))
    for channel in candidates:
        name = channel.name if count[channel.name] == 1 else f"{channel.group_name}/{channel.name}"
        kind = channel.dtype.kind if channel.dtype is not None else "O"
        if not len(channel):
            container.leave_out(name, "empty")
        elif kind not in "biuf":
            container.leave_out(name, "of time stamps" if kind == "M" else "not numeric")
        else:
            channels.append(channel)
            container.columns[name] = partial(_column, channel, channels, waveform_of, clock_of)


def _column(
    channel: Any, channels: Sequence[Any], waveform_of: Callable[..., EpochClock], clock_of: Callable[..., Any]
) -> SlicedColumn:
    """Return a channel as a column, with the clock of its waveform or of the channel of times in its group."""
    step = _step(channel)
    if step is not None:
        offset = float(channel.properties.get("wf_start_offset", 0.0))
        return SlicedColumn.of(channel, waveform_of(_start(channel), offset, step), _unit(channel))
    beside = [other for other in channels if other.group_name == channel.group_name and len(other) >= len(channel)]
    clocks = (clock_of(other) for other in beside if channel.name not in _CLOCK_NAMES)
    return SlicedColumn.of(channel, next(filter(None, clocks), None), _unit(channel))


def _waveform(start: Fraction | None, offset: float, step: float) -> EpochClock:
    return EpochClock(np.arange, step, (start or 0) + Fraction(offset), dated=start is not None)


def _stated_clock(container: Container, channel: Any) -> EpochClock | None:
    """Return a channel as a clock; None if it has not the name of one, or no unit of time."""
    stated = _unit(channel) or "?"
    unit = find_unit(stated)
    if channel.name not in _CLOCK_NAMES or unit is None or unit.si != "s":
        return None
    clock = EpochClock(partial(rows_of, channel), unit.factor)
    return with_plausible_unit(clock, stated, container.findings, channel.name)


def _step(channel: Any) -> float | None:
    """Return a waveform's sample period [s]; None for any other channel."""
    step = channel.properties.get("wf_increment")
    known = isinstance(step, int | float | np.number) and not isinstance(step, bool) and 0.0 < float(step) < np.inf
    return float(step) if known else None


def _start(channel: Any) -> Fraction | None:
    """Return a waveform's start [s] since 1970; None if it has no start, or the start of an empty stamp (1904)."""
    start = channel.properties.get("wf_start_time")
    if start is None:
        return None
    microseconds = np.datetime64(start, "us").astype(np.int64)
    seconds = Fraction(int(microseconds), 10**6)
    return seconds if seconds > 0 else None


def _unit(channel: Any) -> str | None:
    return next((str(channel.properties[key]) for key in _UNIT_KEYS if channel.properties.get(key)), None)
