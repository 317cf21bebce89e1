"""One detector of a benchmark file, ready for single logs: its threshold and all settings that affect results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdtool.detection import WHOLE_MACHINE
from cdtool.errors import UsageError, nearest
from cdtool.evaluation.explanation.normal_choice import Absence, NormalMotions
from cdtool.evaluation.results import RecordingFinding, Skipped
from cdtool.plain_text import counted
from cdtool.plausible import PlausibleRanges
from cdtool.signature_store import read_signature
from cdtool.workflows.benchmark.benchmark_file import BenchmarkFile, read_benchmark_file, with_detectors
from cdtool.workflows.benchmark.learned_thresholds import learn_thresholds
from cdtool.workflows.benchmark.measured_synchronisation import with_synchronisation
from cdtool.workflows.benchmark.scoring import Detect, Scored, detect_with, score_log
from cdtool.workflows.runs import RunReading, load_runs
from cdtool.workflows.signature.normal_runs import normal_motions, normals_of, notes_on


@dataclass(frozen=True)
class PreparedBenchmark:
    """A detector with its threshold in `cdtool benchmark`; `described` states in words where the threshold is from.

    `learned` has the hashes of the logs learned from, `ranges` the ranges of their channels and `normals` their
    normal motion. `skipped` lists the runs left out in learning, with the reason; `losses` lists what is lost of the
    others. `notes` concern a signature file of an earlier version, and a measured synchronisation.
    """

    setup: BenchmarkFile
    detector: str
    described: str
    learned: Mapping[str, str]
    run: Detect
    ranges: PlausibleRanges | None
    normals: NormalMotions
    notes: tuple[RecordingFinding, ...] = ()
    skipped: tuple[Skipped, ...] = ()
    losses: tuple[RecordingFinding, ...] = ()

    def score(self, log: Path) -> Scored:
        """Return the log's rows as in a benchmark, with the window of its group if it has one. Raises nothing."""
        group, path = self._listed(log)
        return score_log(self.setup, group, path, self.run, {}, self.ranges)

    def window(self, log: Path) -> float:
        """Return how long after its onset a contact of the log may be detected [s]."""
        return self.setup.rules_of(self._listed(log)[0]).window

    def _listed(self, log: Path) -> tuple[str, Path]:
        """Return the log's group and its path as the file names it; an empty group if it is in none."""
        for name, group in self.setup.impacts.items():
            for path in group.logs:
                if path.resolve() == log.resolve():
                    return name, path
        return "", log


def prepare_benchmark(
    file: str | Path, *, detector: str | None = None, signature: str | Path | None = None
) -> PreparedBenchmark:
    """Read a benchmark file and learn the threshold of one of its detectors, or use that of a signature file.

    `detector` is optional if the file names only one, or a signature is given. Raises ConfigurationError for a wrong
    file, SignatureError if nothing can be learned or the signature does not belong, UsageError for an ambiguous
    detector.
    """
    setup, measured = with_synchronisation(read_benchmark_file(file, detectors=(detector,) if detector else ()))
    machine_file = setup.machine_file
    if signature is not None:
        stored = read_signature(signature)
        instance = machine_file.detector(detector or stored.detector)
        stored.check(machine_file.machine, instance)
        # Without `joints` in the file all joints are monitored; a signal of the whole machine has one column.
        everything = (tuple(machine_file.machine.joints), WHOLE_MACHINE)
        if stored.joints != setup.watched and (setup.watched or stored.joints not in everything):
            names = [", ".join(joints) or "all joints" for joints in (stored.joints, setup.watched)]
            raise UsageError(f"the signature monitors {names[0]}, {file} {names[1]}", "learn it for the same joints")
        thresholds: Mapping[str, Any] = {instance.name: stored.current}
        learned = {run.sha256: "" for run in stored.runs}
        run = detect_with(setup, [instance], thresholds, {})
        return PreparedBenchmark(
            setup,
            instance.name,
            stored.described,
            learned,
            run,
            stored.plausible,
            normals_of(stored),
            (*measured, *notes_on(stored)),
        )
    setup = with_detectors(setup, [_chosen(setup, detector)])
    instance = machine_file.detector(setup.detectors[0])
    reading = RunReading(setup.operations, onset=setup.onset, base=setup.path.parent)
    runs = load_runs(setup.learn, machine_file, reading)
    fitted = learn_thresholds(setup, runs.operations, [instance], runs.skipped)
    used = fitted.learned_from(runs.operations)
    many = counted(len(used), "impact-free run")
    classes = len(fitted.thresholds[instance.name])
    many += f" of {classes} classes of motion" if classes > 1 else ""
    described = f"threshold '{setup.threshold}' of {setup.path.name}, learned from {many}"
    hashes = {operation.recording.digest: operation.recording.name for operation in used}
    run = detect_with(setup, [instance], fitted.thresholds, fitted.unusable)
    normals = NormalMotions(normal_motions(used), Absence.FEW_RUNS)
    return PreparedBenchmark(
        setup,
        instance.name,
        described,
        hashes,
        run,
        runs.ranges,
        normals,
        notes=tuple(measured),
        skipped=(*runs.skipped, *fitted.skipped),
        losses=tuple(item for item in runs.findings if item.is_loss),
    )


def _chosen(setup: BenchmarkFile, detector: str | None) -> str:
    if detector is None and len(setup.detectors) == 1:
        return setup.detectors[0]
    if detector is None:
        raise UsageError(
            f"{setup.path} names {len(setup.detectors)} detectors",
            f"give --detector, one of {', '.join(setup.detectors)}",
        )
    name: str = setup.machine_file.detector(detector).name
    if name not in setup.detectors:
        raise UsageError(f"{setup.path} does not name detector '{detector}'", nearest(name, setup.detectors))
    return name
