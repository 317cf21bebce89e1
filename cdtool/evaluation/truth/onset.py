"""Ground truth: which contacts does a recording show? By the load cell, by labels or by events.

Conventions: a contact begins where the force, followed back from the first sample of a stay above the upper level,
left the lower level over the cell's rest level. State the rule in every report: in soft impacts the cell feels the
contact tens of milliseconds after touch.
"""

from __future__ import annotations

import numpy as np

from cdtool.errors import RecordingError
from cdtool.evaluation.truth.load_cell import load_cell_contacts
from cdtool.evaluation.truth.onset_rule import OnsetRule as OnsetRule
from cdtool.recording import Contact, Recording


def find_contacts(recording: Recording, rule: OnsetRule, steps: float = 0.0) -> list[Contact]:
    """Contacts by the load cell, else by the label channel, else by events; raises RecordingError without any.

    A load cell's level from the noise is at least `steps` of the steps in which it reads.
    """
    if "force" in recording:
        return load_cell_contacts(recording["force"], rule, steps)
    if "label" in recording:
        return _from_label(recording)
    if "event" in recording:
        return _from_events(recording, rule)
    raise RecordingError(
        f"{recording.name}: no ground truth: none of 'force', 'label', 'event' is mapped",
        "map the load cell in [channels], name a label file, or use cdtool detect",
    )


def _from_label(recording: Recording) -> list[Contact]:
    series = recording["label"]
    present = np.isfinite(series.values[:, 0])  # a missing sample does not end a contact
    time, touched = series.time[present], (series.values[present, 0] > 0.5).astype(int)
    edges = np.diff(np.concatenate(([0], touched, [0])))
    period = series.period if len(series) > 1 else 0.0
    return [
        Contact(
            start=float(time[a]),
            end=float(time[b - 1]),
            uncertainty=0.5 * period if a else 0.0,
            found_by="label",
            resolution=period,
            in_progress=bool(a == 0),
        )
        for a, b in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True)
    ]


def _from_events(recording: Recording, rule: OnsetRule) -> list[Contact]:
    series = recording["event"]
    times = series.time[np.nan_to_num(series.values[:, 0]) != 0.0]
    apart = np.concatenate(([True], np.diff(times) > rule.separation)) if len(times) else np.empty(0, dtype=bool)
    return [Contact(float(time), float(time), 0.0, found_by="event", resolution=0.0) for time in times[apart]]
