"""The contact pressure of a repetition: its curve, how it compares with the limits of a body area, and what is open.

Conventions: pressure in N/cm2, as in the table of limits; time counts from the onset of the contact on the load cell
[s]. A pressure is that above the reading at rest before the contact. A record is compared as a force is: up to the
second step of the profile with the transient limit, from there on with the quasi-static one. Of a peak that was entered
by hand nobody knows when it was: it may be as high as the transient limit only if a record shows that it was early.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.commands.protocol.assessment.sampling import sample_rate
from cdtool.recordings.recording import CONTACT_PRESSURE, Contact, Recording, Series
from cdtool.recordings.units import UNITS
from cdtool.truth.force.curve import TAIL, ForceTimeCurve, force_time_curve
from cdtool.truth.force.limits import ForceProfile, ForceStep, PressureLimit
from cdtool.truth.force.verdict import ForceVerdict, Outcome, assess_force
from cdtool.truth.missing_samples import cell_samples
from cdtool.truth.rest_level import RunningRest

_PA = UNITS["N/cm2"].factor
# A record that begins within this time [s] before a contact may show no rest at all: a slow contact begins with it.
EARLY = 0.6
# Its first readings, over this time [s], are those nearest to the rest.
FIRST = 0.01
# An entered peak that differs from the recorded one by more than this share of the larger is shown as a deviation.
SAME_PEAK = 0.1


@dataclass(frozen=True)
class PressureRecord:
    """The recorded pressure of a contact.

    `curve`: pressure (n,) [N/cm2], as the force of a ForceTimeCurve. `rest` [N/cm2]: the reading before the contact,
    which is subtracted; `drift` [N/cm2 per s]: its drift, 0 unless beyond doubt; `rest_error` [N/cm2]: how far the rest
    may be wrong because the record begins shortly before the contact. `rises`: the pressure exceeds in the contact what
    it was before; else the sensor did not see it, or its clock is wrong.
    """

    curve: ForceTimeCurve
    rest: float = 0.0
    drift: float = 0.0
    rest_error: float = 0.0
    rises: bool = True

    @property
    def peak(self) -> float:
        """Return the largest pressure [N/cm2]."""
        return self.curve.peak

    @property
    def largest_reading(self) -> float:
        """Return the largest magnitude that the sensor had to show [N/cm2]."""
        return self.peak + abs(self.rest)

    @property
    def sample_rate(self) -> float:
        """Return the measured sample rate [Hz]; NaN below two samples."""
        return sample_rate(self.curve)

    def peak_from(self, begin: float) -> float:
        """Return the largest pressure from a time [s after the onset] on; NaN without a sample there."""
        late = self.curve.force[self.curve.time >= begin]
        return float(late.max()) if len(late) else math.nan


def pressure_record(
    recording: Recording, contact: Contact, until: float = math.inf, since: float = -math.inf
) -> PressureRecord | None:
    """Return the recorded pressure of a contact.

    Parameters
    ----------
    recording : Recording
        The recording, with the channel `contact_pressure` [Pa] on a clock of its own.
    contact : Contact
        The contact, found on the load cell.
    until : float
        Start of the next contact [s on the recording's clock].
    since : float
        End of the contact before [s on the recording's clock]: what the sensor reads at rest is sought after it.

    Returns
    -------
    PressureRecord or None
        None without a reading in the contact, or without one at rest before it: an offset would be unknown.

    Examples
    --------
    A film that reads 20 000 Pa at rest shows half a sine of 100 N/cm2.

    >>> time = np.arange(3000) * 1e-3
    >>> pulse = np.where((time >= 1.0) & (time <= 1.5), 1e6 * np.sin(2.0 * np.pi * (time - 1.0)), 0.0)
    >>> run = Recording("run", "", ("axis",), {"contact_pressure": Series(time, 2e4 + pulse, "Pa")})
    >>> record = pressure_record(run, Contact(start=1.0, end=1.5, uncertainty=0.001))
    >>> round(record.peak, 6), round(record.rest, 6), record.rises
    (100.0, 2.0, True)
    """
    if CONTACT_PRESSURE not in recording:
        return None
    samples = cell_samples(recording[CONTACT_PRESSURE])
    time, pressure = samples.time, samples.force / _PA
    before = (time >= since) & (time < contact.start)
    # The rest is known if the sensor was read between 1 s and 0.1 s before the contact.
    near = before & (time >= contact.start - 1.0)
    if not near.any() or time[near][0] > contact.start - 0.1:
        return None
    line = RunningRest(time[before], pressure[before]).line(contact.start)
    rest = line.value(contact.start)
    # The same rules as for a load cell: clipping, holes, where the curve ends.
    own = replace(recording, channels={**recording.channels, "force": Series(time, pressure, "N")})
    try:
        curve = force_time_curve(own, replace(contact, rest=rest, hole=0.0), until=until)
    except RecordingError:
        return None
    if contact.end >= time[-1] and recording.end - time[-1] > TAIL:
        # The sensor ends in the contact: the rest of it is a hole.
        curve = replace(curve, end=min(recording.end, until) - contact.start)
    noise = float(np.max(np.abs(pressure[near] - rest), initial=0.0))
    begin = time[before][0]
    first = float(np.mean(pressure[before & (time <= begin + FIRST)]))
    rest_error = abs(rest - first) if contact.start - begin < EARLY else 0.0
    return PressureRecord(curve, rest, line.drift, rest_error, rises=curve.peak > noise)


def as_profile(profile: ForceProfile, limit: PressureLimit) -> ForceProfile:
    """Return the limits of a pressure as those of a force, so that it is compared by the same rules.

    Parameters
    ----------
    profile : ForceProfile
        The profile, whose first two steps give the times and the names.
    limit : PressureLimit
        The limits [N/cm2].

    Returns
    -------
    ForceProfile
        The same profile with the pressures in its steps [N/cm2]; it does not average.

    Examples
    --------
    >>> from cdtool.truth.force.limits import read_force_limits
    >>> chest = read_force_limits()["iso_ts_15066_chest"]
    >>> [(step.from_s, step.at_most_n) for step in as_profile(chest, chest.pressure_limit()).steps]
    [(0.0, 240.0), (0.5, 120.0)]
    """
    first, *others = profile.steps
    steps = [ForceStep(0.0, limit.first, first.name)]
    steps += [ForceStep(step.from_s, limit.quasi_static, step.name) for step in others[:1]]
    return replace(profile, steps=tuple(steps), average_of=1)


@dataclass(frozen=True)
class PressureAssessment:
    """The pressure of one repetition: `record` and `entered` [N/cm2] as far as known, compared with `limit`.

    `verdict` is that of the record; None without a record or a limit.
    """

    limit: PressureLimit | None
    boundary: float
    record: PressureRecord | None = None
    entered: float | None = None
    verdict: ForceVerdict | None = None

    @classmethod
    def of(
        cls, profile: ForceProfile, area: str, record: PressureRecord | None, entered: float | None
    ) -> PressureAssessment:
        """Return what is known of a repetition; an entered pressure of 0 is not known: no contact has none."""
        limit = profile.pressure_limit(area)
        boundary = profile.steps[1].from_s if len(profile.steps) > 1 else 0.0
        verdict = assess_force(record.curve, as_profile(profile, limit)) if record and limit else None
        return cls(limit, boundary, record, entered or None, verdict)

    @property
    def is_judged(self) -> bool:
        """Whether a measured pressure is compared with a limit."""
        return self.limit is not None and self.is_known

    @property
    def is_known(self) -> bool:
        """Whether a pressure was measured."""
        return self.record is not None or self.entered is not None

    @property
    def peak(self) -> float | None:
        """Return the largest pressure [N/cm2], recorded or entered."""
        known = [self.record.peak] if self.record else []
        return max([*known, *([self.entered] if self.entered else [])], default=None)

    @property
    def late_peak(self) -> float | None:
        """Return the largest recorded pressure where the quasi-static limit applies [N/cm2]."""
        return self.record.peak_from(self.boundary) if self.record else None

    @property
    def peaks_differ(self) -> bool:
        """Whether the recorded and the entered peak differ by more than `SAME_PEAK`."""
        if self.record is None or self.entered is None:
            return False
        return abs(self.record.peak - self.entered) > SAME_PEAK * max(self.record.peak, self.entered)

    @property
    def time_is_unknown(self) -> bool:
        """Whether an entered peak is between both limits, and no record shows when it was."""
        if self.entered is None or self.limit is None or (self.record is not None and not self.peaks_differ):
            return False
        return self.limit.quasi_static < self.entered <= self.limit.first

    @property
    def outcome(self) -> Outcome:
        """Return fail if a limit is exceeded, not assessable if that is not known, otherwise pass."""
        if self.limit is None:
            return "pass"
        if (self.entered or 0.0) > self.limit.first or (self.verdict and self.verdict.outcome == "fail"):
            return "fail"
        is_open = not self.is_known or self.time_is_unknown or (self.record is not None and not self.record.rises)
        return "not_assessable" if is_open or (self.verdict and self.verdict.outcome != "pass") else "pass"
