"""What a benchmark has learned from its impact-free runs: all that is needed to score a log, and to say how.

It can be stored and restored without loss. A log that is learned from, too, is scored by what the others give; for that
the runs themselves are needed (`Teaching`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from cdtool.detectors import DETECTORS
from cdtool.evaluation.explanation.normal_choice import Absence, NormalMotions
from cdtool.evaluation.results import CalibrationResult, RecordingFinding, Skipped
from cdtool.findings import Finding
from cdtool.findings.scoring import DetectorLeftOut
from cdtool.operations import Operation
from cdtool.plausible import LearnedRanges, PlausibleRanges
from cdtool.remote.remote_path import location
from cdtool.thresholds.base import FittedThreshold, Threshold
from cdtool.thresholds.normal_motion import NormalMotion
from cdtool.thresholds.stored import fitted_from_dict, fitted_to_dict
from cdtool.workflows.benchmark.benchmark_file import BenchmarkFile, with_only
from cdtool.workflows.benchmark.learned_thresholds import learn_thresholds, that_can_run
from cdtool.workflows.execution.workers import Workers
from cdtool.workflows.runs import load_runs, shown_path
from cdtool.workflows.signature.fitting import Pair
from cdtool.workflows.signature.normal_runs import normals_for
from cdtool.workflows.store.encoding import decoded, encoded


@dataclass(frozen=True)
class _Reported:
    """What is reported about learning; `names` are those of the runs learned from, `unusable` the reasons."""

    detectors: tuple[str, ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]
    calibration: tuple[CalibrationResult, ...]
    unusable: Mapping[str, str]
    names: tuple[str, ...]
    digests: Mapping[str, str]
    sources: Mapping[str, str]


@dataclass(frozen=True)
class Learned:
    """Thresholds by detector, plausible ranges and normal motions, and what is to be reported about learning.

    `detectors` are those that are used; `skipped` the runs that were left out; `unusable` the detectors that cannot be
    used on any run, with the reason. `names` are the runs learned from, `digests` the SHA-256 of their files by path,
    `sources` the names of all runs by the SHA-256 of their recordings.
    """

    detectors: tuple[str, ...]
    thresholds: Mapping[str, tuple[FittedThreshold, ...]]
    ranges: LearnedRanges
    normals: NormalMotions
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()
    calibration: tuple[CalibrationResult, ...] = ()
    unusable: Mapping[str, str] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    digests: Mapping[str, str] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)

    def to_text(self, rule: Threshold) -> str:
        """Return it as JSON, with the thresholds of a rule."""
        ranges = {name: item.to_dict() for name, item in self.ranges.by_name.items()}
        reported = _Reported(
            self.detectors,
            self.skipped,
            self.findings,
            self.calibration,
            self.unusable,
            self.names,
            self.digests,
            self.sources,
        )
        values = {
            "reported": encoded(reported, _Reported),
            "thresholds": {
                name: [fitted_to_dict(rule, item) for item in items] for name, items in self.thresholds.items()
            },
            "ranges": self.ranges.all.to_dict(),
            "ranges_without": ranges,
            "normals": [item.to_dict() for item in self.normals.motions],
            "absent": self.normals.absent.name,
        }
        return json.dumps(values, separators=(",", ":"))

    @classmethod
    def of_text(cls, text: str, rule: Threshold) -> Learned:
        """Return what `to_text` wrote; raises ValueError, KeyError or TypeError for anything else."""
        values = json.loads(text)
        reported = decoded(values["reported"], _Reported)
        ranges = {name: PlausibleRanges.from_dict(item) for name, item in values["ranges_without"].items()}
        normals = tuple(NormalMotion.from_dict(item) for item in values["normals"])
        thresholds = {
            name: tuple(fitted_from_dict(rule, item) for item in items) for name, items in values["thresholds"].items()
        }
        return cls(
            detectors=reported.detectors,
            thresholds=thresholds,
            ranges=LearnedRanges(PlausibleRanges.from_dict(values["ranges"]), ranges),
            normals=NormalMotions(normals, Absence[values["absent"]]),
            skipped=reported.skipped,
            findings=reported.findings,
            calibration=reported.calibration,
            unusable=reported.unusable,
            names=reported.names,
            digests=reported.digests,
            sources=reported.sources,
        )


@dataclass(frozen=True)
class Teaching:
    """The runs that were learned from, and each detector's signals of them."""

    operations: tuple[Operation, ...] = ()
    pairs: Mapping[str, Sequence[Pair]] = field(default_factory=dict)


def learn(setup: BenchmarkFile, workers: Workers, *, every_detector: bool = False) -> tuple[Learned, Teaching]:
    """Learn from the impact-free runs of a benchmark; with `every_detector`, those that cannot run are left out.

    Raises SignatureError if nothing can be learned, UsageError if there are too few runs for the budget.
    """
    machine_file = setup.machine_file
    runs = load_runs(setup.learn, machine_file, setup.run_reading(workers))
    used: list[Any] = [machine_file.detector(name) for name in setup.detectors]
    left_out: list[RecordingFinding] = []
    if every_detector:
        used, left_out = that_can_run(used, runs.operations, machine_file.machine)
        broken = DETECTORS.broken_plugins().items()
        left_out += [RecordingFinding.of(name, Finding(DetectorLeftOut(str(fault)))) for name, fault in broken]
        setup = with_only(setup, [detector.name for detector in used])
    made = learn_thresholds(setup, runs.operations, used, runs.skipped)
    names = made.learned_from(runs.operations)
    unassessable = [Skipped(name, f"not assessable: {reason}") for name, reason in made.unusable.items()]
    base = setup.path.parent
    learned = Learned(
        detectors=tuple(detector.name for detector in used),
        thresholds=made.thresholds,
        ranges=runs.ranges,
        normals=normals_for(runs.operations, setup.rule),
        skipped=(*runs.skipped, *made.skipped, *unassessable),
        findings=(*runs.findings, *left_out, *made.not_assessable),
        calibration=tuple(made.calibration),
        unusable=made.unusable,
        names=tuple(operation.name for operation in names),
        digests={shown_path(location(item.recording.source), base): item.recording.digest for item in names},
        sources={item.recording.digest: item.whole.name for item in runs.operations},
    )
    return learned, Teaching(runs.operations, made.pairs) if setup.both else Teaching()
