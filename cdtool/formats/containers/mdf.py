"""ASAM MDF, versions 3 and 4, by asammdf."""

from __future__ import annotations

import gc
import logging
import os
import re
import sys
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from importlib import import_module
from itertools import chain
from pathlib import Path
from traceback import clear_frames
from typing import Any, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import requested_keys
from cdtool.formats.columns import as_float64
from cdtool.formats.containers.container_checks import (
    as_numbers,
    check_size,
    left_out_finding,
    library,
    one_line_errors,
)
from cdtool.formats.groups import Group, Parts, WrittenNames, prefix_keys, require_clocks
from cdtool.formats.pieces import Pieces, PiecewiseFormat
from cdtool.formats.slices import SlicedColumn, header_of, interleave
from cdtool.formats.source import Source
from cdtool.recordings.units import find_unit

_MAGICS = (b"MDF     ", b"UnFinMF ")
# A library would evaluate the text of a conversion formula: only plain arithmetic is accepted.
_ARITHMETIC = re.compile(r"[0-9Xx.eE+\-*/() ]*")
_ORIGIN = re.compile(r"^cdtool\.origin_s: (\S+)$", re.MULTILINE)


@dataclass(frozen=True)
class Mdf(PiecewiseFormat):
    """MDF files: a column is a channel, prefixed with its group's number if several groups have a channel of that name.

    Each group's master channel is the clock of its channels. Attachments are not opened.
    """

    name: ClassVar[str] = "mdf"
    suffixes: ClassVar[tuple[str, ...]] = (".mf4", ".mdf", ".mf3")

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like an MDF file."""
        with path.open("rb") as file:
            return file.read(8) in _MAGICS

    def _read(self, path: Path, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        asammdf = _library()
        logging.getLogger("asammdf").setLevel(logging.CRITICAL)  # its problems are reported as errors or findings
        findings: list[Finding] = []
        with path.open("rb") as file:
            unfinished = file.read(8) == _MAGICS[1]
        with one_line_errors("an MDF file"), _opened(asammdf, path) as log:
            if unfinished:
                findings.append(Finding("never_finalised"))
            channels = _channels(log, findings)
            keys = [key for key in requested_keys(wanted, tuple(channels)) if some is None or key in some]
            if not keys:
                raise RecordingError("has no channel of numbers", "see cdtool info")
            check_size(path, sum(log.groups[channels[key][0]].channel_group.cycles_nr for key in keys))
            columns: list[SlicedColumn] = []
            for key in keys:
                column = _column(log, key, *channels[key], findings)
                if column is not None:
                    columns.append(column)
                elif wanted is not None:
                    raise RecordingError(f"channel '{key}' is not numeric", "map another channel")
            if not columns:
                raise RecordingError("has no channel of numbers", "see cdtool info")
            yield from interleave(columns)
            stated = _ORIGIN.search(str(log.header.description)) if hasattr(log.header, "description") else None
            details = {"version": str(log.version), "start": str(log.start_time)}
        headers = {column.name: header_of(column) for column in columns}
        origin = float(stated[1]) if stated else 0.0
        return Source(path, self.name, headers, origin, tuple(dict.fromkeys(findings)), details, tuple(channels))


def _library() -> Any:
    """Return asammdf; raises RecordingError if it is not installed.

    A log that is interrupted while it is made is closed by its destructor, which needs an attribute that it does not
    have yet: it is closed until it is open.
    """
    asammdf = library("asammdf", "mdf")
    for module, name in (("asammdf.blocks.mdf_v4", "MDF4"), ("asammdf.blocks.mdf_v3", "MDF3")):
        version = getattr(import_module(module), name)
        version._closed = getattr(version, "_closed", True)
    return asammdf


def _opened(asammdf: Any, path: Path) -> Any:
    """Return the open log.

    Objects that asammdf has created from a damaged file raise when they are destroyed; these errors are suppressed.
    """
    hook = sys.unraisablehook
    try:
        return asammdf.MDF(os.fspath(path))
    except Exception as fault:
        reason = " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
        sys.unraisablehook = lambda _: None
        clear_frames(fault.__traceback__)
    gc.collect()
    sys.unraisablehook = hook
    raise RecordingError(f"damaged or not an MDF file: {reason}", "copy or save it again")


def _channels(log: Any, findings: list[Finding]) -> dict[str, tuple[int, int]]:
    """Return group and index of every channel that may have numbers, by column name; master channels are left out."""
    candidates = [
        (group, index, channel)
        for group, content in enumerate(log.groups)
        for index, channel in enumerate(content.channels)
        if log.masters_db.get(group) != index
    ]
    count = Counter(channel.name for _, _, channel in candidates)
    channels: dict[str, tuple[int, int]] = {}
    for group, index, channel in candidates:
        name = channel.name if count[channel.name] == 1 else f"{group}/{channel.name}"
        while name in channels:
            name += "'"
        formula = str(getattr(channel.conversion, "formula", "") or "")
        if not log.groups[group].channel_group.cycles_nr:
            findings.append(left_out_finding(name, "empty"))
        elif not _ARITHMETIC.fullmatch(formula):
            findings.append(left_out_finding(name, f"defined by the formula '{formula[:40]}', which is not evaluated"))
        else:
            channels[name] = (group, index)
    return channels


def _column(log: Any, key: str, group: int, index: int, findings: list[Finding]) -> SlicedColumn | None:
    """Return a channel as a column; None, with a finding, if its values are not numbers."""
    first = _signal(log, group, index, 0, 1)
    if first.samples.dtype.kind not in "biuf" or first.samples.ndim != 1:
        kind = "of texts" if first.samples.dtype.kind in "SUO" else "an array or a structure"
        findings.append(left_out_finding(key, kind))
        return None
    rows = int(log.groups[group].channel_group.cycles_nr)

    def values(start: int, end: int) -> FloatArray:
        signal = _signal(log, group, index, start, end)
        numbers = as_numbers(key, signal.samples, findings)
        if signal.invalidation_bits is not None and np.any(signal.invalidation_bits):
            numbers = np.where(np.asarray(signal.invalidation_bits), np.nan, numbers)
        if len(numbers) < end - start:
            lost = {"count": end - start - len(numbers), "first": start + len(numbers)}
            findings.append(Finding("values_cut_off", key, lost))
        return np.pad(numbers, (0, end - start - len(numbers)), constant_values=np.nan)

    factor = _time_factor(log, group)
    if factor is None:
        return SlicedColumn(key, rows, values, unit=first.unit or None)

    def time(start: int, end: int) -> FloatArray:
        times = as_float64(_signal(log, group, index, start, end).timestamps)
        return times if factor == 1.0 else times * factor

    return SlicedColumn(key, rows, values, str(group), time, first.unit or None)


def _signal(log: Any, group: int, index: int, start: int, end: int) -> Any:
    """Return the rows from `start` to before `end` of a channel."""
    return log.get(
        group=group, index=index, ignore_invalidation_bits=True, record_offset=start, record_count=end - start
    )


def _time_factor(log: Any, group: int) -> float | None:
    """Return the factor from the master's unit to seconds; None if the master is an angle or a distance."""
    master = log.masters_db.get(group)
    unit = None if master is None else find_unit(log.groups[group].channels[master].unit or "s")
    return unit.factor if unit is not None and unit.si == "s" else None


def write_mdf(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write MDF 4.10: one channel per column with its unit, one group per clock; provenance as the file's comment."""
    asammdf = _library()
    require_clocks(groups)
    shared = Counter(part.name for group in groups for part in chain(*group.flat))
    with asammdf.MDF(version="4.10") as log:
        # The log's own start, or the epoch: with the time of writing the same log would give different bytes.
        start = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=float(provenance.get("origin_s", "0")))
        log.header.start_time = start
        log.header.comment = "\n".join(f"{key}: {value}" for key, value in prefix_keys(provenance).items())
        for group in groups:
            signals = [
                asammdf.Signal(samples=np.empty(0), timestamps=np.empty(0), name=part.name, unit=part.unit or "")
                for part in chain(*group.flat)
            ]
            log.append(signals, acq_name=group.name, comment=group.name, common_timebase=True)
        for ready in parts:
            for number, part in enumerate(ready):
                if part is not None:  # asammdf buffers it in a temporary file
                    log.extend(number, [(values, None) for values in (part.time, *part.flat)])
        with path.open("wb+") as file:  # given a path, asammdf would change the suffix
            log.save(file)
    return [
        [[f"{number}/{p.name}" if shared[p.name] > 1 else p.name for p in parts] for parts in group.flat]
        for number, group in enumerate(groups)
    ]
