"""Limit the cost of a fault at a contact: its own length and 20 ms, unless part of the contact was in it.

A method cannot detect what was not logged. Three checks determine whether this is why a contact was found late; none
uses the results of a detector or threshold on the damaged log.

* The load cell: outside the fault, did the contact press as hard and as long (peak and impulse of the force) within the
  time allowed as it had within the whole log when that alarmed?
* The whole log's own statistic: without the samples that the fault took, and with all others as they are, when does it
  alarm? Only samples within the fault's own length count as taken, and of those only the ones for which the damaged log
  has no judged sample, or one that rests on a held value.
* The whole log with a straight line where the fault lies, or with the values held, and nothing marked as missing: when
  does it alarm, at the latest? Detectors and thresholds remember: what the fault took is missing in what they show long
  behind it (a pulse summed up, a rise that a filter followed). In such a log no sample is missing, yet it shows no more
  than the damaged one: where a method is late in it, what is left of the contact does not suffice for that method.

A contact that the whole log itself finds as late with limits 5 % wider does not count either: its alarm was marginal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cdtool.alarms.activation import Activation, crossings_of
from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import BoolArray
from cdtool.detectors.detection import Status
from cdtool.recordings.recording import Contact, Recording

# What a fault may cost beyond its own length [s].
ALLOWED = 0.02
# Times of samples are equal to within this [s].
_SAME = 1e-9

# Limits wider by this share: what then is as late in the whole log was found in time by chance.
_HAIR = 0.05

Outcome = Literal["in time", "late", "missed", "evidence lost", "by a hair"]


@dataclass(frozen=True)
class Cost:
    """A detected contact with a fault of `length` [s]: first crossing of the whole and of the damaged log [s].

    `reachable`: the first crossing of the whole log's statistic without the samples that the fault took; `wider`: that
    of the whole log with wider limits; `filled`: the latest of the logs with a straight line or held values in the
    fault's place. Infinite: none. `pressed`: whether the contact showed enough of its force outside the fault.
    """

    length: float
    whole: float
    damaged: float
    reachable: float
    wider: float
    filled: float
    pressed: bool

    @property
    def seconds(self) -> float:
        """How much later the damaged log alarms than the whole one, beyond the fault's length [s]."""
        return self.damaged - self.whole - self.length

    @property
    def outcome(self) -> Outcome:
        """In time: at most the fault's length and 20 ms later."""
        if self.seconds <= ALLOWED + _SAME:
            return "in time"
        if not self.pressed or self.damaged <= max(self.reachable, self.filled) + ALLOWED + _SAME:
            return "evidence lost"
        if self.damaged <= self.wider + self.length + ALLOWED + _SAME:
            return "by a hair"
        return "missed" if np.isinf(self.damaged) else "late"


def cost_of(
    whole: Detection,
    damaged: Detection,
    contact: Contact,
    fault: tuple[float, float],
    activation: Activation,
    factor: float,
    filled: Callable[[], Sequence[Detection]],
    window: float = 1.0,
) -> Cost | None:
    """What a `fault` (start, length) [s] costs a contact at a safety factor; None where the whole log misses it.

    `filled` judges the whole log with the fault filled in, in each way; it is called where the alarm comes late.
    """
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
    after = first_crossing(damaged, activation, factor, late)
    # The line leads up to the first sample behind the fault: it may alarm before the onset.
    straight = min(span[0], start), late[1]
    in_time = after <= before + length + ALLOWED + _SAME
    return Cost(
        length,
        before,
        after,
        first_crossing(whole, activation, factor, late, taken),
        first_crossing(whole, activation, (1.0 + _HAIR) * factor, late),
        before if in_time else max(first_crossing(item, activation, factor, straight) for item in filled()),
        pressed_outside(whole.operation.recording, contact, fault, before),
    )


def pressed_outside(recording: Recording, contact: Contact, fault: tuple[float, float], alarm: float) -> bool:
    """Whether the contact presses as hard and as long outside the fault, by the time allowed, as until the alarm.

    By the load cell; True without one. `alarm` [s] is the whole log's; allowed are the fault's length and 20 ms more.
    """
    if "force" not in recording:
        return True
    start, length = fault
    force = recording["force"].between(contact.start, alarm + length + ALLOWED)
    size = np.abs(force.values[:, 0] - (contact.rest if np.isfinite(contact.rest) else 0.0))
    until = force.time <= alarm + _SAME
    outside = (force.time < start - _SAME) | (force.time >= start + length - _SAME)
    peaks = [float(size[part].max(initial=0.0)) for part in (until, outside)]
    impulses = [float(size[part].sum()) for part in (until, outside)]
    return peaks[1] >= peaks[0] and impulses[1] >= impulses[0]


def first_crossing(
    found: Detection,
    activation: Activation,
    factor: float,
    span: tuple[float, float],
    taken: BoolArray | None = None,
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
