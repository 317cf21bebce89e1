"""Where the runs of a log begin and end: by ids or labels in a column, or where its clock starts again."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.plain_text import plain, shorten
from cdtool.recordings.clock.stamps import StrayStampMarker, wrapped_bits

# The clock starts again if so many consecutive time stamps are below the highest one; fewer are single stray rows.
_RESTART_ROWS = 3
_SLASHES = re.compile(r"[/\\]+")

Rows = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Segments:
    """The runs of a log in order: `start` (r,) and `stop` (r,) are the first row of each and the row after its last.

    `ids` (r,) are values of a column, `words` the texts that some of them stand for; `number` (r,) counts the earlier
    runs with the same id.
    """

    start: Rows
    stop: Rows
    ids: FloatArray
    number: Rows
    words: Mapping[float, str]

    def __len__(self) -> int:
        return len(self.start)

    def names(self, which: Rows) -> list[str]:
        """Return the names of some runs: the id, with a number after it if earlier runs have it, too."""
        names: list[str] = []
        known: set[str] = set()
        for value, number in zip(self.ids[which].tolist(), self.number[which].tolist(), strict=True):
            base = id_text(value, self.words)
            name = base if not number else f"{base}/{number + 1}"
            while name in known:
                number += 1
                name = f"{base}/{number + 1}"
            known.add(name)
            names.append(name)
        return names


def id_text(value: float, words: Mapping[float, str]) -> str:
    """Return an id as text: its words, or its number with as many digits as it needs.

    A name that contains the text is treated like a path, so that slashes are replaced.

    >>> id_text(3.0, {}), id_text(0.1, {}), id_text(-1.0, {-1.0: "run_A"}), id_text(-1.0, {-1.0: "push/hard"})
    ('3', '0.1', 'run_A', 'push_hard')
    """
    if value in words:
        return shorten(plain(_SLASHES.sub("_", words[value].strip())), 60)  # the length of a name
    short = f"{value:.15g}"
    return short if float(short) == value else f"{value:.17g}"


def segments_by_id(ids: FloatArray, words: Mapping[float, str], bridged: bool) -> Segments:
    """Return the runs of consecutive samples with the same id.

    Parameters
    ----------
    ids : ndarray (n,)
        The id of each sample; NaN without one.
    words : mapping of float to str
        The texts that some of the ids stand for.
    bridged : bool
        Samples without an id between two of the same id belong to their run; else they end it.

    Returns
    -------
    Segments
        The runs.
    """
    known = np.flatnonzero(~np.isnan(ids))
    if not len(known):
        nothing = np.empty(0, dtype=np.intp)
        return Segments(nothing, nothing, np.empty(0), nothing, words)
    values = ids[known]
    changes: BoolArray = values[1:] != values[:-1]
    if not bridged:
        changes |= np.diff(known) > 1
    first = np.concatenate(([0], np.flatnonzero(changes) + 1))
    last = np.concatenate((first[1:], [len(known)])) - 1
    of_runs = values[first]
    return Segments(known[first], known[last] + 1, of_runs, _occurrences(of_runs), words)


def segments_by_reset(stamps: FloatArray) -> Segments:
    """Return the runs of a clock that starts again, numbered from 1.

    Parameters
    ----------
    stamps : ndarray (n,)
        Time stamps in the order of the file; NaN where one is missing.

    Returns
    -------
    Segments
        The runs; together they have all rows.
    """
    start = np.array([0, *_resets(stamps)], dtype=np.intp)
    stop = np.concatenate((start[1:], [len(stamps)]))
    return Segments(start, stop, np.arange(1.0, len(start) + 1.0), np.zeros(len(start), dtype=np.intp), {})


def _resets(stamps: FloatArray) -> list[int]:
    """Return the rows in which the clock starts again."""
    known = np.flatnonzero(np.isfinite(stamps))
    known = known[~StrayStampMarker().add(stamps[known], final=True)]
    x = stamps[known]
    steps = np.diff(x)
    rising = steps[steps > 0.0]
    usual = float(np.median(rising)) if len(rising) else 0.0
    whole = bool(np.all(x == np.floor(x)))
    resets: list[int] = []
    begin, last, highest = 0, 0, -np.inf
    for k in (np.flatnonzero(steps < 0.0) + 1).tolist():
        highest = max(highest, float(x[last:k].max()))
        last = k
        following = x[k : k + _RESTART_ROWS]
        if len(following) < _RESTART_ROWS or float(following.max()) >= highest:
            continue
        # A clock that starts again returns to the first half of the run before it; a smaller step back is rows out of
        # order.
        if float(x[k]) > float(x[begin]) + 0.5 * (highest - float(x[begin])):
            continue
        if whole and wrapped_bits(float(x[k - 1]), float(x[k]), usual, float(x[k - 1])):
            continue
        resets.append(int(known[k]))
        begin, highest = k, -np.inf
    return resets


def _occurrences(ids: FloatArray) -> Rows:
    """Return for each id how many equal ones are before it (r,)."""
    before: Counter[float] = Counter()
    number = np.empty(len(ids), dtype=np.intp)
    for i, each in enumerate(ids.tolist()):
        number[i] = before[each]
        before[each] += 1
    return number
