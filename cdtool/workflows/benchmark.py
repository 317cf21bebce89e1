"""Many recordings, many detectors: learn, detect, match, count."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from cdtool.activation import Activation
from cdtool.errors import CdtoolError, NothingValidError, RecordingError, SignatureError
from cdtool.evaluation.results import ContactResult, FalseAlarmResult, Results, Skipped
from cdtool.kernels import compile_loaded
from cdtool.operations import Operation
from cdtool.pipeline import run_detector
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.base import FittedThreshold
from cdtool.version import __version__
from cdtool.workflows.benchmark_file import HOLDOUT, BenchmarkFile, read_benchmark_file, with_detectors
from cdtool.workflows.learning import fit_signatures
from cdtool.workflows.runs import Progress, in_order, load_runs, shown_path
from cdtool.workflows.scoring import Exposure, Scored, Trace, contact_results, false_alarm_results, score_log


@dataclass(frozen=True)
class Benchmark:
    """The results, the traces of one recording a group, and where the time went [s]."""

    results: Results
    traces: tuple[Trace, ...]
    seconds: Mapping[str, float]


def benchmark(
    file: str | Path | BenchmarkFile,
    *,
    detectors: Sequence[str] = (),
    jobs: int = 1,
    progress: Progress | None = None,
) -> Benchmark:
    """Learn every detector's threshold, run them over all groups, match alarms with contacts.

    `detectors`: others than the file's; "all" alone stands for every one that is registered and can learn from these
    logs, the others are named in `results.findings`.

    A log that cannot be read or scored is left out and named in `results.skipped`. Raises ConfigurationError for a
    wrong file, SignatureError where nothing can be learned, RecordingError where nothing could be scored.
    """
    setup = file if isinstance(file, BenchmarkFile) else read_benchmark_file(file)
    setup = with_detectors(setup, detectors) if detectors else setup
    machine_file = setup.machine_file
    used = [machine_file.detector(name) for name in setup.detectors]
    compile_loaded()
    begin = perf_counter()
    learn = load_runs(setup.learn, machine_file, setup.operations, jobs=jobs, base=setup.path.parent)
    learned_at = perf_counter()
    left_out: list[Skipped] = []
    if list(detectors) == ["all"]:
        used, left_out = _that_can_run(used, learn.operations, machine_file.machine)
        setup = replace(setup, detectors=tuple(detector.name for detector in used))
    thresholds, skipped, blind = _learn(setup, learn.operations, used, learn.skipped)
    seconds = {"reading": learned_at - begin, "detecting": perf_counter() - learned_at}
    work = [(group, path) for group in setup.groups for path in _paths(setup, group)]
    activation = Activation(setup.debounce)

    def score(item: tuple[str, Path]) -> Scored:
        return score_log(setup, item[0], item[1], used, thresholds, activation)

    traces: dict[str, Trace] = {}
    contacts: list[ContactResult] = []
    false_alarms: list[FalseAlarmResult] = []
    exposure: dict[tuple[str, str], Exposure] = {}
    skipped = [*learn.skipped, *skipped]
    findings = [*learn.findings, *left_out, *blind]
    digests = {op.recording.source: op.recording.digest for op in learn.operations}
    for (group, _), scored in zip(work, in_order(score, work, jobs, progress), strict=True):
        skipped += scored.skipped
        findings += scored.findings
        if scored.digest:
            digests[scored.digest[0]] = scored.digest[1]
        seconds["reading"] += scored.reading
        seconds["detecting"] += scored.detecting
        for trace in scored.traces:
            contacts += contact_results(trace)
            false_alarms += false_alarm_results(trace)
            for detection in trace.detections:
                exposure.setdefault((group, detection.detector), Exposure()).add(detection)
            if len(trace.detections) > len(traces[group].detections if group in traces else ()):
                traces[group] = trace
        for name in {detection.detector for trace in scored.traces for detection in trace.detections}:
            exposure[group, name].recordings += 1
    if not exposure:
        reason = f"; first reason: {skipped[0].recording}: {skipped[0].reason}" if skipped else ""
        raise RecordingError(f"{setup.path}: no recording could be scored{reason}", "check with cdtool info")
    results = Results(
        provenance=_provenance(setup, used, thresholds, digests, learn.operations),
        detectors=setup.detectors,
        groups=setup.groups,
        contacts=tuple(contacts),
        false_alarms=tuple(false_alarms),
        exposure=tuple(item.result(group, name) for (group, name), item in exposure.items()),
        skipped=tuple(skipped),
        findings=tuple(findings),
    )
    return Benchmark(results, tuple(traces[group] for group in setup.groups if group in traces), seconds)


def _that_can_run(
    detectors: Sequence[Any], operations: Sequence[Operation], machine: Any
) -> tuple[list[Any], list[Skipped]]:
    """The detectors that the first run holds all channels for, and why not the others."""
    able: list[Any] = []
    left_out: list[Skipped] = []
    for detector in detectors:
        try:
            for operation in operations[:1]:
                run_detector(operation, machine, detector)
            able.append(detector)
        except CdtoolError as fault:
            left_out.append(Skipped(detector.name, f"left out: {fault.message}"))
    return able, left_out


def _learn(
    setup: BenchmarkFile, operations: Sequence[Operation], detectors: Sequence[Any], unread: Sequence[Skipped]
) -> tuple[dict[str, tuple[FittedThreshold, ...]], list[Skipped], list[Skipped]]:
    """Each detector's thresholds, the runs left out, and the detectors that could judge nothing in any run."""
    thresholds: dict[str, tuple[FittedThreshold, ...]] = {}
    skipped: list[Skipped] = []
    blind: list[Skipped] = []
    for detector in detectors:
        try:
            if setup.threshold == "signature":
                fitted, _, left_out = fit_signatures(
                    operations, setup.machine_file.machine, detector, setup.signature, unread, watched=setup.watched
                )
                thresholds[detector.name] = fitted
                skipped += left_out
            else:
                thresholds[detector.name] = (_limits(setup, operations, detector),)
        except NothingValidError as fault:
            thresholds[detector.name] = ()
            blind.append(Skipped(detector.name, f"not assessable: {fault.message}"))
    return thresholds, skipped, blind


def _limits(setup: BenchmarkFile, operations: Sequence[Operation], detector: Any) -> FittedThreshold:
    if not operations:
        raise SignatureError(f"no run to learn {detector.name} from", "check with cdtool info")
    pairs = [
        (op.recording.without_ground_truth(), run_detector(op, setup.machine_file.machine, detector, setup.watched))
        for op in operations
    ]
    fitted: FittedThreshold = THRESHOLDS.load(setup.threshold)(safety_factor=setup.signature.factor).fit(pairs)
    return fitted


def _provenance(
    setup: BenchmarkFile,
    detectors: Sequence[Any],
    thresholds: Mapping[str, tuple[FittedThreshold, ...]],
    digests: Mapping[str, str],
    learned: Sequence[Operation],
) -> dict[str, Any]:
    base = setup.path.parent
    return {
        "tool": "cdtool",
        "tool_version": __version__,
        "benchmark_sha256": setup.digest,
        "machine": setup.machine_file.machine.name,
        "machine_sha256": setup.machine_file.digest,
        "gains": {detector.name: asdict(detector) for detector in detectors},
        "threshold": setup.threshold,
        "signature_rule": {**asdict(setup.signature), "safety_factor": setup.signature.factor},
        "signature_sha256": {name: _digest(items) for name, items in thresholds.items()},
        "learned_runs": [operation.name for operation in learned],
        "debounce_samples": setup.debounce,
        "window_s": setup.window,
        "onset": setup.onset.described,
        "operations": setup.operations,
        "watched_joints": ", ".join(setup.watched) or None,
        "units": {detector.name: detector.unit(setup.machine_file.machine) for detector in detectors},
        "short_names": {detector.name: detector.short_name for detector in detectors},
        "logs_sha256": {shown_path(Path(source), base): digest for source, digest in sorted(digests.items())},
    }


def _digest(thresholds: Sequence[FittedThreshold]) -> str:
    text = json.dumps([item.to_dict() for item in thresholds], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _paths(setup: BenchmarkFile, group: str) -> tuple[Path, ...]:
    return setup.holdout if group == HOLDOUT else setup.impacts[group]
