"""A log's time stamps -> strictly increasing times, for a whole log or piece by piece, and the findings on them.

A stray time stamp is far from its neighbours. If a clock jumps ahead for some rows and returns, only these rows are
dropped. Whether a row is stray depends on the rows before it and at most the next 100, not on the rest of the log.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import NAMED
from cdtool.recordings.clock.coarse_clock import fit_line
from cdtool.recordings.distribution import Distribution

# A step longer than this many periods is a gap.
GAP_PERIODS = 2.5
# Above this share of repeated time stamps, the clock is coarse and not faulty.
COARSE_SHARE = 0.2
# Widths [bits] of counters that may wrap within a log.
_COUNTER_BITS = (16, 32)
# A jump ahead spans at most this many rows; fewer at the edges of a log, where one side is unknown.
STRAY_ROWS, EDGE_ROWS = 50, 3
# A step of about 3 years [s] at an edge of a log is not a pause: the time stamps beyond it are from another clock. A
# clock that begins later than this counts from an epoch.
THREE_YEARS = 1e8
# The start of a log can be stray if this many time stamps in order follow it; logs below 8 rows are not checked.
_IN_ORDER, _SHORTEST = 3, 8
# Rows after which a mark is known, and rows that are kept for it.
_AHEAD, _BEHIND = 2 * STRAY_ROWS, 4 * STRAY_ROWS


@dataclass(frozen=True)
class CleanTime:
    """Strictly increasing times [s], which rows are kept, and the findings."""

    time: FloatArray
    keep: BoolArray
    findings: tuple[Finding, ...]


def clean_time(
    time: npt.ArrayLike, first_row: int = 0, *, counted: npt.ArrayLike | None = None, sampled: bool = True
) -> CleanTime:
    """Drop time stamps [s] that are missing, stray, repeated or run backward; regularise a coarse clock.

    Stray time stamps are defined by StrayStampMarker. A coarse clock (more than 20 % repeated time stamps) is replaced
    by a straight line that is fitted recursively to (index, stamp): coarse_clock.fit_line. Dropped rows are reported
    with their share; they are a loss if they are more than single stray rows.

    `first_row` is the line of the first sample in the file, for messages (0: unknown). `counted` (n,) are the time
    stamps as in the file, in which the wrap of a counter is recognised. `sampled` is False for the times of events,
    which are not on a line. Raises RecordingError if no time stamp is above the first.
    """
    stamps = np.asarray(time, dtype=np.float64)
    if _is_clean(stamps):  # the usual case
        return CleanTime(stamps.copy(), np.ones(len(stamps), dtype=bool), ())
    cleaner = ClockCleaner()
    _, rows = cleaner.classify(stamps, stamps if counted is None else np.asarray(counted, dtype=np.float64), final=True)
    index = rows.index[~rows.backward]
    rising = stamps[index]
    if sampled and len(rising) > 1 and rising[0] == rising[-1]:
        raise RecordingError(
            f"none of the {len(rows.index)} time stamps is above {rising[0]:g} s: the clock stands still",
            "name another clock in [channels] time, or the sample rate: time = { rate_hz = ... }",
        )
    if not (sampled and cleaner.is_coarse):
        keep = rows.kept(len(stamps))
        return CleanTime(stamps[keep], keep, tuple(cleaner.findings(first_row)))
    line, on_line = fit_line(rising)
    share = {"share": float(rows.repeated.mean()), "step_ms": 1e3 * _median_step(rising)}
    stuck = _RowCount("stuck_stamps")
    stuck.add(index[~on_line], 0)
    coarse = [Finding("coarse_clock", "time", share), *stuck.findings(len(stamps), first_row)]
    keep = np.zeros(len(stamps), dtype=bool)
    keep[index[on_line]] = True
    findings = (*cleaner.findings(first_row, with_repeated=False), *coarse)
    return CleanTime(np.ascontiguousarray(line[on_line]), keep, findings)


def _is_clean(stamps: FloatArray) -> bool:
    """Return whether all time stamps are finite and increase by steps too short to be stray: none is dropped."""
    if len(stamps) < 2:
        return False
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diff(stamps)
    return bool(steps.min() > 0.0 and steps.max() <= THREE_YEARS)  # False for a step that is NaN


@dataclass(frozen=True)
class _RowKinds:
    """The rows of a piece, by their `index`, that are neither missing nor stray, and which repeat or run backward."""

    index: npt.NDArray[np.intp]
    repeated: BoolArray
    backward: BoolArray

    def kept(self, count: int) -> BoolArray:
        """Return which of all rows of the piece are kept."""
        keep = np.zeros(count, dtype=bool)
        keep[self.index[~(self.backward | self.repeated)]] = True
        return keep


class ClockCleaner:
    """Cleans time stamps [s] piece by piece; drops those that are missing, stray, repeated or run backward.

    The last rows of a piece are returned with the next one, or with `final`, as later rows determine whether they are
    stray. A coarse clock, whose time stamps repeat, is not regularised as in clean_time, which passes a whole clock as
    one piece.
    """

    def __init__(self) -> None:
        self._rows, self._highest = 0, -np.inf
        self._unknown, self._stray = _RowCount("unknown_stamps"), _RowCount("stray_stamps")
        self._repeated, self._backward = _RowCount("repeated_stamps"), _RowCount("backward_stamps")
        self._restart, self._stray_marker = _RestartDetector(), StrayStampMarker()
        self._steps, self._last = Distribution(), np.empty(0)
        self._waiting = np.empty(0), np.empty(0)

    def times(self, stamps: FloatArray, counted: FloatArray, final: bool = False) -> FloatArray:
        """Return the times of the rows that are decided and kept; `counted` are the time stamps as in the file."""
        decided, rows = self.classify(stamps, counted, final)
        return decided[rows.kept(len(decided))]

    def classify(self, stamps: FloatArray, counted: FloatArray, final: bool = False) -> tuple[FloatArray, _RowKinds]:
        """Return the time stamps that are decided, and which of them are to be kept."""
        is_stray = self._stray_marker.add(stamps[np.isfinite(stamps)], final)
        stamps, counted = np.concatenate((self._waiting[0], stamps)), np.concatenate((self._waiting[1], counted))
        known = np.flatnonzero(np.isfinite(stamps))
        decided = len(stamps) if len(is_stray) == len(known) else int(known[len(is_stray)])
        # Copies, as a view would keep the whole piece in memory.
        self._waiting = stamps[decided:].copy(), counted[decided:].copy()
        stamps, counted, before = stamps[:decided], counted[:decided], self._rows
        self._rows += decided
        unknown = ~np.isfinite(stamps)
        self._unknown.add(np.flatnonzero(unknown), before)
        index = np.flatnonzero(~unknown)
        self._stray.add(index[is_stray], before)
        index = index[~is_stray]
        kept, raw = stamps[index], counted[index]
        highest = np.maximum.accumulate(np.concatenate(([self._highest], kept)))
        self._highest = float(highest[-1])
        rows = _RowKinds(index, kept == highest[:-1], kept < highest[:-1])
        self._backward.add(index[rows.backward], before)
        self._repeated.add(index[rows.repeated], before)
        steps = np.diff(np.concatenate((self._last, raw)))
        self._steps.add(steps[steps > 0.0])
        self._last = raw[-1:] if len(raw) else self._last
        self._restart.add(raw, rows.backward)
        return stamps, rows

    @property
    def is_coarse(self) -> bool:
        """True if so many time stamps repeat that the clock is coarse."""
        known = self._rows - self._unknown.count - self._stray.count
        return known > 0 and self._repeated.count / known > COARSE_SHARE

    def findings(self, first_row: int, with_repeated: bool = True) -> list[Finding]:
        """Return the findings on dropped rows; `first_row` is the file's line of the first sample (0: unknown)."""
        restart = self._restart.cause(self._steps.median if self._steps.count else 0.0)
        kinds = [(self._unknown, None), (self._stray, None), (self._backward, restart)]
        kinds += [(self._repeated, None)] if with_repeated else []
        return [finding for rows, cause in kinds for finding in rows.findings(self._rows, first_row, cause)]


def epoch_start(stamps: FloatArray, factor: float) -> float:
    """Return the first time stamp, in its own unit, if the clock counts from an epoch (3 years or more ago), else 0.

    `factor` converts to seconds. Subtract the result before scaling, so that no digit is lost. Stray time stamps are
    skipped.
    """
    if factor > 0.0 and np.fmax.reduce(stamps, initial=-np.inf) * factor <= THREE_YEARS:  # the usual case
        return 0.0
    finite = stamps[np.isfinite(stamps)]
    first = finite[count_leading_strays(finite, THREE_YEARS / factor) :][:1]
    return float(first[0]) if len(first) and first[0] * factor > THREE_YEARS else 0.0


def missing_findings(absent: int, values: int, channel: str, masked: int = 0) -> list[Finding]:
    """Return the finding on missing values: `absent` of `values`, less the `masked` ones, which have their own."""
    missing = absent - masked
    return [Finding("missing_values", channel, {"count": missing, "values": values})] if missing else []


class GapStatistics:
    """The gaps and the jitter of strictly increasing times [s] whose median step is `period` [s]."""

    def __init__(self, period: float, channel: str) -> None:
        self._period, self._channel = period, channel
        self._last, self._total, self._count = np.empty(0), 0, 0
        self._first: list[dict[str, Any]] = []
        self._regular, self._mean, self._squares = 0, 0.0, 0.0  # steps without gaps: count, mean, sum of squares

    def add(self, times: FloatArray) -> None:
        """Add the times of a piece."""
        self._total += len(times)
        time = np.concatenate((self._last, times))
        steps = np.diff(time)
        gaps = np.flatnonzero(steps > GAP_PERIODS * self._period)
        self._count += len(gaps)
        self._first += [{"time": float(time[i]), "length": float(steps[i])} for i in gaps[: NAMED - len(self._first)]]
        regular = steps[steps <= GAP_PERIODS * self._period]
        if len(regular):
            share = len(regular) / (self._regular + len(regular))
            shift = float(regular.mean()) - self._mean
            self._squares += float(regular.var()) * len(regular) + shift * shift * self._regular * share
            self._regular, self._mean = self._regular + len(regular), self._mean + shift * share
        self._last = time[-1:]

    def findings(self) -> list[Finding]:
        """Return the findings on gaps and jitter."""
        findings: list[Finding] = []
        if self._total <= 2:  # too few for a period
            return findings
        if self._count:
            findings.append(Finding("sample_gaps", self._channel, {"count": self._count, "first": tuple(self._first)}))
        jitter = float(np.sqrt(self._squares / self._regular)) / self._period if self._regular else 0.0
        if jitter > 0.1:  # of a period
            findings.append(Finding("jitter", self._channel, {"share": jitter, "period": self._period}))
        return findings


def gaps_in(times: Iterable[FloatArray], period: float, channel: str) -> list[Finding]:
    """Return the findings on gaps and jitter of a clock whose `times` [s] are given piece by piece."""
    gaps = GapStatistics(period, channel)
    for piece in times:
        gaps.add(piece)
    return gaps.findings()


def gaps_of(time: FloatArray, period: float, channel: str) -> list[Finding]:
    """Return `gaps_in` of a clock in memory, `time` (n,) [s]."""
    return [] if _is_regular(time, period) else gaps_in([time], period, channel)


def _is_regular(times: FloatArray, period: float) -> bool:
    """Return whether no step can be a gap, and the steps are too similar for jitter: it is at most half their range."""
    if len(times) < 2:
        return False
    steps = np.diff(times)
    least, most = float(steps.min()), float(steps.max())
    return most <= GAP_PERIODS * period and most - least <= 0.1 * period


class _RowCount:
    """The rows dropped for one reason, the `kind` of finding: their number, and the first ones."""

    def __init__(self, kind: str) -> None:
        self.kind, self.count = kind, 0
        self._first: list[int] = []

    def add(self, rows: npt.NDArray[np.intp], before: int) -> None:
        """Add rows of a piece; `before` is the number of rows before the piece."""
        self.count += len(rows)
        self._first += (rows[: NAMED - len(self._first)] + before).tolist()

    def findings(self, rows: int, first_row: int, restart: dict[str, Any] | None = None) -> list[Finding]:
        """Return the finding, given the total of `rows`: a loss if there is a cause, or if many rows are dropped."""
        if not self.count:
            return []
        first = tuple(row + first_row for row in self._first)
        numbers = {"count": self.count, "rows": rows, "first": first, "row_name": "line" if first_row else "sample"}
        if self.kind == "backward_stamps":
            numbers["restart"] = restart
        # Single rows in a log are no loss.
        is_loss = restart or self.kind == "stuck_stamps" or self.count / rows > 0.01
        return [Finding(self.kind, "time", numbers, "loss" if is_loss else "warning")]


class _RestartDetector:
    """Determines why many time stamps run backward: a counter wraps, or the clock restarts."""

    def __init__(self) -> None:
        self._last = np.empty(0)
        self._whole, self._largest = True, 0.0
        self._step_back: tuple[float, float] | None = None  # time stamps before and after the first one
        self._run = self._longest = 0  # consecutive rows that run backward: at present, at most

    def add(self, stamps: FloatArray, backward: BoolArray) -> None:
        """Add the finite time stamps of a piece as in the file, and which of them run backward."""
        known = np.concatenate((self._last, stamps))
        self._whole = self._whole and bool(np.all(stamps == np.floor(stamps)))
        self._largest = max(self._largest, float(np.max(np.abs(stamps), initial=0.0)))
        rows = np.flatnonzero(backward)
        if len(rows) and self._step_back is None:
            at = int(rows[0]) + len(self._last)
            self._step_back = float(known[at - 1]), float(known[at])
        edges = np.flatnonzero(np.diff(np.concatenate(([False], backward, [False])).astype(np.int8)))
        runs = (edges[1::2] - edges[::2]).tolist()
        if len(backward) and not backward[0]:
            self._run = 0
        if runs and edges[0] == 0:
            runs[0] += self._run
        self._longest = max(self._longest, *runs, 0)
        self._run = (runs[-1] if runs and edges[-1] == len(backward) else 0) if len(backward) else self._run
        self._last = known[-1:]

    def cause(self, usual_step: float) -> dict[str, Any] | None:
        """Return the cause; None for stray time stamps. `usual_step` is the median forward step, 0 if unknown."""
        if self._step_back is None:
            return None
        bits = wrapped_bits(*self._step_back, usual_step, self._largest) if self._whole else 0
        # Three consecutive rows that run backward: the clock restarted.
        return {"wrapped_bits": bits} if bits or self._longest >= 3 else None


def wrapped_bits(before: float, after: float, usual_step: float, largest: float) -> int:
    """Return the width of a counter of whole numbers, up to `largest`, that continues at zero; 0 if it restarts."""
    step = after - before
    return next((k for k in _COUNTER_BITS if largest < 2.0**k and 0.0 < step + 2.0**k <= GAP_PERIODS * usual_step), 0)


def _median_step(stamps: FloatArray) -> float:
    """Return the median of the forward steps; 0 if there are no forward steps."""
    steps = np.diff(stamps)
    forward = steps[steps > 0.0]
    return float(np.median(forward)) if len(forward) else 0.0


class StrayStampMarker:
    """Marks the stray time stamps of a clock piece by piece; the mark of a row is known 100 rows later.

    Stray rows are up to 50 rows between a time stamp g and the next one n >= g if all of them are above g by more than
    2.5 times both n - g and the shortest of the 9 steps before g, and at least as many rows with time stamps below them
    follow: dropping n and its successors instead would lose more rows. Up to 3 rows at the start of a log are stray if
    they are above the next ones, and up to 3 rows at either edge if they are 3 years off.
    """

    def __init__(self) -> None:
        self._stamps, self._stray = np.empty(0), np.empty(0, dtype=bool)
        self._next = 1  # the first row whose step has not been checked
        self._returned = self._total = 0  # buffered rows that were already returned, rows so far

    def add(self, stamps: FloatArray, final: bool = False) -> BoolArray:
        """Add the next finite time stamps [s]; return which of the rows decided now are stray, in their order."""
        starts = self._total < _SHORTEST
        self._stamps = np.concatenate((self._stamps, stamps))
        self._stray = np.concatenate((self._stray, np.zeros(len(stamps), dtype=bool)))
        self._total += len(stamps)
        count = len(self._stamps)
        if starts and (final or self._total >= _SHORTEST):
            leading = count_leading_strays(self._stamps, THREE_YEARS)
            self._stray[:leading] = True
            self._next = max(self._next, leading + 1)
        until = count if final else max(count - STRAY_ROWS, self._next)
        if starts and self._total < _SHORTEST and not final:
            until = self._next
        for row in (np.flatnonzero(np.diff(self._stamps[self._next - 1 : until]) < 0.0) + self._next).tolist():
            self._mark_before(row)
        self._next = max(self._next, until)
        if final and self._total >= _SHORTEST:
            rows = np.flatnonzero(~self._stray)[-EDGE_ROWS - 1 :]
            self._stray[rows[len(rows) - _count_trailing_strays(self._stamps[rows]) :]] = True
        return self._take_decided(count if final else max(count - _AHEAD, self._returned))

    def _take_decided(self, until: int) -> BoolArray:
        decided = self._stray[self._returned : until].copy()
        forget = max(0, until - _BEHIND)
        self._stamps, self._stray = self._stamps[forget:], self._stray[forget:]
        self._next, self._returned = max(self._next - forget, 1), until - forget
        return decided

    def _mark_before(self, step_back: int) -> None:
        """Mark the rows before the row `step_back` in which the clock had jumped ahead."""
        first = max(0, step_back - 2 * STRAY_ROWS)
        before = self._stamps[first:step_back].tolist()
        stray = self._stray[first:step_back].tolist()
        back = float(self._stamps[step_back])
        lowest, rows, i = np.inf, 0, len(before) - 1
        while i >= 0 and (stray[i] or before[i] > back):
            if not stray[i]:
                lowest, rows = min(lowest, before[i]), rows + 1
            i -= 1
        if i < 0 or not 0 < rows <= STRAY_ROWS:
            return
        shortest = _shortest_step([x for x, off in zip(before[: i + 1], stray[: i + 1], strict=True) if not off])
        if lowest - before[i] <= GAP_PERIODS * max(back - before[i], shortest):
            return
        after = self._stamps[step_back : step_back + rows]
        if len(after) == rows and bool(np.all(after < lowest)):
            self._stray[first + i + 1 : step_back] = True


def count_leading_strays(stamps: FloatArray, no_pause: float) -> int:
    """Return how many finite time stamps at the start of a log, up to 3, are stray.

    `no_pause` is a step, in the unit of the time stamps, that is too long for a pause.
    """
    begin = stamps[: 2 * EDGE_ROWS + _IN_ORDER]
    for rows in range(1, EDGE_ROWS + 1):
        following = begin[rows : rows + _IN_ORDER]
        if len(following) < _IN_ORDER or np.any(np.diff(following) < 0.0):
            continue
        if following[-1] < begin[:rows].min():
            return rows
        if len(stamps) < _SHORTEST:
            continue
        if following[0] - begin[:rows].max() > no_pause and following[-1] - following[0] < no_pause:
            return rows
    return 0


def _count_trailing_strays(stamps: FloatArray) -> int:
    """Return how many of the last time stamps are 3 years ahead of the one before them."""
    jumps = np.flatnonzero(np.diff(stamps) > THREE_YEARS)
    return len(stamps) - 1 - int(jumps[0]) if len(jumps) else 0


def _shortest_step(stamps: list[float]) -> float:
    """Return the shortest forward step among the last time stamps; 0 if there is no forward step."""
    last = stamps[-10:]  # the nine steps before a jump
    return min((b - a for a, b in pairwise(last) if b > a), default=0.0)
