"""ASAM MDF, versions 3 and 4, by asammdf."""

from __future__ import annotations

import gc
import logging
import os
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import cache, partial
from itertools import chain
from pathlib import Path
from traceback import clear_frames
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.base.findings import Finding
from cdtool.formats.containers.container_checks import library, one_line_errors
from cdtool.formats.epoch_clock import EpochClock
from cdtool.formats.groups import Group, Parts, WrittenNames, names_of, prefix_keys, require_clocks
from cdtool.formats.slices import Container, SlicedColumn, SlicedFormat
from cdtool.recordings.units import find_unit

_MAGICS = (b"MDF     ", b"UnFinMF ")
# A library would evaluate the text of a conversion formula: only plain arithmetic is accepted.
_ARITHMETIC = re.compile(r"[0-9Xx.eE+\-*/() ]*")
_ORIGIN = re.compile(r"^cdtool\.origin_s: (\S+)$", re.MULTILINE)


@dataclass(frozen=True)
class Mdf(SlicedFormat):
    """MDF files: a column is a channel, prefixed with its group's number if several groups have a channel of that name.

    Each group's master channel is the clock of its channels. Attachments are not opened.
    """

    name: ClassVar[str] = "mdf"
    suffixes: ClassVar[tuple[str, ...]] = (".mf4", ".mdf", ".mf3")

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like an MDF file."""
        with path.open("rb") as file:
            return file.read(8) in _MAGICS

    @contextmanager
    def _open(self, container: Container) -> Iterator[None]:
        asammdf = library("asammdf", "mdf")
        logging.getLogger("asammdf").setLevel(logging.CRITICAL)  # its problems are reported as errors or findings
        with container.path.open("rb") as file:
            if file.read(8) == _MAGICS[1]:
                container.findings.append(Finding("never_finalised"))
        with one_line_errors("an MDF file"), _opened(asammdf, container.path) as log:
            _add_channels(container, log)
            stated = _ORIGIN.search(str(log.header.description)) if hasattr(log.header, "description") else None
            container.origin = float(stated[1]) if stated else 0.0
            container.details = {"version": str(log.version), "start": str(log.start_time)}
            yield


@contextmanager
def _opened(asammdf: Any, path: Path) -> Iterator[Any]:
    """Yield the open log.

    Objects that asammdf has created from a damaged file raise when they are destroyed; these errors are suppressed.
    """
    hook = sys.unraisablehook
    try:
        log = asammdf.MDF(os.fspath(path))
    except BaseException as fault:
        sys.unraisablehook = lambda _: None
        clear_frames(fault.__traceback__)
        gc.collect()
        sys.unraisablehook = hook
        raise
    with log:
        yield log


def _add_channels(container: Container, log: Any) -> None:
    """Add every channel that may have numbers; master channels are the clocks of their groups."""
    candidates = [
        (group, index, channel)
        for group, content in enumerate(log.groups)
        for index, channel in enumerate(content.channels)
        if log.masters_db.get(group) != index
    ]
    clock_of = cache(partial(_clock, log))
    count = Counter(channel.name for _, _, channel in candidates)
    for group, index, channel in candidates:
        name = channel.name if count[channel.name] == 1 else f"{group}/{channel.name}"
        while name in container.columns:
            name += "'"
        formula = str(getattr(channel.conversion, "formula", "") or "")
        if not log.groups[group].channel_group.cycles_nr:
            container.leave_out(name, "empty")
        elif not _ARITHMETIC.fullmatch(formula):
            container.leave_out(name, f"defined by the formula '{formula[:40]}', which is not evaluated")
        else:
            signal = partial(log.get, group=group, index=index, ignore_invalidation_bits=True)
            rows = int(log.groups[group].channel_group.cycles_nr)
            container.columns[name] = partial(_column, container, name, rows, signal, partial(clock_of, group))


def _column(
    container: Container, name: str, rows: int, signal: Callable[..., Any], clock: Callable[[], EpochClock | None]
) -> SlicedColumn | None:
    """Return a channel as a column; None, with a finding, if its values are not numbers."""
    first = signal(record_offset=0, record_count=1)
    if first.samples.dtype.kind not in "biuf" or first.samples.ndim != 1:
        container.leave_out(name, "of texts" if first.samples.dtype.kind in "SUO" else "an array or a structure")
        return None

    def read(start: int, end: int) -> npt.NDArray[Any]:
        part = signal(record_offset=start, record_count=end - start)
        if part.invalidation_bits is None or not np.any(part.invalidation_bits):
            return np.asarray(part.samples)
        return np.where(np.asarray(part.invalidation_bits), np.nan, part.samples)

    return SlicedColumn(rows, read, clock(), first.unit or None)


def _clock(log: Any, group: int) -> EpochClock | None:
    """Return the master of a group; None if it is an angle or a distance."""
    master = log.masters_db.get(group)
    unit = None if master is None else find_unit(log.groups[group].channels[master].unit or "s")
    if unit is None or unit.si != "s":
        return None

    def read(start: int, end: int) -> npt.NDArray[Any]:
        return np.asarray(log.get_master(group, record_offset=start, record_count=end - start))

    return EpochClock(read, unit.factor)


def write_mdf(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write MDF 4.10: one channel per column with its unit, one group per clock; provenance as the file's comment."""
    asammdf = library("asammdf", "mdf")
    require_clocks(groups)
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
    return names_of(groups, [str(number) for number in range(len(groups))])
