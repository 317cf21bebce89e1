"""Results as test cases for CI: every limit, force profile and recording, so that a report shows which one failed.

Conventions: a failure is a limit or force profile that is not met, or a recording's part in one; so there is a failure
exactly where the exit status is 1. What was left out or lost is an error, and so is a force profile that could not be
assessed and a detector that could not assess anything of a group; other outcomes that are not assessable are skipped.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, groupby, islice

from cdtool.base.plain_text import counted
from cdtool.report.number_text import number, spoken
from cdtool.report.tables.conditions import condition_words
from cdtool.report.tables.results import required, value_of
from cdtool.results.changed_conditions import ConditionRow, condition_rows
from cdtool.results.conclusion import ForceCheck, force_checks, force_missed, nothing_assessed
from cdtool.results.evaluated import Evaluated
from cdtool.results.recording_outcomes import RecordingOutcome, recording_outcomes
from cdtool.results.results import DAMAGED, ContactResult, LimitResult, RecordingFinding
from cdtool.results.summary import Summary, later_ms

# A CI system keeps every case in memory and in its database: of more cases than this a suite has those that did not
# pass, so many of each kind, and one that counts the others.
MOST_CASES, MOST_OF_KIND = 5000, 1000
_MORE = {"": "that passed", "failure": "more that fail", "error": "more errors", "skipped": "more not assessable"}


@dataclass(frozen=True)
class Case:
    """One test case: `kind` is "failure", "error", "skipped" or, of one that passed, empty; `lines` are its output."""

    name: str
    kind: str = ""
    message: str = ""
    lines: tuple[str, ...] = ()


@dataclass(frozen=True)
class Suite:
    """The test cases of one subject, at most `MOST_CASES` and those that count the others."""

    name: str
    cases: tuple[Case, ...]


def suites_of(evaluated: Evaluated) -> Iterator[Suite]:
    """Yield the conclusion, limits, force profiles, losses, recordings by detector and group, conditions, and kinds."""
    results = evaluated.results
    conclusion = results.conclusion
    kind = {"bad": "failure", "unknown": "skipped"}.get(conclusion.tone, "")
    head = Case("conclusion", kind, conclusion.headline if kind else "", (conclusion.headline, *conclusion.reasons))
    yield Suite("conclusion", (head,))
    if results.limits:
        yield Suite("limits", _bounded(map(_limit, results.limits)))
    checks = force_checks(results)
    if checks:
        yield Suite("force", _bounded(map(_force, checks)))
    if results.skipped:
        yield Suite("left out", _bounded(Case(item.recording, "error", item.reason) for item in results.skipped))
    if results.losses:
        yield Suite("damaged", _bounded(map(_damaged, results.losses)))
    silent = {(item.detector, item.group) for item in nothing_assessed(evaluated.summaries)}
    forbidden = {(item.detector, item.group) for item in force_missed(results, evaluated.summaries)}
    none = True
    for pair, items in groupby(recording_outcomes(results), key=lambda item: (item.detector, item.group)):
        none = False
        yield Suite(".".join(pair), _bounded(_recording(item, pair in silent, pair in forbidden) for item in items))
    if conditions := condition_rows(evaluated):
        yield Suite("changed conditions", _bounded(map(_condition, conditions)))
    if evaluated.kinds:
        yield Suite("kinds", _bounded(map(_kind, evaluated.kinds)))
    if none:
        yield Suite("benchmark", (Case("scored", "error", "nothing was scored"),))


def _bounded(cases: Iterable[Case]) -> tuple[Case, ...]:
    """Return all cases; of more than `MOST_CASES` the first of each kind that did not pass, and how many others."""
    remaining = iter(cases)
    kept = list(islice(remaining, MOST_CASES))
    if (more := next(remaining, None)) is None:
        return tuple(kept)
    of_kind: dict[str, list[Case]] = {}
    counts: Counter[str] = Counter()
    for case in chain(kept, (more,), remaining):
        counts[case.kind] += 1
        if case.kind and counts[case.kind] <= MOST_OF_KIND:
            of_kind.setdefault(case.kind, []).append(case)
    listed = [case for items in of_kind.values() for case in items]
    for kind, count in counts.items():
        if others := count - len(of_kind.get(kind, ())):
            words = f"{others} {_MORE[kind]}: all of them are in results.json"
            listed.append(Case(f"{others} {_MORE[kind]}", kind, words if kind else "", () if kind else (words,)))
    return tuple(listed)


def _limit(item: LimitResult) -> Case:
    name = f"{item.limit} ({item.detector}, {item.group})"
    words = f"{item.figure} is {value_of(item)}; required: {required(item)}"
    if item.outcome == "met":
        return Case(name, lines=(words,))
    return Case(name, "failure", f"{spoken(item.outcome)}: {words}; {item.reason}")


def _force(item: ForceCheck) -> Case:
    name = f"{item.group}: {item.name or 'no contact'}"
    if item.verdict == "pass":
        return Case(name, lines=(f"{item.profile}: pass",))
    kind = "failure" if item.verdict == "fail" else "error"
    return Case(name, kind, f"{item.profile}: {spoken(item.verdict)}: {item.reason}")


def _damaged(item: RecordingFinding) -> Case:
    return Case(item.recording, "error", f"{DAMAGED}: {item.reason}")


def _recording(item: RecordingOutcome, silent: bool, forbidden: bool) -> Case:
    """Return the case of one recording with one detector.

    `silent`: the detector could not assess anything of the group; `forbidden`: a missed contact violates its profile.
    """
    lines = [_contact(contact) for contact in item.contacts]
    lines += [f"false alarm at {alarm.time_s:.3f} s on {alarm.joint}" for alarm in item.false_alarms]
    missed = [contact.contact for contact in item.contacts if forbidden and contact.outcome == "missed"]
    breaks = [*item.breaks, *(f"contact {number} is missed where a force profile is set" for number in missed)]
    if breaks:
        return Case(item.recording, "failure", "; ".join(breaks), tuple(lines))
    if item.is_not_assessable:
        why = "; ".join(dict.fromkeys(contact.reason or "" for contact in item.contacts))
        kind = "error" if silent else "skipped"
        return Case(item.recording, kind, f"not assessable: {why or 'the detector gave no result'}", tuple(lines))
    return Case(item.recording, lines=tuple(lines) or ("no contact and no alarm",))


def _kind(item: Summary) -> Case:
    """Return the figures of one kind of contact; limits on it are cases of their own."""
    words = f"{item.detected} of {counted(item.contacts, 'contact')} detected, {item.missed} missed"
    words += f", {item.not_assessable} not assessable" if item.not_assessable else ""
    latency = f"; median latency {number(item.median_ms, error=item.resolution_ms)} ms" if item.assessable else ""
    return Case(f"{item.detector}.{item.group}", lines=(words + latency,))


def _condition(item: ConditionRow) -> Case:
    """Return the results of a detector under a changed condition; limits on it are cases of their own."""
    return Case(f"{item.detector}.{item.condition}", lines=(condition_words(item),))


def _contact(item: ContactResult) -> str:
    kind = f" ({item.kind})" if item.kind else ""
    words = f"contact {item.contact}{kind} at {item.onset_s:.3f} s: {spoken(item.outcome)}"
    if item.latency_ms is not None:
        words += f" after {number(item.latency_ms, error=item.resolution_ms)} ms"
        words += " (before the onset, within its uncertainty)" if item.clipped else ""
        if item.onset_hole_ms is not None:
            later = number(later_ms(item), error=item.resolution_ms)
            words += f" or up to {later} ms later (load-cell samples missing at the onset)"
    if item.force_at_alarm_n is not None:
        words += f" at {number(item.force_at_alarm_n)} N"
    if item.peak_force_n is not None:
        words += f", peak {number(item.peak_force_n)} N"
    if item.force_hole_ms is not None:
        words += f" or more (load-cell samples missing for {number(item.force_hole_ms)} ms)"
    return f"{words} ({item.reason})" if item.reason else words
