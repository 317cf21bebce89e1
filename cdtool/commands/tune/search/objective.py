"""What is minimised: the mean over groups of the logarithm of a group's cost; a missed contact costs its window."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.commands.tune.search.candidate import Measured
from cdtool.commands.tune.search.recordings import TuningRecordings

# Costs below this are not distinguished [s] or [N].
_LEAST = 1e-4
# How much worse than the default a group may get.
WORSE_AT_MOST = 0.1


class Goal(Enum):
    """The cost of a group: mean latency, its 95th percentile, or the mean force at the alarm."""

    LATENCY = "latency"
    P95 = "p95"
    FORCE = "force"


@dataclass(frozen=True)
class Objective:
    """The costs of the groups of some recordings, and one number that combines them.

    `worse_at_most`: a choice that makes a group worse than its default by more than this share is not used.
    """

    goal: Goal
    recordings: TuningRecordings
    worse_at_most: float = WORSE_AT_MOST

    def costs(self, measured: Measured, debounce: int, subset: int) -> FloatArray:
        """Return the cost of each group (g,): seconds, or newtons; NaN for a group without a contact in the subset."""
        force = measured.force[debounce, subset]
        return self.costs_of(measured.latency[debounce, subset], force, self.recordings.contacts_in(subset))

    def costs_of(self, latency: FloatArray, force: FloatArray, counted: BoolArray) -> FloatArray:
        """Return the cost of each group (g,) for latencies [s] and forces [N] of all contacts (C,), of those counted.

        A missed contact counts as its window, and with its highest force.
        """
        missed = np.isnan(latency)
        if self.goal is Goal.FORCE:
            values = np.where(missed, self.recordings.peak_of, force)
            counted = counted & np.isfinite(values)
        else:
            values = np.where(missed, self.recordings.window_of, latency)
        found = np.full(len(self.recordings.groups), np.nan)
        for group in range(len(found)):
            own = values[counted & (self.recordings.group_of == group)]
            if len(own):
                found[group] = np.quantile(own, 0.95) if self.goal is Goal.P95 else np.mean(own)
        return found

    def score(self, costs: FloatArray) -> float:
        """Return the mean of log cost over the groups with contacts; infinite without any."""
        known = costs[np.isfinite(costs)]
        return float(np.mean(np.log(np.maximum(known, _LEAST)))) if len(known) else math.inf

    def is_acceptable(self, costs: FloatArray, default: FloatArray) -> bool:
        """Return whether no group is worse than by default beyond what is allowed; without a default, any choice is."""
        known = np.isfinite(costs) & np.isfinite(default)
        return bool((costs[known] <= (1.0 + self.worse_at_most) * default[known] + 1e-12).all())
