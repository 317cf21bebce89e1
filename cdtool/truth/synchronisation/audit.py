"""Audit the synchronisation of a log's channels by the physics that connects them.

The speed is the derivative of the position, the acceleration that of the speed, and in a contact the load cell reads
what the machine's momentum balance leaves over: drive force less friction less inertia times acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import counted
from cdtool.machines.dynamics import Machine
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.synchronisation.channel_delay import ChannelDelay, RestsOn, TimedEvent, channel_delay_from
from cdtool.truth.synchronisation.combination import clock_line
from cdtool.truth.synchronisation.delay import LEAST_POINTS, EventDelay, SmoothSignal, delay_of
from cdtool.truth.synchronisation.smoothing import POINTS_PER_WIDTH, REACH, Grid, local_derivative

# Delays up to this are found [s].
LONGEST_DELAY = 0.25
# Widths of the smoothing: these multiples of the longer sample period. The least is what a local fit needs.
_WIDTHS = (1.5, 3.0, 6.0, 12.0, 24.0)
# Sections of a motion that are examined: as many as are needed, and as are affordable.
_MOST_SECTIONS = 48


@dataclass(frozen=True)
class _Waveform:
    """A signal, observed or part of a prediction: its samples (n,), the order of the derivative, and a factor."""

    time: FloatArray
    values: FloatArray
    order: int
    factor: float

    @cached_property
    def period(self) -> float:
        return float(np.median(np.diff(self.time)))

    def on(self, grid: Grid, width: float) -> FloatArray:
        """Return the signal (count,) on a grid."""
        times = grid.times
        first, last = np.searchsorted(self.time, (times[0] - REACH * width, times[-1] + REACH * width))
        near = slice(int(first), int(last) + 1)
        return self.factor * local_derivative(self.time[near], self.values[near], times, width, self.order)


@dataclass(frozen=True)
class _Window:
    """An event's start and end [s], and the rise time of a contact [s]."""

    start: float
    end: float
    rise: float = math.nan


def audit(recording: Recording, machine: Machine, contacts: Sequence[Contact]) -> tuple[ChannelDelay, ...]:
    """Return the delay of every channel that physics connects with another one.

    Parameters
    ----------
    recording : Recording
        A log on the load side, with each channel on its own clock.
    machine : Machine
        Its inertia and friction, for the balance in contacts.
    contacts : sequence of Contact
        The log's contacts, on the load cell's clock.

    Returns
    -------
    tuple of ChannelDelay
        Per joint the speed against the position, and the acceleration against position or speed; the load cell against
        the balance with the position and with the speed. Each states why where it is not assessable. Channels that
        cdtool derived from others are not listed. The load cell is only compared here, never used by a detector.

    Notes
    -----
    F = u - friction - J dv/dt for a rigid machine. With an accelerometer on the load, m dv/dt of the load is measured
    instead (two masses, connected by an elastic transmission). Of an axis, the friction in the machine file is
    subtracted; scale and offset are estimated in every event. The method fails where neither holds: contacts that the
    machine's inertia does not feel (very slow ones), clamping at standstill, robots whose contact moves another joint
    than the one examined, dry friction that the machine file does not have where the load rebounds.

    Examples
    --------
    The stamps of a speed are 4 ms late.

    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Series
    >>> time = np.arange(0.0, 6.0, 0.005)
    >>> position = Series(time, 0.3 * np.sin(2.0 * time) ** 3, "m")
    >>> speed = Series(time + 0.004, 1.8 * np.sin(2.0 * time) ** 2 * np.cos(2.0 * time), "m/s")
    >>> axis = LinearAxis.of({"coordinates": "load"})
    >>> found = audit(Recording("run", "", ("axis",), {"position": position, "speed": speed}), axis, [])
    >>> found[0].channel, found[0].reference, round(found[0].offset.value, 4)
    ('speed', 'position', 0.004)
    """
    found: list[ChannelDelay] = []
    # Of implausibly large values squares are infinite: what they are part of is not assessable.
    with np.errstate(over="ignore", invalid="ignore"):
        for j, joint in enumerate(recording.joints):
            found += _motion_delays(recording, j, joint if len(recording.joints) > 1 else "", contacts)
        if "force" in recording:
            found += _load_cell_delays(recording, machine, contacts, found)
    return tuple(found)


def _is_measured(recording: Recording, channel: str) -> bool:
    derived = {"speed": "derived_speed", "position": "integrated_position"}.get(channel)
    if channel not in recording or len(recording[channel]) < 3:
        return False
    return derived is None or not any(item.kind == derived for item in recording.findings)


def _part(series: Series, joint: int, order: int, factor: float = 1.0) -> _Waveform:
    return _Waveform(series.time, np.ascontiguousarray(series.values[:, joint]), order, factor)


def _motion_delays(recording: Recording, joint: int, name: str, contacts: Sequence[Contact]) -> list[ChannelDelay]:
    found = []
    has_position, has_speed = _is_measured(recording, "position"), _is_measured(recording, "speed")
    if has_position and has_speed:
        observed = _part(recording["speed"], joint, 0)
        predictor = _part(recording["position"], joint, 1)
        found.append(_by_sections(ChannelDelay("speed", "position", "derivative", name), observed, predictor, math.inf))
    if _is_measured(recording, "acceleration") and (has_position or has_speed):
        base, order = ("position", 2) if has_position else ("speed", 1)
        # In a contact an elastic transmission separates the accelerometer on the load from the motor.
        until = min((contact.start for contact in contacts), default=math.inf)
        observed, predictor = _part(recording["acceleration"], joint, 0), _part(recording[base], joint, order)
        found.append(_by_sections(ChannelDelay("acceleration", base, "derivative", name), observed, predictor, until))
    return found


def _by_sections(empty: ChannelDelay, observed: _Waveform, predictor: _Waveform, until: float) -> ChannelDelay:
    start = max(float(observed.time[0]), float(predictor.time[0]))
    end = min(float(observed.time[-1]), float(predictor.time[-1]), until)
    period = max(observed.period, predictor.period)
    windows = _sections(start, end, period, predictor)
    if not windows:
        return replace(empty, reason="the motion is too short, or at rest")
    found = _best_delay(empty, observed, [[predictor]], windows)
    # Three sections must agree: a single one may show the machine's elasticity, not the channel.
    if found.assessable and len(found.used) < 3:
        reason = f"only {counted(len(found.used), 'section')} of {len(windows)} with a change of motion that both show"
        return replace(empty, events=found.events, reason=reason)
    return found


def _sections(start: float, end: float, period: float, predictor: _Waveform) -> list[_Window]:
    """Return the sections of a motion in which it changes, at most `_MOST_SECTIONS`."""
    # At least 1 s and 100 samples; a long log is cut into 2000 sections, from which the ones to examine are chosen.
    length = max(1.0, 100.0 * period, (end - start) / 2000)
    if end - start < length:
        return []
    count = max(int((end - start) / length), 1)
    edges = np.linspace(start, end, count + 1)
    # How much the motion changes in a section: coarse, from a few points each.
    coarse = Grid.over(start, end, (end - start) / count / 10.0)
    change = local_derivative(predictor.time, predictor.values, coarse.times, coarse.step, predictor.order)
    section = np.clip(np.searchsorted(edges, coarse.times, side="right") - 1, 0, count - 1)
    spread = np.zeros(count)
    for number in range(count):
        own = change[(section == number) & np.isfinite(change)]
        spread[number] = float(np.ptp(own)) if len(own) > 3 else 0.0
    if not spread.any():
        return []
    busy = np.flatnonzero(spread > 0.05 * spread.max())
    if len(busy) > _MOST_SECTIONS:
        busy = busy[np.linspace(0, len(busy) - 1, _MOST_SECTIONS).round().astype(np.int64)]
    return [_Window(float(edges[number]), float(edges[number + 1])) for number in busy]


def _load_cell_delays(
    recording: Recording, machine: Machine, contacts: Sequence[Contact], others: Sequence[ChannelDelay]
) -> list[ChannelDelay]:
    windows = _contact_windows(recording["force"], contacts) if len(recording["force"]) > 2 else []
    bases = [name for name in ("position", "speed") if _is_measured(recording, name)]
    if not bases or not windows:
        reason = "no contact that the load cell shows" if bases else "neither position nor speed is measured"
        return [ChannelDelay("force", bases[0] if bases else "position", "deceleration", reason=reason)]
    found = []
    for base in bases:
        rests_on, sums = _balances(recording, machine, base, others)
        found.append(_best_delay(ChannelDelay("force", base, rests_on), _part(recording["force"], 0, 0), sums, windows))
    return found


def _contact_windows(force: Series, contacts: Sequence[Contact]) -> list[_Window]:
    windows = []
    for contact in (item for item in contacts if not item.in_progress):
        # From 0.15 s before its onset to 0.05 s after its end; of a long one, the rise and what follows it.
        end = min(contact.end + 0.05, contact.start + 0.6)
        windows.append(_Window(contact.start - 0.15, end, _rise_time(force, contact)))
    return windows


def _rise_time(force: Series, contact: Contact) -> float:
    """Return how long the force takes from its onset to half of its peak [s]."""
    part = force.between(contact.start, contact.end)
    over = np.abs(part.values[:, 0] - (contact.rest if math.isfinite(contact.rest) else 0.0))
    known = np.isfinite(over)
    if not known.any():
        return 0.5 * force.period
    high = np.flatnonzero(known & (over >= 0.5 * float(np.max(over[known]))))
    return max(float(part.time[high[0]]) - contact.start, 0.5 * force.period)


def _balances(
    recording: Recording, machine: Machine, base: str, others: Sequence[ChannelDelay]
) -> tuple[RestsOn, list[list[_Waveform]]]:
    """Return what the balance rests on, and one sum of parts per joint that may feel the contact."""
    order = 2 if base == "position" else 1
    inertia = machine.nominal_inertia
    has_torque = "torque" in recording and len(recording["torque"]) > 2 and bool(np.all(inertia > 0.0))
    reflected = getattr(machine, "reflected_inertia", None)
    sums = []
    rests_on: RestsOn = "momentum balance" if has_torque else "deceleration"
    for j in range(len(recording.joints)):
        motion = _part(recording[base], j, order)
        if not has_torque:
            sums.append([replace(motion, factor=-1.0)])
            continue
        parts = [replace(motion, factor=-float(inertia[j]))]
        lateness = _lateness(others, base, recording.joints[j] if len(recording.joints) > 1 else "")
        if _is_measured(recording, "acceleration") and not machine.coupled and reflected is not None:
            rests_on = "two masses"
            acceleration = recording["acceleration"]
            load = _Waveform(
                acceleration.time - (lateness or 0.0),
                np.ascontiguousarray(acceleration.values[:, j]),
                0,
                -float(inertia[j] - reflected[j]),
            )
            parts = [replace(motion, factor=-float(reflected[j])), load] if reflected[j] > 0.0 else [load]
        torque = recording["torque"]
        parts.append(_part(torque, j, 0))
        if "speed" in recording and not machine.coupled:
            # Constant while the motion keeps its direction; it changes its sign where the load rebounds.
            speed = recording["speed"]
            nothing = np.zeros_like(speed.values)
            parts.append(_part(speed.with_values(machine.force_balance(nothing, nothing, speed.values), "N"), j, 0))
        sums.append(parts)
    return rests_on, sums


def _lateness(others: Sequence[ChannelDelay], base: str, joint: str) -> float | None:
    """Return how late the accelerometer is against `base` [s]; None if that is not known."""
    found = {item.channel: item for item in others if item.joint == joint and item.assessable}
    if "acceleration" not in found:
        return None
    late = found["acceleration"].offset.value
    if found["acceleration"].reference == base:
        return late
    return late - found["speed"].offset.value if "speed" in found else None


def _best_delay(
    empty: ChannelDelay, observed: _Waveform, sums: Sequence[Sequence[_Waveform]], windows: Sequence[_Window]
) -> ChannelDelay:
    """Return the delay with the narrowest interval of all smoothings, widened by its change at twice that."""
    period = max(observed.period, *(part.period for parts in sums for part in parts))
    shortest = min(window.end - window.start for window in windows)
    # Twice the chosen width must still resolve an event: at least 12 widths per event.
    widths = [factor * period for factor in _WIDTHS if factor * period * 12.0 <= shortest] or [_WIDTHS[0] * period]
    trials = [_joint_events(observed, sums, windows, width) for width in widths]
    counts = [sum(event.delay.known for event in events) for events in trials]
    # A few events by chance, of many, do not show a smoothing to be good.
    scores = [
        # A smoothing counts if it shows a delay in at least 75 % of the events in which another one does.
        _score(events) if count >= 0.75 * max(counts) else math.inf
        for events, count in zip(trials, counts, strict=True)
    ]
    best = int(np.argmin(scores))
    if not math.isfinite(scores[best]):
        return channel_delay_from(replace(empty, width=widths[best]), trials[best])
    beside = trials[best + 1] if best + 1 < len(trials) else _joint_events(observed, sums, windows, 2.0 * widths[best])
    return channel_delay_from(
        replace(empty, width=widths[best], dependence=_change(trials[best], beside)), trials[best]
    )


def _joint_events(
    observed: _Waveform, sums: Sequence[Sequence[_Waveform]], windows: Sequence[_Window], width: float
) -> list[TimedEvent]:
    """Return the events of the joint that explains the observed signal best."""
    per_joint = [[_event(observed, parts, window, width) for window in windows] for parts in sums]
    return min(per_joint, key=_score)


def _event(observed: _Waveform, parts: Sequence[_Waveform], window: _Window, width: float) -> TimedEvent:
    step = width / POINTS_PER_WIDTH
    own = Grid.over(window.start, window.end, step)
    if own.count < LEAST_POINTS:
        middle = 0.5 * (window.start + window.end)
        return TimedEvent(EventDelay(middle, math.nan, math.nan, math.nan, reason="too few samples"), window.rise)
    is_contact = not math.isnan(window.rise)
    # A contact that is later than half of its window would be compared with what is not part of it.
    half = 0.5 * (window.end - window.start)
    # A periodic motion would allow longer ones: filters of drives are shorter than 0.1 s.
    longest = min(LONGEST_DELAY, half) if is_contact else max(0.1, 4.0 * width)
    wide = Grid.over(window.start - longest - step, window.end + longest + step, step)
    predicted = sum((part.on(wide, width) for part in parts), np.zeros(wide.count))
    y = SmoothSignal(own, observed.on(own, width))
    delay = delay_of(y, SmoothSignal(wide, predicted), window.start, window.end, longest, is_contact)
    # A delay whose standard error is above 50 ms says nothing.
    if delay.known and delay.error > 0.05:
        delay = EventDelay(delay.time, math.nan, math.nan, delay.explained, reason="the signals do not change enough")
    if delay.known and is_contact:
        period = max(observed.period, *(part.period for part in parts))
        # A force that rises within a sample period is not resolved: its delay is uncertain by a tenth of the period,
        # and by less the longer the rise is. Without noise, contacts at 30 Hz that rise in 20 to 100 ms scatter so.
        aliasing = 0.1 * period * min(period / window.rise, 1.0)
        delay = replace(delay, error=math.hypot(delay.error, aliasing))
    return TimedEvent(delay, window.rise)


def _score(events: Sequence[TimedEvent]) -> float:
    """Return half the width of the interval of the offset that the events show; infinite without a delay."""
    known = [event.delay for event in events if event.delay.known]
    if not known:
        return math.inf
    offset = clock_line(known).offset
    return 0.5 * (offset.high - offset.low)


def _change(chosen: Sequence[TimedEvent], beside: Sequence[TimedEvent]) -> float:
    """Return by how much the offset differs between two smoothings, beyond the uncertainty of the second one [s]."""
    pairs = [(a.delay, b.delay) for a, b in zip(chosen, beside, strict=True) if a.delay.known and b.delay.known]
    if not pairs:
        return 0.0
    offset = clock_line([replace(b, delay=b.delay - a.delay) for a, b in pairs]).offset
    return max(abs(offset.value) - 0.5 * (offset.high - offset.low), 0.0)
