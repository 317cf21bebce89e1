"""How long a contact presses above a level: the dynamic and the residual time of a force-time curve.

Conventions: times count from the onset of the contact [s]. Between two samples the force is a straight line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.errors import UsageError
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import ForceProfile


@dataclass(frozen=True)
class TimeAbove:
    """From the first time that a force exceeds a level to the last time that it returns to it [s after the onset].

    Both are NaN for a force that never exceeds it; `end` is infinite if the force is above it at the end of the record.
    """

    begin: float
    end: float

    @property
    def length(self) -> float:
        """Return the time between them [s]: 0 for a force that never exceeds the level, infinite if it never ends."""
        return 0.0 if math.isnan(self.begin) else self.end - self.begin


def time_above(curve: ForceTimeCurve, level: float) -> TimeAbove:
    """Return from when to when a force exceeds a level; all pauses between several peaks count.

    Parameters
    ----------
    curve : ForceTimeCurve
        Force (n,) [N] over the time after the onset (n,) [s].
    level : float
        The level [N], above 0.

    Returns
    -------
    TimeAbove
        The first crossing and the last one, by linear interpolation. A force that is above the level in the first
        sample exceeds it from there; missing samples are bridged by a straight line.

    Raises
    ------
    UsageError
        The level is not above 0.

    Notes
    -----
    EN 12453 calls the time above 150 N the dynamic time, and that above 25 N the total time. The force of a contact
    that rings or rebounds crosses the level several times. Here the time runs from the first crossing to the last:
    the longest, therefore the strictest reading.

    Examples
    --------
    A triangle of 300 N and 1 s is above 150 N for half of its time.

    >>> time = np.arange(2001) * 1e-3
    >>> force = np.maximum(300.0 - 600.0 * np.abs(time - 0.5), 0.0)
    >>> above = time_above(ForceTimeCurve(time, force, np.zeros(2001, dtype=bool), end=2.0), 150.0)
    >>> round(above.begin, 6), round(above.end, 6), round(above.length, 6)
    (0.25, 0.75, 0.5)
    """
    if not level > 0.0:
        raise UsageError(f"the level is {level:g} N", "give a level above 0")
    time, force = curve.time, curve.force
    above = np.flatnonzero(force > level)
    if not len(above):
        return TimeAbove(math.nan, math.nan)
    first, last = int(above[0]), int(above[-1])
    begin = float(time[0]) if first == 0 else _crossing(curve, first - 1, level)
    return TimeAbove(begin, math.inf if last == len(force) - 1 else _crossing(curve, last, level))


def dynamic_time(curve: ForceTimeCurve, profile: ForceProfile) -> float:
    """Return how long the force exceeds the limit that applies after the first step of a profile.

    Parameters
    ----------
    curve : ForceTimeCurve
        The force-time curve of a contact.
    profile : ForceProfile
        The profile; its second step has the limit.

    Returns
    -------
    float
        The time [s]: 0 if the limit is never exceeded, infinite if it is at the end of the record; NaN for a profile
        of one step, which has no such time.

    Examples
    --------
    300 N for 0.4 s, then 20 N, are above the 150 N of EN 12453 for 0.4 s.

    >>> from cdtool.truth.force.limits import read_force_limits
    >>> time = np.arange(6000) * 1e-3
    >>> curve = ForceTimeCurve(time, np.where(time < 0.4, 300.0, 20.0), np.zeros(6000, dtype=bool), end=6.0)
    >>> round(dynamic_time(curve, read_force_limits()["en_12453_reducing_gap"]), 3)
    0.4
    """
    return time_above(curve, profile.steps[1].at_most_n).length if len(profile.steps) > 1 else math.nan


def _crossing(curve: ForceTimeCurve, before: int, level: float) -> float:
    """Return where the straight line from a sample to the next one crosses the level [s]."""
    times, forces = curve.time[before : before + 2], curve.force[before : before + 2]
    share = (level - forces[0]) / (forces[1] - forces[0])
    return float(times[0] + share * (times[1] - times[0]))
