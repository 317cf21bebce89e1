"""Ground truth: the contacts of a recording, by the load cell, by labels or by events.

Conventions: a contact begins where the force, followed back from the first sample of a stay above the upper level, left
the lower level over the cell's rest level; of a force with several axes, its magnitude over their rest levels. State
the rule in every report: in soft impacts the cell responds to the contact tens of milliseconds after touch.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.recordings.recording import Contact, Recording
from cdtool.truth.force_vector import ForceMagnitude, force_magnitude, magnitude_contacts
from cdtool.truth.load_cell import load_cell_contacts
from cdtool.truth.onset_rule import OnsetRule as OnsetRule


def find_contacts(recording: Recording, rule: OnsetRule, steps: float = 0.0) -> list[Contact]:
    """Return the contacts of a recording, by the load cell, else by the label channel, else by events.

    With a load cell and a label channel of several kinds, times and forces are the cell's, the kinds the label's.

    Parameters
    ----------
    recording : Recording
        A recording with one of the channels force [N], label or event.
    rule : OnsetRule
        When a contact begins on the load cell.
    steps : float
        A level derived from the noise of the load cell is at least this many steps of its reading.

    Returns
    -------
    list of Contact
        In order of time.

    Raises
    ------
    RecordingError
        The recording has none of the channels.

    Examples
    --------
    A load cell reads 100 N from 1.0 s to 1.5 s.

    >>> from cdtool.recordings.recording import Series
    >>> time = np.arange(3000) * 1e-3
    >>> force = Series(time, np.where((time >= 1.0) & (time <= 1.5), 100.0, 0.0), "N")
    >>> contacts = find_contacts(Recording("run", "", ("axis",), {"force": force}), OnsetRule(above=20.0, back_to=8.0))
    >>> len(contacts), round(contacts[0].start, 2), contacts[0].peak_force
    (1, 1.0, 100.0)
    """
    if "force" in recording:
        force = recording["force"] if recording["force"].joint_count == 1 else force_magnitude(recording["force"], rule)
        found = (
            magnitude_contacts(force, rule, steps)
            if isinstance(force, ForceMagnitude)
            else load_cell_contacts(force, rule, steps)
        )
        found = _with_kinds(found, recording, rule)
        return [_widened(contact, recording.truth_clock) for contact in found] if recording.truth_clock else found
    if "label" in recording:
        return _from_label(recording)
    if "event" in recording:
        return _from_events(recording, rule)
    raise RecordingError(
        f"{recording.name}: no ground truth: none of 'force', 'label', 'event' is mapped",
        "map the load cell in [channels], name a label file, or use cdtool detect",
    )


def _with_kinds(contacts: list[Contact], recording: Recording, rule: OnsetRule) -> list[Contact]:
    """Return the load cell's contacts with the kinds of a label channel: of the label that lasts longest during each.

    A label that begins or ends up to `rule.separation` [s] from a contact counts if none is during it.
    """
    if not recording.label_kinds or "label" not in recording:
        return contacts
    labels = _from_label(recording)

    def kind_of(contact: Contact) -> str:
        shared = [(min(item.end, contact.end) - max(item.start, contact.start), item.kind) for item in labels]
        longest, kind = max(shared, key=lambda pair: pair[0], default=(-math.inf, ""))
        return kind if longest >= -rule.separation else ""

    return [replace(contact, kind=kind_of(contact)) for contact in contacts]


def _widened(contact: Contact, clock: float) -> Contact:
    """Return a contact whose onset may be earlier by how far the load cell's clock may be off [s]."""
    return contact if contact.in_progress else replace(contact, uncertainty=contact.uncertainty + clock)


def _from_label(recording: Recording) -> list[Contact]:
    series = recording["label"]
    present = np.flatnonzero(np.isfinite(series.values[:, 0]))
    time, values = series.time[present], series.values[present, 0]
    # The number of its kind, from 1; 0 where there is no contact. A change of kind is another contact.
    kinds = np.zeros(len(time), dtype=int)
    if recording.label_kinds:
        for number, (code, _) in enumerate(recording.label_kinds, 1):
            kinds[values == code] = number
    else:
        kinds[values > 0.5] = 1
    # A missing sample does not end a contact, unless the log has no other samples without one.
    usual = float(np.median(np.diff(present))) if len(present) > 1 else 1.0
    # Where a label has no value between contacts, more than five missing samples, by its usual step, are no contact.
    behind_hole = (np.diff(present, prepend=-1) > 5 * usual) & bool(np.all(kinds > 0))
    firsts = np.flatnonzero((np.diff(kinds, prepend=0) != 0) | behind_hole)
    ends = np.append(firsts[1:], len(time))[: len(firsts)]
    period = series.period if len(series) > 1 else 0.0
    before = np.concatenate((series.time[:1], time))[: len(time)]
    hole = np.where(behind_hole, time - before, 0.0)
    return [
        Contact(
            start=float(time[first]),
            end=float(time[end - 1]),
            uncertainty=max(0.5 * period if first else 0.0, float(hole[first])),
            found_by="label",
            kind=recording.label_kinds[kinds[first] - 1][1] if recording.label_kinds else "",
            resolution=max(period, float(hole[first])),
            in_progress=bool(first == 0 and not behind_hole[0]),
            hole=float(hole[first]),
        )
        for first, end in zip(firsts, ends, strict=True)
        if kinds[first]
    ]


def _from_events(recording: Recording, rule: OnsetRule) -> list[Contact]:
    series = recording["event"]
    times = series.time[np.nan_to_num(series.values[:, 0]) != 0.0]
    apart = np.concatenate(([True], np.diff(times) > rule.separation)) if len(times) else np.empty(0, dtype=bool)
    return [Contact(float(time), float(time), 0.0, found_by="event", resolution=0.0) for time in times[apart]]
