"""Is a new build better or worse than the old one? Two results files, detector by detector and group by group.

Conventions: a change is new minus old. Contacts in both files are compared pair by pair. All tests are corrected
together (Holm): the family-wise error rate of "worse" and "better" is at most `significance`. The answer is "no change
shown" only if a relevant change would have been shown, otherwise "inconclusive". A complete change, such as every
contact missed that was detected before, needs no test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cdtool.errors import UsageError
from cdtool.evaluation.builds.configuration import Changed, changed_settings, refuse_other_rules
from cdtool.evaluation.builds.pairs import pair_recordings
from cdtool.evaluation.builds.rows import (
    INCONCLUSIVE,
    NOTHING_SHOWN,
    RELEVANT_CHANGE,
    Build,
    BuildRow,
    Outcome,
    answer,
    ask,
)
from cdtool.evaluation.builds.words import SAME_RESULTS, gone_words, overall_words, pairing_words, row_words
from cdtool.evaluation.comparison import SIGNIFICANT, check_significance
from cdtool.evaluation.results import Results
from cdtool.exit_status import Fact


@dataclass(frozen=True)
class BuildComparison:
    """All tests of two builds, the verdict over them, and other differences.

    `relevant_change`: the smallest change that matters. `inconclusive`: rows in which some test could not have shown
    it, whatever else they show. `asked` tests were corrected together. `only_old`, `only_new`: detectors, groups, or
    a detector in a group present in only one file. `changed`: settings under test that differ. `notes`: recordings
    without a partner.
    """

    verdict: Outcome
    words: str
    significance: float
    relevant_change: float
    inconclusive: int
    asked: int
    rows: tuple[BuildRow, ...]
    changed: tuple[Changed, ...]
    only_old: tuple[str, ...]
    only_new: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def facts(self) -> tuple[Fact, ...]:
        """What the exit status of a comparison depends on where a conclusion is required."""
        found = [Fact.WORSE] if self.verdict in ("worse", "mixed") else []
        found += [Fact.INCONCLUSIVE] if self.inconclusive else []
        return (*found, *([Fact.INCOMPLETE] if self.only_old else []))


def compare_builds(
    old: Results, new: Results, significance: float = SIGNIFICANT, relevant_change: float = RELEVANT_CHANGE
) -> BuildComparison:
    """Compare every detector and group present in both results.

    `relevant_change`: the smallest change for the worse that matters, as a share of the old mean latency and force, of
    the contacts missed or not assessable, and of a false alarm per operation.
    Latency and force: `paired_difference` by recording or campaign, else `unpaired_difference`; misses and contacts not
    assessable: McNemar, else Fisher; false alarms: `poisson_difference_p` on counts and hours.
    Raises ConfigurationError, naming the key, if a setting differs that defines the results; UsageError if nothing is
    common to both.
    """
    check_significance(significance)
    if not 0.0 < relevant_change <= 1.0:
        raise UsageError(f"relevant change is {relevant_change:g}", "a share above 0 and up to 1, such as 0.1")
    groups = [group for group in old.groups if group in new.groups]
    detectors = [name for name in old.detectors if name in new.detectors]
    builds = (Build(old), Build(new))
    both = builds[0].held & builds[1].held
    held = [(name, group) for group in groups for name in detectors if (name, group) in both]
    if not held:
        raise UsageError("the two results have no detector and group in common", "compare results of one benchmark")
    refuse_other_rules(old.provenance, new.provenance, groups)
    pairings = pair_recordings(old, new)
    asked = [ask(name, group, builds, pairings[group], 1.0 - significance) for name, group in held]
    answered, count = answer(asked, significance, relevant_change)
    same = old == new
    rows = tuple(
        replace(row, words=f"{row.outcome}: {SAME_RESULTS}" if same else row_words(row, count)) for row in answered
    )
    verdict = _verdict(rows)
    words = overall_words(verdict, rows, count, significance, relevant_change)
    only_old = tuple(_alone(old, new, builds))
    return BuildComparison(
        verdict=verdict,
        words=f"{verdict}: {SAME_RESULTS}" if same else words + gone_words(only_old),
        significance=significance,
        relevant_change=relevant_change,
        inconclusive=sum(item.inconclusive for item in rows),
        asked=count,
        rows=rows,
        changed=tuple(changed_settings(old.provenance, new.provenance, detectors)),
        only_old=only_old,
        only_new=tuple(_alone(new, old, builds[::-1])),
        notes=tuple(pairing_words(pairings)),
    )


def _verdict(rows: Sequence[BuildRow]) -> Outcome:
    outcomes = {item.outcome for row in rows for item in row.questions}
    if {"worse", "better"} <= outcomes:
        return "mixed"
    if "worse" in outcomes:
        return "worse"
    return "better" if "better" in outcomes else INCONCLUSIVE if INCONCLUSIVE in outcomes else NOTHING_SHOWN


def _alone(one: Results, other: Results, builds: Sequence[Build]) -> list[str]:
    """What only the first holds: whole detectors, whole groups, then a detector in a group."""
    words = [f"detector {name}" for name in one.detectors if name not in other.detectors]
    words += [f"group {name}" for name in one.groups if name not in other.groups]
    known = ((group, name) for group in one.groups for name in one.detectors)
    shared = [(group, name) for group, name in known if group in other.groups and name in other.detectors]
    held = builds[0].held - builds[1].held
    return words + [f"{name} in {group}" for group, name in shared if (name, group) in held]
