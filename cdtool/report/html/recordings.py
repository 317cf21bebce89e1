"""The HTML report's table of recordings: what every detector made of each log; and what was left out."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from cdtool.evaluation.alike import Reason
from cdtool.evaluation.results import ContactResult, RecordingResult, Results
from cdtool.evaluation.summary import later_ms
from cdtool.evaluation.traces.trace import Trace
from cdtool.plain_text import counted
from cdtool.report.figure_text import NOTHING, number, percent
from cdtool.report.html.table import Cell, Column, Row, Table, count_cell, figure_cell, key_of, shown
from cdtool.report.html.tables import outcome_cell

# A log's group and name.
Log = tuple[str, str]

_OPERATION = re.compile(r"#\d+\Z")
_CONTACTS_TOLD = 3
_DIGEST = 12
_NOT_SEEN = "not assessable"
_FORCE_ORDER = ("fail", "not_assessable", "pass")


@dataclass
class _Seen:
    """What one detector made of one log."""

    contacts: list[ContactResult] = field(default_factory=list)
    false_alarms: int = 0


def traces_of(results: Results, traces: Sequence[Trace]) -> dict[Log, list[int]]:
    """The numbers of the traces of each log: one an operation that was kept."""
    logs = logs_of(results)
    found: dict[Log, list[int]] = {}
    for number_of, trace in enumerate(traces):
        found.setdefault(log_of(trace.group, trace.recording, logs), []).append(number_of)
    return found


def recordings_table(results: Results, opens: Mapping[Log, Sequence[int]]) -> Table:
    """A row a log with a column a detector; `opens`: the numbers of its traces."""
    seen = _seen(results)
    forces = _force_verdicts(results)
    blind = {
        (item.group, item.detector)
        for item in results.exposure
        if not item.hours or item.not_assessable >= item.operations
    }
    columns = [Column("recording"), Column("group", choice=True), Column("contacts", numeric=True)]
    columns += [Column(f"{shown(name)} [ms]", numeric=True) for name in results.detectors]
    columns += [Column("peak [N]", numeric=True)]
    columns += [Column("force limits", choice=True)] if forces else []
    columns += [Column("length [s]", numeric=True)]
    campaigns = any(item.campaign for item in results.recordings)
    columns += [Column("campaign", choice=True)] if campaigns else []
    columns += [Column(f"SHA-256, first {_DIGEST} digits")]
    rows, marks = [], []
    for item in results.recordings:
        log = (item.group, item.recording)
        parts = [seen.get((*log, name), _Seen()) for name in results.detectors]
        row = [Cell(shown(item.recording)), Cell(shown(item.group)), count_cell(item.contacts)]
        row += [
            _seen_cell(part, item, (item.group, name) in blind)
            for part, name in zip(parts, results.detectors, strict=True)
        ]
        row += [figure_cell(_peak(parts))]
        row += [outcome_cell(forces.get(log, NOTHING))] if forces else []
        row += [figure_cell(item.seconds)]
        row += [Cell(item.campaign or NOTHING)] if campaigns else []
        row += [Cell(item.sha256[:_DIGEST] or NOTHING)]
        rows.append(row)
        marks.append(_marks(parts, forces.get(log), bool(opens.get(log))))
    return Table(
        "recordings-table",
        "Every recording that was scored",
        columns,
        rows,
        marks={name: [mark[name] for mark in marks] for name in (marks[0] if marks else {})},
        opens=[opens.get((item.group, item.recording), ()) for item in results.recordings],
    )


def not_judged_table(results: Results) -> Table:
    """What each detector could not judge, and why."""
    names = ("group", "detector", "operations judged nowhere", "share of its samples", "why")
    columns = [Column(name, numeric=name.startswith(("operations", "share"))) for name in names]
    rows: list[Row] = [
        (
            Cell(shown(item.group)),
            Cell(shown(item.detector)),
            Cell(f"{item.not_assessable} of {item.operations}", key=item.not_assessable),
            Cell(percent(sum(item.not_judged.values())), key=sum(item.not_judged.values())),
            Cell(", ".join(f"{reason} {percent(share)}" for reason, share in item.not_judged.items())),
        )
        for item in results.exposure
        if item.not_judged or item.not_assessable
    ]
    return Table("not-judged-table", "Share of the samples that could not be judged", columns, rows)


def reasons_table(name: str, caption: str, items: Sequence[Reason]) -> Table:
    """Recordings or detectors with a reason each."""
    rows = [
        (Cell(shown(item.recording)), Cell(item.reason.removeprefix(f"{item.recording}: ") or NOTHING))
        for item in items
    ]
    return Table(name, caption, (Column("recording"), Column("reason")), rows)


def log_of(group: str, operation: str, logs: frozenset[Log]) -> Log:
    """The log that an operation belongs to: its name, less the "#2" where it was cut into several."""
    if (group, operation) in logs:
        return group, operation
    return group, _OPERATION.sub("", operation)


def logs_of(results: Results) -> frozenset[Log]:
    """Every log that was scored."""
    return frozenset((item.group, item.recording) for item in results.recordings)


def _seen(results: Results) -> dict[tuple[str, str, str], _Seen]:
    logs = logs_of(results)
    found: dict[tuple[str, str, str], _Seen] = {}
    for item in results.contacts:
        found.setdefault((item.group, item.recording, item.detector), _Seen()).contacts.append(item)
    for alarm in results.false_alarms:
        log = log_of(alarm.group, alarm.recording, logs)
        found.setdefault((*log, alarm.detector), _Seen()).false_alarms += 1
    return found


def _force_verdicts(results: Results) -> dict[Log, str]:
    """The worst verdict of each log."""
    found: dict[Log, str] = {}
    for item in results.forces:
        log = (item.group, item.recording)
        found[log] = min(found.get(log, item.verdict), item.verdict, key=_FORCE_ORDER.index)
    return found


def _peak(parts: Sequence[_Seen]) -> float | None:
    peaks = [item.peak_force_n for part in parts for item in part.contacts if item.peak_force_n is not None]
    return max(peaks, default=None)


def _seen_cell(seen: _Seen, recording: RecordingResult, blind: bool) -> Cell:
    """Latencies, misses and false alarms in words; sorted by the slowest contact, a missed one after all others.

    `blind`: the detector judged nothing in the whole group, so that no false alarm says nothing.
    """
    outcomes = [item.outcome for item in seen.contacts]
    words = _contact_words(seen.contacts)
    if blind and not seen.contacts and not seen.false_alarms:
        return Cell(_NOT_SEEN, key=key_of(None), tone="unknown")
    if seen.false_alarms or not (words or recording.contacts):
        words.append(counted(seen.false_alarms, "false alarm"))
    late = [item.latency_ms for item in seen.contacts if item.latency_ms is not None]
    slowest = float("inf") if "missed" in outcomes else max(late, default=None)
    tone = "bad" if "missed" in outcomes or seen.false_alarms else "unknown" if "not_assessable" in outcomes else ""
    return Cell(words[0] if words else NOTHING, tuple(words[1:]), key_of(slowest), tone)


def _contact_words(contacts: Sequence[ContactResult]) -> list[str]:
    if len(contacts) <= _CONTACTS_TOLD:
        told = [_latency(item) if item.latency_ms is not None else _missing(item) for item in contacts]
        return [", ".join(told)] if told else []
    late = [item.latency_ms for item in contacts if item.latency_ms is not None]
    slowest = f", slowest {number(max(late))}" if late else ""
    return [f"{len(late)} of {len(contacts)} detected{slowest}"]


def _latency(item: ContactResult) -> str:
    """A latency, or its range where the load cell did not see when the contact began."""
    shortest, later = item.latency_ms or 0.0, later_ms(item)
    return f"{number(shortest)} to {number(shortest + later)}" if later else number(shortest)


def _missing(item: ContactResult) -> str:
    if item.in_progress:
        return "in progress at the start"
    return "missed" if item.outcome == "missed" else _NOT_SEEN


def _marks(parts: Sequence[_Seen], force: str | None, has_trace: bool) -> dict[str, bool]:
    outcomes = {item.outcome for part in parts for item in part.contacts}
    return {
        "with a missed contact": "missed" in outcomes,
        "with a false alarm": any(part.false_alarms for part in parts),
        "with a contact that was not assessable": "not_assessable" in outcomes,
        "with a force limit exceeded": force == "fail",
        "detected by all": outcomes == {"detected"} and not any(part.false_alarms for part in parts),
        "with a trigger plot": has_trace,
    }
