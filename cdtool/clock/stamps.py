"""A log's time stamps -> strictly increasing times, and what is odd about them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.clock.coarse import line_through
from cdtool.clock.wild import EPOCH, WildStamps, leading_wild
from cdtool.errors import RecordingError
from cdtool.plain_text import counted
from cdtool.recording import BoolArray, Finding, FloatArray, Series

# A pause of more than this many periods between samples is a gap.
GAP_PERIODS = 2.5
# Above this share of repeated stamps the clock is coarse, not faulty.
_COARSE_SHARE = 0.2
# Stamps that are dropped are a loss above this share, and where so many consecutive ones run backward: the clock
# restarts.
_STRAY_SHARE, _RESTART_ROWS = 0.01, 3
# Counters are this wide, in bits, where they wrap within a log.
_COUNTERS = (16, 32)
# What is reported of wild stamps.
FAR_OFF = "lie far off those around them"


@dataclass(frozen=True)
class CleanTime:
    """Strictly increasing stamps [s], the rows kept, and what was found."""

    time: FloatArray
    keep: BoolArray
    findings: tuple[Finding, ...]


def clean_time(
    time: npt.ArrayLike,
    first_row: int = 0,
    row_name: str = "sample",
    *,
    counted: npt.ArrayLike | None = None,
    sampled: bool = True,
) -> CleanTime:
    """Drop stamps [s] that are missing, wild (wild.py), repeated or run backward; regularise a coarse clock.

    `first_row` is the number of the first sample in the file, for messages; `counted` (n,) are the stamps as the file
    has them, in which a counter's wrap shows. A coarse clock (more than 20 % repeated stamps) is replaced by the
    straight line through (index, stamp) fitted to the stamps so far, recursively: coarse.line_through. Without
    `sampled` the stamps are those of events, which lie on no line. Dropped rows are told with their share: as a loss
    where they are more than strays. Raises RecordingError where no stamp is above the first.
    """
    stamps = np.asarray(time, dtype=np.float64)
    told = _Told(len(stamps), first_row, row_name)
    finite = np.isfinite(stamps)
    told.dropped(np.flatnonzero(~finite), "are no number")
    index = np.flatnonzero(finite)
    if len(index) == 0:
        return CleanTime(np.empty(0), finite, tuple(told.findings))
    wild = WildStamps().add(stamps[index], final=True)
    told.dropped(index[wild], FAR_OFF)
    index = index[~wild]
    kept = stamps[index]
    highest = np.maximum.accumulate(kept)
    repeated = np.zeros(len(kept), dtype=bool)
    repeated[1:] = kept[1:] == highest[:-1]
    backward = np.zeros(len(kept), dtype=bool)
    backward[1:] = kept[1:] < highest[:-1]
    rising = kept[~backward]
    if sampled and len(rising) > 1 and rising[0] == rising[-1]:
        raise RecordingError(
            f"none of the {len(kept)} time stamps is above {kept[0]:g} s: the clock stands still",
            "name another clock in [channels] time, or the sample rate: time = { rate_hz = ... }",
        )
    raw = kept if counted is None else np.asarray(counted, dtype=np.float64)[index]
    told.dropped(index[backward], "run backward", _restart(raw, backward))
    if sampled and repeated.mean() > _COARSE_SHARE:
        index = index[~backward]
        line, on_line = line_through(rising)
        steps = np.diff(rising)
        step = 1e3 * float(np.median(steps[steps > 0.0]))
        text = f"{100.0 * repeated.mean():.0f} % of the time stamps repeat: a coarse clock of steps of {step:.3g} ms"
        told.findings.append(Finding(f"{text}, replaced by a causal straight line", "time"))
        told.dropped(index[~on_line], "stand still beyond a coarse clock's step", "; the clock was stuck")
        index, kept = index[on_line], line[on_line]
    else:
        told.dropped(index[repeated], "repeat")
        good = ~(repeated | backward)
        index, kept = index[good], kept[good]
    keep = np.zeros(len(stamps), dtype=bool)
    keep[index] = True
    return CleanTime(np.ascontiguousarray(kept), keep, tuple(told.findings))


def epoch_start(stamps: FloatArray, factor: float) -> float:
    """The first stamp, in its own unit, where the clock counts from an epoch (3 years or more), else 0.

    `factor` leads to seconds. To be taken off before scaling, so that no digit is lost; a wild stamp is not the first.
    """
    finite = stamps[np.isfinite(stamps)]
    first = finite[leading_wild(finite, EPOCH / factor) :][:1]
    return float(first[0]) if len(first) and first[0] * factor > EPOCH else 0.0


def gap_findings(series: Series, channel: str, masked: int = 0) -> list[Finding]:
    """Gaps and jitter of one channel's clock, and its missing values, of which `masked` are reported elsewhere."""
    found: list[Finding] = []
    if len(series) > 2:
        steps = np.diff(series.time)
        period = float(np.median(steps))
        gaps = np.flatnonzero(steps > GAP_PERIODS * period)
        if len(gaps):
            at = ", ".join(f"{series.time[i]:.3f} s ({steps[i] * 1e3:.0f} ms)" for i in gaps[:3])
            more = f" and {len(gaps) - 3} more" if len(gaps) > 3 else ""
            found.append(Finding(f"{counted(len(gaps), 'gap')} after {at}{more}", channel))
        regular = steps[steps <= GAP_PERIODS * period]
        jitter = float(np.std(regular)) / period
        if jitter > 0.1:
            found.append(
                Finding(
                    f"the sample period varies by {100 * jitter:.0f} % (std) about {period * 1e3:.3g} ms",
                    channel,
                )
            )
    absent = int(np.count_nonzero(~np.isfinite(series.values)))
    return found + missing_findings(absent, series.values.size, channel, masked)


def missing_findings(absent: int, values: int, channel: str, masked: int = 0) -> list[Finding]:
    """Of so many values those that are `absent`; what is `masked` among these has a finding of its own."""
    missing = absent - masked
    verb = "is" if missing == 1 else "are"
    return [Finding(f"{missing} of {counted(values, 'value')} {verb} missing (NaN)", channel)] if missing else []


class _Told:
    """What is said of the stamps of a clock of `count` rows."""

    def __init__(self, count: int, first_row: int, row_name: str) -> None:
        self.findings: list[Finding] = []
        self._count, self._first_row, self._name = count, first_row, row_name

    def dropped(self, rows: npt.NDArray[np.intp], what: str, why: str = "") -> None:
        """Count the rows that are dropped; with a reason `why` they are a loss, however few."""
        if not len(rows):
            return
        share = len(rows) / self._count
        shown = ", ".join(str(int(row) + self._first_row) for row in rows[:3])
        where = f"{self._name} {shown}{', ...' if len(rows) > 3 else ''}"
        text = f"{counted(len(rows), 'time stamp', what)} ({where}), dropped ({_percent(share)} % of the rows){why}"
        severity: Literal["warning", "loss"] = "loss" if why or share > _STRAY_SHARE else "warning"
        self.findings.append(Finding(text, "time", severity))


def _restart(stamps: FloatArray, backward: BoolArray) -> str:
    """Why the stamps run backward where that is no stray one: a counter wraps, or the clock starts again."""
    starts = np.flatnonzero(backward)
    if not len(starts):
        return ""
    i = int(starts[0])
    steps = np.diff(stamps)
    forward = steps[steps > 0.0]
    usual = float(np.median(forward)) if len(forward) else 0.0
    if np.all(stamps == np.floor(stamps)):
        for bits in _COUNTERS:
            wide = 2.0**bits
            if np.max(np.abs(stamps)) < wide and 0.0 < stamps[i] - stamps[i - 1] + wide <= GAP_PERIODS * usual:
                return (
                    f"; the counter of {bits} bits wraps there: log a wider one, "
                    f"or add {int(wide)} to the stamps from each wrap on"
                )
    run = np.convolve(backward, np.ones(_RESTART_ROWS), "valid") if len(backward) >= _RESTART_ROWS else np.empty(0)
    if np.any(run == _RESTART_ROWS):
        return "; the clock starts again there, or has jumped ahead before: cut the log there, or correct its stamps"
    return ""


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g}" if share < 0.1 else f"{100.0 * share:.0f}"
