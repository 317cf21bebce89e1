"""What a fault at a contact may cost: its own length and 20 ms, but for what of the contact lay within it.

A method cannot see what was never logged. Whether that is why a contact was found late is asked of the whole log's own
statistic: without the samples that the fault took, and with all others as they are, when does it alarm? Only samples
within the fault's own length count as taken, and of those only the ones for which the damaged log has no judged sample,
or one that rests on a held value: what a detector does not judge behind a fault, or makes of the samples there, excuses
nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from cdtool.activation import Activation, crossings_of
from cdtool.detection import Status
from cdtool.pipeline import Detection
from cdtool.recording import Contact, FloatArray

# What a fault may cost beyond its own length [s].
ALLOWED = 0.02
# Times of samples are equal to within this [s].
_SAME = 1e-9

Outcome = Literal["in time", "late", "missed", "evidence lost"]


@dataclass(frozen=True)
class Cost:
    """A detected contact with a fault of `length` [s]: first crossing of the whole and of the damaged log [s].

    `reachable`: the first crossing of the whole log's statistic without the samples that the fault took. Infinite: none
    within the contact's window.
    """

    length: float
    whole: float
    damaged: float
    reachable: float

    @property
    def seconds(self) -> float:
        """How much later the damaged log alarms than the whole one, beyond the fault's length [s]."""
        return self.damaged - self.whole - self.length

    @property
    def excused(self) -> bool:
        """Whether the whole log itself would have been as late without the samples that the fault took."""
        return self.reachable > self.whole + self.length + ALLOWED + _SAME

    @property
    def outcome(self) -> Outcome:
        """In time: at most the fault's length and 20 ms later. Evidence lost: 20 ms behind what was reachable."""
        if self.seconds <= ALLOWED + _SAME:
            return "in time"
        if self.excused and (np.isinf(self.reachable) or self.damaged <= self.reachable + ALLOWED + _SAME):
            return "evidence lost"
        return "missed" if np.isinf(self.damaged) else "late"


def cost_of(
    whole: Detection,
    damaged: Detection,
    contact: Contact,
    fault: tuple[float, float],
    activation: Activation,
    factor: float,
    window: float = 1.0,
) -> Cost | None:
    """What a `fault` (start, length) [s] costs a contact at a safety factor; None where the whole log misses it."""
    span = contact.start - contact.uncertainty, contact.start + window
    before = first_crossing(whole, activation, factor, span)
    if np.isinf(before):
        return None
    start, length = fault
    time = whole.statistic.time
    whole_samples = damaged.statistic.valid.any(axis=1)
    if damaged.signal.lost is not None:
        whole_samples &= ~damaged.signal.lost.any(axis=1)
    seen = damaged.statistic.time[whole_samples]
    near = np.minimum(np.searchsorted(seen, time - _SAME), max(len(seen) - 1, 0))
    judged = np.abs(seen[near] - time) <= _SAME if len(seen) else np.zeros(len(time), dtype=bool)
    taken = (time >= start - _SAME) & (time < start + length - _SAME) & ~judged
    late = span[0], span[1] + length + ALLOWED
    return Cost(
        length,
        before,
        first_crossing(damaged, activation, factor, late),
        first_crossing(whole, activation, factor, late, taken),
    )


def first_crossing(
    found: Detection,
    activation: Activation,
    factor: float,
    span: tuple[float, float],
    taken: FloatArray | None = None,
) -> float:
    """When a detection first crosses its limits within `span` [s] at a safety factor; infinite where it does not.

    `taken` (n,): samples that are left out, as missing.
    """
    statistic, met = found.statistic, found.exceedance()
    needed = activation.needed(statistic.time)
    fresh = np.zeros(len(statistic.time), dtype=bool)
    first = np.inf
    for joint in range(met.shape[1]):
        status = statistic.status[:, joint].copy()
        if taken is not None:
            status[taken] = Status.GAP
        level = np.ascontiguousarray(met[:, joint])
        calm = level <= (1.0 - activation.hysteresis) * factor
        at, _ = crossings_of(statistic.time, level > factor, calm, status, needed, activation.wait, fresh)
        times = statistic.time[at]
        inside = times[(times >= span[0]) & (times <= span[1])]
        first = min(first, float(inside[0]) if len(inside) else np.inf)
    return first
