"""Run one detector over one log."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, detect_operations
from cdtool.base.errors import RecordingError, UsageError
from cdtool.base.plain_text import digits
from cdtool.base.remote.remote_path import location
from cdtool.commands.detecting.detection_options import DetectionOptions
from cdtool.commands.judging.matched_log import CutLog, match_log
from cdtool.commands.judging.runs import (
    absent_truth,
    check_joints,
    named_on_load_side,
    read_named,
    reported,
    shown_path,
    without_contradicted,
)
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.true_contacts import any_contacts
from cdtool.detectors.base import Detector
from cdtool.detectors.detection import Alarm
from cdtool.formats.channels.run_reading import read_runs
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.motion.applicable import HOLD
from cdtool.recordings.operations import RunCut, operations_of
from cdtool.recordings.plausible import PlausibleRanges
from cdtool.recordings.recording import SHOWS_CONTACTS, Contact, Recording
from cdtool.results.results import ContactResult, RecordingFinding, Skipped
from cdtool.thresholds.base import FittedThreshold
from cdtool.thresholds.baseline import Baseline
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.normal_motion import Absence, NormalMotions
from cdtool.truth.matching import Matching, belongs, windows
from cdtool.truth.missing_samples import longest_step

if TYPE_CHECKING:
    from cdtool.commands.detecting.prepared_detector import PreparedBenchmark
    from cdtool.commands.scoring.scoring import ScoredLog


@dataclass(frozen=True)
class Detected:
    """A log, the detector's result for each of its operations, and the contacts if the log has ground truth.

    `matchings` match each operation's alarms with its contacts, in the order of `detections`. `threshold` describes
    the threshold, `activation` how a signal outside it becomes an alarm. `learned`: the signature was learned from this
    log, so the absence of alarms is no evidence. `window`: how long after its onset a contact may be detected [s].
    `normals`: the normal motion of impact-free runs, or why it is unknown.
    `contact_rows` contains, for each of `detections`, the rows of these contacts as written by `cdtool benchmark`.
    `not_scored` names contacts without an onset; `findings` concern the log itself and the signature file.
    `onset` describes how the onset is found on the load cell.
    """

    recording: Recording
    detections: tuple[Detection, ...]
    contacts: tuple[Contact, ...]
    matchings: tuple[Matching, ...]
    threshold: str
    activation: Activation = field(default_factory=Activation)
    learned: bool = False
    window: float = 1.0
    contact_rows: tuple[tuple[ContactResult, ...], ...] = ()
    not_scored: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()
    normals: NormalMotions = field(default_factory=NormalMotions)
    onset: str = ""

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the names of the signal's columns: the monitored joints."""
        return self.detections[0].statistic.joints if self.detections else self.recording.joints


@dataclass(frozen=True)
class DetectedRuns:
    """The results for the runs of a log, in its order; `skipped` are runs left out, `findings` concern the log."""

    runs: tuple[Detected, ...]
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()


def detect_log(log: str | Path, options: DetectionOptions) -> DetectedRuns:
    """Run one detector over each run of a log; a log that is not cut into runs is one.

    Parameters
    ----------
    log : str or Path
        The log, or LOG#ID for some of its runs.
    options : DetectionOptions
        The machine, the detector and its threshold.

    Returns
    -------
    DetectedRuns
        The same as `detect` for each run, and what was left out.

    Raises
    ------
    UsageError
        No threshold is given, or two are.
    SignatureError
        The signature belongs to another machine or to other gains.
    RecordingError
        The log cannot be read, or has no channel that the detector needs.

    Examples
    --------
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> found = detect_log(log, DetectionOptions(machine, detector="momentum", limit=[400.0]))
    >>> [run.detections[0].verdict.outcome for run in found.runs]
    ['alarm']
    """
    path = location(log)
    if benchmark := options.prepared():
        return _detect_prepared(path, benchmark)
    cut = RunCut.of(options.operations)
    run = _OneDetector.of(options)
    if cut is None:
        whole = read_named(path, run.machine_file, ranges=run.ranges, onset=run.rules.onset)
        return DetectedRuns((run.detect(whole),))
    logged = read_runs(path, run.machine_file, cut)
    skipped, findings = reported(logged, path)
    found: list[Detected] = []
    for item in logged.runs:
        name = shown_path(location(item.recording.source))
        try:
            whole = named_on_load_side(item, location(name), run.machine_file, None, run.ranges, run.rules.onset)
            found.append(run.detect(whole))
        except RecordingError as fault:
            skipped.append(Skipped(name, str(fault).removeprefix(f"{name}: ")))
    if not found:
        raise RecordingError(f"{path}: no run can be used, the first: {skipped[-1].reason}", "see cdtool info")
    return DetectedRuns(tuple(found), tuple(skipped), tuple(findings))


@dataclass(frozen=True)
class _OneDetector:
    """A detector with its thresholds and all settings: what `detect` needs for any recording."""

    machine_file: MachineFile
    detector: Detector
    thresholds: tuple[FittedThreshold, ...]
    described: str
    activation: Activation
    joints: tuple[str, ...]
    section: LogSection
    operations: str
    rules: ScoringRules
    learned: frozenset[str]
    ranges: PlausibleRanges | None
    normals: NormalMotions
    notes: tuple[RecordingFinding, ...]

    @classmethod
    def of(cls, options: DetectionOptions) -> _OneDetector:
        """Return the detector and threshold of the options; raises what `detect` raises for wrong ones."""
        machine_file = options.machine_file()
        signature, detector, limit, joints = options.signature, options.detector, options.limit, options.joints
        if [signature is not None, bool(limit), options.warm_up is not None].count(True) != 1:
            hint = "give one of --signature FILE, --limit VALUE, --warm-up SECONDS"
            in_python = "in Python signature=, limit=[...], warm_up="
            raise UsageError("give a signature, a limit or a warm-up", f"{hint}; {in_python}")
        thresholds: tuple[FittedThreshold, ...]
        learned: set[str] = set()
        ranges: PlausibleRanges | None = None
        normals, notes = NormalMotions(absent=Absence.BY_HAND), list[RecordingFinding]()
        if signature is not None:
            from cdtool.commands.learning.learning import signature_of
            from cdtool.commands.learning.normal_runs import normals_of, notes_on

            stored = signature_of(signature)
            instance = machine_file.detector(detector or stored.detector)
            stored.check(machine_file.machine, instance)
            if joints:
                hint = "a signature monitors the joints that it was learned for"
                raise UsageError("joints require a limit or a warm-up", hint)
            thresholds, joints, ranges = stored.current, stored.joints, stored.plausible
            learned = {run.sha256 for run in stored.runs}
            raised_by, described = stored.activation, stored.described
            normals = normals_of(stored)
            notes = notes_on(stored)
        else:
            if detector is None:
                what = "limit" if limit else "warm-up"
                raise UsageError(f"a {what} requires a detector", "give --detector NAME; see cdtool list detectors")
            instance = machine_file.detector(detector)
            check_joints(joints, machine_file.machine)
            raised_by = Activation()
            if options.warm_up is None:
                thresholds = (Limit.given(limit),)
                described = f"limit {', '.join(map(digits, limit))} {instance.unit(machine_file.machine)} set by hand"
            else:
                sides = machine_file.machine.default_sides
                baseline = Baseline(warm_up=options.warm_up, sides=sides).fit([])
                thresholds, normals = (baseline,), NormalMotions(absent=Absence.PER_RUN)
                first = f"the first {digits(baseline.warm_up)} s in motion"
                described = f"baseline of {first}, safety factor {baseline.safety_factor:g}"
        stored_one, raised_by = raised_by, raised_by.changed(options.activation or {})
        if raised_by != stored_one and signature is not None:
            described += ", with an activation different from the file's"
        return cls(
            machine_file,
            instance,
            thresholds,
            described,
            raised_by,
            tuple(joints),
            options.section,
            options.operations,
            options.rules or ScoringRules(),
            frozenset(learned),
            ranges,
            normals,
            tuple(notes),
        )

    def detect(self, whole: Recording) -> Detected:
        """Return the result for a recording, or for the section of it; raises RecordingError."""
        rules, machine = self.rules, self.machine_file.machine
        if self.ranges and not self.ranges.contradicted:  # the machine file may have changed since it was learned
            whole = without_contradicted(whole, machine, rules.onset)
        recording = self.section.of(whole)
        parts = operations_of(recording, self.operations)
        hold = max(HOLD, rules.window)
        detections = tuple(
            detect_operations(parts, machine, self.detector, self.thresholds, self.activation, self.joints, hold)
        )
        contacts = any_contacts(whole, rules)
        contacts = list(self.section.contacts_of(whole, contacts)) if self.section else contacts
        log = CutLog(recording, parts, self.operations, contacts)
        matched = match_log(log, [[item] for item in detections], "", rules, self.activation.wait)
        return Detected(
            recording,
            detections,
            tuple(contacts),
            tuple(item.matchings[0] for item in matched.judged),
            self.described,
            self.activation,
            recording.digest in self.learned,
            rules.window,
            matched.contacts,
            matched.not_scored,
            (*matched.findings, *rules.findings, *self.notes),
            self.normals,
            rules.onset.described,
        )


def _detect_prepared(log: Path, benchmark: PreparedBenchmark) -> DetectedRuns:
    """Return the detection as `cdtool benchmark` scores it; raises RecordingError if it leaves the log out."""
    every = benchmark.score(log)
    skipped, findings, found = list[Skipped](), list[RecordingFinding](), list[Detected]()
    if benchmark.setup.has_runs:
        skipped, findings, every = list(every[0].rows.skipped), list(every[0].rows.findings), every[1:]
    for scored in every:
        detected = _detected(scored, log, benchmark)
        if detected is None:
            skipped += scored.left_out or [Skipped(str(log), "no operation is assessable")]
        else:
            found.append(detected)
    if not found:
        reason = skipped[0].reason if skipped else "no operation is assessable"
        raise RecordingError(reason if str(log) in reason else f"{log}: {reason}")
    return DetectedRuns(tuple(found), tuple(skipped), tuple(findings))


def _detected(scored: ScoredLog, log: Path, benchmark: PreparedBenchmark) -> Detected | None:
    """Return the detection in a scored recording; None if it was left out."""
    matched = scored.matched
    judged = (
        [(item, rows) for item, rows in zip(matched.judged, matched.contacts, strict=True) if item.detections]
        if matched
        else []
    )
    if scored.recording is None or matched is None or not judged:
        return None
    return Detected(
        scored.recording,
        tuple(item.detections[0] for item, _ in judged),
        scored.contacts,
        tuple(item.matchings[0] for item, _ in judged),
        benchmark.described,
        benchmark.setup.activation,
        benchmark.has_judged_itself(scored.recording),
        benchmark.window(log),
        tuple(rows for _, rows in judged),
        matched.not_scored,
        (*matched.findings, *benchmark.setup.rules_of("").findings, *benchmark.notes),
        benchmark.normals_for(scored.recording),
        benchmark.setup.onset.described,
    )


def contact_of(found: Detected, alarm: Alarm) -> Contact | None:
    """Return the contact that an alarm belongs to: by its window, or because the contact lasts until the alarm."""
    spans = windows(found.contacts, found.window)
    return next((span[0] for span in reversed(spans) if belongs(alarm.time, [span])), None)


def same_contact(found: Detected, contact: Contact, alarm: Alarm) -> str:
    """Describe an alarm of a contact that did not detect it: another joint's, a repeated or a late one."""
    matches = [item for matching in found.matchings for item in matching.matches if item.contact == contact]
    first = next((item.alarm for item in matches if item.alarm), None)
    if contact.in_progress:
        return "contact in progress at the start"
    if first is None and contact.hole and contact.uncertainty >= found.window:
        return f"contact first seen at {contact.start:.3f} s: load-cell samples are missing where it began"
    if first is None:
        return f"contact at {contact.start:.3f} s, more than {found.window:g} s after its onset"
    if first.joint != alarm.joint:
        return f"same contact, also {alarm.joint}"
    return f"same contact, {alarm.joint} again"


# Why a false alarm has no latency.
NO_CONTACT = "no contact"


def why_no_contact(found: Detected, alarm: Alarm) -> str:
    """Explain why an alarm without a contact has no latency: no ground truth, ground truth ended, or a false alarm."""
    channel = next((name for name in SHOWS_CONTACTS if name in found.recording), None)
    if channel is None:
        absent = absent_truth(found.recording)
        return f"{absent[0].channel} is not in this log" if absent else "no ground truth is mapped"
    series = found.recording[channel]
    present = series.time[np.isfinite(series.values[:, 0])]
    if channel != "event" and (not len(present) or alarm.time > present[-1]):
        ends = f"ends at {present[-1]:.3f} s" if len(present) else "has no samples"
        return f"{'load cell' if channel == 'force' else channel} {ends}"
    if channel == "force" and len(present) > 1:
        k = int(np.searchsorted(present, alarm.time))
        if k > 0 and present[k] - present[k - 1] > longest_step(present):
            return f"unknown: load-cell samples are missing from {present[k - 1]:.3f} to {present[k]:.3f} s"
    return NO_CONTACT
