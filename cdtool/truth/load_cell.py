"""Contacts from a load cell: when the force left its rest level, how finely that is known, and when it came back.

Conventions: times in s on the cell's own clock, forces in N over the rest level before the contact (`rest_level`). The
truth is found afterwards and nothing live rests on it, so the noise, the cell's steps and the search for the end use
the whole log; the rest level is that from before the onset. A contact that is in progress when the log begins has no
onset: it lasts from the first sample to its release.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.recordings.recording import Contact, Series
from cdtool.truth.missing_samples import CellSamples, cell_samples, time_to_shoulder
from cdtool.truth.onset_rule import OnsetRule
from cdtool.truth.rest_level import RestLine, RunningRest
from cdtool.truth.rest_lines import INTERVAL, IntArray

# Standard deviation of the error of rounding to steps of 1: uniform between -1/2 and 1/2.
ROUNDING = 12.0**-0.5
# A step above this [N] must be proved by its grid. Eight deviations of its rounding are 46 N: a coarser load cell is no
# truth for contacts that limits of 65 N and more allow.
_COARSEST = 20.0
# The rest level is estimated again from the samples up to this long before the onset [s].
BEFORE_ONSET = 0.05
# A burst of noise is looked for within this time before and after [s]: contacts last longer.
BURST = 0.03
# Released is what settles at this share of the first level, or less.
_RELEASED = 0.5


def reading_step(force: FloatArray) -> float:
    """The step in which a load cell (n,) reads [N]: the smallest distance between two readings; 0 if all are equal.

    Where it is coarser than the cell's noise, the median absolute deviation is 0 although the reading flickers by a
    step: the noise is then no less than the rounding's own, step / sqrt(12) (Widrow and Kollar, Quantization Noise,
    2008), so that 8 standard deviations are 2.3 steps. A cell that rests at one reading shows no steps but those of its
    contacts, which in a short contact may be as large as the contact: a step above 20 N counts only if four or more
    readings prove it, all on its grid; otherwise 20 N are returned. `force` holds no missing samples.
    """
    ordered = np.sort(force)
    distances = np.diff(ordered)
    # Readings closer than 1e-6 of the largest one differ by what arithmetic rounds, not by a step of the cell.
    is_step = distances > 1e-6 * float(np.max(np.abs(force), initial=0.0))
    if not is_step.any():
        return 0.0
    step = float(distances[is_step].min())
    if step <= _COARSEST:
        return step
    on_grid = (ordered - ordered[0]) / step
    # At least four readings, none off the grid by more than a hundredth of a step.
    proved = np.count_nonzero(is_step) >= 3 and bool(np.all(np.abs(on_grid - np.round(on_grid)) < 0.01))
    return step if proved else _COARSEST


def load_cell_contacts(series: Series, rule: OnsetRule, steps: float = 0.0) -> list[Contact]:
    """The contacts that a load cell feels, in order of time; missing samples are skipped.

    Where the level comes from the noise it is at least `steps` of the cell's steps.
    """
    samples = cell_samples(series)
    if len(samples.time) < 3:
        return []
    return ContactSearch(samples, rule, steps, float(series.time[0])).contacts()


def _joined(contact: Contact, rebound: Contact) -> Contact:
    """A contact with another that came too soon after it to be one of its own."""
    return replace(contact, end=rebound.end, peak_force=max(contact.peak_force, rebound.peak_force))


@dataclass(frozen=True)
class _Rise:
    """Where a contact begins: the first sample off the rest level, the first above the upper level, the direction."""

    onset: int
    high: int
    sign: float
    rest: RestLine


class ContactSearch:
    """One load cell's readings (n,) and what has been found in them so far.

    `rest` is their rest level, by default a running one.
    """

    def __init__(
        self, samples: CellSamples, rule: OnsetRule, steps: float, since: float, rest: RunningRest | None = None
    ) -> None:
        self.time, self.force, self.clock = samples.time, samples.force, samples.clock
        self.rule, self.since = rule, since
        self.period = samples.clock.period
        self.rest = RunningRest(samples.time, samples.force) if rest is None else rest
        # Levels that are given by hand do not depend on the noise.
        by_noise = (self.noise, steps * self.step) if rule.above is None else (0.0, 0.0)
        self.above, self.back_to = rule.levels(*by_noise)

    @cached_property
    def step(self) -> float:
        """Return the step in which the cell reads [N]."""
        return reading_step(self.force)

    @cached_property
    def noise(self) -> float:
        """Return the standard deviation of a reading at rest [N]."""
        return max(self.rest.noise, ROUNDING * self.step)

    def contacts(self) -> list[Contact]:
        """Every contact; one that is in progress at the start comes first."""
        found: list[Contact] = []
        begin, at_start = 0, self.rest.start
        while (rise := self._next(begin)) is not None:
            # Nothing has been at rest yet, or only what turned out to be a contact: was it one from the start?
            release = self._release(rise, begin) if all(item.in_progress for item in found) else None
            if release is not None:
                last, level = release
                found = [self._in_progress(last, level)]
                self.rest.exclude(float(self.time[0]), float(self.time[last]), level)
                begin, at_start = last + 1, level
            else:
                contact, last = self._contact(rise, at_start)
                if found and contact.start - found[-1].end <= self.rule.separation:
                    found[-1] = _joined(found[-1], contact)
                else:
                    found.append(contact)
                self.rest.exclude(contact.start - BEFORE_ONSET, contact.end + INTERVAL)
                begin = last + 1
        return found

    def _next(self, begin: int) -> _Rise | None:
        """The next contact's beginning from sample `begin` on."""
        while begin < len(self.time):
            over = self.force[begin:] - self.rest.levels[begin:]
            beyond = np.where(np.abs(over) > self.above, np.sign(over), 0.0)
            first = self._first_held(begin, beyond)
            if first is None:
                return None
            after = self._end_of_burst(begin, first, over)
            if after is None:
                others = np.flatnonzero(beyond[first - begin :] != beyond[first - begin])
                after = first + int(others[0]) if len(others) else len(self.time)
                rise = self._rise(begin, first, after, float(beyond[first - begin]))
                if rise is not None:
                    return rise
            begin = after
        return None

    def _first_held(self, begin: int, beyond: FloatArray) -> int | None:
        """The first sample of a run beyond one and the same level that lasts as long as the rule wants."""
        starts, _ = self._held_runs(begin, beyond)
        return begin + int(starts[0]) if len(starts) else None

    def _held_runs(self, begin: int, beyond: FloatArray) -> tuple[IntArray, IntArray]:
        """First and last sample, counted from `begin`, of each such run; `beyond` is -1, 0 or 1."""
        edges = np.flatnonzero(np.diff(beyond) != 0.0) + 1
        starts = np.concatenate(([0], edges))
        ends = np.concatenate((edges, [len(beyond)])) - 1
        time = self.time[begin : begin + len(beyond)]
        lasting = time[ends] - time[starts] + self.period
        # A sample stands for one period of the cell; half of one more or less is jitter.
        held = (beyond[starts] != 0.0) & (lasting >= self.rule.hold - 0.5 * min(self.period, self.rule.hold))
        return starts[held], ends[held]

    def _end_of_burst(self, begin: int, first: int, over: FloatArray) -> int | None:
        """Return the sample after a burst of noise around `first`, which goes to both sides; None without a burst."""
        since = max(begin, int(np.searchsorted(self.time, self.time[first] - BURST)))
        until = int(np.searchsorted(self.time, self.time[first] + BURST, side="right"))
        part = over[since - begin : until - begin]
        large = np.flatnonzero(np.abs(part) > self.above)
        sides = np.sort([float(np.max(part)), -float(np.min(part))])
        crossings = np.count_nonzero(np.diff(np.sign(part[large])))
        # A burst crosses both levels at least four times, goes to the other side by 40 % at least, and holds on one
        # side in at most half of its excursions.
        if crossings < 4 or sides[0] < 0.4 * sides[1]:
            return None
        # A load cell that rings after an impact stays on each side for longer.
        held, _ = self._held_runs(since, np.where(np.abs(part) > self.above, np.sign(part), 0.0))
        if len(held) > 0.5 * (crossings + 1):
            return None
        return since + int(large[-1]) + 1

    def _rise(self, begin: int, high: int, after: int, sign: float) -> _Rise | None:
        """Follow the force back to the lower level, over the rest level just before the onset.

        None if it is nowhere above the upper level over that one, from `high` to before `after`: the rest level of
        0.3 s ago was too far off.
        """
        line = self.rest.line(float(self.time[high]))
        onset = self._followed_back(begin, high, sign, line)
        for _ in range(3):
            line = self.rest.line(float(self.time[onset]), BEFORE_ONSET)
            before, onset = onset, self._followed_back(begin, high, sign, line)
            if onset == before:
                break
        over = sign * (self.force[onset:after] - line.value(self.time[onset:after]))
        above = np.flatnonzero(over > self.above)
        return _Rise(onset, onset + int(above[0]), sign, line) if len(above) else None

    def _followed_back(self, begin: int, high: int, sign: float, line: RestLine) -> int:
        """Return the sample after the last one, before `high`, at or below the lower level; otherwise `begin`."""
        span = 256
        while True:
            first = max(begin, high - span)
            over = sign * (self.force[first:high] - line.value(self.time[first:high]))
            low = np.flatnonzero(over <= self.back_to)
            if len(low) or first == begin:
                return first + int(low[-1]) + 1 if len(low) else begin
            span *= 4

    def _contact(self, rise: _Rise, at_start: float) -> tuple[Contact, int]:
        """The contact that begins there, and its last sample.

        With the sample period T, the interval i before the onset (also of a hole or a batch of stamps) and the rise
        time r from the onset to the upper level::

            uncertainty = max(T / 2, i - T / 2) + r,    resolution = i + r + (noise + error of the rest level) / slope

        The uncertainty reaches back to the touch: from there to the lower level a force that rises steadily takes no
        longer than r, if the upper level is at least twice the lower one, as by default.
        """
        onset, high, line = rise.onset, rise.high, rise.rest
        over = self.force[onset:] - line.value(self.time[onset:])
        last = onset + self._end(rise, over)
        start = float(self.time[onset])
        before = onset - 1
        # Where samples are missing before the onset, it may have come at any time in the hole.
        interval = max(self.period, start - float(self.time[before])) if before >= 0 else self.period
        rise_time = float(self.time[high]) - start
        drifted = line.error_at(start)
        blurred = self._time_for(rise, self.noise) + self._time_for(rise, drifted)
        level = line.value(float(self.time[onset]))
        hole, since_hole = self._hole(rise, over[: last - onset + 1])
        interval = max(interval, since_hole, self.clock.batch_length)
        contact = Contact(
            start=start,
            end=float(self.time[last]),
            uncertainty=max(0.5 * self.period, interval - 0.5 * self.period) + rise_time,
            peak_force=float(np.max(np.abs(over[: last - onset + 1]))),
            found_by="load cell",
            rest=level,
            drift=line.drift,
            shift=level - at_start,
            resolution=interval + rise_time + blurred,
            hole=hole,
        )
        return contact, last

    def _hole(self, rise: _Rise, over: FloatArray) -> tuple[float, float]:
        """How long samples are missing where the contact may have begun, and how long before its start that is [s].

        Just before the onset, and from there until the force is above the upper level. Earlier holes, up to the rule's
        separation, count where a touch as long as this one's rise fits in: this one may be its rebound.
        """
        first = int(np.searchsorted(self.time, self.time[rise.onset] - self.rule.separation))
        marks = self.time[max(first - 1, 0) : rise.high + 1]
        if first == 0:
            marks = np.concatenate(([self.since], marks))
        steps = np.diff(marks)
        touch = time_to_shoulder(self.time[rise.onset : rise.onset + len(over)], rise.sign * over, self.period)
        least = np.where(marks[1:] < self.time[rise.onset], touch, 0.0)
        wide = np.flatnonzero((steps > self.clock.longest_step) & (steps >= least))
        if not len(wide):
            return 0.0, 0.0
        return float(steps[wide].max()), max(float(self.time[rise.onset] - marks[wide[0]]), 0.0)

    def _time_for(self, rise: _Rise, force: float) -> float:
        """How long the force takes, as steeply as it rises at the onset, to rise by so many newtons [s]."""
        before = max(rise.onset - 1, 0)
        time = float(self.time[rise.high] - self.time[before])
        climbed = abs(float(self.force[rise.high] - self.force[before]))
        return force * time / climbed if climbed > 0.0 else 0.0

    def _end(self, rise: _Rise, over: FloatArray) -> int:
        """The last sample off the rest level before a pause as long as the rule's separation.

        A drift goes on in the meantime, or not: the lower level widens by it.
        """
        time = self.time[rise.onset :]
        off = np.abs(over) > self.back_to + abs(rise.rest.drift) * (time - time[0])
        starts, ends = self._held_runs(rise.onset, np.where(off, np.sign(over), 0.0))
        if not len(starts):
            return rise.high - rise.onset
        pauses = np.flatnonzero(time[starts[1:]] - time[ends[:-1]] > self.rule.separation)
        return int(ends[pauses[0]] if len(pauses) else ends[-1])

    def _release(self, rise: _Rise, begin: int) -> tuple[int, float] | None:
        """The last sample of a contact that lasted from the first on, and the rest level after it; else None.

        It was one where the force does not come back to what it was at first, but settles at half of it or less, and
        closer to zero by more than the upper level. So a load cell that is not tared is at rest as long as it comes
        back, or nearly so, and where the force went further to the other side of zero than a release does.
        """
        line, onset = rise.rest, rise.onset
        level = line.value(float(self.time[onset]))
        first = max(begin, min(onset, rise.high))
        over = self.force[onset:] - line.value(self.time[onset:])
        last = onset + self._end(rise, over)
        if abs(level) <= self.above or self.time[-1] - self.time[last] >= 2 * INTERVAL:
            return None
        settled = self.rest.settled(first, min(abs(level) - self.above, _RELEASED * abs(level)), self.back_to)
        if settled is None:
            return None
        sample, rest = settled
        if self.rest.reaches(onset, sample, -level, _RELEASED * level) or self._goes_on(sample, level, rest):
            return None
        over = self.force[: sample + 1] - rest
        # What was felt at the start was a contact if it was a tenth of the largest force until its release, or more.
        if abs(level - rest) < 0.1 * float(np.max(np.abs(over))):
            return None
        _, ends = self._held_runs(0, np.where(np.abs(over) > self.back_to, np.sign(over), 0.0))
        return int(ends[-1]) if len(ends) else sample, rest

    def _goes_on(self, sample: int, level: float, rest: float) -> bool:
        """Whether the force that went from `level` to `rest` goes on that way, within the rule's separation.

        A touch that is held before the impact: one contact, against the offset of a cell that is not tared.
        """
        until = int(np.searchsorted(self.time, self.time[sample] + self.rule.separation, side="right"))
        further = np.sign(rest - level) * (self.force[sample:until] - rest)
        return float(np.max(further)) > _RELEASED * abs(level - rest)

    def _in_progress(self, last: int, rest: float) -> Contact:
        return Contact(
            start=float(self.time[0]),
            end=float(self.time[last]),
            uncertainty=0.0,
            peak_force=float(np.max(np.abs(self.force[: last + 1] - rest))),
            found_by="load cell",
            rest=rest,
            in_progress=True,
        )
