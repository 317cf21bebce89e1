"""What is searched: a detector's gains and a threshold rule with its settings; and what is measured with it."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.detectors.base import Detector
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.stored import rule_to_dict


@dataclass(frozen=True)
class Candidate:
    """A detector's gains, by name, and a threshold rule."""

    gains: tuple[tuple[str, Any], ...]
    rule: Threshold

    @classmethod
    def of(cls, detector: Any, rule: Threshold) -> Candidate:
        """Return the candidate with a detector's gains."""
        return cls(tuple((item.name, getattr(detector, item.name)) for item in fields(detector)), rule)

    @cached_property
    def key(self) -> str:
        """Return a text that two candidates share only if they are equal."""
        return json.dumps([self.gains, rule_to_dict(self.rule)], sort_keys=True)

    def detector(self, base: Any) -> Detector:
        """Return the detector `base` with these gains."""
        made: Detector = replace(base, **dict(self.gains))
        return made

    def with_gain(self, name: str, factor: float) -> Candidate:
        """Return the candidate with one gain times a factor, for all joints."""
        gains = tuple((own, _times(value, factor) if own == name else value) for own, value in self.gains)
        return replace(self, gains=gains)


def _times(value: Any, factor: float) -> Any:
    """Return a gain times a factor, with the digits that a file has."""
    if isinstance(value, tuple):
        return tuple(_times(item, factor) for item in value)
    return float(f"{value * factor:.4g}")


@dataclass(frozen=True)
class Measured:
    """What a candidate gives: for d debounces, s subsets of the recordings and c contacts.

    Every recording is assessed with a threshold learned without its fold; `factors` (d, s) meet the budget on the
    impact-free operations of a subset, `alarming` (d, s) of them alarm with it. `latency` (d, s, c) [s] is NaN if the
    contact was missed; `force` (d, s, c) [N] is that at the alarm, NaN if unknown. `assessable` (c,). `reason` states
    why the candidate cannot be used; it then has no numbers.
    """

    factors: FloatArray
    latency: FloatArray
    force: FloatArray
    assessable: BoolArray
    alarming: npt.NDArray[np.int64]
    reason: str = ""

    @classmethod
    def unusable(cls, reason: str) -> Measured:
        """Return that of a candidate that cannot be used."""
        return cls(
            np.empty((0, 0)), np.empty((0, 0, 0)), np.empty((0, 0, 0)), np.empty(0, bool), np.empty((0, 0), int), reason
        )
