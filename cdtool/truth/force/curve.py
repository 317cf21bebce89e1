"""The force-time curve of a contact, to be checked against a force limit.

Conventions: time counts from the contact's onset [s]. The force is positive in the direction of the contact, whatever
the load cell's sign. Samples are missing if two are further apart than `missing_samples` allows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError, UsageError
from cdtool.recordings.motion import leading_joint
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.force_vector import ForceMagnitude
from cdtool.truth.missing_samples import PERIODS, CellClock, cell_samples, longest_step
from cdtool.truth.rest_level import rest_before

# Number of consecutive equal readings at the maximum that show a load cell at its stop.
_STUCK = 5
# Before the rounded top of a smooth peak, the reading one step lower lasts this share of it or more: a parabola 0.2.
_SLOW = 0.15
# A cell that ends earlier than its log by this time [s] has not recorded all of it.
TAIL = 0.1


@dataclass(frozen=True)
class ForceTimeCurve:
    """Contact force (n,) [N] at the times (n,) [s after the onset] of the existing samples.

    `at_stop` (n,): the load cell was at its stop, the true force was larger. `end`: how long the record continues after
    the onset [s]. `clock`: that of the cell's samples in the whole record, if they are more. `before`: time
    from the preceding sample, at which the force was at rest, to the first sample [s]; NaN if unknown. `hole`: for how
    long samples are missing where the contact may have begun, up to `uncertainty` earlier [s].
    """

    time: FloatArray
    force: FloatArray
    at_stop: BoolArray
    end: float
    clock: CellClock | None = None
    before: float = float("nan")
    hole: float = 0.0
    uncertainty: float = 0.0

    @property
    def saturated(self) -> bool:
        """Whether the load cell was at its stop at any time."""
        return bool(self.at_stop.any())

    @property
    def peak(self) -> float:
        """Return the largest force [N]."""
        return float(self.force.max())

    @cached_property
    def resolution(self) -> float:
        """Return the step in which the readings are written [N]; 0 if they are on no such grid, or too few show one."""
        return _resolution(self.force)

    @property
    def longest_step(self) -> float:
        """Return the largest distance of two samples without a missing one between them [s]."""
        return self._clock.longest_step

    @cached_property
    def _clock(self) -> CellClock:
        return CellClock(self.time) if self.clock is None else self.clock

    def holes(self) -> tuple[FloatArray, FloatArray]:
        """Return where samples are missing: beginnings and ends [s after the onset]."""
        return self._holes

    @cached_property
    def _holes(self) -> tuple[FloatArray, FloatArray]:
        marks = np.concatenate(([0.0], self.time, [max(self.end, float(self.time[-1]))]))
        wide = np.flatnonzero(np.diff(marks) > self.longest_step)
        return marks[wide], marks[wide + 1]

    def longest_hole(self, until: float = float("inf")) -> float:
        """Return the longest interval of missing samples, at the onset and up to `until` [s after the onset], or 0."""
        begins, ends = self.holes()
        inside = begins <= until
        return max(self.hole, float(np.max(ends[inside] - begins[inside], initial=0.0)))

    @property
    def has_missing_samples(self) -> bool:
        """Whether samples are missing anywhere, for longer than the cell's clock explains."""
        return bool(self.longest_hole() or self.could_reach(-np.inf, np.inf)[1])

    def could_reach(self, begin: float, end: float) -> tuple[float, float]:
        """Return the largest possible force [N] in steps longer than the period but not holes, and that step [s].

        `begin`, `end` [s after the onset]. Between forces a and b, a time d apart, it cannot exceed (a + b) / 2 + s d /
        2 if it changes by at most s per second: the steepest change in as much time next to the step. Both are 0
        without such a step.
        """
        time, force, period, longest = self.time, self.force, self._clock.period, self.longest_step
        if np.isfinite(self.before):
            time, force = np.concatenate(([time[0] - self.before], time)), np.concatenate(([0.0], force))
        steps, changes = np.diff(time), np.diff(force)
        odd = steps > PERIODS * period
        found = (0.0, 0.0)
        for k in np.flatnonzero(odd & (steps <= longest) & (time[1:] > begin) & (time[:-1] < end)):
            reach = max(steps[k], 3.0 * period) + 0.5 * period
            beside = ~odd & (time[1:] > time[k] - reach) & (time[:-1] < time[k + 1] + reach)
            steepest = float(np.max(np.abs(changes[beside] / steps[beside]), initial=0.0)) if beside.any() else np.inf
            most = 0.5 * float(force[k] + force[k + 1]) + 0.5 * steepest * float(steps[k])
            found = max(found, (most, float(steps[k])))
        return found


def force_time_curve(
    recording: Recording, contact: Contact, mass_before_cell: float = 0.0, until: float = float("inf")
) -> ForceTimeCurve:
    """Return the force-time curve of a contact: the load cell minus its reading at rest, plus inertia.

    Parameters
    ----------
    recording : Recording
        The whole recording in which the contact was found, on the load side: the reading at rest is that before the
        onset.
    contact : Contact
        The contact.
    mass_before_cell : float
        Mass that moves with the machine between load cell and contact [kg].
    until : float
        Start of the next contact [s on the recording's clock], at which the curve ends.

    Returns
    -------
    ForceTimeCurve
        Force (n,) [N], positive in the direction of the contact, at times (n,) [s after the onset].

    Raises
    ------
    UsageError
        The mass is negative or not finite.
    RecordingError
        There is no force sample after the onset; or, with a mass, acceleration in m/s2 or speed is missing, or the
        leading joint is at rest.

    Notes
    -----
    F_contact = F_cell + m a (thesis figure 4.11), with a [m/s2] in the direction of the contact force on the machine,
    against the motion of the leading joint: F_contact = F_cell - m sign(v) a_measured. The acceleration is interpolated
    linearly to the cell's clock.

    A sample is at the stop if 5 consecutive readings, or 5 times as many as the cell usually repeats, equal the
    largest.

    Fails: a coarse cell under a steady push looks as at its stop; a bias of the accelerometer appears multiplied by m.

    Examples
    --------
    A load cell that reads 3 N at rest shows half a sine of 150 N from 1.0 s to 1.5 s.

    >>> from cdtool.recordings.recording import Series
    >>> time = np.arange(3000) * 1e-3
    >>> pulse = np.where((time >= 1.0) & (time <= 1.5), 150.0 * np.sin(2.0 * np.pi * (time - 1.0)), 0.0)
    >>> run = Recording("run", "", ("axis",), {"force": Series(time, 3.0 + pulse, "N")})
    >>> curve = force_time_curve(run, Contact(start=1.0, end=1.5, uncertainty=0.001))
    >>> round(curve.peak, 6), round(float(curve.time[curve.force.argmax()]), 6), curve.saturated
    (150.0, 0.25, False)
    """
    if mass_before_cell < 0.0 or not np.isfinite(mass_before_cell):
        raise UsageError(f"mass_before_cell is {mass_before_cell:g} kg", "give 0 or more")
    samples = cell_samples(recording["force"])
    whole = samples.time
    first, last = (int(at) for at in np.searchsorted(whole, (contact.start, until)))
    if first >= last:
        raise RecordingError(
            f"{recording.name}: no load-cell sample after the onset at {contact.start:.3f} s",
            "check the force limits of contacts on the load cell",
        )
    rest = contact.rest if np.isfinite(contact.rest) else _rest(recording, contact)
    time, over = whole[first:last], samples.force[first:last] - rest
    pressing = (time <= contact.end) | (contact.end <= contact.start)
    largest = int(np.argmax(np.where(pressing, np.abs(over), -1.0)))
    force = over if over[largest] >= 0.0 else -over
    at_stop = _at_stop(force) | _axis_at_stop(recording["force"], first, last)
    if mass_before_cell > 0.0:
        force = force + mass_before_cell * _acceleration_with_contact(recording, contact.start, time)
    known = np.isfinite(force)
    if not known.any():
        raise RecordingError(f"{recording.name}: no acceleration after the onset", "set mass_before_cell to 0")
    end = min(_end(recording, contact, samples.clock), until) - contact.start
    return ForceTimeCurve(
        time[known] - contact.start,
        force[known],
        at_stop[known],
        end,
        clock=samples.clock,
        before=float(time[0] - whole[first - 1]) if first and known[0] else float("nan"),
        hole=contact.hole,
        uncertainty=contact.uncertainty if contact.hole else 0.0,
    )


def _rest(recording: Recording, contact: Contact) -> float:
    """Return the reading at rest before a contact that the load cell did not show; 0 of a magnitude."""
    if isinstance(recording["force"], ForceMagnitude):
        return 0.0
    samples = cell_samples(recording["force"])
    return rest_before(samples.time, samples.force, contact.start)


def force_at(curve: ForceTimeCurve, time: float) -> float:
    """Return the force at a time.

    Parameters
    ----------
    curve : ForceTimeCurve
        The force-time curve of a contact.
    time : float
        The time [s after the onset].

    Returns
    -------
    float
        The force of the last sample at or before the time [N]; NaN if samples are missing there, or after the end.

    Examples
    --------
    >>> time = np.arange(1000) * 1e-3
    >>> curve = ForceTimeCurve(time, 200.0 * time, np.zeros(1000, dtype=bool), end=1.0)
    >>> round(force_at(curve, 0.5004), 6), force_at(curve, 2.0)
    (100.0, nan)
    """
    at = int(np.searchsorted(curve.time, time, side="right")) - 1
    if at < 0 or time - curve.time[at] > curve.longest_step:
        return float("nan")
    return float(curve.force[at])


def _end(recording: Recording, contact: Contact, clock: CellClock) -> float:
    """Return until when samples are expected [s]: the cell's last one, or the log's if the cell ends in the contact."""
    last = float(recording["force"].time[-1])
    pressing = contact.end >= float(clock.time[-1]) - clock.longest_step
    return recording.end if pressing and recording.end - last > TAIL else last


def _resolution(force: FloatArray) -> float:
    """Return the step in which readings are written [N]; 0 if they are on no such grid, or too few show one."""
    steps = np.diff(np.unique(force))
    # Readings that differ by less than 1e-6 of the largest are equal: files have six digits or more.
    steps = steps[steps > 1e-6 * float(np.max(np.abs(force)))]
    if not len(steps):
        return 0.0
    smallest = float(steps.min())
    # Readings up to ten steps apart are multiples of the step, within a tenth of it.
    near = steps[steps < 10.0 * smallest] / smallest
    is_grid = len(near) > 1 and bool(np.all(np.abs(near - np.rint(near)) < 0.1))
    return smallest if is_grid else 0.0


def _at_stop(force: FloatArray) -> BoolArray:
    """Return the samples at the largest reading, if it repeats more often than the cell usually repeats a reading.

    The rounded top of a smooth peak repeats, too: it is not at a stop.
    """
    if np.count_nonzero(force == force.max()) < _STUCK:
        return np.zeros(len(force), dtype=bool)
    edges = np.flatnonzero(np.diff(force)) + 1
    lengths = np.diff(np.concatenate(([0], edges, [len(force)])))
    first = np.concatenate(([0], edges))
    highest = force[first] == force.max()
    usual = 1.0 if highest.all() else float(np.median(lengths[~highest]))
    if lengths[highest].max() < _STUCK * usual:
        return np.zeros(len(force), dtype=bool)
    long = highest & (lengths >= _STUCK * usual)
    cell = _resolution(force)
    if cell and all(
        _is_rounded(force, start, count, cell) for start, count in zip(first[long], lengths[long], strict=True)
    ):
        return np.zeros(len(force), dtype=bool)
    return np.repeat(highest, lengths)


def _is_rounded(force: FloatArray, start: int, count: int, cell: float) -> bool:
    """Return whether `count` largest readings are the rounded top of a peak: the force was rising slowly before them.

    If it goes on as it rose, it exceeds the reading by less than 1 / `_SLOW` steps of the cell before it falls.
    """
    lower = np.flatnonzero(force[:start] < force[start] - 1.5 * cell)
    near = force[lower[-1] + 1 if len(lower) else 0 : start]
    return bool(np.count_nonzero(near < force[start]) >= _SLOW * count)


def _axis_at_stop(series: Series, first: int, last: int) -> BoolArray | bool:
    """Return the samples from `first` to `last` at which an axis of a magnitude is at its stop.

    Only of an axis that takes part in the contact: one at rest may repeat its reading.
    """
    if not isinstance(series, ForceMagnitude):
        return False
    present = np.isfinite(series.values[:, 0])
    axes, readings = series.axes[present][first:last], series.readings[present][first:last]
    peak = float(np.max(series.values[present][first:last]))
    at_stop = np.zeros(len(axes), dtype=bool)
    for over, reading in zip(axes.T, readings.T, strict=True):
        largest = float(over[np.argmax(np.abs(over))])
        # An axis takes part in a contact from 30 % of the magnitude's peak on.
        if abs(largest) >= 0.3 * peak:
            at_stop |= _at_stop(np.copysign(1.0, largest) * reading)
    return at_stop


def _acceleration_with_contact(recording: Recording, onset: float, clock: FloatArray) -> FloatArray:
    """Return the acceleration (m,) [m/s2] in the direction of the contact force on the machine, at times `clock`."""
    for channel in ("acceleration", "speed"):
        if channel not in recording:
            raise RecordingError(
                f"{recording.name}: mass_before_cell requires the channel '{channel}'",
                "map it in [channels], or set mass_before_cell to 0",
                channel=channel,
            )
    measured = recording["acceleration"]
    if measured.unit != "m/s2":
        raise RecordingError(
            f"{recording.name}: mass_before_cell requires the acceleration in m/s2, not in {measured.unit}",
            "set mass_before_cell to 0",
        )
    joint = leading_joint(recording["speed"])
    return -_direction(recording, joint, onset) * _interpolated(measured.time, measured.values[:, joint], clock)


def _direction(recording: Recording, joint: int, onset: float) -> float:
    """Return +1 or -1: the direction of the joint at the beginning of the contact."""
    series = recording["speed"]
    speed = series.values[:, joint]
    # The direction of travel is that of the mean speed over the last 0.1 s before the onset.
    before = speed[(series.time >= onset - 0.1) & (series.time <= onset)]
    before = before[np.isfinite(before)]
    mean = float(np.mean(before)) if len(before) else 0.0
    if abs(mean) <= 0.05 * float(np.nanmax(np.abs(speed), initial=0.0)):  # at rest
        raise RecordingError(
            f"{recording.name}: the axis is at rest at {onset:.3f} s: the direction of the contact force is unknown",
            "set mass_before_cell to 0",
        )
    return 1.0 if mean > 0.0 else -1.0


def _interpolated(time: FloatArray, values: FloatArray, clock: FloatArray) -> FloatArray:
    """Interpolate linearly between existing samples; NaN outside and where samples are missing."""
    present = np.isfinite(values)
    time, values = time[present], values[present]
    if len(time) < 2:
        return np.full(len(clock), np.nan)
    after = np.clip(np.searchsorted(time, clock), 1, len(time) - 1)
    wide = time[after] - time[after - 1] > longest_step(time)
    missing = wide & (clock != time[after]) & (clock != time[after - 1])
    found: FloatArray = np.where(missing, np.nan, np.interp(clock, time, values, left=np.nan, right=np.nan))
    return found
