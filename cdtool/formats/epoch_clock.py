"""The clock of a container that may count from an epoch: its first stamp is subtracted before anything is rounded.

Nanoseconds since 1970 have 19 digits and float64 has 16, so that only their differences are exact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.formats.columns import as_float64
from cdtool.recordings.clock import THREE_YEARS
from cdtool.recordings.clock.plausible_unit import SECONDS, both_readings, contradicted_by_epoch

# The years 2000 to 2100 in days since 1899-12-30, as counted by Excel.
EXCEL_2000, EXCEL_2100 = 36526.0, 73051.0
# A clock in days steps by less than this (4 s); a clock in seconds that steps by less samples above 20 kHz.
SHORTEST_STEP = 5e-5


@dataclass(frozen=True)
class EpochClock:
    """The stamps of a file: `read(start, end)` returns them without conversion, integers as integers.

    A stamp is a multiple of `factor` [s], counted from `base` [s] after 1970 (`dated`) or after an unknown start.
    """

    read: Callable[[int, int], npt.NDArray[Any]]
    factor: float
    base: Fraction = Fraction(0)
    dated: bool = False
    first: Fraction | None = field(init=False)

    def __post_init__(self) -> None:
        # The first stamps may be missing.
        stamps = (stamp for stamp in self.read(0, 1000) if np.isfinite(stamp))
        first = next(stamps, None)
        exact = int(first) if isinstance(first, np.integer) else None if first is None else float(first)
        object.__setattr__(self, "first", None if exact is None else Fraction(exact))

    @property
    def start(self) -> Fraction | None:
        """Return the first stamp [s] without rounding; None if the first ones are not finite numbers."""
        return None if self.first is None else self.base + self.first * _decimal(self.factor)

    @property
    def is_since_1970(self) -> bool:
        """Return whether the stamps are known to count from 1970."""
        return self.start is not None and (self.dated or self.start > THREE_YEARS)

    def times(self, start: int, end: int, origin: Fraction) -> FloatArray:
        """Return times [s] after `origin` if the stamps count from 1970; NaN where the stamp is missing."""
        raw = self.read(start, end)
        if self.start is None or not self.is_since_1970:
            return as_float64(raw) * self.factor + float(self.base)
        return _since(raw, self.first or Fraction(0)) * self.factor + float(self.start - origin)


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
    return EpochClock(clock.read, SECONDS[meant])


def common_origin(clocks: Mapping[str, EpochClock], findings: list[Finding]) -> Fraction:
    """Return the earliest first stamp [s] of the clocks, by column, that count from 1970; 0 without one.

    It is to be subtracted. The other clocks are assumed to start with it, which is a finding.
    """
    starts = [clock.start for clock in clocks.values() if clock.start is not None and clock.is_since_1970]
    unknown = tuple(column for column, clock in clocks.items() if not clock.is_since_1970)
    if starts and unknown:
        findings.append(Finding("no_start_time", "", {"channels": unknown}))
    return min(starts, default=Fraction(0))


def _since(raw: npt.NDArray[Any], first: Fraction) -> FloatArray:
    """Return the stamps minus the first one; differences of integers are exact."""
    if raw.dtype.kind == "u":  # modulo 2^64, so that stamps before the first one become negative
        return (raw.astype(np.uint64) - np.uint64(int(first))).view(np.int64).astype(np.float64)
    if raw.dtype.kind == "i":
        return (raw.astype(np.int64) - np.int64(int(first))).astype(np.float64)
    return as_float64(raw) - float(first)


def _decimal(factor: float) -> Fraction:
    """Return the decimal value of a factor: 1e-9 stands for 1 / 10^9, which float64 cannot represent."""
    return Fraction(repr(factor))
