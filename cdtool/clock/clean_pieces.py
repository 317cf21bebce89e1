"""clock.clean_time and clock.gap_findings of a clock that comes piece by piece: the same times, the same findings."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from cdtool.clock import GAP_PERIODS
from cdtool.clock.stamps import FAR_OFF, WildStamps
from cdtool.distribution import Distribution
from cdtool.plain_text import counted
from cdtool.recording import BoolArray, Finding, FloatArray

_SHOWN = 3
# As in clock/stamps.py; a test holds the two alike.
_STRAY_SHARE, _RESTART_ROWS, _COARSE_SHARE = 0.01, 3, 0.2
_COUNTERS = (16, 32)


class _Dropped:
    """Rows that were dropped: how many, and which the first were."""

    def __init__(self, what: str) -> None:
        self.what, self.count = what, 0
        self._first: list[int] = []

    def add(self, rows: npt.NDArray[np.intp], before: int) -> None:
        """Some rows of a piece that begins behind `before` others."""
        self.count += len(rows)
        self._first += (rows[: _SHOWN - len(self._first)] + before).tolist()

    def finding(self, rows: int, first_row: int, why: str) -> Finding:
        """They are a loss where there is a reason, or where they are more than strays."""
        name, share = "line" if first_row else "sample", self.count / rows
        shown = ", ".join(str(row + first_row) for row in self._first)
        where = f"{name} {shown}{', ...' if self.count > _SHOWN else ''}"
        stamps = counted(self.count, "time stamp", self.what)
        text = f"{stamps} ({where}), dropped ({100.0 * share:.2g} % of the rows){why}"
        return Finding(text, "time", "loss" if why or share > _STRAY_SHARE else "warning")


class _Restart:
    """Why stamps run backward where that is no stray one: a counter wraps, or the clock starts again."""

    def __init__(self) -> None:
        self._steps = Distribution()
        self._last = np.empty(0)
        self._whole, self._largest = True, 0.0
        self._fall: tuple[float, float] | None = None
        self._run = self._longest = 0  # of rows that run backward

    def add(self, stamps: FloatArray, backward: BoolArray) -> None:
        """The finite stamps of a piece as the file has them, and which of them run backward."""
        known = np.concatenate((self._last, stamps))
        steps = np.diff(known)
        self._steps.add(steps[steps > 0.0])
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

    def why(self) -> str:
        """Empty where there is no more to say."""
        if self._fall is None:
            return ""
        usual = self._steps.median if self._steps.count else 0.0
        for bits in _COUNTERS if self._whole else ():
            wide = 2.0**bits
            if self._largest < wide and 0.0 < self._fall[1] - self._fall[0] + wide <= GAP_PERIODS * usual:
                return (
                    f"; the counter of {bits} bits wraps there: log a wider one, "
                    f"or add {int(wide)} to the stamps from each wrap on"
                )
        if self._longest >= _RESTART_ROWS:
            return (
                "; the clock starts again there, or has jumped ahead before: cut the log there, or correct its stamps"
            )
        return ""


class CleanPieces:
    """Stamps [s] -> strictly increasing times; what is missing, wild, repeated or runs backward is dropped.

    The last rows of a piece wait for the next one, or for `final`: whether they are wild shows behind them. Of a coarse
    clock, whose stamps repeat, clean_time makes a straight line: this says only that it `is_coarse`.
    """

    def __init__(self) -> None:
        self._unknown, self._repeated = _Dropped("are no number"), _Dropped("repeat")
        self._wild, self._wild_stamps = _Dropped(FAR_OFF), WildStamps()
        self._backward, self._restart = _Dropped("run backward"), _Restart()
        self._highest = -np.inf
        self._rows = 0
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
        keep: BoolArray = np.isfinite(stamps)
        before, self._rows = self._rows, self._rows + len(stamps)
        self._unknown.add(np.flatnonzero(~keep), before)
        index = np.flatnonzero(keep)
        self._wild.add(index[is_wild], before)
        keep[index[is_wild]] = False
        index = index[~is_wild]
        kept = stamps[index]
        highest = np.maximum.accumulate(np.concatenate(([self._highest], kept)))
        repeated, backward = kept == highest[:-1], kept < highest[:-1]
        self._highest = float(highest[-1])
        self._backward.add(index[backward], before)
        self._repeated.add(index[repeated], before)
        self._restart.add(counted[index], backward)
        keep[index[backward | repeated]] = False
        return keep

    @property
    def is_coarse(self) -> bool:
        """So many stamps repeat that clean_time would make a straight line of the clock."""
        known = self._rows - self._unknown.count - self._wild.count
        return known > 0 and self._repeated.count / known > _COARSE_SHARE

    def findings(self, first_row: int) -> list[Finding]:
        """What was dropped; `first_row` is the file's line of the first sample (0: not known)."""
        kinds = ((self._unknown, ""), (self._wild, ""), (self._backward, self._restart.why()), (self._repeated, ""))
        return [rows.finding(self._rows, first_row, why) for rows, why in kinds if rows.count]


class Gaps:
    """Gaps and jitter of strictly increasing times [s] whose median step is `period` [s]."""

    def __init__(self, period: float, channel: str) -> None:
        self._period, self._channel = period, channel
        self._last, self._total, self._count = np.empty(0), 0, 0
        self._shown: list[str] = []
        self._regular, self._mean, self._squares = 0, 0.0, 0.0  # steps that are no gaps, and their spread so far

    def add(self, times: FloatArray) -> None:
        """The times of a piece."""
        self._total += len(times)
        time = np.concatenate((self._last, times))
        steps = np.diff(time)
        gaps = np.flatnonzero(steps > GAP_PERIODS * self._period)
        self._count += len(gaps)
        self._shown += [f"{time[i]:.3f} s ({steps[i] * 1e3:.0f} ms)" for i in gaps[: _SHOWN - len(self._shown)]]
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
            more = f" and {self._count - _SHOWN} more" if self._count > _SHOWN else ""
            found.append(Finding(f"{counted(self._count, 'gap')} after {', '.join(self._shown)}{more}", self._channel))
        jitter = float(np.sqrt(self._squares / self._regular)) / self._period if self._regular else 0.0
        if jitter > 0.1:
            text = f"the sample period varies by {100 * jitter:.0f} % (std) about {self._period * 1e3:.3g} ms"
            found.append(Finding(text, self._channel))
        return found


def gaps_in(times: Iterable[FloatArray], period: float, channel: str) -> list[Finding]:
    """Gaps and jitter of a clock whose times [s] come piece by piece."""
    gaps = Gaps(period, channel)
    for piece in times:
        gaps.add(piece)
    return gaps.findings()
