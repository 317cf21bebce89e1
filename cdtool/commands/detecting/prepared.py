"""One detector with its threshold and all settings, ready for any log: from a signature, limits or a benchmark file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import detect_operations
from cdtool.base.errors import RecordingError, UsageError
from cdtool.base.plain_text import digits
from cdtool.base.remote.remote_path import location
from cdtool.base.settings import Place, keys_of
from cdtool.commands.detecting.detection import Detected, DetectedRuns
from cdtool.commands.judging.matched_log import CutLog, match_log
from cdtool.commands.judging.runs import (
    named_on_load_side,
    read_named,
    reported,
    shown_path,
    without_contradicted,
)
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.settings_table import (
    DetectionTable,
    apply_settings,
    read_settings,
    refuse_beside_signature,
)
from cdtool.commands.judging.true_contacts import any_contacts
from cdtool.detectors.base import Detector
from cdtool.formats.channels.run_reading import read_runs
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.motion.applicable import GRACE
from cdtool.recordings.operations import RunCut, operations_of
from cdtool.recordings.plausible import PlausibleRanges
from cdtool.recordings.recording import Recording
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.thresholds.base import FittedThreshold, Threshold, is_per_run
from cdtool.thresholds.normal_motion import Absence, NormalMotions
from cdtool.thresholds.signature import Signature

if TYPE_CHECKING:
    from cdtool.commands.detecting.prepared_benchmark import PreparedBenchmark
    from cdtool.commands.learning.learning import LearnedSignature
    from cdtool.formats.signature_file import SignatureFile


@dataclass(frozen=True)
class PreparedDetector:
    """A detector with its threshold and all settings, for any log of the machine.

    `described` states in words where the threshold is from; `learned` has the hashes of the logs learned from. `notes`
    concern the signature file. `skipped` and `losses` are as those of a PreparedBenchmark.
    """

    machine_file: MachineFile
    detector: Detector
    thresholds: tuple[FittedThreshold, ...]
    described: str
    activation: Activation
    joints: tuple[str, ...]
    section: LogSection
    operations: str
    rules: ScoringRules
    learned: frozenset[str] = frozenset()
    ranges: PlausibleRanges | None = None
    normals: NormalMotions = field(default_factory=NormalMotions)
    notes: tuple[RecordingFinding, ...] = ()

    skipped: ClassVar[tuple[Skipped, ...]] = ()
    losses: ClassVar[tuple[RecordingFinding, ...]] = ()

    @property
    def has_runs(self) -> bool:
        """Whether each log is cut into runs."""
        return RunCut.of(self.operations) is not None

    def detect(self, log: Path) -> DetectedRuns:
        """Run the detector over each run of a log; one that is not cut into runs is one. Raises RecordingError."""
        cut = RunCut.of(self.operations)
        if cut is None:
            whole = read_named(log, self.machine_file, ranges=self.ranges, onset=self.rules.onset)
            return DetectedRuns((self._of_run(whole),))
        logged = read_runs(log, self.machine_file, cut)
        skipped, findings = reported(logged, log)
        found: list[Detected] = []
        for item in logged.runs:
            name = shown_path(location(item.recording.source))
            try:
                run = named_on_load_side(item, location(name), self.machine_file, None, self.ranges, self.rules.onset)
                found.append(self._of_run(run))
            except RecordingError as fault:
                skipped.append(Skipped(name, str(fault).removeprefix(f"{name}: ")))
        if not found:
            raise RecordingError(f"{log}: no run can be used, the first: {skipped[-1].reason}", "see cdtool info")
        return DetectedRuns(tuple(found), tuple(skipped), tuple(findings))

    def _of_run(self, whole: Recording) -> Detected:
        """Return the result for a recording, or for the section of it; raises RecordingError."""
        rules, machine = self.rules, self.machine_file.machine
        if self.ranges and not self.ranges.contradicted:  # the machine file may have changed since it was learned
            whole = without_contradicted(whole, machine, rules.onset)
        recording = self.section.of(whole)
        parts = operations_of(recording, self.operations)
        grace = max(GRACE, rules.window)
        detections = tuple(
            detect_operations(parts, machine, self.detector, self.thresholds, self.activation, self.joints, grace)
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


def prepared(
    machine: str | Path | MachineFile | None,
    *,
    benchmark: str | Path | None = None,
    signature: str | Path | LearnedSignature | SignatureFile | None = None,
    detector: str | Detector | None = None,
    settings: Mapping[str, Any] | None = None,
) -> PreparedDetector | PreparedBenchmark:
    """Return the detector that the arguments of `cdtool.detect` describe, which has the errors.

    Examples
    --------
    >>> log, machine = Path("sample_logs/gate/stiff/03.csv"), "sample_logs/gate/machine.toml"
    >>> limit = {"threshold.name": "limit", "threshold.limits": 400.0}
    >>> found = prepared(machine, detector="momentum", settings=limit).detect(log)
    >>> [run.detections[0].verdict.outcome for run in found.runs]
    ['alarm']
    """
    if benchmark is not None:
        if machine is not None:
            raise UsageError("a machine file cannot be combined with a benchmark file", "omit one of the two")
        from cdtool.commands.detecting.prepared_benchmark import prepare_benchmark

        if not isinstance(detector, str | None):
            raise UsageError("a benchmark file names its detectors", "give the name of one of them")
        return prepare_benchmark(benchmark, detector=detector, signature=signature, settings=settings)
    if machine is None:
        raise UsageError("no machine file is given", "give --machine FILE or --benchmark FILE")
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    table, place = read_settings(DetectionTable, settings or {})
    place.tried(None, table.run_cut, place)
    section, rules = place.tried(LogSection(), table.section, place), place.tried(ScoringRules(), _rules, table, place)
    make = partial(PreparedDetector, machine_file, section=section, operations=table.operations, rules=rules)
    if signature is None:
        return _by_hand(make, machine_file, detector, table, place)
    given = apply_settings({}, settings or {})
    return _by_signature(make, machine_file, detector, signature, (table, given, place))


def _rules(table: DetectionTable, place: Place) -> ScoringRules:
    return table.rules(place, window=table.window_s, mass_before_cell=table.force.mass_before_cell_kg)


_NO_THRESHOLD = "give --signature FILE, or set threshold.limits, or threshold.name=baseline"


def _by_hand(
    make: Callable[..., PreparedDetector],
    machine_file: MachineFile,
    detector: str | Detector | None,
    table: DetectionTable,
    place: Place,
) -> PreparedDetector:
    """Return the detector with a threshold that is not learned: limits set by hand, or those of each run itself."""
    machine = machine_file.machine
    table.check_joints(place, machine)
    signature = Signature().sided(machine.default_sides)
    otherwise: Threshold = signature
    rule = place.tried(otherwise, table.rule, place, signature)
    limits = getattr(rule, "limits", ())
    place.finish()
    if not limits and not is_per_run(rule):
        known = {key.partition(".")[0] for key in place.by_option}
        if "threshold" in known:
            raise place.fault("threshold", f"'{rule.name}' is learned from impact-free runs", _NO_THRESHOLD)
        raise UsageError("no threshold is given", _NO_THRESHOLD)
    if detector is None:
        raise UsageError("no detector is given", "give --detectors NAME; see cdtool list detectors")
    instance = machine_file.detector(detector)
    described = f"threshold '{rule.name}', from each run itself, safety factor {rule.safety_factor:g}"
    if limits:
        described = f"limit {', '.join(map(digits, limits))} {instance.unit(machine)} set by hand"
    return make(
        detector=instance,
        thresholds=(rule.fit([]),),
        described=described,
        activation=table.activation,
        joints=table.joints,
        normals=NormalMotions(absent=Absence.BY_HAND if limits else Absence.PER_RUN),
    )


def _by_signature(
    make: Callable[..., PreparedDetector],
    machine_file: MachineFile,
    detector: str | Detector | None,
    signature: str | Path | LearnedSignature | SignatureFile,
    given: tuple[DetectionTable, Mapping[str, Any], Place],
) -> PreparedDetector:
    """Return the detector with the threshold of a signature, and its activation where the settings have no other."""
    from cdtool.commands.learning.learning import signature_of
    from cdtool.commands.learning.normal_runs import normals_of, notes_on

    table, values, place = given
    refuse_beside_signature(values, place, ("threshold", "joints"))
    place.finish()
    stored = signature_of(signature)
    instance = machine_file.detector(detector or stored.detector)
    stored.check(machine_file.machine, instance)
    keys = [key.attribute for name, key in keys_of(Activation).items() if name in values.get("activation", {})]
    raised_by = replace(stored.activation, **{name: getattr(table.activation, name) for name in keys})
    changed = raised_by != stored.activation
    return make(
        detector=instance,
        thresholds=stored.current,
        described=stored.described + (", with an activation different from the file's" if changed else ""),
        activation=raised_by,
        joints=stored.joints,
        learned=frozenset(run.sha256 for run in stored.runs),
        ranges=stored.plausible,
        normals=normals_of(stored),
        notes=tuple(notes_on(stored)),
    )
