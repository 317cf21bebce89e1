"""What a benchmark has learned from its impact-free runs: all that is needed to score a log, and to say how.

It can be stored and restored without loss. A log that is learned from, too, is scored by what the others give; for that
the runs themselves are needed (`Teaching`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from cdtool.base.files.bounded_loading import parse_own_json
from cdtool.base.files.typed_json import plain, typed
from cdtool.base.findings import Finding
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.runs import Runs, load_runs, shown_path
from cdtool.commands.learning.fitting import Pair
from cdtool.commands.learning.normal_runs import normals_for
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, with_only
from cdtool.commands.scoring.learned_thresholds import LearnedThresholds, learn_thresholds, that_can_run
from cdtool.detectors import DETECTORS
from cdtool.execution.workers import Workers
from cdtool.recordings.operations import Operation
from cdtool.recordings.plausible import LearnedRanges, PlausibleRanges
from cdtool.results.results import CalibrationResult, RecordingFinding, Skipped
from cdtool.thresholds.base import FittedThreshold, Threshold
from cdtool.thresholds.normal_motion import Absence, NormalMotion, NormalMotions
from cdtool.thresholds.stored import fitted_from_dict, fitted_to_dict


@dataclass(frozen=True)
class AboutLearning:
    """What is reported about learning.

    `detectors` are those that are used; `skipped` the runs that were left out; `unusable` the detectors that cannot be
    used on any run, with the reason. `names` are the runs learned from, `digests` the SHA-256 of their files by path,
    `sources` the names of all runs by the SHA-256 of their recordings.
    """

    detectors: tuple[str, ...]
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()
    calibration: tuple[CalibrationResult, ...] = ()
    unusable: Mapping[str, str] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    digests: Mapping[str, str] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Learned:
    """Thresholds by detector, plausible ranges and normal motions, and what is to be reported about learning.

    `lasts`: the same runs would give the same again.
    """

    about: AboutLearning
    thresholds: Mapping[str, tuple[FittedThreshold, ...]]
    ranges: LearnedRanges
    normals: NormalMotions
    lasts: bool = True

    def to_text(self, rule: Threshold) -> str:
        """Return it as JSON; `rule` is that of the thresholds."""
        values = {
            "about": plain(self.about),
            "thresholds": {
                name: [fitted_to_dict(rule, item) for item in items] for name, items in self.thresholds.items()
            },
            "ranges": self.ranges.all.to_dict(),
            "ranges_without": {name: item.to_dict() for name, item in self.ranges.by_name.items()},
            "normals": [item.to_dict() for item in self.normals.motions],
            "absent": self.normals.absent.name,
        }
        return json.dumps(values, separators=(",", ":"))

    @classmethod
    def of_text(cls, text: str, rule: Threshold) -> Learned:
        """Return what `to_text` wrote; raises ValueError for anything else."""
        try:
            values = parse_own_json(text)
            ranges = {name: PlausibleRanges.from_dict(item) for name, item in values["ranges_without"].items()}
            return cls(
                typed(AboutLearning, values["about"], "about"),
                {
                    name: tuple(fitted_from_dict(rule, item) for item in items)
                    for name, items in values["thresholds"].items()
                },
                LearnedRanges(PlausibleRanges.from_dict(values["ranges"]), ranges),
                NormalMotions(
                    tuple(NormalMotion.from_dict(item) for item in values["normals"]), Absence[values["absent"]]
                ),
            )
        except (KeyError, TypeError, AttributeError) as fault:
            raise ValueError(f"not what was learned: {fault}") from fault


@dataclass(frozen=True)
class Teaching:
    """Learns from the impact-free runs of a benchmark when the runs, or what they give, are first asked for.

    With `every_detector`, detectors that cannot run on the first run are left out. What is learned raises
    SignatureError if nothing can be learned, UsageError if there are too few runs for the budget.
    """

    setup: BenchmarkFile
    workers: Workers
    every_detector: bool = False

    @property
    def operations(self) -> tuple[Operation, ...]:
        """Return the runs."""
        return self._runs.operations

    @property
    def pairs(self) -> Mapping[str, Sequence[Pair]]:
        """Return the runs with the signals of each detector."""
        return self._fitted.pairs

    @cached_property
    def learned(self) -> Learned:
        """Return what the runs give."""
        runs, made, base = self._runs, self._fitted, self.setup.path.parent
        used = made.learned_from(runs.operations)
        unassessable = [Skipped(name, f"not assessable: {reason}") for name, reason in made.unusable.items()]
        about = AboutLearning(
            detectors=tuple(detector.name for detector in self._detectors[0]),
            skipped=(*runs.skipped, *made.skipped, *unassessable),
            findings=(*runs.findings, *self._detectors[1], *made.findings),
            calibration=tuple(made.calibration),
            unusable=made.unusable,
            names=tuple(operation.name for operation in used),
            digests={shown_path(location(item.recording.source), base): item.recording.digest for item in used},
            sources={item.recording.digest: item.whole.name for item in runs.operations},
        )
        normals = normals_for(runs.operations, self.setup.rule)
        return Learned(about, made.thresholds, runs.ranges, normals, runs.lasts)

    @cached_property
    def _runs(self) -> Runs:
        return load_runs(self.setup.learn, self.setup.machine_file, self.setup.run_reading(self.workers))

    @cached_property
    def _detectors(self) -> tuple[list[Any], list[RecordingFinding]]:
        """Return the detectors that are used, and why others are left out."""
        machine_file = self.setup.machine_file
        used: list[Any] = [machine_file.detector(name) for name in self.setup.detectors]
        if not self.every_detector:
            return used, []
        used, left_out = that_can_run(used, self._runs.operations, machine_file.machine)
        broken = DETECTORS.broken_plugins().items()
        left_out += [
            RecordingFinding.of(name, Finding("detector_left_out", "", {"reason": str(fault)}))
            for name, fault in broken
        ]
        return used, left_out

    @cached_property
    def _fitted(self) -> LearnedThresholds:
        used = self._detectors[0]
        setup = with_only(self.setup, [detector.name for detector in used])
        return learn_thresholds(setup, self._runs.operations, used, self._runs.skipped, self.workers.jobs)
