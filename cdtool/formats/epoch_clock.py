"""The clock of a container that may count from an epoch: its first stamp is subtracted before anything is rounded.

Nanoseconds since 1970 have 19 digits and float64 has 16, so that only their differences are exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.formats.columns import as_float64
from cdtool.recordings.clock import EPOCH
from cdtool.recordings.clock.plausible_unit import SECONDS, both_readings, contradicted_by_epoch


@dataclass(frozen=True)
class EpochClock:
    """The stamps of a file: `read(start, end)` returns them without conversion, integers as integers.

    A stamp is a multiple of `factor` [s], counted from `base` [s] after 1970 or after an unknown start. Stamps that are
    equal to one of `missing` are missing.
    """

    read: Callable[[int, int], npt.NDArray[Any]]
    factor: float
    base: Fraction = Fraction(0)
    missing: tuple[float, ...] = ()
    first: Fraction | None = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "first", _exact(self.read(0, 1)[0]))

    @property
    def start(self) -> Fraction | None:
        """Return the first stamp [s] without rounding; None if it is not a finite number."""
        return None if self.first is None else self.base + self.first * _decimal(self.factor)

    def times(self, start: int, end: int, origin: Fraction) -> FloatArray:
        """Return times [s] after `origin`; NaN where the stamp is missing."""
        raw = self.read(start, end)
        if not origin or self.start is None:
            times = as_float64(raw) * self.factor + float(self.base - origin)
        else:
            times = _since(raw, self.first or Fraction(0)) * self.factor + float(self.start - origin)
        if self.missing:
            times[np.isin(raw, self.missing)] = np.nan
        return times


def with_plausible_unit(clock: EpochClock, stated: str, findings: list[Finding], channel: str) -> EpochClock:
    """Return the clock in the unit that its stamps can have.

    If the stamps cannot be times in the stated unit but are plausible times since 1970 in another unit, the clock is
    returned in that unit, and a warning with both readings is added to the findings.
    """
    stamp = float(clock.first) if clock.first is not None else 0.0
    meant = contradicted_by_epoch(stamp, clock.factor)
    if clock.base or not meant:
        return clock
    findings.append(
        Finding("file_unit_implausible", channel, {"readings": both_readings(stamp, clock.factor, stated, meant)})
    )
    return EpochClock(clock.read, SECONDS[meant], missing=clock.missing)


def common_origin(clocks: Iterable[EpochClock]) -> Fraction:
    """Return the earliest first stamp [s], to be subtracted, if all clocks count from an epoch; 0 otherwise."""
    starts = [clock.start for clock in clocks if clock.start is not None]
    earliest = min(starts, default=Fraction(0))
    return earliest if earliest > EPOCH else Fraction(0)


def _since(raw: npt.NDArray[Any], first: Fraction) -> FloatArray:
    """Return the stamps minus the first one; differences of integers are exact."""
    if raw.dtype.kind == "u":  # modulo 2^64, so that stamps before the first one become negative
        return (raw.astype(np.uint64) - np.uint64(int(first))).view(np.int64).astype(np.float64)
    if raw.dtype.kind == "i":
        return (raw.astype(np.int64) - np.int64(int(first))).astype(np.float64)
    return as_float64(raw) - float(first)


def _exact(stamp: Any) -> Fraction | None:
    if isinstance(stamp, np.integer):
        return Fraction(int(stamp))
    return Fraction(float(stamp)) if np.isfinite(float(stamp)) else None


def _decimal(factor: float) -> Fraction:
    """Return the decimal value of a factor: 1e-9 stands for 1 / 10^9, which float64 cannot represent."""
    return Fraction(repr(factor))
