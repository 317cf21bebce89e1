"""Totals of a benchmark over its operations: exposure, and the curve of latency against false alarms."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.commands.scoring.log_outcome import OperationOutcome
from cdtool.results.results import ExposureResult, SweepResult


@dataclass
class Exposure:
    """How long one detector monitored one group."""

    recordings: int = 0
    operations: int = 0
    seconds: float = 0.0
    not_assessable: int = 0
    samples: int = 0
    by_reason: Counter[str] = field(default_factory=Counter)

    def add(self, outcome: OperationOutcome) -> None:
        """Add one operation."""
        self.operations += 1
        self.seconds += outcome.seconds
        self.not_assessable += outcome.is_not_assessable
        self.samples += outcome.samples
        for reason, count in outcome.by_reason.items():  # Counter.update takes three times as long
            self.by_reason[reason] += count

    def result(self, group: str, detector: str) -> ExposureResult:
        """Return the row of results.json."""
        shares = {reason: count / max(self.samples, 1) for reason, count in sorted(self.by_reason.items())}
        hours = self.seconds / 3600.0
        return ExposureResult(group, detector, self.recordings, self.operations, hours, self.not_assessable, shares)


@dataclass
class SweepRows:
    """The points of the curve: false alarms from the impact-free group, latencies from each group of impacts."""

    factors: Mapping[str, FloatArray]
    impact_free: str
    _false_alarms: dict[str, np.ndarray] = field(default_factory=dict)
    _watched: dict[str, tuple[int, float]] = field(default_factory=dict)
    # By detector and group: of each contact the latency with every factor, one contact after the other.
    _latency: dict[tuple[str, str], array[float]] = field(default_factory=dict)
    _blind: Counter[tuple[str, str]] = field(default_factory=Counter)

    def add(self, group: str, name: str, outcome: OperationOutcome) -> None:
        """Add one operation of the detector `name`."""
        swept = outcome.swept
        if swept is None:
            return
        if group == self.impact_free:
            if outcome.seconds <= 0.0:
                return  # an operation without an assessable sample does not count as exposure
            self._false_alarms[name] = self._false_alarms.get(name, 0) + swept.false_alarms
            operations, seconds = self._watched.get(name, (0, 0.0))
            self._watched[name] = operations + 1, seconds + outcome.seconds
            return
        seen = np.array([item in ("detected", "missed") for item in outcome.outcomes], dtype=bool)
        self._latency.setdefault((name, group), array("d")).frombytes(swept.latency[:, seen].T.tobytes())
        self._blind[name, group] += outcome.outcomes.count("not_assessable")

    def rows(self, detectors: Sequence[str], groups: Sequence[str]) -> Iterator[SweepResult]:
        """Return a row for each detector, group of impacts and safety factor."""
        for group in groups:
            for name in detectors:
                if name in self._watched and (name, group) in self._latency:
                    yield from self._rows_of(name, group)

    def _rows_of(self, name: str, group: str) -> Iterator[SweepResult]:
        latency = 1e3 * np.frombuffer(self._latency[name, group]).reshape(-1, len(self.factors[name])).T
        operations, seconds = self._watched[name]
        in_use = len(self.factors[name]) // 2
        for i, factor in enumerate(self.factors[name]):
            if i < min(_loudest(self._false_alarms[name]), in_use):
                continue
            values = latency[i]
            detected = values[np.isfinite(values)]
            yield SweepResult(
                detector=name,
                group=group,
                safety_factor=float(factor),
                false_alarms=int(self._false_alarms[name][i]),
                operations=operations,
                hours=seconds / 3600.0,
                detected=len(detected),
                missed=len(values) - len(detected),
                not_assessable=self._blind[name, group],
                mean_ms=float(detected.mean()) if len(detected) else None,
                median_ms=_median(values),
                in_use=i == in_use,
            )


def _loudest(false_alarms: npt.NDArray[np.int64]) -> int:
    """Return the largest factor with the most false alarms; below it the signal hardly returns and alarms merge."""
    return int(np.flatnonzero(false_alarms == false_alarms.max())[-1])


def _median(values: FloatArray) -> float | None:
    """Return the median [ms], counting a missed contact (NaN) as later than all; None if it is not reached."""
    ordered = np.sort(np.where(np.isnan(values), np.inf, values))
    if not len(ordered):
        return None
    middle = 0.5 * float(ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])
    return middle if np.isfinite(middle) else None
