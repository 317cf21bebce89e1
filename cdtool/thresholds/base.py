"""What every threshold is: a rule that is fitted to impact-free runs, and a fitted band that is evaluated causally."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from cdtool.detection import Band, Signal, Status
from cdtool.recording import FloatArray, Recording


class FittedThreshold(Protocol):
    """A band that is known: `evaluate` gives the statistic that is compared and its limits, sample by sample.

    Causal: limits up to sample k do not change when the samples after k do.
    """

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """The statistic (status NO_LIMIT where no limit is known) and the band, both on the signal's clock."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """All of it as JSON values."""
        ...

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`."""
        ...


class Threshold(Protocol):
    """The contract: a frozen dataclass of the rule's settings, the channels it needs, and `fit`."""

    name: ClassVar[str]
    needs: ClassVar[tuple[str, ...]]

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedThreshold:
        """Learn from impact-free runs; fitting may look at whole runs. Raises SignatureError."""
        ...


def with_limits(signal: Signal, lower: FloatArray, upper: FloatArray) -> tuple[Signal, Band]:
    """The signal as its own statistic; where it is valid but a limit is NaN, its status becomes NO_LIMIT."""
    status = signal.status.copy()
    unknown = (np.isnan(lower) | np.isnan(upper)) & (status == Status.VALID)
    status[unknown] = Status.NO_LIMIT
    return replace(signal, status=status), Band(lower, upper)
