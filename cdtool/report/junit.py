"""JUnit XML: every limit and every recording as a test case, so that a CI system shows which one broke the build.

Conventions: a failure is a limit or force profile that is not met, or a recording's part in one; so there is a failure
exactly where the exit status is 1. What was left out is an error, and so is a force profile that could not be assessed
and a detector that could assess nothing of a group; what else could not be assessed is skipped. `time` is 0: a latency
is no running time. Text from files is plain, so that every XML 1.0 parser reads it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from xml.etree import ElementTree

from cdtool.evaluation.conclusion import ForceCheck, force_checks, force_missed, nothing_assessed
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.recording_outcomes import RecordingOutcome, recording_outcomes
from cdtool.evaluation.results import DAMAGED, ContactResult, LimitResult, RecordingFinding
from cdtool.evaluation.summary import later_ms
from cdtool.plain_text import plain
from cdtool.report.figure_text import number, spoken
from cdtool.report.verdict_words import allowed, value_of

_COUNTED = {"failures": "failure", "errors": "error", "skipped": "skipped"}


def to_junit(evaluated: Evaluated) -> str:
    """The report as JUnit XML, as Jenkins and GitLab read it; the same text for the same results."""
    suites = list(_suites(evaluated))
    counts = {key: str(sum(int(suite.get(key, "0")) for suite in suites)) for key in ("tests", "failures", "errors")}
    # Jenkins' schema knows no "skipped" of all suites together.
    root = ElementTree.Element("testsuites", {"name": "cdtool", **counts, "time": "0"})
    root.extend(suites)
    ElementTree.indent(root, " ")
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'


def _suites(evaluated: Evaluated) -> Iterator[ElementTree.Element]:
    results = evaluated.results
    if results.limits:
        yield _suite("limits", [_limit(item) for item in results.limits])
    checks = force_checks(results)
    if checks:
        yield _suite("force", [_force(item) for item in checks])
    if results.skipped:
        yield _suite("left out", [_case("left out", item.recording, "error", item.reason) for item in results.skipped])
    if results.losses:
        yield _suite("damaged", [_damaged(item) for item in results.losses])
    blind = {(item.detector, item.group) for item in nothing_assessed(evaluated.summaries)}
    forbidden = {(item.detector, item.group) for item in force_missed(results, evaluated.summaries)}
    outcomes = recording_outcomes(results)
    for (detector, group), items in groupby(outcomes, key=lambda item: (item.detector, item.group)):
        name = f"{detector}.{group}"
        nothing, strict = (detector, group) in blind, (detector, group) in forbidden
        yield _suite(name, [_recording(name, item, nothing, strict) for item in items])
    if not outcomes:
        yield _suite("benchmark", [_case("benchmark", "scored", "error", "nothing was scored")])


def _limit(item: LimitResult) -> ElementTree.Element:
    name = f"{item.limit} ({item.detector}, {item.group})"
    words = f"{item.figure} is {value_of(item)}, {allowed(item)} allowed"
    if item.outcome == "met":
        return _case("limits", name, lines=[words])
    return _case("limits", name, "failure", f"{spoken(item.outcome)}: {words}; {item.reason}")


def _force(item: ForceCheck) -> ElementTree.Element:
    name = f"{item.group}: {item.name or 'no contact'}"
    if item.verdict == "pass":
        return _case("force", name, lines=[f"{item.profile}: pass"])
    kind = "failure" if item.verdict == "fail" else "error"
    return _case("force", name, kind, f"{item.profile}: {spoken(item.verdict)}: {item.reason}")


def _damaged(item: RecordingFinding) -> ElementTree.Element:
    return _case("damaged", item.recording, "error", f"{DAMAGED}: {item.reason}")


def _recording(suite: str, item: RecordingOutcome, nothing: bool, strict: bool) -> ElementTree.Element:
    """`nothing`: the detector could assess nothing of the group; `strict`: a missed contact violates its profile."""
    lines = [_contact(contact) for contact in item.contacts]
    lines += [f"false alarm at {alarm.time_s:.3f} s on {alarm.joint}" for alarm in item.false_alarms]
    missed = [contact.contact for contact in item.contacts if strict and contact.outcome == "missed"]
    breaks = [*item.breaks, *(f"contact {number} is missed where a force profile is set" for number in missed)]
    if breaks:
        return _case(suite, item.recording, "failure", "; ".join(breaks), lines)
    if item.blind:
        why = "; ".join(dict.fromkeys(contact.reason or "" for contact in item.contacts))
        kind = "error" if nothing else "skipped"
        return _case(suite, item.recording, kind, f"not assessable: {why or 'the detector gave no result'}", lines)
    return _case(suite, item.recording, lines=lines or ["no contact and no alarm"])


def _contact(item: ContactResult) -> str:
    words = f"contact {item.contact} at {item.onset_s:.3f} s: {item.outcome.replace('_', ' ')}"
    if item.latency_ms is not None:
        words += f" after {number(item.latency_ms)} ms"
        words += " (before the onset, within its uncertainty)" if item.clipped else ""
        if item.onset_hole_ms is not None:
            words += f" or up to {number(later_ms(item))} ms later (load-cell samples missing at the onset)"
    if item.force_at_alarm_n is not None:
        words += f" at {number(item.force_at_alarm_n)} N"
    if item.peak_force_n is not None:
        words += f", peak {number(item.peak_force_n)} N"
    if item.force_hole_ms is not None:
        words += f" or more (load-cell samples missing for {number(item.force_hole_ms)} ms)"
    return f"{words} ({item.reason})" if item.reason else words


def _case(suite: str, name: str, kind: str = "", message: str = "", lines: Sequence[str] = ()) -> ElementTree.Element:
    case = ElementTree.Element("testcase", {"classname": plain(suite), "name": plain(name), "time": "0"})
    if kind:
        # Jenkins shows the message, GitLab the text.
        ElementTree.SubElement(case, kind, {"type": kind, "message": plain(message)}).text = _text(message)
    if lines:
        ElementTree.SubElement(case, "system-out").text = "\n".join(map(_text, lines))
    return case


def _text(line: str) -> str:
    """A line that holds no [[ATTACHMENT|file]], which Jenkins and GitLab would make a link to a file of theirs."""
    return re.sub(r"\[(?=\[)", "[ ", plain(line))


def _suite(name: str, cases: Sequence[ElementTree.Element]) -> ElementTree.Element:
    counts = {key: str(sum(case.find(kind) is not None for case in cases)) for key, kind in _COUNTED.items()}
    suite = ElementTree.Element("testsuite", {"name": plain(name), "tests": str(len(cases)), **counts, "time": "0"})
    suite.extend(cases)
    return suite
