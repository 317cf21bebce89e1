"""What needs attention: the recordings that violate a limit, are missed, raise false alarms or exceed a force limit.

Conventions: the worst recording comes first: force limits exceeded, then the number of detectors that missed a contact,
then the peak force, violated limits, false alarms, and the longest latency of a detector that violates a limit.
Recordings of changed conditions are listed only if they violate a limit: they count in nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from cdtool.base.plain_text import counted
from cdtool.report.number_text import NOTHING, number
from cdtool.report.table import Cell, Fields, Heading, Log, Table, empty_cell, name_cell, shown, tabulate
from cdtool.report.tables.results import part_of
from cdtool.results.recording_outcomes import RecordingOutcome, recording_outcomes
from cdtool.results.results import ForceResult, Results
from cdtool.results.traces.trace import Trace


@dataclass
class FailedRecording:
    """A recording and everything in it that needs attention.

    `missed`, `false_alarms` and `violated`: by detector the number of contacts and alarms, and its part in violated
    limits. `force`: the contact with the highest peak of those above their limits. `peak_n`: of the missed contacts.
    `latest_ms`: the longest latency of the detectors with a part in a violated limit.
    """

    log: Log
    missed: dict[str, int] = field(default_factory=dict)
    false_alarms: dict[str, int] = field(default_factory=dict)
    violated: dict[str, tuple[str, ...]] = field(default_factory=dict)
    force: ForceResult | None = None
    peak_n: float = 0.0
    latest_ms: float = 0.0

    @property
    def badness(self) -> tuple[bool, int, float, int, int, float]:
        """What the recordings are ordered by; the worst has the largest."""
        peak = max(self.peak_n, self.force.peak_n or 0.0) if self.force else self.peak_n
        violations = sum(map(len, self.violated.values()))
        alarms = sum(self.false_alarms.values())
        return self.force is not None, len(self.missed), peak, violations, alarms, self.latest_ms


def failed_recordings(results: Results) -> list[FailedRecording]:
    """Return the recordings that need attention, the worst first; equally bad ones in the order of the benchmark file.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    list of FailedRecording
        Empty if nothing was missed, raised falsely or above a limit.

    Examples
    --------
    `cdtool.benchmark` returns the results.
    """
    found: dict[Log, FailedRecording] = {}

    def of(log: Log) -> FailedRecording:
        return found.setdefault(log, FailedRecording(log))

    for item in results.forces:
        if item.verdict == "fail":
            failed = of((item.group, item.recording))
            if failed.force is None or (item.peak_n or 0.0) > (failed.force.peak_n or 0.0):
                failed.force = item
    for outcome in recording_outcomes(results):
        missed = [contact.peak_force_n or 0.0 for contact in outcome.contacts if contact.outcome == "missed"]
        if _needs_attention(results, outcome, bool(missed)):
            failed = of((outcome.group, outcome.recording))
            failed.peak_n = max([failed.peak_n, *missed])
            for amounts, count in ((failed.missed, len(missed)), (failed.false_alarms, len(outcome.false_alarms))):
                amounts.update({outcome.detector: count} if count else {})
            if outcome.breaks:
                failed.violated[outcome.detector] = outcome.breaks
                latencies = [contact.latency_ms or 0.0 for contact in outcome.contacts]
                failed.latest_ms = max([failed.latest_ms, *latencies])
    return sorted(found.values(), key=lambda item: item.badness, reverse=True)


def _needs_attention(results: Results, outcome: RecordingOutcome, missed: bool) -> bool:
    if outcome.breaks:
        return True
    return outcome.group in results.groups and (missed or bool(outcome.false_alarms))


def attention_table(results: Results, failed: Sequence[FailedRecording]) -> Table:
    """Return a row per failed recording, the worst first; columns that no row fills are left out."""
    names = part_of(results.provenance, "short_names")
    every: Fields[FailedRecording] = (
        (Heading("recording"), lambda item: name_cell(item.log[1])),
        (Heading("group", choice=True), lambda item: name_cell(item.log[0])),
        (Heading("missed by"), lambda item: _missed_by(item, results, names)),
        (Heading("force limit exceeded"), _force),
        (Heading("false alarms"), lambda item: _false_alarms(item, names)),
        (Heading("violates limits"), lambda item: _violated(item, names)),
    )
    table = tabulate("attention", "Failed recordings, the worst first", every, failed, "contacts")
    used = [i for i in range(len(every)) if any(row[i].text != NOTHING for row in table.rows)]
    columns = [table.columns[i] for i in used]
    rows = [[row[i] for i in used] for row in table.rows]
    return Table(table.name, table.title, columns, rows, table.source, logs=[item.log for item in failed])


def failed_traces(failed: Sequence[Log], traces: Sequence[Trace], numbers: Mapping[Log, Sequence[int]]) -> list[int]:
    """Return the traces of failed recordings, the worst first; of a log cut into operations, those that failed.

    Parameters
    ----------
    failed : sequence of (str, str)
        Group and name of the failed recordings.
    traces : sequence of Trace
        The traces of the benchmark.
    numbers : mapping of (str, str) to sequence of int
        The traces of each recording.

    Returns
    -------
    list of int
        Their numbers.

    Examples
    --------
    >>> failed_traces([("stiff", "01.csv")], (), {})
    []
    """
    found: list[int] = []
    for log in failed:
        of_log = numbers.get(log, ())
        found += [number for number in of_log if _failed(traces[number])] or of_log
    return found


def _failed(trace: Trace) -> bool:
    return any(panel.false_alarms or any(seen.outcome == "missed" for seen in panel.seen) for panel in trace.panels)


def _missed_by(item: FailedRecording, results: Results, names: Mapping[str, object]) -> Cell:
    if not item.missed:
        return empty_cell()
    if len(item.missed) == len(results.detectors) > 1:
        return Cell("all detectors", key=len(item.missed), tone="bad")
    of = f" of {counted(len(results.detectors), 'detector')}"
    return Cell(_listed(item.missed, names), (f": {len(item.missed)}{of}",), len(item.missed), "bad")


def _force(item: FailedRecording) -> Cell:
    if item.force is None:
        return empty_cell()
    return Cell(f"{number(item.force.peak_n)} N", (f": {item.force.reason}",), item.force.peak_n, "bad")


def _false_alarms(item: FailedRecording, names: Mapping[str, object]) -> Cell:
    if not item.false_alarms:
        return empty_cell()
    count = sum(item.false_alarms.values())
    return Cell(str(count), (f": {_listed(item.false_alarms, names)}",), count, "bad")


def _violated(item: FailedRecording, names: Mapping[str, object]) -> Cell:
    lines = [f"{names.get(name, shown(name))}: {part}" for name, parts in item.violated.items() for part in parts]
    if not lines:
        return empty_cell()
    return Cell(lines[0], tuple(f"; {line}" for line in lines[1:]), len(lines), "bad")


def _listed(detectors: Mapping[str, object], names: Mapping[str, object]) -> str:
    return ", ".join(str(names.get(name, shown(name))) for name in detectors)
