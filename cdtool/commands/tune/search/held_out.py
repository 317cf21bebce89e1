"""What choices give on recordings that neither chose them nor set their limits, and what that says about the limit.

A limit that was set on the runs that also chose is too low: of many candidates, those are fast whose limit happened to
be low on just these runs. How much too low is seen on the runs of each fold: they influenced neither choice nor limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.results.curves.false_alarm_budget import Budget

# The multiples of a limit for which latencies are known: up to four times, in steps of 3 %.
MULTIPLIERS: FloatArray = 1.03 ** np.arange(48.0)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """What a choice gives on a fold that neither chose it nor set its limit.

    `contacts` (c,) are numbers of contacts; `latency` [s] and `force` [N] (m, c) for each multiple of the limit, NaN if
    missed; `assessable` (c,). `ratios` (r,): the critical factor of each impact-free operation over the limit, above 1
    for one that alarms; `seconds`: how long these were monitored.
    """

    contacts: npt.NDArray[np.int64]
    latency: FloatArray
    force: FloatArray
    assessable: BoolArray
    ratios: FloatArray
    seconds: float
    reason: str = ""

    @classmethod
    def unusable(cls, reason: str) -> HeldOut:
        """Return that of a choice that cannot be used without the fold."""
        nothing = np.empty((len(MULTIPLIERS), 0))
        return cls(np.empty(0, dtype=np.int64), nothing, nothing, np.empty(0, dtype=bool), np.empty(0), 0.0, reason)


def correction(budget: Budget, folds: Sequence[HeldOut]) -> int:
    """Return the number of the multiple of the limit that meets the budget on the runs of these folds; 0: it is met.

    The ratios are exchangeable with those of other runs, as critical factors are: see `Budget.allowed`. The limit is
    never reduced.
    """
    ratios = np.sort(np.concatenate([item.ratios for item in folds]))[::-1]
    if not len(ratios):
        return 0
    exposure = len(ratios) if budget.per == "operation" else sum(item.seconds for item in folds) / 3600.0
    allowed = min(max(budget.allowed(float(exposure)), 0), len(ratios) - 1)
    needed = int(np.searchsorted(MULTIPLIERS, ratios[allowed] * (1.0 + 1e-9)))
    return min(needed, len(MULTIPLIERS) - 1)


@dataclass(frozen=True, eq=False)
class Pooled:
    """The folds together: `latency` [s], `force` [N] and `assessable` of all contacts (C,), alarming and free runs.

    Each fold has the limit that the runs of the other folds correct; `multiplier` is the correction of all of them.
    """

    latency: FloatArray
    force: FloatArray
    assessable: BoolArray
    alarming: int
    free: int
    multiplier: float


def pooled(budget: Budget, folds: Sequence[HeldOut], contacts: int, *, corrects: bool) -> Pooled | None:
    """Return what all folds give together for so many contacts; None if one could not be assessed."""
    if not folds or any(item.reason for item in folds):
        return None
    latency, force, assessable = np.full(contacts, np.nan), np.full(contacts, np.nan), np.zeros(contacts, dtype=bool)
    alarming = 0
    for own in folds:
        number = correction(budget, [item for item in folds if item is not own]) if corrects else 0
        latency[own.contacts], force[own.contacts] = own.latency[number], own.force[number]
        assessable[own.contacts] = own.assessable
        alarming += int(np.count_nonzero(own.ratios > MULTIPLIERS[number]))
    multiplier = float(MULTIPLIERS[correction(budget, folds)]) if corrects else 1.0
    free = sum(len(item.ratios) for item in folds)
    return Pooled(latency, force, assessable, alarming, free, multiplier)
