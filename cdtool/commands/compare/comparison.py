"""Is a new build better or worse than the old one? Two results files, detector by detector and group by group.

Conventions: a change is new minus old. Contacts in both files are compared pair by pair. All tests are corrected
together (Holm): the family-wise error rate of "worse" and "better" is at most `significance`. The answer is "no change
shown" only if a relevant change would have been shown, otherwise "inconclusive". A complete change, such as every
contact missed that was detected before, needs no test. Builds are compared only if the rules that
define their results are equal; settings under test may differ, and are listed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.alarms.activation import DEBOUNCE_TIME
from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.base.exit_status import Fact
from cdtool.base.plain_text import counted, shorten
from cdtool.base.remote.remote_path import location
from cdtool.commands.compare.pairs import pair_recordings
from cdtool.commands.compare.rows import (
    INCONCLUSIVE,
    NOTHING_SHOWN,
    RELEVANT_CHANGE,
    Build,
    BuildRow,
    Outcome,
    answer,
    ask,
)
from cdtool.commands.compare.words import SAME_RESULTS, gone_words, overall_words, pairing_words, row_words
from cdtool.results.comparison import SIGNIFICANT, check_significance
from cdtool.results.files.results_file import read_results
from cdtool.results.results import Results

# Provenance keys of settings that define the results, and where the benchmark file sets them.
_RULES = {
    "onset": "[onset]",
    "separation_s": "[onset] separation_s",
    "force": "machine file's [channels] force",
    "label_file": "[onset] labels",
    "not_contacts": "[onset] not_contacts",
    "synchronisation_s": "[onset] synchronisation_s",
    "window_s": "window_s",
    "operations": "operations",
    "watched_joints": "joints",
    "mass_before_cell_kg": "[force] mass_before_cell_kg",
    "force_profiles": "[force] limits or profile",
    "sections": "from and to of the logs",
}
_BY_GROUP = ("window_s", "force_profiles")
_UNDER_TEST = (
    "tool_version",
    "machine",
    "machine_sha256",
    "gains",
    "threshold",
    "threshold_rule",
    "safety_factor_set",
    "learned_until",
    "signature_rule",
    "debounce_samples",
    "rearm_s",
    "hysteresis",
    "latch",
    "false_alarm_budget",
    "signature_sha256",
    "plugins",
)
_BY_DETECTOR = ("gains", "signature_sha256")
_DEFAULT_DEBOUNCE = f"default ({1e3 * DEBOUNCE_TIME:g} ms)"
_HASH = re.compile(r"[0-9a-f]{64}")
_Leaf = tuple[str, Any, Any]


@dataclass(frozen=True, repr=False)
class BuildComparison:
    """All tests of two builds, the verdict over them, and other differences.

    `relevant_change`: the smallest change that matters. `inconclusive`: rows in which some test could not have shown
    it, whatever else they show. `later`: rows in which the new build is later on the same contacts by a relevant
    change, or misses more of them. `asked` tests were corrected together. `only_old`, `only_new`: detectors, groups, or
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
    later: int = 0

    def __repr__(self) -> str:
        return f"BuildComparison({self.words})"

    @property
    def facts(self) -> tuple[Fact, ...]:
        """What the exit status of a comparison depends on where a conclusion is required."""
        found = [Fact.WORSE] if self.verdict in ("worse", "mixed") else []
        found += [Fact.INCONCLUSIVE] if self.inconclusive else []
        return (*found, *([Fact.INCOMPLETE] if self.only_old else []))


def compare(
    old: str | Path | Results,
    new: str | Path | Results,
    *,
    significance: float = SIGNIFICANT,
    relevant_change: float = RELEVANT_CHANGE,
) -> BuildComparison:
    """Compare two builds: every detector and group present in both results.

    Parameters
    ----------
    old, new : str, Path or Results
        A results.json, or the results in memory.
    significance : float, optional
        Family-wise error rate of "worse" and "better".
    relevant_change : float, optional
        The smallest change for the worse that matters, as a share of the old mean latency and force, of the contacts
        missed or not assessable, and of a false alarm per operation.

    Returns
    -------
    BuildComparison
        One row per detector and group, and the verdict over all of them.

    Raises
    ------
    RecordingError
        A file is not a results file.
    ConfigurationError
        A setting differs that defines the results; the message names the key.
    UsageError
        The two results have no detector and group in common, or a share is outside its range.

    Notes
    -----
    Latency and force: `paired_difference` by recording or campaign, else `unpaired_difference`. Misses and contacts not
    assessable: `mcnemar_p`, else `fisher_p`. False alarms: `poisson_difference_p` on counts and hours. All p are
    corrected together by `holm`.

    Examples
    --------
    >>> import cdtool
    >>> results = cdtool.score("docs/examples/triggers.csv", "sample_logs/gate/benchmark.toml").evaluated.results
    >>> comparison = cdtool.compare(results, results)
    >>> comparison.verdict, len(comparison.rows)
    ('no change shown', 3)
    """
    old, new = (item if isinstance(item, Results) else read_results(location(item)) for item in (old, new))
    check_significance(significance)
    if not 0.0 < relevant_change <= 1.0:
        raise UsageError(f"relevant change is {relevant_change:g}", "give a share above 0 and up to 1, such as 0.1")
    groups = [group for group in old.every_group if group in new.every_group]
    detectors = [name for name in old.detectors if name in new.detectors]
    builds = (Build(old), Build(new))
    both = builds[0].held & builds[1].held
    held = [(name, group) for group in groups for name in detectors if (name, group) in both]
    if not held:
        raise UsageError("the two results have no detector and group in common", "compare results of one benchmark")
    _refuse_other_rules(old.provenance, new.provenance, groups)
    pairings = pair_recordings(old, new)
    asked = [ask(name, group, builds, pairings[group], 1.0 - significance) for name, group in held]
    answered, count = answer(asked, significance, relevant_change)
    same = old == new
    rows = tuple(
        replace(row, words=f"{row.outcome}: {SAME_RESULTS}" if same else row_words(row, count)) for row in answered
    )
    verdict = _verdict(rows)
    words = overall_words(verdict, rows, count, significance, relevant_change)
    later = [row for row in rows if row.is_later(relevant_change)]
    if later and verdict in (INCONCLUSIVE, NOTHING_SHOWN, "better"):
        ways = ["later on"] if not all(row.misses_more for row in later) else []
        ways += ["missing more of"] if any(row.misses_more for row in later) else []
        where = f"the same contacts in {len(later)} of {counted(len(rows), 'row')}"
        words = f"{' or '.join(ways)} {where}; about other recordings {words}"
    only_old = tuple(_alone(old, new, builds))
    return BuildComparison(
        verdict=verdict,
        words=f"{verdict}: {SAME_RESULTS}" if same else words + gone_words(only_old),
        significance=significance,
        relevant_change=relevant_change,
        inconclusive=sum(item.inconclusive for item in rows),
        asked=count,
        rows=rows,
        changed=tuple(_changed_settings(old.provenance, new.provenance, detectors)),
        only_old=only_old,
        only_new=tuple(_alone(new, old, builds[::-1])),
        notes=tuple(pairing_words(pairings)),
        later=len(later),
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
    words += [f"group {name}" for name in one.every_group if name not in other.every_group]
    known = ((group, name) for group in one.every_group for name in one.detectors)
    shared = [(group, name) for group, name in known if group in other.every_group and name in other.detectors]
    held = builds[0].held - builds[1].held
    return words + [f"{name} in {group}" for group, name in shared if (name, group) in held]


@dataclass(frozen=True)
class Changed:
    """A setting that differs between the builds; "none" where a file does not hold it."""

    key: str
    old: str
    new: str


def _refuse_other_rules(old: Mapping[str, Any], new: Mapping[str, Any], groups: Sequence[str]) -> None:
    """Raise ConfigurationError if a rule that defines the results of these groups differs."""
    for key, where in _RULES.items():
        before, after = old.get(key), new.get(key)
        if key in _BY_GROUP:
            before, after = _only(before, groups), _only(after, groups)
        if key == "label_file":
            # Other recordings have other labels; the same ones with other onsets are refused where they are paired.
            before, after = before is not None, after is not None
        for name, one, other in _leaves(key, before, after):
            raise ConfigurationError(
                f"{name} differs: {_shown(one)} in old, {_shown(other)} in new",
                f"such results cannot be compared: use the same {where} in the benchmark file and run one again",
            )


def _changed_settings(old: Mapping[str, Any], new: Mapping[str, Any], detectors: Sequence[str]) -> list[Changed]:
    """What is under test and differs, of the detectors that both hold."""
    found = []
    for key in _UNDER_TEST:
        before, after = old.get(key), new.get(key)
        if key in _BY_DETECTOR:
            before, after = _only(before, detectors), _only(after, detectors)
        if key == "debounce_samples":
            before, after = (
                _DEFAULT_DEBOUNCE if key in side and side[key] is None else side.get(key) for side in (old, new)
            )
        found += [Changed(name, _shown(one), _shown(other)) for name, one, other in _leaves(key, before, after)]
    return found + _other_runs(old, new)


def _other_runs(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[Changed]:
    """Runs learned from, told apart by their bytes."""
    before, after = (_only(side.get("learned_sha256"), None) for side in (old, new))
    if sorted(map(str, before.values())) == sorted(map(str, after.values())):
        return []
    both = len({str(value) for value in before.values()} & {str(value) for value in after.values()})
    return [
        Changed("learned_runs", counted(len(before), "run"), f"{counted(len(after), 'run')}, {both} of them the same")
    ]


def _only(values: Any, names: Sequence[str] | None) -> dict[str, Any]:
    if not isinstance(values, Mapping):
        return {}
    return {name: value for name, value in values.items() if names is None or name in names}


def _leaves(key: str, old: Any, new: Any) -> Iterator[_Leaf]:
    """What differs, as far down as tables and lists of one length go."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for name in [*old, *(name for name in new if name not in old)]:
            yield from _leaves(f"{key}.{name}", old.get(name), new.get(name))
    elif isinstance(old, list | tuple) and isinstance(new, list | tuple) and len(old) == len(new):
        for i, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _leaves(f"{key}[{i}]", one, other)
    elif old != new:
        yield key, old, new


def _shown(value: Any) -> str:
    if value is None:
        return "none"
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
    # The beginning of a hash tells it apart as well.
    return text[:12] if _HASH.fullmatch(text) else shorten(text, 80)
