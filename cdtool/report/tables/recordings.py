"""Tables of recordings: what every detector made of each, single contacts and false alarms, what was left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from cdtool.base.plain_text import counted
from cdtool.report.alike import RecordingReason, alike
from cdtool.report.many import most_rows
from cdtool.report.number_text import NOT_ASSESSABLE, NOTHING, number, percent
from cdtool.report.table import (
    Cell,
    Fields,
    Heading,
    Log,
    Table,
    count_cell,
    key_of,
    name_cell,
    number_cell,
    outcome_cell,
    shown,
    tabulate,
)
from cdtool.report.tables.results import detector_cell, part_of
from cdtool.results.results import ContactResult, ExposureResult, FalseAlarmResult, RecordingResult, Results, grouped
from cdtool.results.summary import later_ms

#: 48 bits: no two logs of a benchmark have the same.
_DIGEST = 12
_FORCE_ORDER = ("fail", "not_assessable", "pass")


@dataclass
class _Outcome:
    """The outcome of one log with one detector."""

    contacts: list[ContactResult] = field(default_factory=list)
    false_alarms: int = 0

    @property
    def outcomes(self) -> set[str]:
        return {item.outcome for item in self.contacts}


def recordings_table(results: Results) -> Table:
    """Return a row per log with a column per detector."""
    outcomes, forces = _outcomes(results), _force_verdicts(results)
    silent = {
        (item.group, item.detector)
        for item in results.exposure
        if not item.hours or item.not_assessable >= item.operations
    }

    def part_of_log(item: RecordingResult, name: str) -> _Outcome:
        return outcomes.get((item.group, item.recording, name), _Outcome())

    def parts_of(item: RecordingResult) -> list[_Outcome]:
        return [part_of_log(item, name) for name in results.detectors]

    def column_of(name: str) -> Callable[[RecordingResult], Cell]:
        return lambda item: _outcome_cell(part_of_log(item, name), item, (item.group, name) in silent)

    def verdict_of(item: RecordingResult) -> str:
        return forces.get((item.group, item.recording), NOTHING)

    fields: list[tuple[Heading, Callable[[RecordingResult], Cell]]] = [
        (Heading("recording"), lambda item: name_cell(item.recording)),
        (Heading("group", choice=True), lambda item: name_cell(item.group)),
        (Heading("contacts", numeric=True), lambda item: count_cell(item.contacts)),
    ]
    fields += [(Heading(f"{shown(name)} [ms]", numeric=True), column_of(name)) for name in results.detectors]
    fields.append((Heading("peak [N]", numeric=True), lambda item: number_cell(_peak(parts_of(item)))))
    if forces:
        fields.append((Heading("force limits", choice=True), lambda item: outcome_cell(verdict_of(item))))
    fields.append((Heading("length [s]", numeric=True), lambda item: number_cell(item.seconds)))
    if any(item.campaign for item in results.recordings):
        fields.append((Heading("campaign", choice=True), lambda item: Cell(item.campaign or NOTHING)))
    fields.append((Heading(f"SHA-256, first {_DIGEST} digits"), lambda item: Cell(item.sha256[:_DIGEST] or NOTHING)))
    logs = [(item.group, item.recording) for item in results.recordings]
    table = tabulate("recordings", "Recordings", fields, results.recordings, "recordings", logs)
    marks = [_marks(parts_of(item), verdict_of(item)) for item in results.recordings]
    return replace(table, marks={name: [mark[name] for mark in marks] for name in (marks[0] if marks else {})})


def contact_tables(results: Results) -> list[Table]:
    """Return the contacts that were missed, not assessable, or in progress at the start of their recording."""
    fields: Fields[ContactResult] = (
        (Heading("recording"), lambda item: name_cell(item.recording)),
        (Heading("group"), lambda item: name_cell(item.group)),
        (Heading("contact", numeric=True), lambda item: count_cell(item.contact)),
        (Heading("onset [s]", numeric=True), lambda item: Cell(f"{item.onset_s:.3f}", key=item.onset_s)),
        (Heading("detector"), lambda item: detector_cell(results, item.detector)),
        (Heading("alarm possible for [ms]", numeric=True), lambda item: number_cell(item.watched_ms)),
        (Heading("peak force [N]", numeric=True), lambda item: number_cell(item.peak_force_n)),
        (Heading("why"), lambda item: Cell(item.reason or ("no alarm in its window" * (item.outcome == "missed")))),
    )
    tables = {
        "missed": ("missed", "Contacts missed"),
        "not_assessable": ("not_assessable_contacts", "Contacts not assessable"),
        "in_progress": ("in_progress", "Contacts in progress at the start"),
    }
    rows = grouped(results.contacts, "outcome")
    return [
        tabulate(name, title, fields, rows.get(outcome, ()), "contacts", (), most_rows(results))
        for outcome, (name, title) in tables.items()
    ]


def false_alarms_table(results: Results) -> Table:
    """Return every alarm without a contact."""
    units = part_of(results.provenance, "units")
    fields: Fields[FalseAlarmResult] = (
        (Heading("recording"), lambda item: name_cell(item.recording)),
        (Heading("group"), lambda item: name_cell(item.group)),
        (Heading("detector"), lambda item: detector_cell(results, item.detector)),
        (Heading("joint"), lambda item: name_cell(item.joint)),
        (Heading("at [s]", numeric=True), lambda item: Cell(f"{item.time_s:.3f}", key=item.time_s)),
        (Heading("crossed"), lambda item: Cell(item.side or NOTHING)),
        (Heading("value", numeric=True), lambda item: _with_unit(item.statistic, units.get(item.detector, ""))),
        (Heading("limit", numeric=True), lambda item: _with_unit(item.limit, units.get(item.detector, ""))),
    )
    rows = results.false_alarms
    return tabulate("false_alarms", "False alarms", fields, rows, "false_alarms", (), most_rows(results))


def not_assessable_table(results: Results) -> Table:
    """Return the share of the samples that each detector could not assess, and why."""
    fields: Fields[ExposureResult] = (
        (Heading("group"), lambda item: name_cell(item.group)),
        (Heading("detector"), lambda item: detector_cell(results, item.detector)),
        (Heading("operations assessable nowhere", numeric=True), _operations),
        (Heading("share of its samples", numeric=True), _share),
        (Heading("why"), lambda item: Cell(", ".join(f"{why} {percent(share)}" for why, share in _reasons(item)))),
    )
    items = [item for item in results.exposure if _reasons(item) or item.not_assessable]
    return tabulate("not_assessable", "Samples not assessable", fields, items, "exposure")


def reasons_tables(results: Results) -> list[Table]:
    """Return what was left out, what is lost of recordings that were used, and the warnings about these."""
    fields: Fields[RecordingReason] = (
        (Heading("recording"), lambda item: name_cell(item.recording)),
        (Heading("reason"), lambda item: Cell(item.reason.removeprefix(f"{item.recording}: ") or NOTHING)),
    )
    return [
        tabulate("skipped", "Left out", fields, alike(results.skipped), "skipped", (), most_rows(results)),
        tabulate("damaged", "Damaged but used", fields, alike(results.losses), "findings", (), most_rows(results)),
        tabulate("findings", "Warnings", fields, alike(results.warnings), "findings", (), most_rows(results)),
    ]


def _outcomes(results: Results) -> dict[tuple[str, str, str], _Outcome]:
    outcomes: dict[tuple[str, str, str], _Outcome] = {}
    for item in results.contacts:
        outcomes.setdefault((item.group, item.recording, item.detector), _Outcome()).contacts.append(item)
    for alarm in results.false_alarms:
        outcomes.setdefault((alarm.group, alarm.recording, alarm.detector), _Outcome()).false_alarms += 1
    return outcomes


def _force_verdicts(results: Results) -> dict[Log, str]:
    """Return the worst verdict of each log."""
    verdicts: dict[Log, str] = {}
    for item in results.forces:
        log = (item.group, item.recording)
        verdicts[log] = min(verdicts.get(log, item.verdict), item.verdict, key=_FORCE_ORDER.index)
    return verdicts


def _peak(parts: Sequence[_Outcome]) -> float | None:
    peaks = [item.peak_force_n for part in parts for item in part.contacts if item.peak_force_n is not None]
    return max(peaks, default=None)


def _outcome_cell(part: _Outcome, recording: RecordingResult, silent: bool) -> Cell:
    """Return latencies, misses and false alarms; sorted by the slowest contact, a missed one after all others.

    `silent`: the detector could assess nothing in the whole group, so that "no false alarm" means nothing.
    """
    words = _contact_words(part.contacts)
    if silent and not part.contacts and not part.false_alarms:
        return Cell(NOT_ASSESSABLE, key=key_of(None), tone="unknown")
    if part.false_alarms or not (words or recording.contacts):
        words.append(counted(part.false_alarms, "false alarm"))
    missed = "missed" in part.outcomes
    latencies = [item.latency_ms for item in part.contacts if item.latency_ms is not None]
    slowest = float("inf") if missed else max(latencies, default=None)
    tone = "bad" if missed or part.false_alarms else "unknown" if "not_assessable" in part.outcomes else ""
    first, *others = words or [NOTHING]
    return Cell(first, tuple(f"; {other}" for other in others), key_of(slowest), tone)


def _contact_words(contacts: Sequence[ContactResult]) -> list[str]:
    if len(contacts) <= 3:
        return [", ".join(map(_contact_word, contacts))] if contacts else []
    latencies = {item.latency_ms: item for item in contacts if item.latency_ms is not None}
    slowest = f", slowest {number(max(latencies), error=latencies[max(latencies)].resolution_ms)}" if latencies else ""
    return [f"{len(latencies)} of {len(contacts)} detected{slowest}"]


def _contact_word(item: ContactResult) -> str:
    """Return a latency, as a range if the load cell missed the beginning of the contact, or the outcome without one."""
    if item.latency_ms is not None:
        later = later_ms(item)
        longest = f" to {number(item.latency_ms + later, error=item.resolution_ms)}" if later else ""
        return f"{number(item.latency_ms, error=item.resolution_ms)}{longest}"
    if item.in_progress:
        return "in progress at the start"
    return "missed" if item.outcome == "missed" else NOT_ASSESSABLE


def _marks(parts: Sequence[_Outcome], verdict: str) -> dict[str, bool]:
    outcomes = {outcome for part in parts for outcome in part.outcomes}
    false_alarms = any(part.false_alarms for part in parts)
    return {
        "with a missed contact": "missed" in outcomes,
        "with a false alarm": false_alarms,
        "with a contact that was not assessable": "not_assessable" in outcomes,
        "with a force limit exceeded": verdict == "fail",
        "detected by all": outcomes == {"detected"} and not false_alarms,
    }


def _with_unit(value: float | None, unit: object) -> Cell:
    return Cell(NOTHING if value is None else f"{number(value)} {unit}".strip(), key=key_of(value))


def _operations(item: ExposureResult) -> Cell:
    return Cell(f"{item.not_assessable} of {item.operations}", key=item.not_assessable)


def _share(item: ExposureResult) -> Cell:
    share = sum(share for _, share in _reasons(item))
    return Cell(percent(share), key=share)


def _reasons(item: ExposureResult) -> list[tuple[str, float]]:
    return list(item.not_judged.items())  # language: the name of the field in results.json
