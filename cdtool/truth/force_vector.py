"""The magnitude of a force vector: the rest level of each axis is removed first, then the axes are joined.

Conventions: with the axes f (n, K) [N] and their rest levels b (n, K) of the same running estimate as that of a single
load cell (`rest_level`), the magnitude is |f - b|. It is never negative: pushing and pulling look the same, and of K
axes with noise sigma each it follows a chi distribution, with a mean of 1.25 sigma for two axes and 1.60 sigma for
three. Its rest level is 0, and the level of the onset rule that is so many standard deviations of a single reading is
that level which noise exceeds as rarely. A contact on one axis keeps the rest levels of all. Fails: a push for seconds
that on no axis exceeds the level from its noise is taken as a new rest level.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.load_cell import BEFORE_ONSET, BURST, ROUNDING, ContactSearch, reading_step
from cdtool.truth.missing_samples import CellClock, CellSamples
from cdtool.truth.onset_rule import OnsetRule
from cdtool.truth.rest_level import RunningRest
from cdtool.truth.rest_lines import INTERVAL

# The level of an axis after a contact that was in progress at the start is the median of this interval after it [s].
_AFTER = 4 * INTERVAL
_FEWEST = 3  # samples of which the first show a rest level


@dataclass(frozen=True, eq=False, repr=False)
class ForceMagnitude(Series):
    """The magnitude (n, 1) [N] of a force vector without its rest level.

    `readings` (n, K) [N] are those of the axes, and `axes` (n, K) [N] them over their rest levels; `noise` [N] is the
    standard deviation of the noisiest axis, `step` [N] the coarsest step in which one reads. A contact was in progress
    when the record began until `pressed_until` [s]; -inf without one.
    """

    axes: FloatArray
    readings: FloatArray
    noise: float
    step: float
    pressed_until: float

    @property
    def rest(self) -> FloatArray:
        """Return the rest level of each axis (n, K) [N]."""
        return self.readings - self.axes

    def between(self, start: float, end: float) -> Series:
        """Return the samples with start <= time <= end [s], as an ordinary channel."""
        return Series(self.time, self.values, self.unit).between(start, end)


def with_scalar_force(recording: Recording, rule: OnsetRule) -> Recording:
    """Return a recording whose force is a single number per sample: of a vector the magnitude, by `force_magnitude`.

    Parameters
    ----------
    recording : Recording
        The recording on the load side.
    rule : OnsetRule
        When a contact begins.

    Returns
    -------
    Recording
        The same recording if its force has one axis, or if it has none.

    Examples
    --------
    `cdtool.benchmark` and `cdtool.detect` use it for every log.
    """
    if "force" not in recording or recording["force"].joint_count == 1:
        return recording
    return replace(recording, channels={**recording.channels, "force": force_magnitude(recording["force"], rule)})


def force_magnitude(vector: Series, rule: OnsetRule) -> ForceMagnitude:
    """Return the magnitude of a force vector without the rest level of each axis.

    Parameters
    ----------
    vector : Series
        The axes (n, K) [N]; a sample with NaN on any axis is missing.
    rule : OnsetRule
        When a contact begins: the rest levels do not follow the force in a contact.

    Returns
    -------
    ForceMagnitude
        The magnitude (n, 1) [N]; NaN where a sample is missing.

    Examples
    --------
    Two axes that rest at 10 N and -5 N, pressed with 30 N and 40 N from 1.0 s on.

    >>> time = np.arange(2000) * 1e-3
    >>> pressed = (time >= 1.0).astype(float)
    >>> vector = Series(time, np.column_stack([10.0 + 30.0 * pressed, -5.0 + 40.0 * pressed]), "N")
    >>> magnitude = force_magnitude(vector, OnsetRule(above=20.0))
    >>> magnitude.values[500, 0], magnitude.values[1500, 0]
    (np.float64(0.0), np.float64(50.0))
    """
    present = np.isfinite(vector.values).all(axis=1)
    time, axes = vector.time[present], np.ascontiguousarray(vector.values[present].T)
    if len(time) < _FEWEST:
        nothing = np.full(vector.values.shape, np.nan)
        return ForceMagnitude(vector.time, nothing[:, 0], vector.unit, nothing, vector.values, 0.0, 0.0, -math.inf)
    steps = [reading_step(axis) for axis in axes]
    rests, pressed_until = _rest_levels(time, axes, rule)
    noise = max(max(rest.noise, ROUNDING * step) for rest, step in zip(rests, steps, strict=True))
    over = np.full(vector.values.shape, np.nan)
    over[present] = axes.T - np.column_stack([rest.levels for rest in rests])
    size = np.sqrt(np.sum(over**2, axis=1))
    return ForceMagnitude(vector.time, size, vector.unit, over, vector.values, noise, max(steps), pressed_until)


def magnitude_contacts(force: ForceMagnitude, rule: OnsetRule, steps: float = 0.0) -> list[Contact]:
    """Return the contacts that the magnitude of a force shows, in order of time.

    Parameters
    ----------
    force : ForceMagnitude
        The magnitude [N].
    rule : OnsetRule
        When a contact begins.
    steps : float
        A level derived from the noise is at least this many steps of the reading.

    Returns
    -------
    list of Contact
        Their `rest` is 0, as it is removed from the axes; `shift` is how far the vector of rest levels has shifted.

    Examples
    --------
    `find_contacts` calls it for a force with several axes.
    """
    present = np.isfinite(force.values[:, 0])
    time = force.time[present]
    if len(time) < _FEWEST:
        return []
    found = _MagnitudeSearch(force, present, rule, steps).contacts()
    return [_described(contact, time, force.rest[present], force.pressed_until) for contact in found]


def quiet_level(sigmas: float, axes: int) -> float:
    """Return the magnitude of `axes` readings with standard deviation 1 that noise exceeds as rarely as one `sigmas`.

    The survival functions of the chi and of the normal distribution are equal there (both sides of the latter).

    >>> [round(quiet_level(8.0, axes), 2) for axes in (1, 2, 3)]
    [8.0, 8.28, 8.51]
    """
    target = _log_chi_survival(sigmas, 1)
    low, high = sigmas, sigmas + 4.0 * math.sqrt(axes)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _log_chi_survival(middle, axes) > target else (low, middle)
    return 0.5 * (low + high)


def _log_chi_survival(level: float, axes: int) -> float:
    """Return the logarithm of the probability that a chi variable of one to three degrees of freedom is larger."""
    if axes == 2:
        return -0.5 * level**2
    tail = math.erfc(level / math.sqrt(2.0))
    more = math.sqrt(2.0 / math.pi) * level * math.exp(-0.5 * level**2) if axes == 3 else 0.0
    return math.log(tail + more) if tail + more > 0.0 else -0.5 * level**2


def _rest_levels(time: FloatArray, axes: FloatArray, rule: OnsetRule) -> tuple[list[RunningRest], float]:
    """Return the rest level of each axis (K, n), kept in the contacts of all, and until when it was pressed [s]."""
    # A magnitude above a level is above this share of it on one axis at least. A level from the noise is not divided:
    # below it, drift cannot be told from a contact.
    share = math.sqrt(len(axes))
    own = replace(rule, above=rule.above and rule.above / share, back_to=rule.back_to and rule.back_to / share)
    clock = CellClock(time)
    searches = [ContactSearch(CellSamples(clock, axis), own, 0.0, float(time[0])) for axis in axes]
    contacts = [search.contacts() for search in searches]
    pressed_until = max((item.end for found in contacts for item in found if item.in_progress), default=-math.inf)
    rests: list[RunningRest] = []
    for k, search in enumerate(searches):
        rest = search.rest
        assert isinstance(rest, RunningRest)
        others = sorted((item for j, found in enumerate(contacts) if j != k for item in found), key=lambda x: x.start)
        for item in others:
            if item.in_progress:
                after = axes[k][(time > item.end) & (time <= item.end + _AFTER)]
                rest.exclude(float(time[0]), item.end, float(np.median(after)) if len(after) else None)
            else:
                rest.exclude(item.start - BEFORE_ONSET, item.end + INTERVAL)
        rests.append(rest)
    return rests, pressed_until


class _MagnitudeSearch(ContactSearch):
    """The search for contacts in a magnitude, which is at rest at 0."""

    def __init__(self, force: ForceMagnitude, present: BoolArray, rule: OnsetRule, steps: float) -> None:
        size = np.ascontiguousarray(force.values[present, 0])
        samples = CellSamples(CellClock(force.time[present]), size)
        self._axes, self._step = force.axes[present], force.step
        # The rule multiplies by its sigmas.
        self._noise = force.noise * quiet_level(rule.sigmas, self._axes.shape[1]) / rule.sigmas
        at_zero = RunningRest(samples.time, np.zeros(len(size)))
        super().__init__(samples, rule, steps, float(force.time[0]), at_zero)

    @cached_property
    def noise(self) -> float:
        """Return the noise [N] that the level of the rule is derived from."""
        return self._noise

    @cached_property
    def step(self) -> float:
        """Return the coarsest step of an axis [N]; a magnitude has none."""
        return self._step

    def _end_of_burst(self, begin: int, first: int, over: FloatArray) -> int | None:
        """Return the sample after a burst of noise, which a sign shows: that along the largest force near it."""
        near, time = self._axes[begin:], self.time[begin:]
        since, until = np.searchsorted(time, (self.time[first] - BURST, self.time[first] + BURST))
        largest = near[since + int(np.argmax(over[since:until]))]
        return super()._end_of_burst(begin, first, np.where(near @ largest < 0.0, -over, over))


def _described(contact: Contact, time: FloatArray, rest: FloatArray, pressed_until: float) -> Contact:
    """Return a contact with the shift of the vector of rest levels (n, K) at times (n,) [s]."""
    onset = int(np.searchsorted(time, contact.start))
    if onset == 0 and pressed_until > -math.inf:
        return replace(contact, uncertainty=0.0, in_progress=True, end=max(contact.end, pressed_until))
    return replace(contact, shift=math.dist(rest[onset], rest[0]))


def rest_of_axes(force: Series) -> Sequence[float]:
    """Return the level [N] at which each axis rests when the record begins; empty for a single load cell.

    Parameters
    ----------
    force : Series
        The force of a recording.

    Returns
    -------
    sequence of float
        One level per axis.

    Examples
    --------
    >>> rest_of_axes(Series(np.arange(3.0), np.zeros(3), "N"))
    ()
    """
    if not isinstance(force, ForceMagnitude):
        return ()
    known = force.rest[np.isfinite(force.rest).all(axis=1)]
    return tuple(known[0].tolist()) if len(known) else ()
