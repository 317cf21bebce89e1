"""Score one log of a benchmark: read, cut, detect with every detector, match with its contacts, return the rows.

Combine the reports of several detectors that left out a run for the same reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from cdtool.alarms.pipeline import Detection, detect_operations
from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError, RecordingError, is_lasting
from cdtool.base.findings import Finding
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.impact_free import without_contacts
from cdtool.commands.judging.judged_operation import Judged, not_assessable
from cdtool.commands.judging.log_findings import log_warnings
from cdtool.commands.judging.matched_log import CutLog, MatchedLog, match_log
from cdtool.commands.judging.runs import (
    absent_truth,
    lost,
    named_on_load_side,
    read_named,
    reported,
    shown_path,
    unread,
    without_contradicted,
)
from cdtool.commands.judging.true_contacts import any_contacts, true_contacts, unwanted_contacts
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.force_rows import force_rows
from cdtool.formats.channels.run_reading import read_runs
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.operations import Operation, RunCut, operations_of
from cdtool.recordings.plausible import LearnedRanges, PlausibleRanges
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.curves.sweep import sweep_operation
from cdtool.results.results import ForceResult, RecordingFinding, RecordingResult, Skipped
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.verdict import ForceVerdict, assess_force


def left_out_by(detectors: Mapping[str, Iterable[Skipped]]) -> list[Skipped]:
    """Return the runs that detectors left out: a reason that all share is listed once, others name their detectors."""
    names: dict[Skipped, dict[str, None]] = {}
    for detector, skipped in detectors.items():
        for item in skipped:
            names.setdefault(item, {})[detector] = None
    return [
        item if len(by) == len(detectors) else Skipped(item.recording, f"{', '.join(by)}: {item.reason}")
        for item, by in names.items()
    ]


@dataclass(frozen=True)
class LogRows:
    """The rows of a log without those of its operations.

    `recording` is None if it was left out. `unchecked`: names of logs assumed to be free of impacts, with the ground
    truth that is missing from them. `beside`: name and SHA-256 of each file beside the log with a channel.
    """

    recording: RecordingResult | None
    forces: tuple[ForceResult, ...] = ()
    verdicts: tuple[ForceVerdict, ...] = ()
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()
    unchecked: tuple[tuple[str, Finding], ...] = ()
    beside: tuple[tuple[str, str], ...] = ()


class Detections(NamedTuple):
    """The detections of each operation of a log.

    `failed` are the operations on which a detector failed, for every detector that was run. `untaught`: why nothing
    could be learned for this log, by detector.
    """

    of_operations: Sequence[Sequence[Detection]]
    failed: Mapping[str, tuple[Skipped, ...]]
    untaught: Mapping[str, Sequence[RecordingFinding]]


@dataclass(frozen=True)
class ScoredLog:
    """One log or run after detection and matching: its rows, and with its samples what the rows are made of.

    `recording`, `contacts` and `matched` are absent if the log was left out; `lasts` says whether it would be again: it
    is not because of a network or a full disk.
    """

    rows: LogRows
    recording: Recording | None = None
    contacts: tuple[Contact, ...] = ()
    matched: MatchedLog | None = None
    lasts: bool = True


# Returns the detections in the operations of a log or run, given by its path.
Detect = Callable[[Path, Sequence[Operation]], Detections]


def detect_with(
    setup: BenchmarkFile,
    detectors: Sequence[Any],
    thresholds_for: Callable[[Path], tuple[Mapping[str, Any], Mapping[str, Sequence[RecordingFinding]]]],
    unusable: Mapping[str, str],
) -> Detect:
    """Return the detectors with their thresholds as one function; a detector that fails on a log is left out there.

    `thresholds_for` returns the thresholds of each detector for a log, and the findings about that. Detectors in
    `unusable` cannot be used, for the given reason; none of their samples is assessable. A class of motion is monitored
    for the longest matching window.
    """
    machine = setup.machine_file.machine

    def detect(log: Path, operations: Sequence[Operation]) -> Detections:
        thresholds, untaught = thresholds_for(log)
        found: list[list[Detection]] = [[] for _ in operations]
        failed: dict[str, tuple[Skipped, ...]] = {}
        for detector in detectors:
            failed[detector.name] = ()
            if detector.name in unusable:
                unit, why = detector.unit(machine), unusable[detector.name]
                made = [not_assessable(item, detector.name, unit, why, setup.watched) for item in operations]
            else:
                known = thresholds[detector.name]
                try:
                    made = detect_operations(
                        operations, machine, detector, known, setup.activation, setup.watched, setup.grace
                    )
                except CdtoolError as fault:
                    failed[detector.name] = tuple(Skipped(item.whole.name, str(fault)) for item in operations)
                    continue
            for of_operation, detection in zip(found, made, strict=True):
                of_operation.append(detection)
        return Detections(found, failed, untaught)

    return detect


def score_runs(
    setup: BenchmarkFile,
    group: str,
    path: Path,
    detect: Detect,
    factors: Mapping[str, FloatArray],
    ranges: LearnedRanges | None = None,
) -> list[ScoredLog]:
    """Score a log, or each of its runs if the benchmark cuts logs into runs; the first entry is then about the log.

    A log or detector that fails is left out and reported, and nothing is raised. `factors`: the safety factors of the
    sweep by detector. `group` is empty for a log outside all groups. Values outside the plausible `ranges` are masked.
    """
    try:
        loads, of_log = _loads(setup, group, path, ranges)
    except CdtoolError as fault:
        return [_unread(setup, path, fault)]
    scored = [ScoredLog(of_log)] if RunCut.of(setup.operations) else []
    return [*scored, *(_score(setup, group, path, detect, factors, name, load) for name, load in loads)]


def _unread(setup: BenchmarkFile, path: Path, fault: CdtoolError) -> ScoredLog:
    left_out = unread(path, setup.path.parent, fault)
    return ScoredLog(LogRows(None, skipped=(left_out,)), lasts=is_lasting(fault))


def logs_to_score(setup: BenchmarkFile, group: str, path: Path) -> Iterator[CutLog | Skipped]:
    """Yield a log as it is scored, or each of its runs; the reason for one that cannot be used."""
    try:
        loads, of_log = _loads(setup, group, path, None)
    except CdtoolError as fault:
        yield unread(path, setup.path.parent, fault)
        return
    yield from of_log.skipped
    for name, load in loads:
        try:
            yield _cut_log(setup, group, path, name, load)
        except CdtoolError as fault:
            yield unread(name, setup.path.parent, fault)


def _loads(
    setup: BenchmarkFile, group: str, path: Path, ranges: LearnedRanges | None
) -> tuple[list[tuple[Path, Callable[[], Recording]]], LogRows]:
    """Return how a log, or each of its runs, is read, and the rows of the whole log; raises CdtoolError."""
    base, cut = setup.path.parent, RunCut.of(setup.operations)

    def known(name: Path) -> PlausibleRanges | None:
        return None if ranges is None else ranges.without(shown_path(name, base))

    if cut is None:
        return [
            (path, lambda: read_named(path, setup.machine_file_of(group), base, known(path), setup.onset))
        ], LogRows(None)
    runs = read_runs(path, setup.machine_file, cut)
    skipped, findings = reported(runs, path, base)
    names = [location(logged.recording.source) for logged in runs.runs]
    loads = [
        (name, partial(named_on_load_side, logged, name, setup.machine_file, base, known(name), setup.onset))
        for name, logged in zip(names, runs.runs, strict=True)
    ]
    return [*loads], LogRows(None, skipped=tuple(skipped), findings=tuple(findings))


def _cut_log(setup: BenchmarkFile, group: str, log: Path, path: Path, load: Callable[[], Recording]) -> CutLog:
    """Read and cut a log or a run at `path`; `log` is its path in the benchmark file. Raises RecordingError."""
    rules = setup.rules_of(group)
    whole = load()
    if setup.checks_channels:
        whole = without_contradicted(whole, setup.machine_file.machine, setup.onset)
    section = setup.sections.get(log, LogSection() if group else setup.section)
    recording = section.of(whole)
    operations = operations_of(recording, setup.operations)
    if setup.is_impact_free(group):
        unwanted: Sequence[Contact] = unwanted_contacts(whole, rules)
        unwanted = section.contacts_of(whole, unwanted) if section else unwanted
        return CutLog(recording, operations, setup.operations, unwanted=unwanted)
    contacts: Sequence[Contact] = true_contacts(whole, rules, path) if group else any_contacts(whole, rules)
    if section and contacts:
        contacts = section.contacts_of(whole, contacts)
        if not contacts and group:
            raise RecordingError(f"{path}: no contact {section}", "change from and to, or move it to [holdout]")
    return CutLog(recording, operations, setup.operations, contacts)


def _score(
    setup: BenchmarkFile,
    group: str,
    log: Path,
    detect: Detect,
    factors: Mapping[str, FloatArray],
    path: Path,
    load: Callable[[], Recording],
) -> ScoredLog:
    """Score a log or one of its runs, at `path`; `log` is its path in the benchmark file."""
    rules = setup.rules_of(group)
    try:
        read = _cut_log(setup, group, log, path, load)
    except CdtoolError as fault:
        return _unread(setup, path, fault)
    recording, operations, contacts, unwanted = read.recording, read.operations, read.contacts, read.unwanted
    findings, skipped, unchecked = [*lost(recording)], list[Skipped](), list[tuple[str, Finding]]()
    if setup.is_impact_free(group):
        operations, touched = without_contacts(operations, unwanted)
        skipped += [replace(item, recording=recording.name) for item in touched]
        unchecked = [(recording.name, item) for item in absent_truth(recording)]
        if not operations:
            findings += log_warnings(recording, unwanted, setup.onset)
            rows = LogRows(None, (), (), tuple(skipped), tuple(findings), tuple(unchecked), beside=recording.beside)
            return ScoredLog(rows, recording, tuple(contacts))
    row = _recording_result(recording, group, log, len(operations), len(contacts), setup)
    found = detect(path, operations)
    matched = match_log(replace(read, operations=operations), found.of_operations, group, rules, setup.activation.wait)
    skipped += matched.not_scored
    findings += matched.findings
    forces, verdicts = list[ForceResult](), dict[int, ForceVerdict]()
    if group in setup.impacts and (profile := setup.impacts[group].force):
        curves = matched.curves
        verdicts = {number: assess_force(curve, profile) for number, curve in curves.items()}
        forces = force_rows(row, verdicts, curves)
        findings += _force_not_seen(recording, profile.name, verdicts, curves)
        numbered = enumerate(contacts, 1)
        unseen = [f"contact {number}" for number, item in numbered if number not in curves and not item.in_progress]
        if unseen:
            text = f"{', '.join(unseen)}: no load-cell force to compare with {profile.name}"
            skipped.append(Skipped(recording.name, text))
    # The curve of latency against false alarms is that of the unchanged machine.
    moved = {} if setup.is_condition(group) else factors
    matched = replace(matched, judged=tuple(_swept(item, setup, rules.window, moved) for item in matched.judged))
    rows = LogRows(
        row,
        tuple(forces),
        tuple(verdicts.values()),
        (*skipped, *left_out_by(found.failed)),
        (*findings, *(item for of_detector in found.untaught.values() for item in of_detector)),
        tuple(unchecked),
        beside=recording.beside,
    )
    return ScoredLog(rows, recording, tuple(contacts), matched)


def _force_not_seen(
    recording: Recording, profile: str, verdicts: Mapping[int, ForceVerdict], curves: Mapping[int, ForceTimeCurve]
) -> list[RecordingFinding]:
    """Return the contacts not assessable by a force profile because load-cell samples are missing: a data loss."""
    unassessable = [
        Finding("force_unassessable", "", {"contact": number, "profile": profile, "reason": verdict.reason})
        for number, verdict in verdicts.items()
        if verdict.outcome == "not_assessable" and curves[number].has_missing_samples
    ]
    return [RecordingFinding.of(recording.name, item) for item in unassessable]


def _recording_result(
    recording: Recording, group: str, path: Path, operations: int, contacts: int, setup: BenchmarkFile
) -> RecordingResult:
    return RecordingResult(
        recording=recording.name,
        group=group,
        sha256=recording.digest,
        seconds=recording.duration,
        operations=operations,
        contacts=contacts,
        campaign=setup.campaigns.get(path),
        point=setup.points.get(path),
        began_s=recording.began,
    )


def _swept(judged: Judged, setup: BenchmarkFile, window: float, factors: Mapping[str, FloatArray]) -> Judged:
    sweeps = sweep_operation(judged.detections, judged.contacts, setup.activation, window, factors)
    return replace(judged, sweeps=sweeps)
