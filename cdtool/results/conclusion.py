"""What a benchmark concludes: limits, force profiles, missed contacts and what could not be assessed, taken together.

Conventions: a force profile that is set for a group decides. The test points with their verdicts count, and each
contact that belongs to none. A missed contact is a violation where a force profile is set, unless a limit of that
detector and group says how many may be missed: then the limit decides. What nothing was measured for is not met.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from cdtool.base.errors import UsageError
from cdtool.base.exit_status import Fact, status_of
from cdtool.base.plain_text import NAMED, counted, plain
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.limits import not_met
from cdtool.results.recording_outcomes import MISSES
from cdtool.results.results import ConclusionResult, Results, grouped
from cdtool.results.summary import Summary

# Limits on these figures say how many contacts may be missed.
_ON_MISSES = MISSES | {"detected", "max_ms"}

Pair = tuple[str, str]
"""Detector and group."""


@dataclass(frozen=True, slots=True)
class ForceCheck:
    """The verdict of one contact, or of one test point, that decides about a group's force profile.

    Without a name it is about the whole group, none of whose contacts was scored.
    """

    group: str
    profile: str
    name: str
    verdict: str
    reason: str
    is_point: bool = False


def force_checks(results: Results) -> list[ForceCheck]:
    """Return what decides about every force profile that is set: test points, then the contacts that belong to none.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    list of ForceCheck
        A contact without any load-cell force to compare is not assessable; so is a profile of a group without scored
        contacts.

    Examples
    --------
    `cdtool.benchmark` returns the results.
    """
    found = []
    forces, scored = grouped(results.forces, "group"), grouped(results.scored_contacts, "group")
    for group, profile in _profiles(results).items():
        points = [item for item in results.points if item.group == group]
        named = {item.point for item in points}
        rows, contacts = forces.get(group, ()), scored.get(group, ())
        found += [
            ForceCheck(group, item.profile, f"test point {item.point}", item.verdict, item.reason or "", is_point=True)
            for item in points
        ]
        found += [
            ForceCheck(
                group, item.profile, f"{item.recording}, contact {item.contact}", item.verdict, item.reason or ""
            )
            for item in rows
            if item.point not in named
        ]
        known, why = {(item.recording, item.contact) for item in rows}, "no load-cell force"
        without = {(item.recording, item.contact) for item in contacts} - known
        unseen = [f"{recording}, contact {number}" for recording, number in sorted(without)]
        if not contacts and not rows and not points:
            unseen, why = [""], "no contact of the group was scored: its recordings were left out, or show none"
            if any(item.group == group for item in results.contacts):
                why = "every contact was in progress when its recording began: its onset is not recorded"
        found += [ForceCheck(group, profile, name, "not_assessable", why) for name in unseen]
    return found


def missed_unasked(results: Results, summaries: Sequence[Summary]) -> list[Summary]:
    """Return the summaries with missed contacts where no limit says how many may be missed."""
    asked = {(item.detector, item.group) for item in results.limits if item.figure in _ON_MISSES}
    return [item for item in summaries if item.missed and (item.detector, item.group) not in asked]


def nothing_assessed(summaries: Sequence[Summary]) -> list[Summary]:
    """Return the summaries of detectors that could assess nothing at all in their group.

    Parameters
    ----------
    summaries : sequence of Summary
        The summaries of a benchmark.

    Returns
    -------
    list of Summary
        Those without an assessable contact or operation.

    Examples
    --------
    `cdtool.benchmark` returns the summaries.
    """
    return [
        item
        for item in summaries
        if (item.contacts and not item.assessable) or (item.operations and not item.judged_operations)
    ]


def force_missed(results: Results, summaries: Sequence[Summary]) -> list[Summary]:
    """Return the summaries whose missed contacts are violations, because their group has a force profile.

    Parameters
    ----------
    results : Results
        The results of a benchmark.
    summaries : sequence of Summary
        Their summaries.

    Returns
    -------
    list of Summary
        Those with missed contacts and a force profile, without a limit on missed contacts.

    Examples
    --------
    `cdtool.benchmark` returns results and summaries.
    """
    profiles = _profiles(results)
    return [item for item in missed_unasked(results, summaries) if item.group in profiles]


class Severity(IntEnum):
    """What a statement of a verdict is about, the worst first. Red is what a requirement forbids: exit status 1."""

    PROTOCOL_FAILED = 0
    VIOLATED = 1
    LIMIT_NOT_ASSESSABLE = 2
    WITHOUT_LIMIT = 3
    OVER_BUDGET = 4
    NOT_ASSESSABLE = 5
    LOST = 6
    INCOMPLETE = 7
    APPARENT = 8
    UNCHECKED = 9
    MET = 10
    NOT_ASKED = 11

    @property
    def tone(self) -> str:
        """Return the colour of a verdict that opens with it: good, bad, unknown, or empty if nothing was required."""
        if self <= Severity.VIOLATED:
            return "bad"
        return {Severity.MET: "good", Severity.UNCHECKED: "", Severity.NOT_ASKED: ""}.get(self, "unknown")


class Statement(NamedTuple):
    """One fact of a verdict: a few words, the fact for the exit status if it has one, and the reasons line by line."""

    severity: Severity
    words: str
    fact: Fact | None = None
    reasons: tuple[str, ...] = ()


def worst_first(statements: Iterable[Statement]) -> tuple[str, str, list[Statement]]:
    """Return the verdict that every report, screen and result shows.

    Parameters
    ----------
    statements : iterable of Statement
        At least one.

    Returns
    -------
    tone : str
        The colour of the worst statement.
    headline : str
        All statements in one sentence, the worst first.
    statements : list of Statement
        In this order.

    Examples
    --------
    >>> worst_first([Statement(Severity.MET, "all 3 limits are met"), Statement(Severity.LOST, "1 entry left out")])[:2]
    ('unknown', '1 entry left out; all 3 limits are met')
    """
    ordered = sorted(statements, key=lambda item: item.severity)
    return ordered[0].severity.tone, "; ".join(item.words for item in ordered), ordered


def conclude(results: Results, summaries: Sequence[Summary]) -> ConclusionResult:
    """Return headline, reasons and exit status of these results; `limits` of the results are checked already."""
    checks = force_checks(results)
    tone, headline, statements = worst_first(
        (
            *_of_protocol(results.conclusion.protocol),
            *_of_limits(results),
            *_of_forces(checks),
            *_of_misses(results, summaries),
            *_of_false_alarms(results, summaries),
            *_of_unassessed(results, summaries),
            *_of_losses(results),
        )
    )
    severities = {item.severity for item in statements}
    unknown = severities & {Severity.LIMIT_NOT_ASSESSABLE, Severity.NOT_ASSESSABLE}
    asked = bool(results.limits or checks or results.conclusion.protocol)
    facts = {item.fact for item in statements if item.fact}
    return ConclusionResult(
        outcome="violated" if tone == "bad" else "not_assessable" if unknown else "met" if asked else "not_asked",
        headline=headline,
        reasons=tuple(reason for item in statements for reason in item.reasons),
        missed_without_limit=sum(item.missed for item in missed_unasked(results, summaries)),
        facts=tuple(sorted(fact.name.lower() for fact in facts)),
        exit_status=int(status_of(facts)),
        tone=tone,
        protocol=results.conclusion.protocol,
    )


def partly_unassessed(results: Results, summaries: Sequence[Summary]) -> list[str]:
    """Return for each detector and group with some contacts that were not assessable the reasons, in words.

    Parameters
    ----------
    results : Results
        The rows of the benchmark.
    summaries : sequence of Summary
        One for each detector and group.

    Returns
    -------
    list of str
        One line each; none for a pair without an assessable contact, which is a reason of the conclusion.

    Examples
    --------
    >>> partly_unassessed(Results({}, (), (), (), (), ()), [])
    []
    """
    partly = [item for item in summaries if 0 < item.not_assessable < item.contacts]
    lines, reasons = [], _reasons_of_contacts(results) if partly else {}
    for item in partly:
        what = f"{item.not_assessable} of {counted(item.contacts, 'contact')} not assessable"
        lines.append(plain(f"{item.detector}, {item.group}: {what}: {_reasons_in_words(results, item, reasons)}"))
    return lines


def _profiles(results: Results) -> dict[str, str]:
    """The name of the profile of each group that has one: of the provenance, which a file may hold anything in."""
    listed = results.provenance.get("force_profiles")
    found = {item.group: item.profile for item in results.forces if item.group in results.groups}
    if isinstance(listed, Mapping):
        named = {str(group): item for group, item in listed.items() if isinstance(item, Mapping)}
        found |= {group: str(item.get("name", "")) for group, item in named.items() if group in results.groups}
    return found


def _of_protocol(protocol: Sequence[str]) -> Iterator[Statement]:
    severities = {
        "fail": (Severity.PROTOCOL_FAILED, Fact.FORCE_VIOLATED),
        "incomplete": (Severity.INCOMPLETE, Fact.INCOMPLETE),
        "pass": (Severity.MET, None),
    }
    if protocol:
        outcome, words, *reasons = protocol
        severity, fact = severities[outcome]
        yield Statement(severity, plain(words), fact, tuple(map(plain, reasons)))


def _of_limits(results: Results) -> Iterator[Statement]:
    limits, failing = results.limits, not_met(results.limits)
    unchecked = [item.reason for item in results.findings if item.kind == "limits_unchecked"]
    if failing:
        unknown = sum(item.outcome == "not_assessable" for item in failing)
        kinds = [f"{len(failing) - unknown} violated"] if len(failing) > unknown else []
        kinds += [f"{unknown} not assessable"] if unknown else []
        words = f"{len(failing)} of {counted(len(limits), 'limit')} not met ({', '.join(kinds)})"
        severity = Severity.VIOLATED if len(failing) > unknown else Severity.LIMIT_NOT_ASSESSABLE
        yield Statement(severity, words, Fact.LIMIT_VIOLATED)
    elif limits:
        words = f"all {len(limits)} limits are met" if len(limits) > 1 else "the limit is met"
        yield Statement(Severity.MET, words)
    elif not unchecked:
        yield Statement(Severity.NOT_ASKED, "no limits are set")
    for words in unchecked:
        yield Statement(Severity.UNCHECKED, plain(words))


def _of_forces(checks: Sequence[ForceCheck]) -> Iterator[Statement]:
    verdicts = Counter(item.verdict for item in checks)
    of, unseen = _things(checks), verdicts["not_assessable"]
    groups = [item.group for item in checks if not item.name]
    if verdicts["fail"]:
        words = f"force profile violated by {verdicts['fail']} of {of}"
        yield Statement(Severity.VIOLATED, words, Fact.FORCE_VIOLATED, _force_reasons(checks, "fail", "violated by"))
    parts = [f"force profile not assessable for {unseen - len(groups)} of {of}"] if unseen > len(groups) else []
    parts += [f"force profile not assessable in {', '.join(groups)}, where no contact was scored"] if groups else []
    if parts:
        fact = Fact.NOTHING_ASSESSABLE if unseen == len(checks) else Fact.INCOMPLETE
        reasons = _force_reasons(checks, "not_assessable", "not assessable for")
        yield Statement(Severity.NOT_ASSESSABLE, "; ".join(parts), fact, reasons)
    if checks and verdicts["pass"] == len(checks):
        yield Statement(Severity.MET, f"force profile met by {of}")


def _force_reasons(checks: Sequence[ForceCheck], verdict: str, what: str) -> tuple[str, ...]:
    """Return a line for each group and profile with this verdict, and its first reason."""
    lines = []
    for (group, profile), items in grouped(checks, "group", "profile").items():
        those = [item for item in items if item.verdict == verdict]
        if those and not those[0].name:
            lines.append(plain(f"force, {group}, {profile}: not assessable: {those[0].reason}"))
        elif those:
            first = f"{those[0].name}: {those[0].reason}" if those[0].reason else those[0].name
            lines.append(plain(f"force, {group}, {profile}: {what} {len(those)} of {_things(items)}; first {first}"))
    return tuple(lines)


def _things(checks: Sequence[ForceCheck]) -> str:
    points = sum(item.is_point for item in checks)
    contacts = sum(bool(item.name) for item in checks) - points
    if points and not contacts:
        return counted(points, "test point")
    return f"{contacts + points} contacts and test points" if points else counted(contacts, "contact")


def _of_misses(results: Results, summaries: Sequence[Summary]) -> Iterator[Statement]:
    profiles = _profiles(results)
    kinds = (
        (True, Severity.VIOLATED, Fact.FORCE_VIOLATED, "under a force profile", "where a force profile is set"),
        (False, Severity.WITHOUT_LIMIT, None, "without a limit", "and no limit on misses is set"),
    )
    for forbidden, severity, fact, words, why in kinds:
        those = [item for item in missed_unasked(results, summaries) if (item.group in profiles) == forbidden]
        reasons = [f"{_pair(each)}: {each.missed} of {each.assessable} contacts missed, {why}" for each in those]
        if those:
            count = counted(sum(item.missed for item in those), "detection")
            yield Statement(severity, f"{count} missed {words}", fact, tuple(map(plain, reasons)))


def _of_false_alarms(results: Results, summaries: Sequence[Summary]) -> Iterator[Statement]:
    """Yield false alarms without a limit, and those above the budget of a detector whose safety factor it set."""
    limited = {(item.detector, item.group) for item in results.limits if item.figure.startswith("false_alarms")}
    budgets = {}
    for each in results.calibration:
        with suppress(UsageError):  # a results file may hold anything
            budgets[each.detector] = Budget.parse(each.budget)
    alone, above = [], []
    for item in summaries:
        if (item.detector, item.group) in limited or not item.false_alarms:
            continue
        if item.detector not in budgets:
            alone.append(item)
        elif words := budgets[item.detector].excess(
            (item.alarming, item.judged_operations), (item.false_alarms, item.hours)
        ):
            above.append((words, plain(f"{_pair(item)}: {words}")))
    if alone:
        reasons = [
            f"{_pair(item)}: {counted(item.false_alarms, 'false alarm')} in {item.alarming} of "
            f"{counted(item.judged_operations, 'operation')}, and no limit on false alarms is set"
            for item in alone
        ]
        words = f"{counted(sum(item.false_alarms for item in alone), 'false alarm')} without a limit"
        yield Statement(Severity.WITHOUT_LIMIT, words, None, tuple(map(plain, reasons)))
    if above:
        words = f"more false alarms than the budget: {above[0][0]}"
        yield Statement(Severity.OVER_BUDGET, words, None, tuple(line for _, line in above))


def _pair(item: Summary) -> str:
    return f"{item.detector}, {item.group}"


def _of_unassessed(results: Results, summaries: Sequence[Summary]) -> Iterator[Statement]:
    unassessed = nothing_assessed(summaries)
    scored = [item for item in summaries if item.operations or item.contacts]
    if not scored:
        yield Statement(Severity.NOT_ASSESSABLE, "nothing was scored", Fact.NOTHING_ASSESSABLE)
    elif unassessed:
        words = "nothing could be assessed"
        if len(unassessed) < len(scored):
            pairs = "detector and group" if len(unassessed) == 1 else "detectors and groups"
            words += f" in {len(unassessed)} of {len(summaries)} pairs of {pairs}"
        of_contacts = _reasons_of_contacts(results)
        reasons = [plain(f"{_pair(item)}: {_why_unassessed(results, item, of_contacts)}") for item in unassessed]
        yield Statement(Severity.NOT_ASSESSABLE, words, Fact.NOTHING_ASSESSABLE, tuple(reasons))


def _of_losses(results: Results) -> Iterator[Statement]:
    if results.skipped:
        yield Statement(Severity.LOST, f"{counted(len(results.skipped), 'entry')} left out", Fact.LEFT_OUT)
    if results.losses:
        names = {item.recording for item in results.losses}
        yield Statement(Severity.LOST, f"data lost in {counted(len(names), 'recording')}", Fact.LOST)


def _why_unassessed(results: Results, item: Summary, reasons: Mapping[Pair, Sequence[str]]) -> str:
    what = f"{item.contacts} contacts" if item.contacts else f"{item.operations} operations"
    return f"none of {what} could be assessed: {_reasons_in_words(results, item, reasons)}"


def _reasons_of_contacts(results: Results) -> dict[Pair, Sequence[str]]:
    """Return the different reasons in the rows of the contacts, by detector and group."""
    found = grouped([item for item in results.contacts if item.reason], "detector", "group")
    return {pair: list(dict.fromkeys(item.reason for item in items if item.reason)) for pair, items in found.items()}


def _reasons_in_words(results: Results, item: Summary, of_contacts: Mapping[Pair, Sequence[str]]) -> str:
    exposures = [row for row in results.exposure if (row.detector, row.group) == (item.detector, item.group)]
    reasons = of_contacts.get((item.detector, item.group)) or [
        f"{name} {100.0 * share:.0f} %" for row in exposures for name, share in row.not_judged.items()
    ]
    more = f"; and {len(reasons) - NAMED} more reasons" if len(reasons) > NAMED else ""
    return f"{'; '.join(reasons[:NAMED]) or 'unknown reason'}{more}"
