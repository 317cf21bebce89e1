"""Running a causal filter over the samples that can be judged, and restarting it where they break off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from cdtool.detection import Signal, Status
from cdtool.recording import BoolArray, FloatArray

# (values, steps) -> output, all (m,); step: time since the sample before [s], infinite where a stretch begins.
ColumnFilter = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Stretches:
    """The samples of one column that a filter takes: where they are, the step before each, time since its start [s].

    The step is infinite where the filter restarts.
    """

    index: npt.NDArray[np.intp]
    step: FloatArray
    elapsed: FloatArray


def stretch_bounds(step: FloatArray) -> list[tuple[int, int]]:
    """First and one past the last sample of each stretch: it begins where the step is infinite."""
    return list(pairwise([*np.flatnonzero(np.isinf(step)).tolist(), len(step)]))


def stretches(time: FloatArray, usable: BoolArray, broken: BoolArray, longest_gap: float) -> Stretches:
    """The usable samples (n,) of one column; it restarts behind a broken one, or a gap above `longest_gap` [s]."""
    index = np.flatnonzero(usable)
    at = time[index]
    breaks = np.cumsum(broken)[index]
    step = np.full(len(index), np.inf)
    step[1:] = np.diff(at)
    step[1:][(np.diff(breaks) > 0) | (step[1:] > longest_gap)] = np.inf
    fresh = np.isinf(step)
    begun = at[np.maximum.accumulate(np.where(fresh, np.arange(len(index)), 0))] if len(index) else at
    return Stretches(index, step, at - begun)


def filtered(signal: Signal, column_filter: ColumnFilter, longest_gap: float, start_up: float, unit: str) -> Signal:
    """The signal through a causal filter, column by column.

    A missing sample is skipped: the next step is longer. Behind a gap above `longest_gap` [s], and behind samples that
    do not apply, are start-up or have no limit, the filter restarts; its first `start_up` [s] are START_UP. NaN
    where the signal is not valid.
    """
    values: FloatArray = np.full(signal.values.shape, np.nan)
    status = signal.status.copy()
    for j in range(values.shape[1]):
        usable = (signal.status[:, j] == Status.VALID) & np.isfinite(signal.values[:, j])
        status[(signal.status[:, j] == Status.VALID) & ~usable, j] = Status.GAP
        broken = (status[:, j] != Status.VALID) & (status[:, j] != Status.GAP)
        part = stretches(signal.time, usable, broken, longest_gap)
        values[part.index, j] = column_filter(np.ascontiguousarray(signal.values[part.index, j]), part.step)
        status[part.index[part.elapsed < start_up], j] = Status.START_UP
    return replace(signal, values=values, status=status, unit=unit)
