"""The part of a log that is learned from: a given section, and what is before the first contact."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cdtool.base.errors import RecordingError
from cdtool.base.plain_text import digits
from cdtool.commands.judging.impact_free import contacts_shown
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.true_contacts import any_contacts, missing_truth
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.recording import SHOWS_CONTACTS, Contact, Recording

# The shortest part that is learned from [s]: detectors start up in less.
_SHORTEST = 0.5


@dataclass(frozen=True)
class PartToLearnFrom:
    """Selects the section of each log, up to `guard` [s] before its first contact; None: contacts are not looked for.

    The onset is that of the `rules`, as for scoring: from a label file that names the log, or from its load cell.
    """

    rules: ScoringRules
    sections: Mapping[Path, LogSection] = field(default_factory=dict)
    guard: float | None = None

    def __call__(self, listed: Path, recording: Recording) -> tuple[Recording, Sequence[Contact]]:
        """Return the part of a log or run and the contacts in it; raises RecordingError if there is no such part.

        `listed` is the path under which `sections` has it.
        """
        section, path = self.sections.get(listed, LogSection()), recording.source
        if self.guard is None:
            part = section.of(recording)
            if self._is_labelled(recording):
                return part, section.contacts_of(recording, any_contacts(recording, self.rules))
            return part, contacts_shown(part, self.rules.onset)
        contacts = any_contacts(recording, self.rules)
        if not contacts and not self._is_labelled(recording):
            self._refuse_without_truth(path, recording)
        if any(item.in_progress for item in contacts):
            raise RecordingError(f"{path}: a contact is in progress at its start: nothing before it to learn from")
        begin, end = section.times(recording)
        doubt = self.rules.synchronisation + self.guard
        first = min((item.start - item.uncertainty for item in contacts), default=math.inf)
        end = min(end, first - doubt)
        part = recording.between(begin, end)
        if not part.channels or not part.duration >= _SHORTEST:
            left = digits(max(0.0, end - max(begin, recording.start)))
            where = f", {digits(doubt)} s before the contact at {digits(first)} s" if math.isfinite(first) else ""
            raise RecordingError(
                f"{path}: {left} s to learn from{where}: at least {digits(_SHORTEST)} s are needed",
                "reduce learn.guard_s, or leave the log out",
            )
        return part, ()

    def _is_labelled(self, recording: Recording) -> bool:
        labels = self.rules.labels
        return labels is not None and labels.name_of(recording.name) is not None

    def _refuse_without_truth(self, path: str, recording: Recording) -> None:
        """Raise RecordingError if a contact would not be seen: without ground truth, or where it is lost."""
        if not any(channel in recording for channel in SHOWS_CONTACTS):
            raise RecordingError(
                f"{path}: no ground truth: until = 'onset' needs a load cell, a label or an event",
                "map one in [channels], name the log in the label file, or give the part by from and to",
            )
        if missing := missing_truth(recording):
            raise RecordingError(
                f"{path}: no contact found, and {missing}", "give the part by from and to, or remove it"
            )
