"""Absolute limits, one per joint: the simplest threshold (thesis 2.3.1)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from cdtool.base.errors import NothingValidError, SignatureError, UsageError
from cdtool.base.settings import Positive, check, setting
from cdtool.detectors.detection import Band, Signal
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import with_limits


@dataclass(frozen=True)
class FittedLimit:
    """lower < i < upper, the same at every sample: `safety_factor` spreads from the extremes of normal runs.

    Parameters
    ----------
    least, greatest : tuple of float
        Extremes of normal runs in the signal's unit, one value for all joints or one per joint.
    spread_below, spread_above : tuple of float
        Their standard deviations; infinite: no limit on that side.
    safety_factor : float
        Number of spreads from the extremes to the limits.

    Examples
    --------
    >>> limit = FittedLimit((-8.0,), (10.0,), spread_below=(1.0,), spread_above=(2.0,), safety_factor=5.0)
    >>> limit.lower, limit.upper
    ((-13.0,), (20.0,))
    """

    least: tuple[float, ...]
    greatest: tuple[float, ...]
    spread_below: tuple[float, ...]
    spread_above: tuple[float, ...]
    safety_factor: float = 1.0

    @property
    def lower(self) -> tuple[float, ...]:
        """The lower limits, in the signal's unit."""
        pairs = zip(self.least, self.spread_below, strict=True)
        return tuple(centre - self.safety_factor * spread for centre, spread in pairs)

    @property
    def upper(self) -> tuple[float, ...]:
        """The upper limits, in the signal's unit."""
        pairs = zip(self.greatest, self.spread_above, strict=True)
        return tuple(centre + self.safety_factor * spread for centre, spread in pairs)

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the signal and its constant band; raises UsageError if the number of joints differs."""
        joints = signal.values.shape[1]
        if len(self.least) not in (1, joints):
            raise UsageError(
                f"{recording.name}: {len(self.least)} limits for {joints} joints",
                "give one limit, or one per joint",
            )
        shape = signal.values.shape
        return with_limits(signal, np.broadcast_to(self.lower, shape), np.broadcast_to(self.upper, shape))

    def with_safety_factor(self, factor: float) -> FittedLimit:
        """Return the threshold with its limits at `factor` spreads from the extremes."""
        return replace(self, safety_factor=factor)

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values; an infinite spread is null."""
        values = asdict(self)
        for name in ("spread_below", "spread_above"):
            values[name] = [None if np.isinf(x) else x for x in values[name]]
        return values

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        names = ("least", "greatest", "spread_below", "spread_above")
        columns = {name: tuple(np.inf if x is None else float(x) for x in values[name]) for name in names}
        return cls(**columns, safety_factor=float(values["safety_factor"]))


@dataclass(frozen=True)
class Limit:
    """Constant limits: the mean of the runs' extremes, `safety_factor` of their standard deviations further out.

    Raises
    ------
    UsageError
        A fixed limit is not above 0.

    Notes
    -----
    Thesis 2.3.1, absolute limits. Fails if friction or gravity vary along the path, if a sensor drifts, or if the speed
    changes.

    Examples
    --------
    >>> import numpy as np
    >>> time, valid = np.arange(3) * 1e-3, np.zeros((3, 1), dtype=np.uint8)
    >>> runs = [
    ...     (Recording("run", "", ("axis",), {}), Signal(time, np.array([[0.0], [peak], [0.0]]), valid, "N"))
    ...     for peak in (9.0, 10.0, 11.0)
    ... ]
    >>> limit = Limit(safety_factor=5.0).fit(runs)
    >>> [round(value, 6) for value in (*limit.lower, *limit.upper)]
    [0.0, 15.0]
    """

    safety_factor: Annotated[Positive, setting("spreads from the mean extreme of the runs to the limit")] = 5.5
    limits: Annotated[
        tuple[Positive, ...],
        setting(
            "fixed limits of |signal| in its unit in place of learned ones, one for all joints or one each; "
            "inf: not monitored",
            infinite=True,
        ),
    ] = ()

    name: ClassVar[str] = "limit"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedLimit,)

    def __post_init__(self) -> None:
        check(self)
        if self.limits:
            self.given(self.limits)  # raises UsageError if they leave no joint

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedLimit:
        """Learn limits from at least 2 impact-free runs; see `Threshold.fit`."""
        if self.limits:
            return self.given(self.limits)
        if len(pairs) < 2:
            raise SignatureError(f"a limit needs at least 2 impact-free runs, {len(pairs)} given", "add runs")
        highest, lowest = [], []
        for recording, signal in pairs:
            if not signal.valid.any(axis=0).all():
                kind = SignatureError if signal.valid.any() else NothingValidError
                raise kind(f"{recording.name}: a joint has no valid sample ({signal.why_not()})", "leave the run out")
            highest.append(np.max(np.where(signal.valid, signal.values, -np.inf), axis=0))
            lowest.append(np.min(np.where(signal.valid, signal.values, np.inf), axis=0))
        return FittedLimit(
            least=tuple(np.mean(lowest, axis=0).tolist()),
            greatest=tuple(np.mean(highest, axis=0).tolist()),
            spread_below=tuple(np.std(lowest, axis=0, ddof=1).tolist()),
            spread_above=tuple(np.std(highest, axis=0, ddof=1).tolist()),
            safety_factor=self.safety_factor,
        )

    @staticmethod
    def given(limits: Sequence[float]) -> FittedLimit:
        """Return fixed limits |i| < limit: one for all joints or one per joint (infinite: the joint is not monitored).

        Their spread is the limit itself, so that a safety factor of 1 keeps the limit unchanged.
        """
        values = tuple(limits)
        if not all(value > 0.0 for value in values):
            raise UsageError(f"limits are {list(values)}", "numbers above 0 are needed (inf: not monitored)")
        if values and all(map(math.isinf, values)):
            raise UsageError(f"limits are {list(values)}: no joint is monitored", "give a number for at least one")
        nothing = (0.0,) * len(values)
        return FittedLimit(nothing, nothing, values, values)
