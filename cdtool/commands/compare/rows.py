"""One detector in one group of two builds: which contacts are compared, and the questions with their answers."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Final, Literal

from cdtool.commands.compare.pairs import Pairing, pairs_of_contacts
from cdtool.commands.compare.questions import (
    LEAST_CHANGE,
    Asked,
    Compared,
    Figure,
    Labels,
    Watched,
    ask_false_alarms,
    ask_mean,
    ask_missed,
    ask_not_assessable,
    ask_not_assessable_operations,
)
from cdtool.results.results import ContactResult, ExposureResult, Results
from cdtool.results.summary import campaigns
from cdtool.statistics.paired import holm

NOTHING_SHOWN: Final = "no change shown"
INCONCLUSIVE: Final = "inconclusive"
Outcome = Literal["worse", "better", "mixed", "no change shown", "inconclusive"]
# The smallest change for the worse that matters: a tenth of the old mean latency or force, of the contacts (missed, not
# assessable), or of a false alarm per operation.
RELEVANT_CHANGE = 0.1


@dataclass(frozen=True, kw_only=True)
class Question(Compared):
    """What is compared, and whether a change is shown, with the p corrected over all questions (Holm).

    `detectable`: the least change of a mean that would have been shown with 80 % power, or the smallest new count that
    would have been; infinite if the sample is too small. `left_open`: the largest change for the worse that these
    recordings do not rule out, as a share of the old mean, of the contacts, or per operation; NaN if there was nothing
    to test.
    """

    outcome: Literal["worse", "better", "no change shown", "inconclusive", "not_asked"]
    corrected_p: float
    detectable: float
    left_open: float


@dataclass(frozen=True)
class BuildRow:
    """One detector in one group.

    `old_contacts` and `new_contacts` are all that the files hold, `pairs` those of recordings in both, which are
    compared one by one where `paired`; in `one_not_assessable` of them one build could not assess the contact, which
    counts there alone. What happened on the pairs: the new build is later on `later` of them, by `later_ms` (least,
    most), earlier on `earlier`, and later by `later_share` of the old mean; `newly_missed` and `newly_detected` count
    the contacts that only one of the builds missed. No latency is finer than `resolution_ms`, None if unknown.
    """

    detector: str
    group: str
    paired: bool
    old_contacts: int
    new_contacts: int
    pairs: int
    one_not_assessable: int
    questions: tuple[Question, ...] = ()
    words: str = ""
    later: int = 0
    later_ms: tuple[float, float] | None = None
    later_share: float = 0.0
    earlier: int = 0
    earlier_ms: tuple[float, float] | None = None
    newly_missed: int = 0
    newly_detected: int = 0
    resolution_ms: float | None = None

    @property
    def outcome(self) -> Outcome:
        """What is shown; else whether a relevant change would have been."""
        found = {item.outcome for item in self.questions}
        if {"worse", "better"} <= found:
            return "mixed"
        for outcome in ("worse", "better", INCONCLUSIVE):
            if outcome in found:
                return outcome
        return NOTHING_SHOWN

    def is_later(self, relevant_change: float) -> bool:
        """Whether the new build misses more of the pairs, or is later on most and by this share of the old mean."""
        return self.misses_more or (self.later > self.earlier and self.later_share >= relevant_change)

    @property
    def misses_more(self) -> bool:
        """Whether more of the pairs are newly missed than no longer missed."""
        return self.newly_missed > self.newly_detected

    @property
    def inconclusive(self) -> bool:
        """Whether a relevant change of some figure could not have been shown."""
        return any(item.outcome == INCONCLUSIVE for item in self.questions)

    @property
    def few(self) -> bool:
        """Whether fewer than ten latencies are compared: tables then show median and range, no mean."""
        latency = self.question("latency_ms")
        return latency is not None and latency.ranges is not None

    def question(self, figure: Figure) -> Question | None:
        """The question about a figure; None where the group has none of it."""
        return next((item for item in self.questions if item.figure == figure), None)


class Build:
    """One build's results by detector and group."""

    def __init__(self, results: Results) -> None:
        self.labels = campaigns(results)
        self._contacts: dict[tuple[str, str], list[ContactResult]] = defaultdict(list)
        self._false_alarms: dict[tuple[str, str], int] = defaultdict(int)
        self._exposure = {(item.detector, item.group): item for item in results.exposure}
        for contact in results.scored_contacts:
            self._contacts[contact.detector, contact.group].append(contact)
        for alarm in results.false_alarms:
            self._false_alarms[alarm.detector, alarm.group] += 1

    @property
    def held(self) -> set[tuple[str, str]]:
        """The detectors and groups that it has figures of."""
        return {*self._contacts, *self._exposure}

    def contacts(self, detector: str, group: str) -> list[ContactResult]:
        """The contacts, seen by a detector."""
        return self._contacts.get((detector, group), [])

    def false_alarms(self, detector: str, group: str) -> Watched:
        """How many, in how many hours and operations."""
        watched = self._watched(detector, group)
        judged = watched.operations - watched.not_assessable
        return Watched(self._false_alarms.get((detector, group), 0), watched.hours, judged)

    def not_assessable_operations(self, detector: str, group: str) -> tuple[int, int]:
        """Return how many were nowhere assessable, and of how many."""
        watched = self._watched(detector, group)
        return watched.not_assessable, watched.operations

    def _watched(self, detector: str, group: str) -> ExposureResult:
        return self._exposure.get((detector, group), ExposureResult(group, detector, 0, 0, 0.0))


def ask(
    detector: str, group: str, builds: tuple[Build, Build], pairing: Pairing, level: float
) -> tuple[BuildRow, list[Asked]]:
    """A row without its questions, and what is asked; `level` of the intervals."""
    old, new = (build.contacts(detector, group) for build in builds)
    paired = pairing.paired
    pairs = pairs_of_contacts(pairing, old, new)
    before, after = ([a for a, _ in pairs], [b for _, b in pairs]) if paired else (old, new)
    labels = (_shared_labels(builds, pairing) if paired else builds[0].labels, builds[1].labels)
    # Counts of other logs that happen to be equal say less.
    same_logs = paired and not pairing.old_alone and not pairing.new_alone
    watched = builds[0].false_alarms(detector, group), builds[1].false_alarms(detector, group)
    if old or new:
        asked = [
            ask_mean("latency_ms", before, after, labels, paired, level),
            ask_missed(before, after, paired),
            ask_not_assessable(before, after, paired),
            ask_false_alarms(*watched, same_logs),
            ask_mean("force_at_alarm_n", before, after, labels, paired, level),
        ]
    else:
        unassessed = (
            builds[0].not_assessable_operations(detector, group),
            builds[1].not_assessable_operations(detector, group),
        )
        asked = [
            ask_not_assessable_operations(*unassessed, same_logs),
            ask_false_alarms(*watched, same_logs),
        ]
    apart = sum((a.outcome == "not_assessable") != (b.outcome == "not_assessable") for a, b in pairs)
    known = [(a.latency_ms, b.latency_ms) for a, b in pairs if a.latency_ms is not None and b.latency_ms is not None]
    changes, before_ms = [b - a for a, b in known], sum(a for a, _ in known)
    late = [change for change in changes if change > LEAST_CHANGE]
    early = [-change for change in changes if -change > LEAST_CHANGE]
    outcomes = [(a.outcome, b.outcome) for a, b in pairs]
    row = BuildRow(
        detector,
        group,
        paired,
        len(old),
        len(new),
        len(pairs),
        apart,
        later=len(late),
        later_ms=(min(late), max(late)) if late else None,
        later_share=sum(changes) / before_ms if before_ms else math.inf,
        earlier=len(early),
        earlier_ms=(min(early), max(early)) if early else None,
        newly_missed=outcomes.count(("detected", "missed")),
        newly_detected=outcomes.count(("missed", "detected")),
        resolution_ms=max((item.resolution_ms for item in (*old, *new) if item.resolution_ms), default=None),
    )
    return row, asked


def answer(
    asked: Sequence[tuple[BuildRow, Sequence[Asked]]], significance: float, relevant_change: float = RELEVANT_CHANGE
) -> tuple[list[BuildRow], int]:
    """The rows with their questions, corrected together over all rows (Holm), and how many were asked.

    A test that shows nothing is inconclusive if it leaves more than `relevant_change` open, unless every value of its
    row is the same, contact by contact.
    """
    p = [item.p for _, items in asked for item in items]
    count = sum(not math.isnan(value) for value in p)
    corrected = iter(holm(p).tolist())
    rows = []
    unchanged = all(_all_same(items, significance) for _, items in asked)
    for row, items in asked:
        # Counts alone can agree by chance; where every latency agrees, or the whole files do, nothing has changed.
        timed = any(item.figure == "latency_ms" and item.same for item in items)
        same = unchanged or (timed and _all_same(items, significance))
        tolerated = math.inf if same else relevant_change
        questions = tuple(_answered(item, next(corrected), significance, count, tolerated) for item in items)
        rows.append(replace(row, questions=questions))
    return rows, count


def _all_same(items: Sequence[Asked], significance: float) -> bool:
    """Whether no figure of a row differs in any contact: a fact about these recordings, not a question of power."""
    known = [item for item in items if item.same or not math.isnan(item.left_open(significance))]
    return bool(known) and all(item.same for item in known)


def _answered(asked: Asked, corrected: float, significance: float, count: int, tolerated: float) -> Question:
    # What is not asked here would have counted as one more question.
    alpha = significance / (count + math.isnan(asked.p))
    left_open = asked.left_open(alpha)
    outcome: Literal["worse", "better", "no change shown", "inconclusive", "not_asked"]
    if not math.isnan(asked.complete_change_p) or corrected < significance:
        # Latency, force, misses, contacts not assessable, false alarms: less is better of each.
        outcome = "worse" if asked.change.value > 0.0 else "better"
    elif left_open > tolerated:
        outcome = INCONCLUSIVE
    else:
        outcome = "not_asked" if math.isnan(corrected) else NOTHING_SHOWN
    compared = {item.name: getattr(asked, item.name) for item in fields(Compared)}
    return Question(
        **compared, outcome=outcome, corrected_p=corrected, detectable=asked.detectable(alpha), left_open=left_open
    )


def _shared_labels(builds: tuple[Build, Build], pairing: Pairing) -> Labels:
    """The campaign of each paired recording, whichever of the files names one; else the recording itself."""
    old, new = builds[0].labels, builds[1].labels
    found = {}
    for name, partner in pairing.partners.items():
        campaign = new.get(partner, partner)
        unnamed = old.get(name, name) == name
        found[name] = campaign if unnamed and campaign != partner else old.get(name, name)
    return found
