"""Means of all channels over common windows: neither noise, nor encoder steps, nor sample rates matter to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.recordings.recording import Recording, Series

# Changes are taken over this number of windows.
_SPAN = 4


@dataclass(frozen=True)
class Windows:
    """Windows of all logs, one after another: their lengths (w,) [s], the log of each, and means (w, J) by channel.

    A window without a sample of a channel is NaN there.
    """

    length: FloatArray
    log: FloatArray
    means: dict[str, FloatArray]

    def changes(self, channel: str, *, integrated: bool = False) -> tuple[FloatArray, FloatArray]:
        """Return the change of a channel, or of its integral, over four windows (k, J), and its noise (J,)."""
        values = self.means[channel]
        bends = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
        known = [column[np.isfinite(column)] for column in bends.T]
        noise = np.array([np.median(column) if len(column) else np.inf for column in known])
        if integrated:
            steps = 0.5 * (values[1:] + values[:-1]) * self.length[1:, np.newaxis]
            changes = np.lib.stride_tricks.sliding_window_view(steps, _SPAN, axis=0).sum(axis=-1)
            noise = noise * float(np.median(self.length)) * _SPAN**0.5
        else:
            changes = values[_SPAN:] - values[:-_SPAN]
        return np.where((self.log[_SPAN:] == self.log[:-_SPAN])[:, np.newaxis], changes, np.nan), noise

    def rate(self, channel: str) -> FloatArray:
        """Return the derivative of a channel, (w, J); NaN in the first and last window of a log."""
        found = np.full_like(self.means[channel], np.nan)
        if len(found) > 2:
            found[1:-1] = (self.means[channel][2:] - self.means[channel][:-2]) / (2.0 * self.length[1:-1, np.newaxis])
            found[1:-1][self.log[2:] != self.log[:-2]] = np.nan
        return found


def windows_of(recordings: Sequence[Recording], channels: Sequence[str]) -> Windows | None:
    """Return the windows of the logs that have all the channels; None without one."""
    chosen = [[item[name] for name in channels] for item in recordings if all(name in item for name in channels)]
    parts = [part for series in chosen if (part := _windows(series)) is not None]
    if not parts:
        return None
    length = np.concatenate([np.full(len(means[0]), step) for step, means in parts])
    log = np.concatenate([np.full(len(means[0]), float(k)) for k, (_, means) in enumerate(parts)])
    return Windows(
        length, log, {name: np.concatenate([means[i] for _, means in parts]) for i, name in enumerate(channels)}
    )


def _windows(series: list[Series]) -> tuple[float, list[FloatArray]] | None:
    if min(map(len, series)) < 2:
        return None
    start, end = max(float(item.time[0]) for item in series), min(float(item.time[-1]) for item in series)
    # 0.05 s, or less in a log that is short, or whose clock has the wrong unit; five samples of the slowest channel; at
    # most 2000 windows.
    shortest = min(0.05, (end - start) / 40.0)
    step = max(shortest, 5.0 * max(item.period for item in series), (end - start) / 2000)
    if not step > 0.0:
        return None
    edges = np.arange(start, end, step)
    return (step, [_mean(item, edges) for item in series]) if len(edges) > 2 * _SPAN else None


def _mean(series: Series, edges: FloatArray) -> FloatArray:
    """Return the mean of the known samples between each two edges, (w, J)."""
    known = np.isfinite(series.values)
    values = series.values.copy()
    for j in range(series.joint_count if series.unit == "rad" else 0):  # an angle may be logged within one turn
        values[known[:, j], j] = np.unwrap(values[known[:, j], j])
    first = np.zeros((1, series.joint_count))
    sums = np.concatenate((first, np.cumsum(np.where(known, values, 0.0), axis=0)))
    counts = np.concatenate((first, np.cumsum(known, axis=0)))
    at = np.searchsorted(series.time, edges)
    with np.errstate(invalid="ignore", divide="ignore"):
        means: FloatArray = np.diff(sums[at], axis=0) / np.diff(counts[at], axis=0)
    return means
