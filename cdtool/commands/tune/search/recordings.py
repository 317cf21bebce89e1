"""The recordings that a detector is tuned on, each in one of a few folds that never assess themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.truth.force.curve import ForceTimeCurve


@dataclass(frozen=True)
class FreeRun:
    """An impact-free operation, and the number of its fold."""

    operation: Operation
    fold: int


@dataclass(frozen=True)
class StruckLog:
    """A log with contacts: its operations with the contacts of each, the group, and the number of its fold.

    A contact may be detected up to `window` [s] after its onset. `curves` has the force over each contact of each
    operation, None where it is unknown. `made_from`: source of the impact-free log that injected contacts are in.
    """

    operations: tuple[Operation, ...]
    contacts: tuple[tuple[Contact, ...], ...]
    curves: tuple[tuple[ForceTimeCurve | None, ...], ...]
    group: str
    window: float
    fold: int
    made_from: str = ""


@dataclass(frozen=True)
class TuningRecordings:
    """Impact-free operations and logs with contacts, in `folds` folds.

    A subset of them is numbered: 0 is everything, k + 1 is what is not in fold k. `subsets` is 1 if the runs outside a
    fold are too few for the budget, so that no figure can be checked on recordings not used for the choice.
    """

    free: tuple[FreeRun, ...]
    struck: tuple[StruckLog, ...]
    folds: int
    is_nested: bool

    @property
    def subsets(self) -> int:
        """Return the number of subsets."""
        return 1 + self.folds if self.is_nested else 1

    def why_not_nested(self, budget: Budget) -> str:
        """Return why there can be no results on recordings not used for the choice; empty if there can be.

        Two folds are left out at a time, and a choice without a fold needs contacts of every group.
        """
        if self.folds < 3:
            return f"the recordings are in {self.folds} parts that stay together, 3 are needed"
        fewest = min(len(self.free_in(fold + 1)) for fold in range(self.folds))
        if budget.per == "operation" and fewest < budget.needed:
            return f"without one of {self.folds} parts, {fewest} impact-free runs are left, {budget.needed:.0f} needed"
        for number, group in enumerate(self.groups):
            if len(set(self.fold_of[self.group_of == number].tolist())) < 2:
                return f"the contacts of {group} are in one part: at least 2 logs are needed"
        return ""

    @cached_property
    def groups(self) -> tuple[str, ...]:
        """Return the names of the groups of contacts, in the order of the logs."""
        return tuple(dict.fromkeys(item.group for item in self.struck))

    @cached_property
    def group_of(self) -> npt.NDArray[np.int64]:
        """Return the number of its group for each contact (C,), in the order of the logs."""
        return np.array([self.groups.index(log.group) for log in self.struck for _ in _each(log)], dtype=np.int64)

    @cached_property
    def window_of(self) -> FloatArray:
        """Return the window of each contact (C,) [s]."""
        return np.array([log.window for log in self.struck for _ in _each(log)], dtype=np.float64)

    @cached_property
    def peak_of(self) -> FloatArray:
        """Return the highest force of each contact (C,) [N]; NaN where it is unknown."""
        curves = [curve for log in self.struck for of_operation in log.curves for curve in of_operation]
        return np.array([np.nan if curve is None else curve.peak for curve in curves], dtype=np.float64)

    @cached_property
    def fold_of(self) -> npt.NDArray[np.int64]:
        """Return the fold of each contact (C,)."""
        return np.array([log.fold for log in self.struck for _ in _each(log)], dtype=np.int64)

    def free_in(self, subset: int) -> list[int]:
        """Return the numbers of the impact-free operations in a subset."""
        return [number for number, run in enumerate(self.free) if run.fold != subset - 1]

    def contacts_in(self, subset: int) -> BoolArray:
        """Return whether each contact (C,) is in a subset."""
        inside: BoolArray = self.fold_of != subset - 1
        return inside


def _each(log: StruckLog) -> Sequence[Contact]:
    return [contact for of_operation in log.contacts for contact in of_operation]
