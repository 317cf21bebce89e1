"""Check a clock's stated unit against its values: time stamps since 1970 and impossible steps contradict a unit.

Only an impossible value is a contradiction. A log at 1 Hz and a counter of milliseconds since power-on are valid; a
time stamp 3,000 years after its zero is not.
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray

# A clock that counts from 1970 in one of these units lies between the years 2001 and 2100.
EPOCHS = ((1e9, 4.1e9, "s"), (1e12, 4.1e12, "ms"), (1e15, 4.1e15, "us"), (1e18, 4.1e18, "ns"))
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# No log of a machine has longer or shorter steps [s]: a minute, half a microsecond.
_LONGEST_STEP, _SHORTEST_STEP = 60.0, 5e-7


def unit_since_1970(stamp: float) -> str:
    """Return the unit in which a time stamp, counted from 1970, is between 2001 and 2100; empty if no unit fits.

    >>> unit_since_1970(1.6e12), unit_since_1970(12.5)
    ('ms', '')
    """
    return next((name for low, high, name in EPOCHS if low <= stamp < high), "")


def contradicted_by_epoch(stamp: float, factor: float) -> str:
    """Return the unit of a first time stamp since 1970 if it cannot be a time in the stated unit (`factor` s).

    Otherwise, the result is empty.

    >>> contradicted_by_epoch(1.6e12, 1.0), contradicted_by_epoch(1.6e12, 1e-3), contradicted_by_epoch(1.6e9, 1e-3)
    ('ms', '', '')
    """
    # No clock counts more seconds, whatever its zero: the year 0 was 6.4e10 s ago.
    return unit_since_1970(stamp) if stamp * factor > 1e11 else ""


def both_readings(stamp: float, factor: float, stated: str, meant: str) -> dict[str, Any]:
    """Return a first time stamp as read in the stated unit (`factor` s), and in the unit `meant` since 1970."""
    day = datetime.fromtimestamp(stamp * SECONDS[meant], tz=UTC).date().isoformat()
    years = stamp * factor / (365.2425 * 86400.0)
    return {"stamp": stamp, "stated": stated, "years": years, "meant": meant, "day": day}


def contradicted_by_steps(stamps: FloatArray, factor: float) -> tuple[str, float]:
    """Return the likely unit of time stamps (n,) if their median step is implausible in the stated one, and that step.

    `factor` converts the stated unit to seconds; the step is in s, 0 if it is plausible. The likely unit is the one
    that yields a plausible sample rate nearest to 1 kHz. It is empty if the stated unit may be right, or no unit yields
    a plausible rate.
    """
    some = stamps[:100_000]  # enough for a median
    steps = np.diff(some)
    # With all steps plausible, so is their median. A step that is NaN is not plausible.
    if len(steps) and steps.min() * factor >= _SHORTEST_STEP and steps.max() * factor <= _LONGEST_STEP:
        return "", 0.0
    steps = np.diff(some[np.isfinite(some)])
    steps = steps[steps > 0.0]
    if len(steps) < 3:
        return "", 0.0
    step = float(np.median(steps))
    if _SHORTEST_STEP <= step * factor <= _LONGEST_STEP:
        return "", 0.0
    # Plausible sample rates of a log in the likely unit: 0.5 Hz to 500 kHz.
    fitting = [name for name, one in SECONDS.items() if 0.5 * (step * one) <= 1.0 <= 500e3 * (step * one)]
    return min(fitting, key=lambda name: abs(np.log(step * SECONDS[name] / 1e-3)), default=""), step * factor
