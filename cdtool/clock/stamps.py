"""A log's time stamps -> strictly increasing times, and what is wrong with them.

Wild stamps lie far off those around them: a clock that leaps ahead for some rows and returns costs these rows, no
others. Which they are is decided by what comes before and by the next 100 rows at most, never by the rest of a log.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.clock.coarse import line_through
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
# A leap ahead spans at most so many rows; at the edges of a log, where one side is unknown, so many.
WILD_ROWS, EDGE_ROWS = 50, 3
# A step of 3 years [s] at an edge of a log is no pause: the stamps beyond it are of another clock.
EPOCH = 1e8
# A leap is longer than this many usual steps; these are looked for among so many rows before it.
_LEAP, _STEPS_BEFORE = 2.5, 9
# So many stamps in order show where a log that begins with wild ones really begins; shorter logs show nothing.
_IN_ORDER, _SHORTEST = 3, 8
_AHEAD, _BEHIND = 2 * WILD_ROWS, 4 * WILD_ROWS


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
    """Drop stamps [s] that are missing, wild (WildStamps), repeated or run backward; regularise a coarse clock.

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


class WildStamps:
    """Marks the wild stamps of a clock that comes piece by piece; those of a row are known 100 rows later.

    Wild are up to 50 rows between a stamp g and the next one n >= g that they all lie above, by more than 2.5 usual
    steps, where at least as many rows follow below them: then fewer rows are lost than by taking n to run backward.
    Wild are up to 3 rows at the start of a log that lie above the next ones, and at either edge those that lie 3 years
    off.
    """

    def __init__(self) -> None:
        self._stamps, self._wild = np.empty(0), np.empty(0, dtype=bool)
        self._next = 1  # the first row whose step has not been looked at
        self._given = self._total = 0  # rows held that are decided, rows so far

    def add(self, stamps: FloatArray, final: bool = False) -> BoolArray:
        """The next finite stamps [s]; returns which are wild of the rows that are decided now, in their order."""
        starts = self._total < _SHORTEST
        self._stamps = np.concatenate((self._stamps, stamps))
        self._wild = np.concatenate((self._wild, np.zeros(len(stamps), dtype=bool)))
        self._total += len(stamps)
        count = len(self._stamps)
        if starts and (final or self._total >= _SHORTEST):
            leading = leading_wild(self._stamps, EPOCH)
            self._wild[:leading] = True
            self._next = max(self._next, leading + 1)
        until = count if final else max(count - WILD_ROWS, self._next)
        if starts and self._total < _SHORTEST and not final:
            until = self._next
        for fall in (np.flatnonzero(np.diff(self._stamps[self._next - 1 : until]) < 0.0) + self._next).tolist():
            self._mark(fall)
        self._next = max(self._next, until)
        if final and self._total >= _SHORTEST:
            rows = np.flatnonzero(~self._wild)[-EDGE_ROWS - 1 :]
            self._wild[rows[len(rows) - _trailing_wild(self._stamps[rows]) :]] = True
        return self._decided(count if final else max(count - _AHEAD, self._given))

    def _decided(self, until: int) -> BoolArray:
        decided = self._wild[self._given : until].copy()
        forget = max(0, until - _BEHIND)
        self._stamps, self._wild = self._stamps[forget:], self._wild[forget:]
        self._next, self._given = max(self._next - forget, 1), until - forget
        return decided

    def _mark(self, fall: int) -> None:
        """Mark the rows before a step back that the clock had leapt ahead in."""
        first = max(0, fall - 2 * WILD_ROWS)
        before = self._stamps[first:fall].tolist()
        wild = self._wild[first:fall].tolist()
        back = float(self._stamps[fall])
        lowest, rows, i = np.inf, 0, len(before) - 1
        while i >= 0 and (wild[i] or before[i] > back):
            if not wild[i]:
                lowest, rows = min(lowest, before[i]), rows + 1
            i -= 1
        if i < 0 or not 0 < rows <= WILD_ROWS or first + i < 0:
            return
        usual = _usual_step([x for x, off in zip(before[: i + 1], wild[: i + 1], strict=True) if not off])
        if lowest - before[i] <= _LEAP * max(back - before[i], usual):
            return
        after = self._stamps[fall : fall + rows]
        if len(after) == rows and bool(np.all(after < lowest)):
            self._wild[first + i + 1 : fall] = True


def leading_wild(stamps: FloatArray, years: float) -> int:
    """How many finite stamps at the start of a log, up to 3, are wild; `years`: a step that is no pause."""
    begin = stamps[: 2 * EDGE_ROWS + _IN_ORDER]
    for rows in range(1, EDGE_ROWS + 1):
        then = begin[rows : rows + _IN_ORDER]
        if len(then) < _IN_ORDER or np.any(np.diff(then) < 0.0):
            continue
        if then[-1] < begin[:rows].min():
            return rows
        if len(stamps) >= _SHORTEST and then[0] - begin[:rows].max() > years and then[-1] - then[0] < years:
            return rows
    return 0


def _trailing_wild(stamps: FloatArray) -> int:
    """How many of the last stamps lie 3 years ahead of the one before them."""
    leaps = np.flatnonzero(np.diff(stamps) > EPOCH)
    return len(stamps) - 1 - int(leaps[0]) if len(leaps) else 0


def _usual_step(stamps: list[float]) -> float:
    """The shortest step ahead among the last stamps, 0 where there is none."""
    last = stamps[-_STEPS_BEFORE - 1 :]
    return min((b - a for a, b in pairwise(last) if b > a), default=0.0)
