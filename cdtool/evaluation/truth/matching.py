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

from cdtool.detection import Alarm, Signal, Verdict
from cdtool.recording import Contact

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
    """Each contact in order of time with the beginning and the end [s] of its window; no two windows overlap."""
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
    """Match in order of time: each contact takes the first crossing in its window that no earlier contact took.

    An alarm outside every window, and not while the load cell still feels a contact, is false. One before a contact is
    counted as false and does not hide the contact's own detection: any new crossing detects, armed again or not. Alarms
    of several joints within `rearm` [s] are one false alarm. Where a log is cut into operations, `of_log` are all its
    contacts and `crossings` those of all its operations: an alarm belongs to its contact whatever the cut lies between.
    """
    taken: set[Alarm] = set()
    matches = []
    spans = windows(of_log or contacts, window)
    known = list(contacts)
    for contact, opens, closes in spans:
        if contact not in known:
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
    """Why nothing can be said of the latency of a contact that began where load-cell samples are missing."""
    return f"load-cell samples are missing for {1e3 * contact.hole:.0f} ms where it begins: its onset is not known"


def one_an_event(times: Sequence[float], rearm: float) -> list[int]:
    """Which alarms count where several joints raise one: those later than `rearm` [s] after the last that counts."""
    counted: list[int] = []
    for i in sorted(range(len(times)), key=lambda i: times[i]):
        if not counted or times[i] - times[counted[-1]] > rearm:
            counted.append(i)
    return counted


def belongs(time: float, spans: Sequence[tuple[Contact, float, float]]) -> bool:
    """Whether an alarm at that time [s] lies in a contact's window, or while the contact still presses."""
    return any(opens <= time <= max(closes, contact.end) for contact, opens, closes in spans)


def _end(statistic: Signal) -> float:
    return float(statistic.time[-1]) if len(statistic.time) else -np.inf


def _assessable(statistic: Signal, start: float, closes: float) -> bool:
    inside = (statistic.time >= start) & (statistic.time <= closes)
    return bool(np.any(statistic.valid[inside]))
