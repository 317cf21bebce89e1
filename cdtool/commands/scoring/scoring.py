"""Score one log of a benchmark: read, cut, detect with every detector, match with its contacts, return the rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from cdtool.alarms.pipeline import Detection, detect_operations
from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError, RecordingError, is_lasting
from cdtool.base.findings import Finding
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.impact_free import without_contacts
from cdtool.commands.judging.judged_operation import Judged, not_assessable
from cdtool.commands.judging.log_findings import log_warnings
from cdtool.commands.judging.matched_log import DetectedLog, MatchedLog, match_log
from cdtool.commands.judging.runs import (
    absent_truth,
    lost,
    named_on_load_side,
    read_named,
    reported,
    shown_path,
    unread,
)
from cdtool.commands.judging.true_contacts import any_contacts, true_contacts, unwanted_contacts
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.force_rows import force_rows
from cdtool.commands.scoring.left_out import LeftOut
from cdtool.formats.channels.logged_recording import LoggedRecording
from cdtool.formats.channels.run_reading import read_runs
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.motion.applicable import HOLD
from cdtool.recordings.operations import Operation, RunCut, operations_of
from cdtool.recordings.plausible import LearnedRanges, PlausibleRanges
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.curves.sweep import sweep_operation
from cdtool.results.results import ForceResult, RecordingFinding, RecordingResult, Skipped
from cdtool.thresholds.base import FittedThreshold
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.verdict import ForceVerdict, assess_force


@dataclass
class Scored:
    """The results of one log.

    `detectors` are those that were run; `failed` are the operations on which one failed, by detector. `untaught`: why
    nothing could be learned for this log, by detector.
    """

    recording: RecordingResult | None = None
    judged: list[Judged] = field(default_factory=list)
    detectors: list[str] = field(default_factory=list)
    failed: dict[str, list[Skipped]] = field(default_factory=dict)
    untaught: Mapping[str, Sequence[RecordingFinding]] = field(default_factory=dict)
    forces: list[ForceResult] = field(default_factory=list)
    verdicts: dict[int, ForceVerdict] = field(default_factory=dict)
    skipped: list[Skipped] = field(default_factory=list)
    findings: list[RecordingFinding] = field(default_factory=list)
    # Whether the log could not be read, and whether that lasts: it is not because of a network or a full disk.
    unread: bool = False
    lasts: bool = True
    # Names of logs assumed to be free of impacts, with the ground truth that is missing from them.
    unchecked: list[tuple[str, Finding]] = field(default_factory=list)
    source: str = ""
    # The recording, its contacts and their matching, for commands that show more than rows.
    log: Recording | None = None
    truth: tuple[Contact, ...] = ()
    matched: MatchedLog | None = None
    reading: float = 0.0
    detecting: float = 0.0

    def leave_out(self, left_out: Skipped, fault: CdtoolError) -> None:
        """Note that the log cannot be read."""
        self.skipped.append(left_out)
        self.unread, self.lasts = True, is_lasting(fault)

    @property
    def left_out(self) -> list[Skipped]:
        """Return everything that was left out; what all detectors left out for the same reason is listed once."""
        combined = LeftOut()
        for name in self.detectors:
            combined.add(name, self.failed.get(name, ()))
        return [*self.skipped, *combined.combined()]


# Returns the detections of each operation of a log; failures are reported in the log's `Scored`.
Detect = Callable[[Sequence[Operation], Scored], list[list[Detection]]]
# Returns how a log, given by its path, is detected, and the findings about that by detector.
DetectionOf = Callable[[Path], tuple[Detect, Mapping[str, Sequence[RecordingFinding]]]]


def detect_with(
    setup: BenchmarkFile,
    detectors: Sequence[Any],
    thresholds: Mapping[str, tuple[FittedThreshold, ...]],
    unusable: Mapping[str, str],
) -> Detect:
    """Return the detectors with their thresholds as one function; a detector that fails on a log is left out there.

    Detectors in `unusable` cannot be used, for the given reason; none of their samples is assessable. A class of
    motion is monitored for the longest matching window.
    """
    hold = max(HOLD, *(group.window for group in setup.impacts.values()))
    machine = setup.machine_file.machine

    def detect(operations: Sequence[Operation], scored: Scored) -> list[list[Detection]]:
        found: list[list[Detection]] = [[] for _ in operations]
        scored.detectors = [detector.name for detector in detectors]
        for detector in detectors:
            failed: list[Skipped] = []
            if detector.name in unusable:
                unit, why = detector.unit(machine), unusable[detector.name]
                made = [not_assessable(item, detector.name, unit, why, setup.watched) for item in operations]
            else:
                known = thresholds[detector.name]
                try:
                    made = detect_operations(
                        operations, machine, detector, known, setup.activation, setup.watched, hold
                    )
                except CdtoolError as fault:
                    failed = [Skipped(item.whole.name, str(fault)) for item in operations]
                    made = []
            scored.failed[detector.name] = failed
            for of_operation, detection in zip(found, made, strict=not failed):
                of_operation.append(detection)
        return found

    return detect


def score_log(
    setup: BenchmarkFile,
    group: str,
    path: Path,
    detect: Detect,
    factors: Mapping[str, FloatArray],
    ranges: LearnedRanges | None = None,
) -> Scored:
    """Return the rows of a log; a log or detector that fails is left out and reported, and nothing is raised.

    `factors`: the safety factors of the sweep by detector. `group` is empty for a log outside all groups. Values
    outside the plausible `ranges` are masked.
    """
    return _score(setup, group, path, detect, factors, _WholeLog(setup, group, path, ranges))


def score_runs(
    setup: BenchmarkFile,
    group: str,
    path: Path,
    detection_of: DetectionOf,
    factors: Mapping[str, FloatArray],
    ranges: LearnedRanges | None = None,
) -> list[Scored]:
    """Return the same for each run of a log, if the benchmark cuts logs into runs; the first entry is about the log.

    `detection_of` returns for the path of a log or run how it is detected.
    """
    cut = RunCut.of(setup.operations)
    if cut is None:
        detect, untaught = detection_of(path)
        whole_log = score_log(setup, group, path, detect, factors, ranges)
        whole_log.untaught = untaught
        return [whole_log]
    about_log, begin = Scored(), perf_counter()
    try:
        runs = read_runs(path, setup.machine_file, cut)
    except CdtoolError as fault:
        about_log.leave_out(unread(path, setup.path.parent, fault), fault)
        return [about_log]
    finally:
        about_log.reading = perf_counter() - begin
    about_log.skipped, about_log.findings = reported(runs, path, setup.path.parent)
    scored = [about_log]
    for logged in runs.runs:
        run = location(logged.recording.source)
        detect, untaught = detection_of(run)
        scored.append(_score(setup, group, path, detect, factors, _OneRun(setup, run, logged, ranges)))
        scored[-1].untaught = untaught
    return scored


@dataclass(frozen=True)
class LogToScore:
    """A log or run of a benchmark as it is scored: its part that is used, cut into operations, and its contacts.

    `unwanted` are contacts of a log that should have none.
    """

    recording: Recording
    operations: Sequence[Operation]
    contacts: Sequence[Contact] = ()
    unwanted: Sequence[Contact] = ()


def logs_to_score(setup: BenchmarkFile, group: str, path: Path) -> Iterator[LogToScore | Skipped]:
    """Yield a log as it is scored, or each of its runs; the reason for one that cannot be used."""
    cut = RunCut.of(setup.operations)
    loads: list[_WholeLog | _OneRun] = [_WholeLog(setup, group, path, None)]
    if cut is not None:
        try:
            runs = read_runs(path, setup.machine_file, cut)
        except CdtoolError as fault:
            yield unread(path, setup.path.parent, fault)
            return
        yield from reported(runs, path, setup.path.parent)[0]
        loads = [_OneRun(setup, location(logged.recording.source), logged, None) for logged in runs.runs]
    for load in loads:
        try:
            yield _log_to_score(setup, group, path, load)
        except CdtoolError as fault:
            yield unread(load.path, setup.path.parent, fault)


@dataclass(frozen=True)
class _WholeLog:
    """Reads a log that is one recording."""

    setup: BenchmarkFile
    group: str
    path: Path
    ranges: LearnedRanges | None

    def __call__(self) -> Recording:
        setup, base = self.setup, self.setup.path.parent
        ranges = _of_others(self.ranges, shown_path(self.path, base))
        return read_named(self.path, setup.machine_file_of(self.group), base, ranges, setup.onset)


@dataclass(frozen=True)
class _OneRun:
    """Converts a run that has been read; `path` is LOG#ID."""

    setup: BenchmarkFile
    path: Path
    logged: LoggedRecording
    ranges: LearnedRanges | None

    def __call__(self) -> Recording:
        setup, base = self.setup, self.setup.path.parent
        ranges = _of_others(self.ranges, shown_path(self.path, base))
        return named_on_load_side(self.logged, self.path, setup.machine_file, base, ranges, setup.onset)


def _of_others(ranges: LearnedRanges | None, name: str) -> PlausibleRanges | None:
    """Return the plausible ranges that a log is compared with; none if none are learned."""
    return None if ranges is None else ranges.without(name)


def _log_to_score(setup: BenchmarkFile, group: str, log: Path, load: _WholeLog | _OneRun) -> LogToScore:
    """Read a log or one of its runs; `log` is its path in the benchmark file. Raises RecordingError."""
    rules, path = setup.rules_of(group), load.path
    whole = load()
    section = setup.sections.get(log, LogSection())
    recording = section.of(whole)
    operations = operations_of(recording, setup.operations)
    if setup.is_impact_free(group):
        unwanted: Sequence[Contact] = unwanted_contacts(whole, rules)
        return LogToScore(recording, operations, (), section.contacts_of(whole, unwanted) if section else unwanted)
    contacts: Sequence[Contact] = true_contacts(whole, rules, path) if group else any_contacts(whole, rules)
    if section and contacts:
        contacts = section.contacts_of(whole, contacts)
        if not contacts:
            raise RecordingError(f"{path}: no contact {section}", "change from and to, or move it to [holdout]")
    return LogToScore(recording, operations, contacts)


def _score(
    setup: BenchmarkFile,
    group: str,
    log: Path,
    detect: Detect,
    factors: Mapping[str, FloatArray],
    load: _WholeLog | _OneRun,
) -> Scored:
    """Return the rows of a log or of one of its runs; `log` is its path in the benchmark file."""
    scored = Scored()
    rules, path = setup.rules_of(group), load.path
    begin = perf_counter()
    try:
        read = _log_to_score(setup, group, log, load)
    except CdtoolError as fault:
        scored.leave_out(unread(path, setup.path.parent, fault), fault)
        scored.reading = perf_counter() - begin
        return scored
    recording, operations, contacts, unwanted = read.recording, read.operations, read.contacts, read.unwanted
    scored.reading = perf_counter() - begin
    scored.source, scored.log, scored.truth = recording.source, recording, tuple(contacts)
    scored.findings += lost(recording)
    if setup.is_impact_free(group):
        operations, touched = without_contacts(operations, unwanted)
        scored.skipped += [replace(item, recording=recording.name) for item in touched]
        scored.unchecked = [(recording.name, item) for item in absent_truth(recording)]
        if not operations:
            scored.findings += log_warnings(recording, unwanted, setup.onset)
            return scored
    scored.recording = _recording_result(recording, group, log, len(operations), len(contacts), setup)
    found = detect(operations, scored)
    detected = DetectedLog(recording, operations, setup.operations, contacts, found)
    matched = match_log(detected, group, rules, setup.activation.wait)
    scored.skipped += matched.not_scored
    scored.findings += matched.about_log
    scored.matched, curves = matched, matched.curves
    profile = setup.impacts[group].force if group in setup.impacts else None
    if profile:
        scored.verdicts = {number: assess_force(curve, profile) for number, curve in curves.items()}
        scored.forces = force_rows(scored.recording, scored.verdicts, curves)
        scored.findings += _force_not_seen(recording, profile.name, scored.verdicts, curves)
        numbered = enumerate(contacts, 1)
        unseen = [f"contact {number}" for number, item in numbered if number not in curves and not item.in_progress]
        if unseen:
            text = f"{', '.join(unseen)}: no load-cell force to compare with {profile.name}"
            scored.skipped.append(Skipped(recording.name, text))
    # The curve of latency against false alarms is that of the unchanged machine.
    moved = {} if setup.is_condition(group) else factors
    scored.judged = [_swept(item, setup, rules.window, moved) for item in matched.judged]
    scored.detecting = perf_counter() - begin - scored.reading
    return scored


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
