"""One detector of a benchmark file, ready for single logs: its threshold and all settings that affect results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from cdtool.base.errors import RecordingError, UsageError, nearest
from cdtool.base.plain_text import counted
from cdtool.base.settings import Place
from cdtool.commands.detecting.detection import Detected, DetectedRuns
from cdtool.commands.judging.runs import load_runs
from cdtool.commands.judging.settings_table import apply_settings, full_keys, refuse_beside_signature
from cdtool.commands.learning.learning import LearnedSignature, signature_of
from cdtool.commands.learning.normal_runs import normals_for, normals_of, notes_on
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file, with_detectors
from cdtool.commands.scoring.learned_thresholds import ThresholdsByLog, learn_thresholds
from cdtool.commands.scoring.scoring import Detect, ScoredLog, detect_with, score_runs
from cdtool.detectors.detection import WHOLE_MACHINE
from cdtool.formats.channels.run_reading import split_run
from cdtool.formats.machine_file import MachineFile
from cdtool.formats.signature_file import SignatureFile
from cdtool.recordings.operations import Operation
from cdtool.recordings.plausible import LearnedRanges
from cdtool.recordings.recording import Recording
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.thresholds.base import is_per_run
from cdtool.thresholds.normal_motion import NormalMotions


@dataclass(frozen=True)
class PreparedBenchmark:
    """A detector with its threshold in `cdtool benchmark`; `described` states in words where the threshold is from.

    `learned` has the hashes of the logs learned from with their names, `runs` their operations, `ranges` the ranges of
    their channels and `normals` their normal motion. `skipped` lists the runs left out in learning, with the reason;
    `losses` lists what is lost of the others. `run` returns how a log is detected: without its own part. `notes`
    concern a signature file of an earlier version.
    """

    setup: BenchmarkFile
    detector: str
    described: str
    learned: Mapping[str, str]
    run: Detect
    ranges: LearnedRanges | None
    normals: NormalMotions
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
                skipped += scored.left_out or [Skipped(str(log), "no operation is assessable")]
            else:
                found.append(detected)
        if not found:
            reason = skipped[0].reason if skipped else "no operation is assessable"
            raise RecordingError(reason if str(log) in reason else f"{log}: {reason}")
        return DetectedRuns(tuple(found), tuple(skipped), tuple(findings))

    def _detected(self, scored: ScoredLog, log: Path) -> Detected | None:
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
            self.described,
            self.setup.activation,
            self.has_judged_itself(scored.recording),
            self.window(log),
            tuple(rows for _, rows in judged),
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


def prepare_benchmark(
    file: str | Path,
    *,
    detector: str | None = None,
    signature: str | Path | LearnedSignature | SignatureFile | None = None,
    settings: Mapping[str, Any] | None = None,
) -> PreparedBenchmark:
    """Read a benchmark file and learn the threshold of one of its detectors, or use that of a signature file.

    `detector` is optional if the file names only one, or a signature is given. `settings` take the place of keys of the
    file. Raises ConfigurationError for a wrong file, SignatureError if nothing can be learned or the signature does not
    belong, UsageError for an ambiguous detector.
    """
    if signature is not None:
        place = Place(str(file), by_option=full_keys(settings))
        own = ("threshold", "signature", "false_alarm_budget")
        refuse_beside_signature(apply_settings({}, settings or {}), place, own)
        place.finish()
    named = (detector,) if detector else ()
    setup = read_benchmark_file(file, detectors=named, settings=settings, command="detect")
    machine_file = setup.machine_file
    if signature is not None:
        stored = signature_of(signature)
        instance = machine_file.detector(detector or stored.detector)
        stored.check(machine_file.machine, instance)
        # Without `joints` in the file all joints are monitored; a signal of the whole machine has one column.
        everything = (tuple(machine_file.machine.joints), WHOLE_MACHINE)
        if stored.joints != setup.watched and (setup.watched or stored.joints not in everything):
            names = [", ".join(joints) or "all joints" for joints in (stored.joints, setup.watched)]
            raise UsageError(f"the signature monitors {names[0]}, {file} {names[1]}", "learn it for the same joints")
        thresholds: Mapping[str, Any] = {instance.name: stored.current}
        learned = {run.sha256: "" for run in stored.runs}
        run = detect_with(setup, [instance], ThresholdsByLog(setup, thresholds).without, {})
        return PreparedBenchmark(
            setup,
            instance.name,
            stored.described,
            learned,
            run,
            LearnedRanges(stored.plausible) if stored.plausible else None,
            normals_of(stored),
            tuple(notes_on(stored)),
        )
    setup = with_detectors(setup, [_chosen(setup, detector)])
    instance = machine_file.detector(setup.detectors[0])
    runs = load_runs(setup.learn, machine_file, setup.run_reading())
    fitted = learn_thresholds(setup, runs.operations, [instance], runs.skipped)
    used = fitted.learned_from(runs.operations)
    many = counted(len(used), "impact-free run")
    classes = len(fitted.thresholds[instance.name])
    many += f" of {classes} classes of motion" if classes > 1 else ""
    origin = "from each run itself" if is_per_run(setup.rule) else f"learned from {many}"
    origin = "set by hand" if setup.limits_by_hand else origin
    described = f"threshold '{setup.rule.name}' of {setup.path.name}, {origin}"
    hashes = {item.recording.digest: item.whole.name for item in used}
    run = detect_with(setup, [instance], ThresholdsByLog.of(setup, fitted).without, fitted.unusable)
    normals = normals_for(used, setup.rule)
    return PreparedBenchmark(
        setup,
        instance.name,
        described,
        hashes,
        run,
        runs.ranges,
        normals,
        skipped=(*runs.skipped, *fitted.skipped),
        losses=tuple(item for item in runs.findings if item.is_loss),
        runs=tuple(used),
    )


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
