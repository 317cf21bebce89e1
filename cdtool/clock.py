"""Causal alignment of channels to a detector's clock, and what is odd about time stamps.

Nothing here looks at a later sample: a value at time t comes from samples at or before t.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, Finding, FloatArray, Series

# A held value older than this many of its own periods is missing, not valid.
HOLD_PERIODS = 5.0
# Its period is the median of this many steps before it: the rate so far, whatever comes later.
_RECENT_STEPS = 9
# A pause of more than this many periods between samples is a gap.
GAP_PERIODS = 2.5
# Above this share of repeated stamps the clock is coarse, not faulty.
_COARSE_SHARE = 0.2


@dataclass(frozen=True)
class CleanTime:
    """Strictly increasing stamps [s], the rows kept, and what was found."""

    time: FloatArray
    keep: BoolArray
    findings: tuple[Finding, ...]


def clean_time(time: npt.ArrayLike, first_row: int = 0, row_name: str = "sample") -> CleanTime:
    """Drop stamps that are missing, repeated or run backward; regularise a clock that is coarser than the samples.

    `first_row` is the number of the first sample in the file, for messages. A coarse clock (more than 20 % repeated
    stamps) is replaced by the straight line through (index, stamp) fitted to the samples so far, recursively.
    """
    stamps = np.asarray(time, dtype=np.float64)
    findings: list[Finding] = []
    finite = np.isfinite(stamps)
    if not finite.all():
        rows = np.flatnonzero(~finite)
        findings.append(
            Finding(f"{len(rows)} time stamps are no number{_rows(rows, first_row, row_name)}: dropped", "time")
        )
    index = np.flatnonzero(finite)
    if len(index) == 0:
        return CleanTime(np.empty(0), finite, tuple(findings))
    kept = stamps[index]
    highest = np.maximum.accumulate(kept)
    repeated = np.zeros(len(kept), dtype=bool)
    repeated[1:] = kept[1:] == highest[:-1]
    backward = np.zeros(len(kept), dtype=bool)
    backward[1:] = kept[1:] < highest[:-1]
    if backward.any():
        rows = index[backward]
        findings.append(
            Finding(f"{len(rows)} time stamps run backward{_rows(rows, first_row, row_name)}: dropped", "time")
        )
    if repeated.mean() > _COARSE_SHARE:
        forward = ~backward
        index = index[forward]
        line = _straight_line_so_far(kept[forward])
        fresh = np.concatenate(([True], line[1:] > np.maximum.accumulate(line)[:-1]))
        share = 100.0 * repeated.mean()
        findings.append(
            Finding(
                f"{share:.0f} % of the time stamps repeat: a coarse clock, replaced by a causal straight line",
                "time",
            )
        )
        index, kept = index[fresh], line[fresh]
    else:
        if repeated.any():
            rows = index[repeated]
            findings.append(
                Finding(f"{len(rows)} time stamps repeat{_rows(rows, first_row, row_name)}: dropped", "time")
            )
        good = ~(repeated | backward)
        index, kept = index[good], kept[good]
    keep = np.zeros(len(stamps), dtype=bool)
    keep[index] = True
    return CleanTime(np.ascontiguousarray(kept), keep, tuple(findings))


def gap_findings(series: Series, channel: str) -> list[Finding]:
    """Gaps and jitter of one channel's clock, and its missing values, all at once."""
    found: list[Finding] = []
    if len(series) > 2:
        steps = np.diff(series.time)
        period = float(np.median(steps))
        gaps = np.flatnonzero(steps > GAP_PERIODS * period)
        if len(gaps):
            at = ", ".join(f"{series.time[i]:.3f} s ({steps[i] * 1e3:.0f} ms)" for i in gaps[:3])
            more = f" and {len(gaps) - 3} more" if len(gaps) > 3 else ""
            found.append(Finding(f"{len(gaps)} gaps after {at}{more}", channel))
        regular = steps[steps <= GAP_PERIODS * period]
        jitter = float(np.std(regular)) / period
        if jitter > 0.1:
            found.append(
                Finding(
                    f"the sample period varies by {100 * jitter:.0f} % (std) about {period * 1e3:.3g} ms",
                    channel,
                )
            )
    missing = int(np.count_nonzero(~np.isfinite(series.values)))
    if missing:
        found.append(Finding(f"{missing} of {series.values.size} values are missing (NaN)", channel))
    return found


def previous_value(series: Series, clock: FloatArray) -> FloatArray:
    """(m, J): at each time of `clock` [s] the last sample at or before it; NaN where there is none or it is too old."""
    if series.time is clock or (len(series.time) == len(clock) and np.array_equal(series.time, clock)):
        return series.values
    at = np.searchsorted(series.time, clock, side="right") - 1
    held = series.values[np.maximum(at, 0)]
    age = clock - series.time[np.maximum(at, 0)]
    oldest = HOLD_PERIODS * _recent_period(series.time)[np.maximum(at, 0)]
    return np.where(((at < 0) | (age > oldest))[:, np.newaxis], np.nan, held)


def _recent_period(time: FloatArray) -> FloatArray:
    """At each sample the median of its last steps [s]; infinite at the first, which has none."""
    period = np.full(len(time), np.inf)
    if len(time) > 1:
        steps = np.diff(time)
        before = np.concatenate((np.full(_RECENT_STEPS - 1, steps[0]), steps))
        period[1:] = np.median(np.lib.stride_tricks.sliding_window_view(before, _RECENT_STEPS), axis=1)
    return period


def differentiate(series: Series, low_pass_hz: float, unit: str) -> Series:
    """Causal derivative of a position: backward difference, then two first-order low-passes at `low_pass_hz`.

    A missing sample is skipped: the difference runs over the longer step. The first sample is NaN.
    """
    rates = np.full(series.values.shape, np.nan)
    for joint in range(series.joint_count):
        # Copies: a Series is read-only, and the kernel's signature is of arrays that are not.
        column = series.values[:, joint].copy()
        _differentiate(series.time, column, 2.0 * np.pi * low_pass_hz, rates[:, joint])
    return Series(series.time, rates, unit)


def integrate(series: Series, unit: str) -> Series:
    """Causal integral of a speed from 0 (trapezoid); over a missing sample the last speed is held."""
    speed = np.where(np.isfinite(series.values), series.values, np.nan)
    filled = _hold_last(speed)
    steps = np.diff(series.time)[:, np.newaxis] * 0.5 * (filled[1:] + filled[:-1])
    travel = np.vstack((np.zeros((1, series.joint_count)), np.cumsum(steps, axis=0)))
    return Series(series.time, travel, unit)


def _hold_last(values: FloatArray) -> FloatArray:
    rows = np.where(np.isfinite(values), np.arange(len(values))[:, np.newaxis], 0)
    last = np.maximum.accumulate(rows, axis=0)
    held: FloatArray = np.take_along_axis(values, last, axis=0)
    return np.nan_to_num(held, nan=0.0)


def _straight_line_so_far(stamps: FloatArray) -> FloatArray:
    """At each sample the value there of the least-squares line through the samples so far."""
    n = np.arange(1, len(stamps) + 1, dtype=np.float64)
    k = n - 1.0
    t = stamps - stamps[0]
    sum_k, sum_t = np.cumsum(k), np.cumsum(t)
    variance = np.cumsum(k * k) - sum_k * sum_k / n
    covariance = np.cumsum(k * t) - sum_k * sum_t / n
    slope = np.divide(covariance, variance, out=np.zeros_like(t), where=variance > 0.0)
    line: FloatArray = stamps[0] + sum_t / n + slope * (k - sum_k / n)
    return line


def _rows(rows: npt.NDArray[np.intp], first_row: int, name: str) -> str:
    shown = ", ".join(str(int(row) + first_row) for row in rows[:3])
    return f" ({name} {shown}{', ...' if len(rows) > 3 else ''})"


@kernel(f"void({READ_ONLY}, {READ_ONLY}, float64, float64[:])")
def _differentiate(time: FloatArray, position: FloatArray, cutoff: float, out: FloatArray) -> None:
    last = -1
    first_stage = 0.0
    second_stage = 0.0
    started = False
    for k in range(len(time)):
        if not np.isfinite(position[k]):
            continue
        if last >= 0:
            step = time[k] - time[last]
            rate = (position[k] - position[last]) / step
            if started:
                weight = 1.0 - np.exp(-cutoff * step)
                first_stage += weight * (rate - first_stage)
                second_stage += weight * (first_stage - second_stage)
            else:
                first_stage = rate
                second_stage = rate
                started = True
            out[k] = second_stage
        last = k
