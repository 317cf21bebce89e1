"""Alarms against contacts: one pass, one to one, everything else is derived from it.

Conventions: latency = time of the sample whose processing raised the alarm (debounce included) - onset. A contact's
window is [onset - its uncertainty, onset + window]; it ends earlier where the next contact's window begins. A contact
without an alarm in it is missed: its latency is censored at `watched`, never dropped. It is not assessable where the
detector's signal was valid nowhere between onset and the window's end, or where load-cell samples are missing for as
long as the window before its first sample: its beginning was not measured. A contact that is in progress when the
recording begins has no onset, and so no latency: it is neither detected nor missed, and what alarms until its release,
and in the window after that, is no false alarm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cdtool.detectors.detection import Alarm, Signal, Verdict
from cdtool.recordings.recording import Contact

# What raises an alarm again within this time [s] is the same event.
REARM = 0.5

# Why a contact that is in progress at the start has no latency.
IN_PROGRESS = "in progress when the recording begins: its onset is not recorded"

Outcome = Literal["detected", "missed", "not_assessable", "in_progress"]


@dataclass(frozen=True)
class Match:
    """One contact and its outcome; `latency` [s] is NaN unless detected, `clipped` if it was negative.

    `watched`: how long after the onset an alarm would have counted [s], the censoring time of a missed contact.
    `reason` states why a contact is not assessable, or has no latency.
    """

    contact: Contact
    outcome: Outcome
    alarm: Alarm | None = None
    latency: float = float("nan")
    clipped: bool = False
    watched: float = float("nan")
    reason: str = ""


@dataclass(frozen=True)
class Matching:
    """Every contact with its outcome, and the alarms that belong to none."""

    matches: tuple[Match, ...]
    false_alarms: tuple[Alarm, ...]


def windows(contacts: Sequence[Contact], window: float) -> list[tuple[Contact, float, float]]:
    """Return for each contact the window in which an alarm detects it.

    Parameters
    ----------
    contacts : sequence of Contact
        The contacts of a log.
    window : float
        How long after its onset a contact may be detected [s].

    Returns
    -------
    list of (Contact, float, float)
        Each contact in order of time, with the beginning and the end of its window [s]. The beginning is earlier than
        the onset by its uncertainty; no two windows overlap.

    Examples
    --------
    >>> contacts = [Contact(start=1.0, end=1.2, uncertainty=0.1), Contact(start=1.5, end=1.6, uncertainty=0.1)]
    >>> [(begin, end) for _, begin, end in windows(contacts, 1.0)]
    [(0.9, 1.4), (1.4, 2.5)]
    """
    ordered = sorted(contacts, key=lambda item: item.start)
    opens = [-np.inf if contact.in_progress else contact.start - contact.uncertainty for contact in ordered]
    for i in range(1, len(ordered)):
        opens[i] = max(opens[i], ordered[i - 1].start)
    begins = [contact.end if contact.in_progress else contact.start for contact in ordered]
    closes = [min(begin + window, after) for begin, after in zip(begins, [*opens[1:], np.inf], strict=False)]
    return list(zip(ordered, opens, closes, strict=True))


def match(
    verdict: Verdict,
    contacts: Sequence[Contact],
    statistic: Signal,
    window: float = 1.0,
    *,
    of_log: Sequence[Contact] = (),
    crossings: Sequence[Alarm] = (),
    rearm: float = REARM,
) -> Matching:
    """Match alarms with contacts in order of time: each contact takes the first crossing in its window.

    Parameters
    ----------
    verdict : Verdict
        Alarms and crossings of the operation.
    contacts : sequence of Contact
        Its contacts.
    statistic : Signal
        Its statistic: a contact in whose window it is nowhere valid is not assessable.
    window : float
        How long after its onset a contact may be detected [s].
    of_log : sequence of Contact
        All contacts of the log, if it is cut into operations.
    crossings : sequence of Alarm
        Those of all operations of the log: an alarm belongs to its contact wherever the log is cut.
    rearm : float
        Alarms of several joints within this time are one false alarm [s].

    Returns
    -------
    Matching
        Every contact with its outcome and latency [s], and the false alarms.

    Notes
    -----
    A crossing is taken by one contact only. An alarm outside every window, and not while the load cell still shows a
    contact, is false. One before a contact counts as false and does not hide the detection of the contact: any new
    crossing detects, whether the alarm is armed again or not.

    Examples
    --------
    >>> alarm = Alarm(time=1.05, joint="axis", side="above", statistic=450.0, limit=400.0)
    >>> time = np.arange(3000) * 1e-3
    >>> statistic = Signal(time, np.zeros((3000, 1)), np.zeros((3000, 1), dtype=np.uint8), "N")
    >>> verdict = Verdict("alarm", (alarm,), crossings=(alarm,))
    >>> matching = match(verdict, [Contact(start=1.0, end=1.2, uncertainty=0.001)], statistic)
    >>> matching.matches[0].outcome, round(matching.matches[0].latency, 6), matching.false_alarms
    ('detected', 0.05, ())
    """
    taken: set[Alarm] = set()
    matches = []
    spans = windows(of_log or contacts, window)
    starts = {contact.start for contact in contacts}  # a copy of a contact is not equal to it if a field is NaN
    for contact, opens, closes in spans:
        if contact.start not in starts:
            continue
        if contact.in_progress:
            matches.append(Match(contact, "in_progress", reason=IN_PROGRESS))
            continue
        watched = max(min(closes, _end(statistic)) - contact.start, 0.0)
        if contact.hole and contact.uncertainty >= window:
            matches.append(Match(contact, "not_assessable", watched=watched, reason=unknown_onset(contact)))
            continue
        candidates = crossings or verdict.crossings
        inside = (alarm for alarm in candidates if opens <= alarm.time <= closes and alarm not in taken)
        found = next(inside, None)
        if found is None:
            if _assessable(statistic, contact.start, closes):
                matches.append(Match(contact, "missed", watched=watched))
            else:
                why = verdict.reason or statistic.why_not(contact.start, closes)
                matches.append(Match(contact, "not_assessable", watched=watched, reason=why))
            continue
        taken.add(found)
        latency = found.time - contact.start
        matches.append(Match(contact, "detected", found, max(latency, 0.0), latency < 0.0, watched))
    alone = [alarm for alarm in verdict.alarms if alarm not in taken and not belongs(alarm.time, spans)]
    return Matching(tuple(matches), tuple(alone[i] for i in one_an_event([alarm.time for alarm in alone], rearm)))


def unknown_onset(contact: Contact) -> str:
    """Return why a contact that began where load-cell samples are missing has no latency."""
    return f"load-cell samples are missing for {1e3 * contact.hole:.0f} ms where it begins: its onset is not known"


def one_an_event(times: Sequence[float], rearm: float) -> list[int]:
    """Return which alarms count if several joints raise one: those later than `rearm` [s] after the last one."""
    counted: list[int] = []
    for i in sorted(range(len(times)), key=lambda i: times[i]):
        if not counted or times[i] - times[counted[-1]] > rearm:
            counted.append(i)
    return counted


def belongs(time: float, spans: Sequence[tuple[Contact, float, float]]) -> bool:
    """Return whether an alarm belongs to a contact.

    Parameters
    ----------
    time : float
        Time of the alarm [s].
    spans : sequence of (Contact, float, float)
        What `windows` returned.

    Returns
    -------
    bool
        True in a contact's window, or while the contact is still in progress.

    Examples
    --------
    >>> spans = windows([Contact(start=1.0, end=3.0, uncertainty=0.0)], 1.0)
    >>> belongs(2.5, spans), belongs(3.5, spans)
    (True, False)
    """
    return any(opens <= time <= max(closes, contact.end) for contact, opens, closes in spans)


def _end(statistic: Signal) -> float:
    return float(statistic.time[-1]) if len(statistic.time) else -np.inf


def _assessable(statistic: Signal, start: float, closes: float) -> bool:
    inside = (statistic.time >= start) & (statistic.time <= closes)
    return bool(np.any(statistic.valid[inside]))
