"""What a benchmark concludes: limits, force profiles, missed contacts and what could not be assessed, taken together.

Conventions: a force profile that is set for a group decides. The test points with their verdicts count, and each
contact that belongs to none. A missed contact is a violation where a force profile is set, unless a limit of that
detector and group says how many may be missed: then the limit decides. What nothing was measured for is not met.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from cdtool.evaluation.limits import not_met
from cdtool.evaluation.recording_outcomes import MISSES
from cdtool.evaluation.results import ConclusionResult, ContactResult, ForceResult, Results
from cdtool.evaluation.rows import grouped, values_of
from cdtool.evaluation.summary import Summary
from cdtool.exit_status import Fact, status_of
from cdtool.plain_text import counted, plain

# Limits on these figures say how many contacts may be missed.
_ON_MISSES = MISSES | {"detected", "max_ms"}
_REASONS = 3

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
        rows, contacts = forces.get((group,), ()), scored.get((group,), ())
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
        known, why = set(_numbers(rows)), "no load-cell force"
        unseen = [_name_of(*contact) for contact in sorted(set(_numbers(contacts)) - known)]
        if not contacts and not rows and not points:
            unseen, why = [""], "no contact of the group was scored: its recordings were left out, or show none"
            if group in values_of(results.contacts, "group"):
                why = "every contact was in progress when its recording began: its onset is not recorded"
        found += [ForceCheck(group, profile, name, "not_assessable", why) for name in unseen]
    return found


def _name_of(recording: str, contact: int) -> str:
    return f"{recording}, contact {contact}"


def _numbers(rows: Sequence[ContactResult] | Sequence[ForceResult]) -> Iterator[tuple[str, int]]:
    """Return recording and number of the contacts."""
    return zip(values_of(rows, "recording"), values_of(rows, "contact"), strict=True)


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


def conclude(results: Results, summaries: Sequence[Summary]) -> ConclusionResult:
    """Return headline, reasons and exit status of these results; `limits` of the results are checked already."""
    checks = force_checks(results)
    verdicts = Counter(item.verdict for item in checks)
    failing = not_met(results.limits)
    missed = missed_unasked(results, summaries)
    forbidden = force_missed(results, summaries)
    unassessed = nothing_assessed(summaries)
    facts = set()
    if failing:
        facts.add(Fact.LIMIT_VIOLATED)
    if verdicts["fail"] or forbidden:
        facts.add(Fact.FORCE_VIOLATED)
    if results.skipped:
        facts.add(Fact.LEFT_OUT)
    if results.losses:
        facts.add(Fact.LOST)
    scored = any(item.contacts or item.operations for item in summaries)
    if unassessed or not scored or (checks and verdicts["not_assessable"] == len(checks)):
        facts.add(Fact.NOTHING_ASSESSABLE)
    elif verdicts["not_assessable"]:
        facts.add(Fact.INCOMPLETE)
    violated = bool(verdicts["fail"] or forbidden) or any(item.outcome == "violated" for item in failing)
    unknown = bool(failing or unassessed or not scored or verdicts["not_assessable"])
    asked = bool(results.limits or checks)
    outcome = "violated" if violated else "not_assessable" if unknown else "met" if asked else "not_asked"
    nothing = [] if scored else ["nothing was scored"]
    parts = [
        *nothing,
        *_force_words(verdicts, checks),
        *_missed_words(missed, forbidden),
        *_unassessed_words(unassessed, summaries),
    ]
    limits = limits_words(results)
    headline = [limits, *parts] if failing else [*parts, limits] if outcome != "met" else [limits, *parts]
    return ConclusionResult(
        outcome=outcome,
        headline="; ".join(headline),
        reasons=tuple(_reasons(results, checks, missed, forbidden, unassessed)),
        missed_without_limit=sum(item.missed for item in missed),
        facts=tuple(sorted(fact.name.lower() for fact in facts)),
        exit_status=int(status_of(facts)),
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


def limits_words(results: Results) -> str:
    """Return whether the limits are met, in a few words."""
    limits = results.limits
    if not limits:
        return "no limits are set"
    failing = not_met(limits)
    if not failing:
        return f"all {len(limits)} limits are met" if len(limits) > 1 else "the limit is met"
    unknown = sum(item.outcome == "not_assessable" for item in failing)
    kinds = [f"{len(failing) - unknown} violated"] if len(failing) > unknown else []
    kinds += [f"{unknown} not assessable"] if unknown else []
    return f"{len(failing)} of {counted(len(limits), 'limit')} not met ({', '.join(kinds)})"


def _profiles(results: Results) -> dict[str, str]:
    """The name of the profile of each group that has one: of the provenance, which a file may hold anything in."""
    listed = results.provenance.get("force_profiles")
    profiles = zip(values_of(results.forces, "group"), values_of(results.forces, "profile"), strict=True)
    found = {group: profile for group, profile in profiles if group in results.groups}
    if isinstance(listed, Mapping):
        named = {str(group): item for group, item in listed.items() if isinstance(item, Mapping)}
        found |= {group: str(item.get("name", "")) for group, item in named.items() if group in results.groups}
    return found


def _force_words(verdicts: Counter[str], checks: Sequence[ForceCheck]) -> Iterator[str]:
    if not checks:
        return
    of = _things(checks)
    if verdicts["fail"]:
        yield f"force profile violated by {verdicts['fail']} of {of}"
    groups = [item.group for item in checks if not item.name]
    if verdicts["not_assessable"] > len(groups):
        yield f"force profile not assessable for {verdicts['not_assessable'] - len(groups)} of {of}"
    if groups:
        yield f"force profile not assessable in {', '.join(groups)}, where no contact was scored"
    if verdicts["pass"] == len(checks):
        yield f"force profile met by {of}"


def _things(checks: Sequence[ForceCheck]) -> str:
    points = sum(item.is_point for item in checks)
    contacts = sum(bool(item.name) for item in checks) - points
    if points and not contacts:
        return counted(points, "test point")
    return f"{contacts + points} contacts and test points" if points else counted(contacts, "contact")


def _missed_words(missed: Sequence[Summary], forbidden: Sequence[Summary]) -> Iterator[str]:
    count, violations = sum(item.missed for item in missed), sum(item.missed for item in forbidden)
    if violations:
        yield f"{counted(violations, 'detection')} missed under a force profile"
    if count > violations:
        yield f"{counted(count - violations, 'detection')} missed without a limit"


def _unassessed_words(unassessed: Sequence[Summary], summaries: Sequence[Summary]) -> Iterator[str]:
    if not unassessed:
        return
    if len(unassessed) == len([item for item in summaries if item.operations or item.contacts]):
        yield "nothing could be assessed"
    else:
        pairs = "detector and group" if len(unassessed) == 1 else "detectors and groups"
        yield f"nothing could be assessed in {len(unassessed)} of {len(summaries)} pairs of {pairs}"


def _reasons(
    results: Results,
    checks: Sequence[ForceCheck],
    missed: Sequence[Summary],
    forbidden: Sequence[Summary],
    unassessed: Sequence[Summary],
) -> Iterator[str]:
    """What is not good about these results beside the limits, line by line, worst first."""
    parts: dict[Pair, list[ForceCheck]] = {}
    for item in checks:
        parts.setdefault((item.group, item.profile), []).append(item)
    for verdict, what in (("fail", "violated by"), ("not_assessable", "not assessable for")):
        for (group, profile), items in parts.items():
            those = [item for item in items if item.verdict == verdict]
            if those and not those[0].name:
                yield plain(f"force, {group}, {profile}: not assessable: {those[0].reason}")
            elif those:
                first = f"{those[0].name}: {those[0].reason}" if those[0].reason else those[0].name
                text = f"force, {group}, {profile}: {what} {len(those)} of {_things(items)}; first {first}"
                yield plain(text)
    for each in missed:
        why = "where a force profile is set" if each in forbidden else "and no limit on misses is set"
        yield plain(f"{each.detector}, {each.group}: {each.missed} of {each.assessable} contacts missed, {why}")
    reasons = _reasons_of_contacts(results) if unassessed else {}
    for each in unassessed:
        yield plain(f"{each.detector}, {each.group}: {_why_unassessed(results, each, reasons)}")


def _why_unassessed(results: Results, item: Summary, reasons: Mapping[Pair, Sequence[str]]) -> str:
    what = f"{item.contacts} contacts" if item.contacts else f"{item.operations} operations"
    return f"none of {what} could be assessed: {_reasons_in_words(results, item, reasons)}"


def _reasons_of_contacts(results: Results) -> dict[Pair, Sequence[str]]:
    """Return the different reasons in the rows of the contacts, by detector and group."""
    found: dict[Pair, dict[str, None]] = {}
    columns = (values_of(results.contacts, name) for name in ("detector", "group", "reason"))
    for detector, group, reason in zip(*columns, strict=True):
        if reason:
            found.setdefault((detector, group), {})[reason] = None
    return {pair: list(reasons) for pair, reasons in found.items()}


def _reasons_in_words(results: Results, item: Summary, of_contacts: Mapping[Pair, Sequence[str]]) -> str:
    exposures = [row for row in results.exposure if (row.detector, row.group) == (item.detector, item.group)]
    reasons = of_contacts.get((item.detector, item.group)) or [
        f"{name} {100.0 * share:.0f} %" for row in exposures for name, share in row.not_judged.items()
    ]
    more = f"; and {len(reasons) - _REASONS} more reasons" if len(reasons) > _REASONS else ""
    return f"{'; '.join(reasons[:_REASONS]) or 'unknown reason'}{more}"
