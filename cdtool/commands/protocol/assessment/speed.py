"""The speed at which a machine ran into a contact, from samples before the contact only.

Conventions: speed in m/s, without sign; times in s. The speed of a rotation says nothing about that of a contact whose
lever is not known.
"""

from __future__ import annotations

import math

import numpy as np

from cdtool.recordings.recording import Contact, Recording

# The speed at the contact is that of a straight line through the samples of this time before it [s], or through the
# last three of a slower log.
_BEFORE, _FEWEST = 0.1, 3
# The last sample may be this old, or so many periods of a slower log, which is at most _OLDEST [s].
_RECENT, _PERIODS, _OLDEST = 0.05, 2.5, 0.25
# A position that is logged more often than it is read stays for more than so many samples. Its derivative is a row of
# pulses: in place of it counts the slope of a parabola through the readings of this time [s].
_HELD, _PARABOLA, _READINGS = 2, 0.2, 5


def speed_before(recording: Recording, contact: Contact) -> float | None:
    """Return the speed just before a contact.

    Parameters
    ----------
    recording : Recording
        The recording on the load side; a speed that is not logged was derived from the position, causally.
    contact : Contact
        The contact.

    Returns
    -------
    float or None
        The largest speed of the joints [m/s], at the earliest possible onset; NaN if no sample is just before it. None
        if no speed in m/s is known: it was not measured.

    Notes
    -----
    A least-squares line through the last 0.1 s, evaluated at the onset: a machine that brakes before the contact has
    there the speed at which it touches. Later samples are not used: the contact brakes, too. If the speed was derived
    from a position that the log repeats, it is the slope of a parabola through the readings of the last 0.2 s.

    Examples
    --------
    >>> from cdtool.recordings.recording import Series
    >>> time = np.arange(2000) * 1e-3
    >>> speed = np.where(time < 1.0, -0.2, 0.0)
    >>> run = Recording("run", "", ("axis",), {"speed": Series(time, speed, "m/s")})
    >>> round(speed_before(run, Contact(start=1.0, end=1.5, uncertainty=0.001)), 6)
    0.2
    """
    if "speed" not in recording or recording["speed"].unit != "m/s":
        return None
    series = recording["speed"]
    onset = contact.start - (contact.uncertainty if math.isfinite(contact.uncertainty) else 0.0)
    speeds = [_at(series.time, column, onset) for column in series.values.T]
    if "position" in recording and any(item.kind == "derived_speed" for item in recording.findings):
        position = recording["position"]
        slopes = [_slope_of_held(position.time, column, onset) for column in position.values.T]
        speeds = [one if slope is None else slope for one, slope in zip(speeds, slopes, strict=True)]
    known = [abs(speed) for speed in speeds if math.isfinite(speed)]
    return max(known) if len(known) == len(speeds) else math.nan


def _at(time: np.ndarray, speed: np.ndarray, onset: float) -> float:
    """Return the speed of one joint at the onset [m/s]; NaN if it is not known."""
    known = np.flatnonzero((time < onset) & np.isfinite(speed))
    if not len(known):
        return math.nan
    first = min(int(np.searchsorted(time[known], onset - _BEFORE)), max(len(known) - _FEWEST, 0))
    time, speed = time[known[first:]] - onset, speed[known[first:]]
    period = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if -time[-1] > max(_RECENT, min(_PERIODS * period, _OLDEST)) or time[0] < -_FEWEST * max(_BEFORE, _OLDEST):
        return math.nan
    if len(time) < _FEWEST:
        return float(speed[-1])
    return float(np.polyval(np.polyfit(time, speed, 1), 0.0))


def _slope_of_held(time: np.ndarray, position: np.ndarray, onset: float) -> float | None:
    """Return the speed of one joint at the onset from readings that the log repeats [m/s]; None if it does not."""
    known = np.flatnonzero((time < onset) & np.isfinite(position))
    changes = known[1:][np.diff(position[known]) != 0.0]
    read = changes[time[changes] >= onset - _PARABOLA]
    if len(read) < _READINGS or np.median(np.diff(read)) <= _HELD:
        return None
    since = time[read] - onset
    if -since[-1] > max(_RECENT, _PERIODS * float(np.median(np.diff(since)))):
        return None
    return float(np.polyval(np.polyder(np.polyfit(since, position[read], 2)), 0.0))
