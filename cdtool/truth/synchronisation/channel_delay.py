"""How late a channel is: the result of the audit, for one log or pooled over several.

Convention: a channel is late by 3 ms if its samples are stamped 3 ms later than the same moment in the reference
channel. The reason may be a clock, a filter, a transmission or the machine's elasticity; the audit cannot distinguish
them. This is not a detector's latency, from onset to alarm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

from cdtool.base.plain_text import counted
from cdtool.statistics.interval import Interval
from cdtool.truth.synchronisation.combination import clock_line
from cdtool.truth.synchronisation.delay import EventDelay

# What connects a channel with its reference.
RestsOn = Literal["derivative", "two masses", "momentum balance", "deceleration"]

_UNKNOWN = Interval(math.nan, math.nan, math.nan)
#: Fewer contacts do not show how much contacts scatter: one contact read 1.50 ms (1.35 to 1.65) at a true offset of 0.
LEAST_CONTACTS = 5
#: An offset whose interval is wider than this [s] says nothing about a clock: it is as long as a stiff contact's rise.
_WIDEST_OFFSET = 0.02


@dataclass(frozen=True)
class TimedEvent:
    """A contact or a section of a motion: its delay, and for a contact its rise time [s], otherwise NaN."""

    delay: EventDelay
    rise: float = math.nan


@dataclass(frozen=True)
class ChannelDelay:
    """How late a channel is against a reference, with a 95 % interval, or why that is not assessable.

    Parameters
    ----------
    channel, reference : str
        The channel, and what its stamps are compared with.
    rests_on : str
        What connects the two: "derivative", or for a load cell the balance of the machine in contacts.
    joint : str
        The joint; empty where there is but one.
    offset : Interval
        How late the channel is at the time `at` [s]; negative: early.
    at : float
        The time for which `offset` holds, the weighted centre of the events [s].
    drift : Interval
        By how much the offset grows per time [s/s]; NaN: not assessable.
    events : tuple of TimedEvent
        All contacts or sections that were examined; those without a delay have a reason.
    used : tuple of int
        Numbers of the events on which offset and drift rest.
    width : float
        Standard deviation of the Gaussian by which both signals were smoothed [s].
    dependence : float
        By how much the offset changes if both are smoothed twice as much, beyond what is uncertain [s]. A clock's
        offset does not, but a filter's or an elastic machine's delay does: it is part of the interval.
    stiff, soft : Interval
        The offset in the contacts with the shorter and the longer rise times [s], which `offset` reaches; NaN: of one
        kind.
    reason : str
        Why the delay is not assessable; empty if it is.
    """

    channel: str
    reference: str
    rests_on: RestsOn
    joint: str = ""
    offset: Interval = _UNKNOWN
    at: float = math.nan
    drift: Interval = _UNKNOWN
    events: tuple[TimedEvent, ...] = ()
    used: tuple[int, ...] = ()
    width: float = math.nan
    dependence: float = 0.0
    stiff: Interval = _UNKNOWN
    soft: Interval = _UNKNOWN
    reason: str = ""

    @property
    def assessable(self) -> bool:
        """Whether there is an offset."""
        return not self.reason

    @property
    def has_delays(self) -> bool:
        """Whether an event has a delay: together with other logs, there may be an offset."""
        return any(event.delay.known for event in self.events)


def channel_delay_from(empty: ChannelDelay, events: Sequence[TimedEvent]) -> ChannelDelay:
    """Return the delay that events show.

    Parameters
    ----------
    empty : ChannelDelay
        The channel, reference and `dependence`, without a result.
    events : sequence of TimedEvent
        All events that were examined.

    Returns
    -------
    ChannelDelay
        The offset, its interval widened by `dependence`; without any known delay, the most frequent reason.

    Examples
    --------
    >>> shown = [TimedEvent(EventDelay(10.0 * i, 3e-3 + 1e-5 * (-1) ** i, 1e-5, 0.99)) for i in range(6)]
    >>> late = channel_delay_from(ChannelDelay("force", "position", "momentum balance"), shown)
    >>> round(late.offset.value, 4), late.reason
    (0.003, '')
    """
    known = [number for number, event in enumerate(events) if event.delay.known]
    if not known:
        reasons = [event.delay.reason for event in events]
        reason = max(reasons, key=reasons.count) if reasons else "no event"
        return replace(empty, events=tuple(events), reason=reason)
    line = clock_line([events[number].delay for number in known])
    used = tuple(known[number] for number in line.used)
    drift = line.drift
    if drift.known and _is_unclear(drift, empty.rests_on):
        drift = _UNKNOWN
    stiff, soft = _by_kind([events[number] for number in used])
    offset = _reaching(_widened(line.offset, empty.dependence), stiff, soft)
    width, reason = offset.high - offset.low, ""
    if empty.rests_on != "derivative" and len(used) < LEAST_CONTACTS:
        reason = f"{counted(len(used), 'contact')} with a delay, at least {LEAST_CONTACTS} are needed"
    elif width > _WIDEST_OFFSET:
        reason = f"the interval is {1e3 * width:.0f} ms wide, at most {1e3 * _WIDEST_OFFSET:.0f} ms is useful"
    if reason:
        return replace(empty, events=tuple(events), used=used, reason=reason)
    return replace(
        empty,
        offset=offset,
        at=line.at,
        drift=drift,
        events=tuple(events),
        used=used,
        stiff=stiff,
        soft=soft,
    )


def pooled(delays: Sequence[ChannelDelay], starts: Sequence[float]) -> ChannelDelay:
    """Return the delay of a channel over several logs that have the same clocks.

    Parameters
    ----------
    delays : sequence of ChannelDelay
        Those of one channel and joint against the same reference, one per log.
    starts : sequence of float
        What each log's times count from, on one clock [s]; 0 if that is unknown.

    Returns
    -------
    ChannelDelay
        The offset of all events together, and, if the logs' starts are known, the drift between the clocks.

    Examples
    --------
    >>> shown = [TimedEvent(EventDelay(1.0, 3e-3 + 1e-5 * i, 1e-5, 0.99)) for i in range(5)]
    >>> each = [channel_delay_from(ChannelDelay("force", "speed", "deceleration"), [event]) for event in shown]
    >>> round(pooled(each, [0.0] * 5).offset.value, 6)
    0.00302
    """
    events = tuple(
        replace(event, delay=replace(event.delay, time=event.delay.time + start - starts[0]))
        for item, start in zip(delays, starts, strict=True)
        for event in item.events
    )
    first = delays[0]
    dependence = max(item.dependence for item in delays)
    empty = ChannelDelay(first.channel, first.reference, first.rests_on, first.joint, dependence=dependence)
    return channel_delay_from(empty, events)


def preferred(delays: Sequence[ChannelDelay]) -> tuple[ChannelDelay, ...]:
    """Return one delay per channel and joint.

    Parameters
    ----------
    delays : sequence of ChannelDelay
        A load cell may have one against the position and one against the speed.

    Returns
    -------
    tuple of ChannelDelay
        The one against the position, which is the least filtered channel; the one against the speed if its interval
        is clearly narrower, as with a position of coarse steps.

    Examples
    --------
    >>> unknown = [ChannelDelay("force", name, "deceleration", reason="no contact") for name in ("position", "speed")]
    >>> [item.reference for item in preferred(unknown)]
    ['position']
    """
    best: dict[tuple[str, str], ChannelDelay] = {}
    for item in delays:
        key = (item.channel, item.joint)
        # Half as wide is clearly narrower.
        if key not in best or _half(item) < 0.5 * _half(best[key]):
            best[key] = item
    return tuple(best.values())


def _half(delay: ChannelDelay) -> float:
    half = 0.5 * (delay.offset.high - delay.offset.low)
    return half if delay.assessable else math.inf


def _is_unclear(drift: Interval, rests_on: RestsOn) -> bool:
    """Return True for a drift that is not assessable, or that of channels of one device if it may be zero."""
    is_zero = drift.low <= 0.0 <= drift.high
    # No clock drifts by 1 ms/s: a drift that is known no better to each side is not assessable.
    return drift.high - drift.low > 2e-3 or (rests_on == "derivative" and is_zero)


def _widened(interval: Interval, dependence: float) -> Interval:
    half = math.hypot(interval.high - interval.value, dependence)
    return replace(interval, low=interval.value - half, high=interval.value + half)


def _reaching(interval: Interval, *kinds: Interval) -> Interval:
    """Return the interval extended to the offsets of both kinds of contacts: which one is the clock's is not known."""
    values = [kind.value for kind in kinds if kind.known]
    return replace(interval, low=min(interval.low, *values), high=max(interval.high, *values)) if values else interval


def _by_kind(events: Sequence[TimedEvent]) -> tuple[Interval, Interval]:
    """Return the offsets of stiff and of soft contacts; NaN if their rise times do not form two kinds."""
    rises = sorted(event.rise for event in events if not math.isnan(event.rise))
    if len(rises) < 2 * 2:
        return _UNKNOWN, _UNKNOWN
    ratios = [later / max(rise, 1e-6) for rise, later in pairwise(rises[1:-1])]
    widest = max(range(len(ratios)), key=ratios.__getitem__)
    if ratios[widest] < 2.5:  # soft contacts rise at least so much slower than stiff ones
        return _UNKNOWN, _UNKNOWN
    limit = rises[widest + 1]
    stiff = [event.delay for event in events if event.rise <= limit]
    soft = [event.delay for event in events if event.rise > limit]
    return clock_line(stiff).offset, clock_line(soft).offset
