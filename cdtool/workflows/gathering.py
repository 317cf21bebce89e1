"""Gather the rows of many logs, for detectors and for external alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from cdtool.errors import ConfigurationError, RecordingError
from cdtool.evaluation.explanation.explanation import explain_operation
from cdtool.evaluation.explanation.normal_choice import Absence, NormalMotions
from cdtool.evaluation.explanation.words import words
from cdtool.evaluation.force.verdict import ForceVerdict
from cdtool.evaluation.results import CalibrationResult, RecordingFinding, RecordingResult, Results, Skipped
from cdtool.evaluation.traces.choice import TraceChoice
from cdtool.evaluation.traces.trace import Trace, make_trace
from cdtool.evaluation.truth.matching import Matching
from cdtool.findings import Finding, Remark
from cdtool.findings.scoring import PlotsLeftOut
from cdtool.pipeline import Detection
from cdtool.recording import FloatArray
from cdtool.workflows.benchmark.benchmark_file import HOLDOUT, BenchmarkFile
from cdtool.workflows.benchmark.counting import Exposure, SweepRows
from cdtool.workflows.benchmark.force_rows import point_rows
from cdtool.workflows.benchmark.scoring import Scored
from cdtool.workflows.contacts.impact_free import unchecked
from cdtool.workflows.contacts.judged_operation import Judged
from cdtool.workflows.detector_inputs import inputs_of


class Gathering:
    """The rows of a benchmark, log by log in the order of the file, and the selected traces.

    `names` are the detectors; `learned` maps the hashes of the logs learned from to their names; `normals` is their
    normal motion.
    """

    def __init__(
        self,
        setup: BenchmarkFile,
        names: Sequence[str],
        factors: Mapping[str, FloatArray],
        learned: Mapping[str, str],
        normals: NormalMotions = NormalMotions(absent=Absence.FEW_RUNS),  # noqa: B008
    ) -> None:
        self.setup = setup
        self.names = tuple(names)
        self.learned = learned
        self.normals = normals
        self.scored: list[Scored] = []
        self.skipped: list[Skipped] = []
        self.findings = [RecordingFinding.of(str(setup.path), Finding(Remark(words))) for words in setup.migrated]
        # By detector: the unit of the value compared with the limits, which may differ from that of the signal.
        self.units: dict[str, str] = {}
        self._exposure: dict[tuple[str, str], Exposure] = {}
        self._sweep = SweepRows(factors, HOLDOUT)
        self._tests: dict[tuple[str, str], list[ForceVerdict]] = {}
        self._scored: dict[str, str] = {}
        self._unchecked: list[tuple[str, Finding]] = []
        self._logs = 0
        self._choice = TraceChoice(sum(len(item.logs) for item in setup.impacts.values()))

    def add(self, group: str, scored: Scored) -> None:
        """Add one log's rows; raises ConfigurationError if the same log, under any name, was learned from."""
        self._logs += 1
        self.skipped += scored.skipped
        self.findings += scored.findings
        self._unchecked += scored.unchecked
        if scored.recording is None:
            return
        self._refuse_learned(scored.recording)
        for judged in scored.judged:
            for detection, matching, swept in zip(judged.detections, judged.matchings, judged.sweeps, strict=True):
                self.units.setdefault(detection.detector, detection.statistic.unit)
                self._exposure.setdefault((group, detection.detector), Exposure()).add(detection)
                self._sweep.add(group, detection, swept, matching)
            _offer(self._choice, self._logs - 1, judged, self.setup, self.normals)
        for name in {detection.detector for judged in scored.judged for detection in judged.detections}:
            self._exposure[group, name].recordings += 1
        if scored.recording.point:
            self._tests.setdefault((group, scored.recording.point), []).extend(scored.verdicts.values())
        self.scored.append(replace(scored, judged=[], verdicts={}, log=None, matched=None))

    @property
    def traces(self) -> tuple[Trace, ...]:
        """Return the selected traces."""
        return self._choice.kept()

    def results(self, provenance: Mapping[str, Any], calibration: Sequence[CalibrationResult] = ()) -> Results:
        """Return all results; raises RecordingError if no log could be scored."""
        if not self._exposure:
            first = self.skipped[0] if self.skipped else None
            reason = f"; first reason: {first.recording}: {first.reason}" if first else ""
            raise RecordingError(f"{self.setup.path}: no recording could be scored{reason}", "check with cdtool info")
        if self._choice.left_out:
            left_out = Finding(PlotsLeftOut(self._choice.left_out))
            self.findings.append(RecordingFinding.of(str(self.setup.path), left_out))
        profiles = {name: group.force for name, group in self.setup.impacts.items()}
        return Results(
            provenance=provenance,
            detectors=self.names,
            groups=self.setup.groups,
            recordings=tuple(item.recording for item in self.scored if item.recording),
            contacts=tuple(row for item in self.scored for row in item.contacts),
            false_alarms=tuple(row for item in self.scored for row in item.false_alarms),
            exposure=tuple(item.result(group, name) for (group, name), item in self._exposure.items()),
            forces=tuple(row for item in self.scored for row in item.forces),
            points=tuple(point_rows(self._tests, profiles)),
            sweep=tuple(self._sweep.rows(self.names, self.setup.groups)),
            calibration=tuple(calibration),
            skipped=tuple(self.skipped),
            findings=(*self.findings, *unchecked(self._unchecked)),
        )

    def _refuse_learned(self, recording: RecordingResult) -> None:
        before = self._scored.setdefault(recording.sha256, recording.recording) if recording.sha256 else ""
        if before and before != recording.recording:
            raise ConfigurationError(
                f"{self.setup.path}: {recording.recording} and {before} have identical content", "score each log once"
            )
        if recording.sha256 and recording.sha256 in self.learned:
            raise ConfigurationError(
                f"{self.setup.path}: {recording.recording} has the same content as {self.learned[recording.sha256]}, "
                "which is used for learning",
                "use a recording either in [learn] or for scoring",
            )


def _offer(choice: TraceChoice, number: int, judged: Judged, setup: BenchmarkFile, normals: NormalMotions) -> None:
    pairs = list(zip(judged.detections, judged.matchings, strict=True))
    missed = [item.detector for item, made in pairs if any(match.outcome == "missed" for match in made.matches)]
    false = [item.detector for item, made in pairs if made.false_alarms]
    words = [f"missed by {', '.join(missed)}"] if missed else []
    words += [f"false alarm of {', '.join(false)}"] if false else []
    slowest = max((match.latency for _, made in pairs for match in made.matches if match.alarm), default=0.0)

    def make(why: str) -> Trace:
        compared = normals.for_one_operation()
        return make_trace(
            judged.group,
            judged.operation,
            judged.contacts,
            judged.detections,
            judged.matchings,
            [_explained(detection, matching, setup, compared) for detection, matching in pairs],
            why,
        )

    choice.offer(number, judged.group, len(judged.detections), "; ".join(words), slowest, make)


def _explained(detection: Detection, matching: Matching, setup: BenchmarkFile, normals: NormalMotions) -> list[str]:
    """Return why each alarm was raised and each contact missed; empty for external alarms."""
    if detection.threshold is None:
        return []
    inputs = inputs_of(detection.detector, setup.machine_file)
    found = explain_operation(detection, matching, setup.activation, inputs, normals)
    return [line for item in found for line in words(item)]
