"""What remains of a scored log in a benchmark: its rows, totals and selected traces, without any of its samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cdtool.evaluation.explanation.explanation import explain_operation
from cdtool.evaluation.explanation.normal_choice import NormalMotions
from cdtool.evaluation.explanation.words import words
from cdtool.evaluation.force.verdict import ForceVerdict
from cdtool.evaluation.results import (
    ContactResult,
    FalseAlarmResult,
    ForceResult,
    RecordingFinding,
    RecordingResult,
    Skipped,
)
from cdtool.evaluation.sweep import Swept
from cdtool.evaluation.traces.choice import TraceChoice
from cdtool.evaluation.traces.trace import Trace, make_trace
from cdtool.evaluation.truth.matching import Matching
from cdtool.findings import Finding
from cdtool.pipeline import Detection
from cdtool.workflows.benchmark.benchmark_file import BenchmarkFile
from cdtool.workflows.benchmark.scoring import Scored
from cdtool.workflows.contacts.judged_operation import Judged
from cdtool.workflows.detector_inputs import inputs_of
from cdtool.workflows.signature.normal_runs import NormalsWithout

# The normal motion of impact-free runs, or how it is made when it is needed.
Normals = NormalMotions | NormalsWithout


@dataclass(frozen=True)
class DetectorOutcome:
    """One detector on one operation: how long it monitored it, and what became of its contacts.

    `seconds` were assessable, `samples` in all, `by_reason` of them not assessable. `outcomes` are those of the
    operation's contacts; `swept` is None without an impact-free group.
    """

    detector: str
    unit: str
    seconds: float
    is_not_assessable: bool
    samples: int
    by_reason: Mapping[str, int]
    outcomes: tuple[str, ...]
    swept: Swept | None


@dataclass(frozen=True)
class OperationOutcome:
    """One operation with every detector, what is striking in it, its longest latency [s], and its trace if wanted."""

    detectors: tuple[DetectorOutcome, ...]
    striking: str
    slowest: float
    trace: Trace | None


@dataclass(frozen=True)
class LogOutcome:
    """The results of one log, small enough to be kept for all logs and to be sent from one process to another.

    `unchecked`: names of logs assumed to be free of impacts, with the ground truth that is missing from them.
    `beside`: name and SHA-256 of each file beside the log with a channel. `reading`, `detecting` [s]: time taken.
    """

    recording: RecordingResult | None
    contacts: tuple[ContactResult, ...]
    false_alarms: tuple[FalseAlarmResult, ...]
    forces: tuple[ForceResult, ...]
    verdicts: tuple[ForceVerdict, ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]
    unchecked: tuple[tuple[str, Finding], ...]
    operations: tuple[OperationOutcome, ...]
    reading: float
    detecting: float
    beside: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class WantedTraces:
    """Which traces of log number `log` are wanted: those that are kept after the operations in `choice`.

    The operations of the log are then in `choice`, too.
    """

    log: int
    choice: TraceChoice


def outcome_of(scored: Scored, setup: BenchmarkFile, normals: Normals, wanted: WantedTraces) -> LogOutcome:
    """Return what remains of a scored log; alarms are explained by comparison with `normals`, for wanted traces."""
    return LogOutcome(
        recording=scored.recording,
        contacts=tuple(scored.contacts),
        false_alarms=tuple(scored.false_alarms),
        forces=tuple(scored.forces),
        verdicts=tuple(scored.verdicts.values()),
        skipped=tuple(scored.skipped),
        findings=tuple(scored.findings),
        unchecked=tuple(scored.unchecked),
        operations=tuple(_operation(judged, setup, normals, wanted) for judged in scored.judged),
        reading=scored.reading,
        detecting=scored.detecting,
        beside=scored.log.beside if scored.log else (),
    )


def _operation(judged: Judged, setup: BenchmarkFile, normals: Normals, wanted: WantedTraces) -> OperationOutcome:
    pairs = list(zip(judged.detections, judged.matchings, strict=True))
    missed = [item.detector for item, made in pairs if any(match.outcome == "missed" for match in made.matches)]
    false = [item.detector for item, made in pairs if made.false_alarms]
    striking = [f"missed by {', '.join(missed)}"] if missed else []
    striking += [f"false alarm of {', '.join(false)}"] if false else []
    slowest = max((match.latency for _, made in pairs for match in made.matches if match.alarm), default=0.0)
    kept = wanted.choice.offer(wanted.log, judged.group, len(pairs), "; ".join(striking), slowest)
    return OperationOutcome(
        tuple(
            _of_detector(detection, matching, swept)
            for (detection, matching), swept in zip(pairs, judged.sweeps, strict=True)
        ),
        "; ".join(striking),
        slowest,
        _trace(judged, setup, normals) if kept is not None else None,
    )


def _of_detector(detection: Detection, matching: Matching, swept: Swept | None) -> DetectorOutcome:
    statistic = detection.statistic
    size = statistic.status.size
    return DetectorOutcome(
        detector=detection.detector,
        unit=statistic.unit,
        seconds=detection.assessed_seconds,
        is_not_assessable=detection.verdict.outcome == "not_assessable",
        samples=size,
        by_reason={reason: round(share * size) for reason, share in statistic.shares().items()},
        outcomes=tuple(match.outcome for match in matching.matches),
        swept=swept,
    )


def _trace(judged: Judged, setup: BenchmarkFile, normals: Normals) -> Trace:
    compared = normals.for_one_operation()
    return make_trace(
        judged.group,
        judged.operation,
        judged.contacts,
        judged.detections,
        judged.matchings,
        [
            _explained(detection, matching, setup, compared)
            for detection, matching in zip(judged.detections, judged.matchings, strict=True)
        ],
    )


def _explained(detection: Detection, matching: Matching, setup: BenchmarkFile, normals: NormalMotions) -> list[str]:
    """Return why each alarm was raised and each contact missed; empty for external alarms."""
    if detection.threshold is None:
        return []
    inputs = inputs_of(detection.detector, setup.machine_file)
    found = explain_operation(detection, matching, setup.activation, inputs, normals)
    return [line for item in found for line in words(item)]
