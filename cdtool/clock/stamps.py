"""A log's time stamps -> strictly increasing times, whole or piece by piece, and what is wrong with them.

Wild stamps lie far off those around them: a clock that leaps ahead for some rows and returns costs these rows, no
others. Which they are is decided by what comes before and by the next 100 rows at most, never by the rest of a log.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from cdtool.clock.coarse_clock import line_through
from cdtool.distribution import Distribution
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.channels import MissingValues
from cdtool.findings.clocks import (
    BackwardStamps,
    ClockRestart,
    CoarseClock,
    DroppedStamps,
    Gap,
    Jitter,
    RepeatedStamps,
    SampleGaps,
    StrayStamps,
    StuckStamps,
    UnknownStamps,
)
from cdtool.recording import BoolArray, FloatArray, Series

# A pause of more than this many periods between samples is a gap.
GAP_PERIODS = 2.5
# Above this share of repeated stamps the clock is coarse, not faulty.
COARSE_SHARE = 0.2
# Stamps that are dropped are a loss above this share, and where so many consecutive ones run backward: the clock
# restarts.
_STRAY_SHARE, _RESTART_ROWS = 0.01, 3
# Counters are this wide, in bits, where they wrap within a log.
_COUNTERS = (16, 32)
# So many rows or gaps are named, the others counted.
_SHOWN = 3
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
    straight line through (index, stamp) fitted to the stamps so far, recursively: coarse_clock.line_through. Without
    `sampled` the stamps are those of events, which lie on no line. Dropped rows are reported with their share: as a
    loss where they are more than strays. Raises RecordingError where no stamp is above the first.
    """
    stamps = np.asarray(time, dtype=np.float64)
    known = np.isfinite(stamps)
    dropped = _DroppedRows()
    index, repeated, backward = dropped.sort_out(stamps, WildStamps().add(stamps[known], final=True))
    if not len(index):
        return CleanTime(np.empty(0), np.zeros(len(stamps), dtype=bool), tuple(dropped.findings(first_row, row_name)))
    kept = stamps[index]
    rising = kept[~backward]
    if sampled and len(rising) > 1 and rising[0] == rising[-1]:
        raise RecordingError(
            f"none of the {len(kept)} time stamps is above {kept[0]:g} s: the clock stands still",
            "name another clock in [channels] time, or the sample rate: time = { rate_hz = ... }",
        )
    restart = _Restart()
    raw = kept if counted is None else np.asarray(counted, dtype=np.float64)[index]
    if backward.any():
        restart.add(raw, backward)
    findings = dropped.findings(first_row, row_name, restart.found(lambda: _median_step(raw)))
    if sampled and dropped.is_coarse:
        index = index[~backward]
        line, on_line = line_through(rising)
        step = 1e3 * _median_step(rising)
        findings.append(Finding(CoarseClock(float(repeated.mean()), step), "time"))
        stuck = _Dropped(StuckStamps)
        stuck.add(index[~on_line], 0)
        findings += stuck.finding(len(stamps), first_row, row_name)
        index, kept = index[on_line], line[on_line]
    else:
        findings += dropped.repeated.finding(len(stamps), first_row, row_name)
        good = ~(repeated | backward)
        index, kept = index[good], kept[good]
    keep = np.zeros(len(stamps), dtype=bool)
    keep[index] = True
    return CleanTime(np.ascontiguousarray(kept), keep, tuple(findings))


class CleanPieces:
    """Stamps [s] -> strictly increasing times; what is missing, wild, repeated or runs backward is dropped.

    The last rows of a piece wait for the next one, or for `final`: whether they are wild shows behind them. Of a coarse
    clock, whose stamps repeat, clean_time makes a straight line: this says only that it `is_coarse`.
    """

    def __init__(self) -> None:
        self._dropped, self._restart = _DroppedRows(), _Restart()
        self._wild_stamps = WildStamps()
        self._steps, self._last = Distribution(), np.empty(0)
        self._waiting: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def times(self, stamps: FloatArray, counted: FloatArray, final: bool = False) -> FloatArray:
        """The times of those rows that are decided and kept; `counted` are the stamps as the file has them."""
        return self.rows(stamps, counted, np.empty((len(stamps), 0)), final)[0]

    def rows(
        self, stamps: FloatArray, counted: FloatArray, values: FloatArray, final: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """The times of those rows that are decided and kept, and their (n, J) values."""
        is_wild = self._wild_stamps.add(stamps[np.isfinite(stamps)], final)
        if self._waiting is not None:
            held = self._waiting
            stamps, counted = np.concatenate((held[0], stamps)), np.concatenate((held[1], counted))
            values = np.concatenate((held[2], values))
        known = np.flatnonzero(np.isfinite(stamps))
        decided = len(stamps) if len(is_wild) == len(known) else int(known[len(is_wild)])
        if final:
            self._waiting = None
        else:  # copies: a view would keep all of the piece
            self._waiting = stamps[decided:].copy(), counted[decided:].copy(), values[decided:].copy()
        stamps, values = stamps[:decided], values[:decided]
        keep = self._keep(stamps, counted[:decided], is_wild)
        return stamps[keep], values if keep.all() else values[keep]

    def _keep(self, stamps: FloatArray, counted: FloatArray, is_wild: BoolArray) -> BoolArray:
        """Which of the decided rows are kept; `is_wild` is of those with a stamp."""
        index, repeated, backward = self._dropped.sort_out(stamps, is_wild)
        raw = counted[index]
        steps = np.diff(np.concatenate((self._last, raw)))
        self._steps.add(steps[steps > 0.0])
        self._last = raw[-1:] if len(raw) else self._last
        self._restart.add(raw, backward)
        keep = np.zeros(len(stamps), dtype=bool)
        keep[index[~(backward | repeated)]] = True
        return keep

    @property
    def is_coarse(self) -> bool:
        """So many stamps repeat that clean_time would make a straight line of the clock."""
        return self._dropped.is_coarse

    def findings(self, first_row: int) -> list[Finding]:
        """What was dropped; `first_row` is the file's line of the first sample (0: not known)."""
        row_name = "line" if first_row else "sample"
        restart = self._restart.found(lambda: self._steps.median if self._steps.count else 0.0)
        found = self._dropped.findings(first_row, row_name, restart)
        return found + self._dropped.repeated.finding(self._dropped.rows, first_row, row_name)


def epoch_start(stamps: FloatArray, factor: float) -> float:
    """The first stamp, in its own unit, where the clock counts from an epoch (3 years or more), else 0.

    `factor` leads to seconds. To be taken off before scaling, so that no digit is lost; a wild stamp is not the first.
    """
    finite = stamps[np.isfinite(stamps)]
    first = finite[leading_wild(finite, EPOCH / factor) :][:1]
    return float(first[0]) if len(first) and first[0] * factor > EPOCH else 0.0


def gap_findings(series: Series, channel: str, masked: int = 0) -> list[Finding]:
    """Gaps and jitter of one channel's clock, and its missing values, of which `masked` are reported elsewhere."""
    absent = int(np.count_nonzero(~np.isfinite(series.values)))
    gaps = gaps_in([series.time], series.period, channel)
    return gaps + missing_findings(absent, series.values.size, channel, masked)


def missing_findings(absent: int, values: int, channel: str, masked: int = 0) -> list[Finding]:
    """Of so many values those that are `absent`; what is `masked` among these has a finding of its own."""
    missing = absent - masked
    return [Finding(MissingValues(missing, values), channel)] if missing else []


class Gaps:
    """Gaps and jitter of strictly increasing times [s] whose median step is `period` [s]."""

    def __init__(self, period: float, channel: str) -> None:
        self._period, self._channel = period, channel
        self._last, self._total, self._count = np.empty(0), 0, 0
        self._first: list[Gap] = []
        self._regular, self._mean, self._squares = 0, 0.0, 0.0  # steps that are no gaps, and their spread so far

    def add(self, times: FloatArray) -> None:
        """The times of a piece."""
        self._total += len(times)
        time = np.concatenate((self._last, times))
        steps = np.diff(time)
        gaps = np.flatnonzero(steps > GAP_PERIODS * self._period)
        self._count += len(gaps)
        self._first += [Gap(float(time[i]), float(steps[i])) for i in gaps[: _SHOWN - len(self._first)]]
        usual = steps[steps <= GAP_PERIODS * self._period]
        if len(usual):
            share = len(usual) / (self._regular + len(usual))
            off = float(usual.mean()) - self._mean
            self._squares += float(usual.var()) * len(usual) + off * off * self._regular * share
            self._regular, self._mean = self._regular + len(usual), self._mean + off * share
        self._last = time[-1:]

    def findings(self) -> list[Finding]:
        """What is odd about the steps."""
        found: list[Finding] = []
        if self._total <= 2:  # fewer stamps have no usual step
            return found
        if self._count:
            found.append(Finding(SampleGaps(self._count, tuple(self._first)), self._channel))
        jitter = float(np.sqrt(self._squares / self._regular)) / self._period if self._regular else 0.0
        if jitter > 0.1:
            found.append(Finding(Jitter(jitter, self._period), self._channel))
        return found


def gaps_in(times: Iterable[FloatArray], period: float, channel: str) -> list[Finding]:
    """Gaps and jitter of a clock whose times [s] come piece by piece."""
    gaps = Gaps(period, channel)
    for piece in times:
        gaps.add(piece)
    return gaps.findings()


class _Dropped:
    """Rows that were dropped for one reason, the `kind` of fact: how many, and which the first were."""

    def __init__(self, kind: type[DroppedStamps]) -> None:
        self.kind, self.count = kind, 0
        self._first: list[int] = []

    def add(self, rows: npt.NDArray[np.intp], before: int) -> None:
        """Some rows of a piece that begins behind `before` others."""
        self.count += len(rows)
        self._first += (rows[: _SHOWN - len(self._first)] + before).tolist()

    def finding(self, rows: int, first_row: int, row_name: str, restart: ClockRestart | None = None) -> list[Finding]:
        """Of `rows` in all those that were dropped: a loss where there is a cause, or where they are many."""
        if not self.count:
            return []
        known = self.count, rows, tuple(row + first_row for row in self._first), row_name
        fact = BackwardStamps(*known, restart) if restart else self.kind(*known)
        is_loss = bool(fact.cause) or self.count / rows > _STRAY_SHARE
        return [Finding(fact, "time", "loss" if is_loss else "warning")]


class _DroppedRows:
    """The rows of a clock that are dropped, by reason; `rows` have been looked at so far."""

    def __init__(self) -> None:
        self.rows = 0
        self.repeated = _Dropped(RepeatedStamps)
        self._unknown, self._wild = _Dropped(UnknownStamps), _Dropped(StrayStamps)
        self._backward = _Dropped(BackwardStamps)
        self._highest = -np.inf

    def sort_out(self, stamps: FloatArray, is_wild: BoolArray) -> tuple[npt.NDArray[np.intp], BoolArray, BoolArray]:
        """The rows of a piece that are neither missing nor wild, and which of them repeat, which run backward.

        `is_wild` is of those with a stamp.
        """
        known = np.isfinite(stamps)
        before, self.rows = self.rows, self.rows + len(stamps)
        self._unknown.add(np.flatnonzero(~known), before)
        index = np.flatnonzero(known)
        self._wild.add(index[is_wild], before)
        index = index[~is_wild]
        kept = stamps[index]
        highest = np.maximum.accumulate(np.concatenate(([self._highest], kept)))
        repeated, backward = kept == highest[:-1], kept < highest[:-1]
        self._highest = float(highest[-1])
        self._backward.add(index[backward], before)
        self.repeated.add(index[repeated], before)
        return index, repeated, backward

    @property
    def is_coarse(self) -> bool:
        """So many stamps repeat that the clock is coarse."""
        known = self.rows - self._unknown.count - self._wild.count
        return known > 0 and self.repeated.count / known > COARSE_SHARE

    def findings(self, first_row: int, row_name: str, restart: ClockRestart | None = None) -> list[Finding]:
        """What was dropped but repeated stamps, which a coarse clock keeps; `restart`: why stamps run backward."""
        kinds = ((self._unknown, None), (self._wild, None), (self._backward, restart))
        return [found for rows, why in kinds for found in rows.finding(self.rows, first_row, row_name, why)]


class _Restart:
    """Why stamps run backward where that is no stray one: a counter wraps, or the clock starts again."""

    def __init__(self) -> None:
        self._last = np.empty(0)
        self._whole, self._largest = True, 0.0
        self._fall: tuple[float, float] | None = None
        self._run = self._longest = 0  # of rows that run backward

    def add(self, stamps: FloatArray, backward: BoolArray) -> None:
        """The finite stamps of a piece as the file has them, and which of them run backward."""
        known = np.concatenate((self._last, stamps))
        self._whole = self._whole and bool(np.all(stamps == np.floor(stamps)))
        self._largest = max(self._largest, float(np.max(np.abs(stamps), initial=0.0)))
        falls = np.flatnonzero(backward)
        if len(falls) and self._fall is None:
            at = int(falls[0]) + len(self._last)
            self._fall = float(known[at - 1]), float(known[at])
        edges = np.flatnonzero(np.diff(np.concatenate(([False], backward, [False])).astype(np.int8)))
        runs = (edges[1::2] - edges[::2]).tolist()
        if len(backward) and not backward[0]:
            self._run = 0
        if runs and edges[0] == 0:
            runs[0] += self._run
        self._longest = max(self._longest, *runs, 0)
        self._run = (runs[-1] if runs and edges[-1] == len(backward) else 0) if len(backward) else self._run
        self._last = known[-1:]

    def found(self, usual_step: Callable[[], float]) -> ClockRestart | None:
        """None where there is no more to say; `usual_step` returns the median step forward, 0 where there is none."""
        if self._fall is None:
            return None
        for bits in _COUNTERS if self._whole else ():
            wide = 2.0**bits
            if self._largest < wide and 0.0 < self._fall[1] - self._fall[0] + wide <= GAP_PERIODS * usual_step():
                return ClockRestart(wrapped_bits=bits)
        return ClockRestart() if self._longest >= _RESTART_ROWS else None


def _median_step(stamps: FloatArray) -> float:
    """The median of the steps forward; 0 where there is none."""
    steps = np.diff(stamps)
    forward = steps[steps > 0.0]
    return float(np.median(forward)) if len(forward) else 0.0


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
