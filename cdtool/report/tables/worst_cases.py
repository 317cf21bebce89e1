"""The worst and the failed cases of more results than a report can list, and how many there are of each kind.

Conventions: of each kind of case, detector and group the worst come first, those with a trace before the others. A
missed contact is worse with a larger peak force, a detected one with a longer latency, a false alarm with a larger
value.
"""

from __future__ import annotations

import heapq
import math
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from cdtool.report.number_text import NOT_ASSESSABLE, NOTHING
from cdtool.report.table import Cell, Fields, Heading, Log, Table, empty_cell, name_cell, number_cell, shown, tabulate
from cdtool.report.tables.results import detector_cell
from cdtool.results.results import ContactResult, FalseAlarmResult, ForceResult, Results, grouped

Row = TypeVar("Row")
# Outcomes of contacts: name, tone, how all of them are counted, and which are the worst.
_OUTCOMES = {
    "missed": ("missed", "bad", "missed", "peak_force_n"),
    "not_assessable": (NOT_ASSESSABLE, "unknown", NOT_ASSESSABLE, "peak_force_n"),
    "detected": ("among the slowest", "", "detected", "latency_ms"),
    "in_progress": ("in progress at the start", "", "in progress at the start", "peak_force_n"),
}


@dataclass(frozen=True)
class _Case:
    """What happened in a recording, with the figures that belong to it."""

    log: Log
    outcome: str
    tone: str = ""
    detector: str = ""
    contact: int | None = None
    at_s: float | None = None
    latency_ms: float | None = None
    resolution_ms: float | None = None
    peak_n: float | None = None
    why: str = ""
    missed_by_all: bool = False


def worst_cases_table(results: Results, traced: Collection[Log]) -> tuple[Table, str]:
    """Return the worst and the failed cases, and how many there are of each kind.

    Parameters
    ----------
    results : Results
        The results of a benchmark.
    traced : collection of (str, str)
        Group and name of the recordings with a trace.

    Returns
    -------
    table : Table
        The cases.
    counts : str
        How many of each kind are listed, and how many there are.

    Examples
    --------
    `cdtool.benchmark` returns the results.
    """
    cases: list[_Case] = []
    counts = []
    for words, made, total in _kinds(results, traced):
        cases += made
        counts += [f"{len(made)} of {total} {words}"] if total else []
    listed = {case.log for case in cases}
    cases += _examples(results, [log for log in traced if log not in listed])
    fields: Fields[_Case] = (
        (Heading("recording"), lambda item: name_cell(item.log[1])),
        (Heading("group", choice=True), lambda item: name_cell(item.log[0])),
        (Heading("detector", choice=True), lambda item: _detector_cell(results, item)),
        (Heading("outcome", choice=True), lambda item: Cell(item.outcome, tone=item.tone)),
        (Heading("contact", numeric=True), _number_of),
        (Heading("at [s]", numeric=True), _time_of),
        (Heading("latency [ms]", numeric=True), lambda item: number_cell(item.latency_ms, item.resolution_ms)),
        (Heading("peak force [N]", numeric=True), lambda item: number_cell(item.peak_n)),
        (Heading("why"), lambda item: Cell(item.why or NOTHING)),
    )
    table = tabulate("cases", "Worst and failed cases", fields, cases, "contacts", [case.log for case in cases])
    marks = {"missed by every detector": [case.missed_by_all for case in cases]}
    return replace(table, marks=marks), f"Listed: {'; '.join(counts)}." if counts else ""


def _kinds(results: Results, traced: Collection[Log]) -> Iterator[tuple[str, Sequence[_Case], int]]:
    """Yield each kind of case in words, its listed cases, and how many there are."""
    pairs = max(len(results.every_group) * len(results.detectors), 1)
    most = max(600 // pairs, 5)  # cases of one kind, and at least of each detector and group
    failed = grouped(results.forces, "verdict").get("fail", ())
    worst = _worst(failed, ("group",), "peak_n", most * max(len(results.detectors), 1), traced)
    yield "contacts above their force limits", [_of_force(item) for item in worst], len(failed)
    alarms = _worst(results.false_alarms, ("group", "detector"), "statistic", most, traced)
    yield "false alarms", [_of_alarm(item) for item in alarms], len(results.false_alarms)
    of_outcome = grouped(results.contacts, "outcome")
    missed = Counter((item.group, item.recording, item.contact) for item in of_outcome.get("missed", ()))
    for outcome, (_, _, words, by) in _OUTCOMES.items():
        rows = of_outcome.get(outcome, ())
        # A trace does not make a latency longer.
        listed = _worst(rows, ("group", "detector"), by, most, () if outcome == "detected" else traced)
        by_all = [missed[item.group, item.recording, item.contact] == len(results.detectors) for item in listed]
        yield words, [_of_contact(*item) for item in zip(listed, by_all, strict=True)], len(rows)


def _worst(rows: Sequence[Row], names: Sequence[str], by: str, most: int, traced: Collection[Log]) -> list[Row]:
    """Return the worst rows by a field, `most` of each with equal values of `names`."""

    def badness(row: Any) -> tuple[bool, float]:
        value = getattr(row, by)
        return (row.group, row.recording) in traced, -math.inf if value is None else value

    return [row for items in grouped(rows, *names).values() for row in heapq.nlargest(most, items, key=badness)]


def _examples(results: Results, logs: Collection[Log]) -> Iterator[_Case]:
    """Yield the contacts of recordings that have a trace and are no case, and those of them without a contact."""
    wanted, seen = set(logs), set()
    for item in results.contacts:
        if (item.group, item.recording) in wanted:
            seen.add((item.group, item.recording))
            case = _of_contact(item, missed_by_all=False)
            yield replace(case, outcome="detected") if item.outcome == "detected" else case
    yield from (_Case(log, "no contact, no alarm") for log in logs if log not in seen)


def _of_contact(item: ContactResult, missed_by_all: bool) -> _Case:
    words, tone, *_ = _OUTCOMES[item.outcome]
    why = item.reason or ("no alarm in its window" * (item.outcome == "missed"))
    return _Case(
        log=(item.group, item.recording),
        outcome=words,
        tone=tone,
        detector=item.detector,
        contact=item.contact,
        at_s=item.onset_s,
        latency_ms=item.latency_ms,
        resolution_ms=item.resolution_ms,
        peak_n=item.peak_force_n,
        why=why,
        missed_by_all=missed_by_all,
    )


def _of_alarm(item: FalseAlarmResult) -> _Case:
    log = item.group, item.recording
    return _Case(log, "false alarm", "bad", item.detector, at_s=item.time_s, why=f"joint {shown(item.joint)}")


def _of_force(item: ForceResult) -> _Case:
    log = item.group, item.recording
    return _Case(log, "force limits exceeded", "bad", contact=item.contact, peak_n=item.peak_n, why=item.reason or "")


def _detector_cell(results: Results, item: _Case) -> Cell:
    return detector_cell(results, item.detector) if item.detector else Cell(NOTHING)


def _number_of(item: _Case) -> Cell:
    return empty_cell() if item.contact is None else Cell(str(item.contact), key=item.contact)


def _time_of(item: _Case) -> Cell:
    return empty_cell() if item.at_s is None else Cell(f"{item.at_s:.3f}", key=item.at_s)
