"""What every threshold is: a rule that is fitted to impact-free runs, and a fitted band that is evaluated causally."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import Field, replace
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from cdtool.detection import Band, Signal, Status
from cdtool.recording import FloatArray, Recording


class FittedThreshold(Protocol):
    """A band that is known: `evaluate` gives the statistic that is compared and its limits, sample by sample.

    Causal: limits up to sample k do not change when the samples after k do. One number sets how wide the band is: both
    limits are linear in the safety factor, and the statistic does not depend on it.
    """

    @property
    def safety_factor(self) -> float:
        """How far the limits are from what is normal, above 0."""
        ...

    def with_safety_factor(self, factor: float) -> Self:
        """The same with another safety factor."""
        ...

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
    """The contract: a frozen dataclass of the rule's settings, the channels it needs, what it makes, and `fit`.

    `fitted` names the classes of which `fit` makes one: files are read back with them.
    A rule may have more: `by_class`, True where it learns each class of motion apart; what it fits then has `motion`,
    the class it serves. A field `sides` that is None becomes the machine's, a field `signature` that is None the
    benchmark file's [signature].
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    name: ClassVar[str]
    needs: ClassVar[tuple[str, ...]]
    fitted: ClassVar[tuple[type, ...]]

    @property
    def safety_factor(self) -> float | None:
        """How far the limits are to be from what is normal, above 0; None where other settings decide."""
        ...

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedThreshold:
        """Learn from impact-free runs; fitting may look at whole runs. Raises SignatureError."""
        ...


def exceedance(threshold: FittedThreshold, recording: Recording, signal: Signal) -> tuple[Signal, FloatArray]:
    """The statistic, and for each sample (n, J) the safety factor at which its limit would be met.

    A sample is outside the band exactly where this is above the safety factor. Limits are linear in the factor k:
    upper(k) = a + k b, so that k* = k + k (i - upper(k)) / (upper(2 k) - upper(k)); -inf where nothing is limited.
    """
    factor = threshold.safety_factor
    statistic, band = threshold.evaluate(recording, signal)
    _, wider = threshold.with_safety_factor(2.0 * factor).evaluate(recording, signal)
    above = _met_at(statistic.values, band.upper, wider.upper, factor)
    below = _met_at(-statistic.values, -band.lower, -wider.lower, factor)
    return statistic, np.fmax(above, below)


def _met_at(value: FloatArray, limit: FloatArray, wider: FloatArray, factor: float) -> FloatArray:
    with np.errstate(invalid="ignore", divide="ignore"):
        met: FloatArray = factor + factor * (value - limit) / (wider - limit)
    stuck = wider == limit
    met = np.where(stuck, np.where(value > limit, np.inf, -np.inf), met)
    return np.where(np.isnan(limit) | np.isposinf(limit), -np.inf, met)


def with_limits(signal: Signal, lower: FloatArray, upper: FloatArray) -> tuple[Signal, Band]:
    """The signal as its own statistic; where it is valid but a limit is NaN, its status becomes NO_LIMIT."""
    status = signal.status.copy()
    unknown = (np.isnan(lower) | np.isnan(upper)) & (status == Status.VALID)
    status[unknown] = Status.NO_LIMIT
    return replace(signal, status=status), Band(lower, upper)
