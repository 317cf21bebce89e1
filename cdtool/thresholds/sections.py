"""Run a causal filter over the valid samples of a signal, and restart it after each interruption."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.detectors.detection import Signal, Status

# (values, steps) -> output, all (m,); step: time since the previous sample [s], infinite where a section begins.
ColumnFilter = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Sections:
    """The samples of one column that a filter uses: index, step before each, time since the start of their section [s].

    The step is infinite where the filter restarts.
    """

    index: npt.NDArray[np.intp]
    step: FloatArray
    elapsed: FloatArray


def section_bounds(step: FloatArray) -> list[tuple[int, int]]:
    """Return the first and one past the last sample of each section: it begins where the step is infinite."""
    return list(pairwise([*np.flatnonzero(np.isinf(step)).tolist(), len(step)]))


def sections(time: FloatArray, usable: BoolArray, broken: BoolArray, longest_gap: float) -> Sections:
    """Return the usable samples (n,) of one column; a section ends at a broken one or a gap above `longest_gap` [s]."""
    index = np.flatnonzero(usable)
    at = time[index]
    breaks = np.cumsum(broken)[index]
    step = np.full(len(index), np.inf)
    step[1:] = np.diff(at)
    step[1:][(np.diff(breaks) > 0) | (step[1:] > longest_gap)] = np.inf
    fresh = np.isinf(step)
    begun = at[np.maximum.accumulate(np.where(fresh, np.arange(len(index)), 0))] if len(index) else at
    return Sections(index, step, at - begun)


def filtered(signal: Signal, column_filter: ColumnFilter, longest_gap: float, start_up: float, unit: str) -> Signal:
    """Filter the signal with a causal filter, column by column.

    A missing sample is skipped: the next step is longer. After a gap above `longest_gap` [s], and after samples that
    are not applicable, start-up or without limit, the filter restarts; its first `start_up` [s] are START_UP. NaN
    where the signal is not valid.
    """
    values: FloatArray = np.full(signal.values.shape, np.nan)
    status = signal.status.copy()
    for j in range(values.shape[1]):
        usable = (signal.status[:, j] == Status.VALID) & np.isfinite(signal.values[:, j])
        status[(signal.status[:, j] == Status.VALID) & ~usable, j] = Status.GAP
        broken = (status[:, j] != Status.VALID) & (status[:, j] != Status.GAP)
        part = sections(signal.time, usable, broken, longest_gap)
        values[part.index, j] = column_filter(np.ascontiguousarray(signal.values[part.index, j]), part.step)
        status[part.index[part.elapsed < start_up], j] = Status.START_UP
    return replace(signal, values=values, status=status, unit=unit)
