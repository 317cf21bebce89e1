"""One detector with its threshold and all settings, ready for any log: of a benchmark file, or of settings alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdtool.alarms.activation import Activation
from cdtool.base.errors import RecordingError, UsageError, nearest
from cdtool.base.plain_text import counted, digits
from cdtool.base.settings import Place, keys_of
from cdtool.commands.detecting.detection import Detected, DetectedRuns
from cdtool.commands.judging.runs import load_runs
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.settings_table import (
    DetectionTable,
    apply_settings,
    full_keys,
    read_settings,
    refuse_beside_signature,
)
from cdtool.commands.learning.learning import LearnedSignature, signature_of
from cdtool.commands.learning.normal_runs import normals_for, normals_of, notes_on
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file, with_detectors
from cdtool.commands.scoring.learned_thresholds import ThresholdsByLog, learn_thresholds
from cdtool.commands.scoring.scoring import Detect, ScoredLog, detect_with, score_runs
from cdtool.detectors.base import Detector
from cdtool.detectors.detection import WHOLE_MACHINE
from cdtool.formats.channels.run_reading import split_run
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.formats.signature_file import SignatureFile
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.operations import Operation
from cdtool.recordings.plausible import LearnedRanges, PlausibleRanges
from cdtool.recordings.recording import Recording
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.thresholds.base import FittedThreshold, Threshold, is_per_run
from cdtool.thresholds.normal_motion import NormalMotions
from cdtool.thresholds.signature import Signature

if TYPE_CHECKING:
    from collections.abc import Sequence

_NO_THRESHOLD = "give --signature FILE, or set threshold.limits, or threshold.name=baseline"


@dataclass(frozen=True)
class PreparedDetector:
    """A detector with its threshold, by which single logs are scored as by `cdtool benchmark`.

    `described` states in words where the threshold is from. `learned` has the hashes of the logs learned from with
    their names, `runs` their operations, `ranges` the ranges of their channels and `normals` their normal motion.
    `skipped` lists the runs left out in learning, with the reason; `losses` lists what is lost of the others. `run`
    returns how a log is detected: without its own part. `notes` concern a signature file of an earlier version.
    """

    setup: BenchmarkFile
    described: str
    run: Detect
    ranges: LearnedRanges
    normals: NormalMotions
    learned: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[RecordingFinding, ...] = ()
    skipped: tuple[Skipped, ...] = ()
    losses: tuple[RecordingFinding, ...] = ()
    runs: tuple[Operation, ...] = ()

    @property
    def has_runs(self) -> bool:
        """Whether each log is cut into runs."""
        return self.setup.has_runs

    @property
    def machine_file(self) -> MachineFile:
        """Return the machine file."""
        return self.setup.machine_file

    def detect(self, log: Path) -> DetectedRuns:
        """Return the detection as `cdtool benchmark` scores it; raises RecordingError if it leaves the log out."""
        every = self.score(log)
        skipped, findings, found = list[Skipped](), list[RecordingFinding](), list[Detected]()
        if self.setup.has_runs:
            skipped, findings, every = list(every[0].rows.skipped), list(every[0].rows.findings), every[1:]
        for scored in every:
            detected = self._detected(scored, log)
            if detected is None:
                skipped += scored.rows.skipped or [Skipped(str(log), "no operation is assessable")]
            else:
                found.append(detected)
        if not found:
            reason = skipped[0].reason if skipped else "no operation is assessable"
            raise RecordingError(reason if str(log) in reason else f"{log}: {reason}")
        return DetectedRuns(tuple(found), tuple(skipped), tuple(findings))

    def _detected(self, scored: ScoredLog, log: Path) -> Detected | None:
        """Return the detection in a scored recording; None if it was left out."""
        matched = scored.matched
        if scored.recording is None or matched is None or not all(item.detections for item in matched.judged):
            return None
        return Detected(
            scored.recording,
            tuple(item.detections[0] for item in matched.judged),
            scored.contacts,
            tuple(item.matchings[0] for item in matched.judged),
            self.described,
            self.setup.activation,
            self.has_judged_itself(scored.recording),
            self.window(log),
            matched.contacts,
            matched.not_scored,
            (*matched.findings, *self.setup.rules_of("").findings, *self.notes),
            self.normals_for(scored.recording),
            self.setup.onset.described,
        )

    def score(self, log: Path) -> list[ScoredLog]:
        """Return the rows of a log, or of each of its runs, as in a benchmark: with the window of its group, if any.

        If the log is cut into runs, the first entry is about the log itself. Raises nothing.
        """
        group, path = self._listed(log)
        return score_runs(self.setup, group, path, self.run, {}, self.ranges)

    def has_judged_itself(self, recording: Recording) -> bool:
        """Return whether a recording was learned from for its own limits; a copy under another name counts as well."""
        learned = self.learned.get(recording.digest)
        return learned is not None and not (self.setup.both and learned == recording.name)

    def normals_for(self, recording: Recording) -> NormalMotions:
        """Return the normal motion that a recording is compared with: without its own."""
        others = [item for item in self.runs if item.whole.name != recording.name]
        if not self.setup.both or len(others) == len(self.runs):
            return self.normals
        return normals_for(others, self.setup.rule)

    def window(self, log: Path) -> float:
        """Return how long after its onset a contact of the log may be detected [s]."""
        return self.setup.rules_of(self._listed(log)[0]).window

    def _listed(self, log: Path) -> tuple[str, Path]:
        """Return the log's group and its path as the file names it; an empty group if it is in none."""
        for name, group in self.setup.impacts.items():
            for path in group.logs:
                if path.resolve() == log.resolve():
                    return name, path
                if self.setup.has_runs and _has_run(path, log):
                    return name, log
        return "", log


def prepared(
    machine: str | Path | MachineFile | None,
    *,
    benchmark: str | Path | None = None,
    signature: str | Path | LearnedSignature | SignatureFile | None = None,
    detector: str | Detector | None = None,
    settings: Mapping[str, Any] | None = None,
) -> PreparedDetector:
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
        if not isinstance(detector, str | None):
            raise UsageError("a benchmark file names its detectors", "give the name of one of them")
        return _of_benchmark(benchmark, detector, signature, settings)
    if machine is None:
        raise UsageError("no machine file is given", "give --machine FILE or --benchmark FILE")
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    table, place = read_settings(DetectionTable, settings or {})
    setup = _of_settings(table, place, machine_file)
    if signature is not None:
        values = apply_settings({}, settings or {})
        refuse_beside_signature(values, place, ("threshold", "joints"))
        place.finish()
        stored = signature_of(signature)
        keys = [key.attribute for name, key in keys_of(Activation).items() if name in values.get("activation", {})]
        raised_by = replace(stored.activation, **{name: getattr(table.activation, name) for name in keys})
        changed = "" if raised_by == stored.activation else ", with an activation different from the file's"
        # The machine file may have changed since it was learned.
        checks = not (stored.plausible and stored.plausible.contradicted)
        setup = replace(setup, watched=stored.joints, activation=raised_by, checks_channels=checks)
        return _by_signature(setup, stored, detector, changed)
    table.check_joints(place, machine_file.machine)
    place.finish()
    if not setup.limits_by_hand and not is_per_run(setup.rule):
        if "threshold" in {key.partition(".")[0] for key in place.by_option}:
            raise place.fault("threshold", f"'{setup.rule.name}' is learned from impact-free runs", _NO_THRESHOLD)
        raise UsageError("no threshold is given", _NO_THRESHOLD)
    if detector is None:
        raise UsageError("no detector is given", "give --detectors NAME; see cdtool list detectors")
    return _by_runs(setup, machine_file.detector(detector))


def _of_settings(table: DetectionTable, place: Place, machine_file: MachineFile) -> BenchmarkFile:
    """Return the benchmark without logs that settings describe, with their mistakes in `place`."""
    place.tried(None, table.run_cut, place)
    signature = Signature().sided(machine_file.machine.default_sides)
    otherwise: Threshold = signature
    rules: ScoringRules = place.tried(
        ScoringRules(),
        lambda: table.rules(place, window=table.window_s, mass_before_cell=table.force.mass_before_cell_kg),
    )
    return BenchmarkFile(
        path=Path(),
        machine_file=machine_file,
        detectors=(),
        watched=table.joints,
        operations=table.operations,
        budget=None,
        signature=signature,
        rule=place.tried(otherwise, table.rule, place, signature),
        activation=table.activation,
        onset=rules.onset,
        labels=rules.labels,
        synchronisation=rules.synchronisation,
        mass_before_cell=rules.mass_before_cell,
        window=rules.window,
        section=place.tried(LogSection(), table.section, place),
        checks_channels=True,
    )


def _of_benchmark(
    file: str | Path,
    detector: str | None,
    signature: str | Path | LearnedSignature | SignatureFile | None,
    settings: Mapping[str, Any] | None,
) -> PreparedDetector:
    """Return one of the detectors of a benchmark file, or any with the threshold of a signature.

    `detector` is optional if the file names only one, or a signature is given.
    """
    if signature is not None:
        place = Place(str(file), by_option=full_keys(settings))
        refuse_beside_signature(
            apply_settings({}, settings or {}), place, ("threshold", "signature", "false_alarm_budget")
        )
        place.finish()
    named = (detector,) if detector else ()
    setup = read_benchmark_file(file, detectors=named, settings=settings, command="detect")
    if signature is None:
        setup = with_detectors(setup, [_chosen(setup, detector)])
        return _by_runs(setup, setup.machine_file.detector(setup.detectors[0]))
    stored = signature_of(signature)
    # Without `joints` in the file all joints are monitored; a signal of the whole machine has one column.
    everything = (tuple(setup.machine_file.machine.joints), WHOLE_MACHINE)
    if stored.joints != setup.watched and (setup.watched or stored.joints not in everything):
        names = [", ".join(joints) or "all joints" for joints in (stored.joints, setup.watched)]
        raise UsageError(f"the signature monitors {names[0]}, {file} {names[1]}", "learn it for the same joints")
    return _by_signature(setup, stored, detector)


def _by_signature(
    setup: BenchmarkFile, stored: SignatureFile, detector: str | Detector | None, changed: str = ""
) -> PreparedDetector:
    """Return the detector with the threshold of a signature file; raises SignatureError if it does not belong."""
    instance = setup.machine_file.detector(detector or stored.detector)
    stored.check(setup.machine_file.machine, instance)
    thresholds: Mapping[str, tuple[FittedThreshold, ...]] = {instance.name: stored.current}
    return PreparedDetector(
        setup,
        f"{stored.described}{changed}",
        detect_with(setup, [instance], ThresholdsByLog(setup, thresholds).without, {}),
        LearnedRanges(stored.plausible or PlausibleRanges({})),
        normals_of(stored),
        {run.sha256: "" for run in stored.runs},
        tuple(notes_on(stored)),
    )


def _by_runs(setup: BenchmarkFile, instance: Any) -> PreparedDetector:
    """Return the detector with the threshold that the runs of a benchmark give, or that needs none.

    Raises SignatureError if nothing can be learned.
    """
    runs = load_runs(setup.learn, setup.machine_file, setup.run_reading())
    fitted = learn_thresholds(setup, runs.operations, [instance], runs.skipped)
    used = fitted.learned_from(runs.operations)
    return PreparedDetector(
        setup,
        _described(setup, instance, used, fitted.thresholds[instance.name]),
        detect_with(setup, [instance], ThresholdsByLog.of(setup, fitted).without, fitted.unusable),
        runs.ranges,
        normals_for(used, setup.rule),
        {item.recording.digest: item.whole.name for item in used},
        skipped=(*runs.skipped, *fitted.skipped),
        losses=tuple(item for item in runs.findings if item.is_loss),
        runs=tuple(used),
    )


def _described(
    setup: BenchmarkFile, instance: Any, used: Sequence[Operation], thresholds: Sequence[FittedThreshold]
) -> str:
    """Return in words where a threshold is from."""
    if setup.limits_by_hand:
        limits = ", ".join(map(digits, setup.limits_by_hand))
        return f"limit {limits} {instance.unit(setup.machine_file.machine)} set by hand"
    words = f"threshold '{setup.rule.name}'" + (f" of {setup.path.name}" if setup.path.name else "")
    if is_per_run(setup.rule):
        return f"{words}, from each run itself, safety factor {setup.rule.safety_factor:g}"
    classes = f" of {len(thresholds)} classes of motion" if len(thresholds) > 1 else ""
    return f"{words}, learned from {counted(len(used), 'impact-free run')}{classes}"


def _has_run(listed: Path, log: Path) -> bool:
    """Return whether a log of a group, as a file or as FILE#IDS, has a run that is given as FILE#ID."""
    (listed_file, ids), (file, run) = split_run(listed), split_run(log)
    return bool(run) and listed_file.resolve() == file.resolve() and (not ids or fnmatchcase(run, ids))


def _chosen(setup: BenchmarkFile, detector: str | None) -> str:
    if detector is None and len(setup.detectors) == 1:
        return setup.detectors[0]
    if detector is None:
        raise UsageError(
            f"{setup.path} names {len(setup.detectors)} detectors",
            f"give --detectors, one of {', '.join(setup.detectors)}",
        )
    name: str = setup.machine_file.detector(detector).name
    if name not in setup.detectors:
        raise UsageError(f"{setup.path} does not name detector '{detector}'", nearest(name, setup.detectors))
    return name
