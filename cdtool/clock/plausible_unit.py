"""Does a clock's unit fit its values? Stamps since 1970 and steps that no log has contradict a unit, whoever states it.

Conventions: only what cannot be otherwise is a contradiction. A log at 1 Hz is honest, and so is a counter of
milliseconds since power-on; a stamp 3,000 years after its zero is neither.
"""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from cdtool.findings.clocks import TwoReadings
from cdtool.recording import FloatArray

# A clock that counts from 1970 in one of these units lies between the years 2001 and 2100.
EPOCHS = ((1e9, 4.1e9, "s"), (1e12, 4.1e12, "ms"), (1e15, 4.1e15, "us"), (1e18, 4.1e18, "ns"))
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# No clock counts more than this many seconds, whatever its zero: the year 0 lies 6.4e10 s back.
_LONGEST = 1e11
# Steps [s] that no log of a machine has: above a minute, below half a microsecond.
_LONGEST_STEP, _SHORTEST_STEP = 60.0, 5e-7
# Rates [Hz] that a log has in the unit that is meant instead.
_SLOWEST, _FASTEST = 0.5, 500e3
# Stamps from whose steps the usual one is taken.
_ENOUGH = 100_000
_YEAR = 365.2425 * 86400.0


def unit_since_1970(stamp: float) -> str:
    """The unit in which a stamp counted from 1970 lies between 2001 and 2100; empty where there is none.

    >>> unit_since_1970(1.6e12), unit_since_1970(12.5)
    ('ms', '')
    """
    return next((name for low, high, name in EPOCHS if low <= stamp < high), "")


def contradicted_by_epoch(stamp: float, factor: float) -> str:
    """The unit that a first stamp counts since 1970, where in the stated unit (`factor` s) it cannot be a time.

    >>> contradicted_by_epoch(1.6e12, 1.0), contradicted_by_epoch(1.6e12, 1e-3), contradicted_by_epoch(1.6e9, 1e-3)
    ('ms', '', '')
    """
    return unit_since_1970(stamp) if stamp * factor > _LONGEST else ""


def both_readings(stamp: float, factor: float, stated: str, meant: str) -> TwoReadings:
    """Return a first stamp as read in the stated unit (`factor` s), and as `meant` since 1970."""
    day = datetime.fromtimestamp(stamp * SECONDS[meant], tz=UTC).date().isoformat()
    return TwoReadings(stamp, stated, stamp * factor / _YEAR, meant, day)


def contradicted_by_steps(stamps: FloatArray, factor: float) -> tuple[str, float]:
    """The likely unit of stamps (n,) whose median step in the stated unit (`factor` s) no log has, and that step [s].

    Of the units in which the steps are those of a log, the one nearest to 1 kHz; empty where the stated unit may be
    right, or none is better.
    """
    some = stamps[:_ENOUGH]
    steps = np.diff(some[np.isfinite(some)])
    steps = steps[steps > 0.0]
    if len(steps) < 3:
        return "", 0.0
    step = float(np.median(steps))
    if _SHORTEST_STEP <= step * factor <= _LONGEST_STEP:
        return "", step * factor
    fitting = [name for name, one in SECONDS.items() if _SLOWEST <= 1.0 / (step * one) <= _FASTEST]
    return min(fitting, key=lambda name: abs(np.log(step * SECONDS[name] / 1e-3)), default=""), step * factor
