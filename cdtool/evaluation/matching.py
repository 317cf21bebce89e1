"""Alarms against contacts: one pass, one to one, everything else is derived from it.

Conventions: latency = time of the sample whose processing raised the alarm (debounce included) - onset. A contact
without an alarm in [onset - its uncertainty, onset + window] is missed: its latency is censored, never dropped. It is
not assessable where the detector's signal was valid nowhere between onset and the window's end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cdtool.detection import Alarm, Signal, Verdict
from cdtool.recording import Contact

Outcome = Literal["detected", "missed", "not_assessable"]


@dataclass(frozen=True)
class Match:
    """One contact and what became of it; `latency` [s] is NaN unless detected, `clipped` if it came out below zero.

    `reason` tells why a contact could not be assessed.
    """

    contact: Contact
    outcome: Outcome
    alarm: Alarm | None = None
    latency: float = float("nan")
    clipped: bool = False
    reason: str = ""


@dataclass(frozen=True)
class Matching:
    """Every contact with its outcome, and the alarms that belong to none."""

    matches: tuple[Match, ...]
    false_alarms: tuple[Alarm, ...]


def match(verdict: Verdict, contacts: Sequence[Contact], statistic: Signal, window: float = 1.0) -> Matching:
    """Match in order of time: each contact takes the first crossing in its window that no earlier contact took.

    An alarm outside every window, and not while the load cell still feels a contact, is false. One before a contact is
    counted as false and does not hide the contact's own detection: any new crossing detects, armed again or not.
    """
    taken: set[Alarm] = set()
    matches = []
    for contact in sorted(contacts, key=lambda item: item.start):
        opens, closes = contact.start - contact.uncertainty, contact.start + window
        inside = (alarm for alarm in verdict.crossings if opens <= alarm.time <= closes and alarm not in taken)
        found = next(inside, None)
        if found is None:
            if _assessable(statistic, contact, window):
                matches.append(Match(contact, "missed"))
            else:
                why = verdict.reason or statistic.why_not(contact.start, closes)
                matches.append(Match(contact, "not_assessable", reason=why))
            continue
        taken.add(found)
        latency = found.time - contact.start
        matches.append(Match(contact, "detected", found, max(latency, 0.0), latency < 0.0))
    alone = (alarm for alarm in verdict.alarms if alarm not in taken)
    false = tuple(alarm for alarm in alone if not _belongs(alarm, contacts, window))
    return Matching(tuple(matches), false)


def _belongs(alarm: Alarm, contacts: Sequence[Contact], window: float) -> bool:
    return any(
        contact.start - contact.uncertainty <= alarm.time <= max(contact.start + window, contact.end)
        for contact in contacts
    )


def _assessable(statistic: Signal, contact: Contact, window: float) -> bool:
    inside = (statistic.time >= contact.start) & (statistic.time <= contact.start + window)
    return bool(np.any(statistic.valid[inside]))
