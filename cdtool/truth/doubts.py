"""What speaks against a load cell as the truth: a rest level that wanders, or a "force" that is the torque again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.statistics.correlation import correlation
from cdtool.statistics.spread import MAD_TO_STD
from cdtool.truth.force_vector import rest_of_axes
from cdtool.truth.missing_samples import cell_samples, longest_step
from cdtool.truth.onset_rule import OnsetRule

# Above this magnitude of the correlation the force follows the torque.
_FOLLOWS = 0.95
# They are compared around each contact: this long before its onset and after it [s].
_BEFORE, _AFTER = 0.2, 0.5
# The force that is left is the median over this end of the log [s], in which noise averages out.
_TAIL = 0.2


def truth_findings(recording: Recording, contacts: Sequence[Contact], rule: OnsetRule) -> list[Finding]:
    """Return warnings about the load cell of a recording as the ground truth of its contacts.

    Parameters
    ----------
    recording : Recording
        The recording.
    contacts : sequence of Contact
        Its contacts.
    rule : OnsetRule
        The rule by which they were found.

    Returns
    -------
    list of Finding
        A drift, an offset, a force that does not return to rest, a late start, or a force that is a copy of a torque.
        Empty without a load cell.

    Examples
    --------
    `cdtool.info` reports them.
    """
    if "force" not in recording:
        return []
    found = [_drifted(contact) for contact in contacts if _has_drifted(contact, rule)]
    found += [item for item in [_not_tared(contacts, rule)] if item]
    found += [item for item in [_not_back(recording["force"], contacts, rule)] if item]
    found += [item for item in [_begins_late(recording, contacts, rule)] if item]
    if levels := rest_of_axes(recording["force"]):
        found.append(Finding("force_magnitude_used", "force", {"rest": tuple(levels)}))
    joint, r = follows_torque(recording, contacts)
    if abs(r) > _FOLLOWS:
        found.append(Finding("follows_torque", "force", {"joint": joint if len(recording.joints) > 1 else "", "r": r}))
    return found


def _not_tared(contacts: Sequence[Contact], rule: OnsetRule) -> Finding | None:
    """A warning where the load cell rests off zero before its first contact."""
    first = next((item for item in contacts if item.found_by == "load cell" and not item.in_progress), None)
    # A cell that rests off zero by more than the upper level, or than 5 % of the first contact's peak, is not tared.
    if first is None or abs(first.rest) <= max(rule.above or 0.0, 0.05 * first.peak_force):
        return None
    return Finding("not_tared", "force", {"rest": first.rest, "onset": first.start})


def _begins_late(recording: Recording, contacts: Sequence[Contact], rule: OnsetRule) -> Finding | None:
    """A warning where the load cell's record begins later than the log, shortly before its first contact."""
    force = recording["force"]
    if not contacts or contacts[0].found_by != "load cell" or contacts[0].in_progress or contacts[0].hole:
        return None
    begins, onset = float(force.time[0]), contacts[0].start
    if begins - recording.start <= longest_step(force.time) or onset - begins > rule.separation:
        return None
    return Finding("force_begins_late", "force", {"begin": begins, "onset": onset})


def _not_back(force: Series, contacts: Sequence[Contact], rule: OnsetRule) -> Finding | None:
    """A warning where the last contact lasts to the end of the log at a force next to nothing."""
    samples = cell_samples(force)
    time, reading = samples.time, samples.force
    if not contacts or not len(time) or contacts[-1].found_by != "load cell" or contacts[-1].end < time[-1]:
        return None
    contact = contacts[-1]
    tail = reading[time >= time[-1] - _TAIL]
    left = float(np.median(tail)) - contact.rest
    noise = MAD_TO_STD * float(np.median(np.abs(tail - np.median(tail))))
    if abs(left) <= max(rule.back_to or 0.0, 3.0 * noise):
        return None  # below the level at which a contact ends: the log was cut off while the axis rebounds
    # More than 5 % of the peak may be a contact that lasts.
    if abs(left) > 0.05 * contact.peak_force or time[-1] - contact.start < _AFTER + _TAIL:
        return None
    return Finding("force_left", "force", {"force": left, "onset": contact.start})


def follows_torque(recording: Recording, contacts: Sequence[Contact]) -> tuple[str, float]:
    """The joint whose torque the force follows most closely without lag, and their correlation around the contacts.

    Without contacts over the whole recording; NaN where a shift fits better, as where a drive answers a contact.
    """
    none = "", float("nan")
    if "torque" not in recording or "force" not in recording:
        return none
    torque, force = recording["torque"], recording["force"]
    samples = cell_samples(force)
    time, reading = samples.time, samples.force
    near = _near(time, contacts)
    time, reading = time[near], reading[near]
    periods = [item.period for item in (force, torque) if np.isfinite(item.period)]
    if len(time) < 10 or not periods or np.ptp(reading) == 0.0:  # too few for a correlation
        return none
    period = max(periods)
    best = none
    for j, joint in enumerate(recording.joints):
        r = _correlation(reading, _at(torque, j, time))
        if not abs(r) > max(abs(best[1]) if best[0] else 0.0, _FOLLOWS):
            continue
        # A load cell that feels what the drive then answers leads the torque: by up to 0.1 s.
        count = int(np.ceil(0.1 / period))
        shifts = period * np.unique(np.linspace(2, max(count, 2), 12).astype(int))
        others = [_correlation(reading, _at(torque, j, time + shift)) for shift in (*shifts, *-shifts)]
        if abs(r) >= np.nanmax(np.abs([0.0, *others])):
            best = joint, r
    return best


def _near(time: FloatArray, contacts: Sequence[Contact]) -> np.ndarray:
    known = [contact for contact in contacts if not contact.in_progress]
    if not known:
        return np.ones(len(time), dtype=bool)
    near = np.zeros(len(time), dtype=bool)
    for contact in known:
        near |= (time >= contact.start - _BEFORE) & (time <= contact.start + _AFTER)
    return near


def _at(series: Series, joint: int, time: FloatArray) -> FloatArray:
    values, stamps = series.values[:, joint], series.time
    present = np.isfinite(values)
    if not present.all():
        values, stamps = values[present], stamps[present]
    if len(values) < 2:
        return np.full(len(time), np.nan)
    return np.asarray(np.interp(time, stamps, values))


def _correlation(a: FloatArray, b: FloatArray) -> float:
    if not np.all(np.isfinite(b)) or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return float("nan")
    return correlation(a, b)


def _has_drifted(contact: Contact, rule: OnsetRule) -> bool:
    # Without a lower level by hand a shift of the rest level counts from 1 % of the peak on.
    least = rule.back_to if rule.back_to is not None else 0.01 * contact.peak_force
    return not contact.in_progress and abs(contact.shift) > least


def _drifted(contact: Contact) -> Finding:
    return Finding(
        "rest_level_shifted", "force", {"shift": contact.shift, "onset": contact.start, "drift": contact.drift}
    )
