"""Lost samples put into a log, seeded: lost rows, repeated stamps, and NaN in one channel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.recordings.clock import clean_time
from cdtool.recordings.recording import MEASURED, Recording, Series

LONGEST = 50
KINDS = ("lost rows", "repeated stamps", "NaN", "lost samples")


@dataclass(frozen=True)
class Fault:
    """`count` samples lost from `start` [s] on: rows of the log, stamps that repeat, NaN or samples of `channel`."""

    kind: str
    start: float
    count: int
    channel: str = ""


def random_faults(recording: Recording, number: int, rng: np.random.Generator, longest: int = LONGEST) -> list[Fault]:
    """`number` faults of random kind, channel, time and length: 1 to `longest` samples, half of them below 7."""
    faults = []
    measured = [name for name in MEASURED if name in recording]
    for _ in range(number):
        kind = str(rng.choice(KINDS))
        count = min(int(longest ** rng.uniform(0.0, 1.0) + 0.5), longest)
        start = float(rng.uniform(recording.start, recording.end))
        faults.append(Fault(kind, start, count, str(rng.choice(measured)) if kind in KINDS[2:] else ""))
    return faults


def damaged(recording: Recording, faults: Sequence[Fault]) -> Recording:
    """Return the recording with all these faults; ground truth is unchanged."""
    channels: dict[str, Series] = dict(recording.channels)
    for fault in faults:
        channels = {name: _spoilt(series, fault) if _hit(name, fault) else series for name, series in channels.items()}
    return replace(recording, channels=channels)


def filled(recording: Recording, fault: Fault) -> tuple[Recording, ...]:
    """Return the recording with the fault filled by a straight line, and with held values."""
    return tuple(
        replace(
            recording,
            channels={
                name: _filled(series, fault, held) if _hit(name, fault) else series
                for name, series in recording.channels.items()
            },
        )
        for held in (False, True)
    )


def _hit(channel: str, fault: Fault) -> bool:
    return channel == fault.channel if fault.channel else channel not in ("force", "label")


def _filled(series: Series, fault: Fault, held: bool) -> Series:
    first = int(np.searchsorted(series.time, fault.start))
    last = min(first + fault.count, len(series))
    before = max(first - 1, 0)
    ends = series.time[[before, min(last, len(series) - 1)]]
    end_values = series.values[[before, before if held else min(last, len(series) - 1)]]
    values = series.values.copy()
    for column in range(values.shape[1]):
        values[first:last, column] = np.interp(series.time[first:last], ends, end_values[:, column])
    return replace(series, values=values)


def _spoilt(series: Series, fault: Fault) -> Series:
    first = int(np.searchsorted(series.time, fault.start))
    lost = slice(first, first + fault.count)
    if fault.kind == "NaN":
        values = series.values.copy()
        values[lost] = np.nan
        return replace(series, values=values)
    if fault.kind == "repeated stamps":
        stamps = series.time.copy()
        stamps[lost] = stamps[max(first - 1, 0)]
        clean = clean_time(stamps)
        return replace(series, time=clean.time, values=series.values[clean.keep])
    keep = np.ones(len(series), dtype=bool)
    keep[lost] = False
    return replace(series, time=series.time[keep], values=series.values[keep])
