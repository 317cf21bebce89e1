"""The thresholds of a benchmark, learned for each detector from its impact-free runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cdtool.alarms.pipeline import run_detector
from cdtool.base.errors import CdtoolError, NothingValidError, SignatureError, UsageError
from cdtool.base.findings import Finding
from cdtool.commands.judging.runs import shown_path
from cdtool.commands.learning.calibration import calibrate, in_fixed_order, kept
from cdtool.commands.learning.fitting import NoUsableRunError, Pair, fitting, signals_of, with_left_out
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.scoring import left_out_by
from cdtool.execution.starting import shares_memory
from cdtool.execution.workers import Workers, in_order
from cdtool.machines.dynamics import Machine
from cdtool.recordings.operations import Operation
from cdtool.results.results import CalibrationResult, RecordingFinding, Skipped
from cdtool.thresholds.base import FittedThreshold, is_per_run


@dataclass(frozen=True)
class LearnedThresholds:
    """Each detector's thresholds, runs left out, findings about detectors, and how factors were set.

    `unusable` maps the detectors that could not be used on any run to the reason; they have no threshold. `unused`: the
    runs that every other detector left out. `pairs` are the runs by detector if logs are scored that are learned from.
    """

    thresholds: dict[str, tuple[FittedThreshold, ...]]
    skipped: list[Skipped]
    findings: list[RecordingFinding]
    calibration: list[CalibrationResult]
    unusable: dict[str, str]
    unused: set[str]
    pairs: dict[str, list[Pair]]

    def learned_from(self, operations: Sequence[Operation]) -> list[Operation]:
        """Return the operations that at least one detector learned from."""
        return [operation for operation in operations if operation.name not in self.unused]


def learn_thresholds(
    setup: BenchmarkFile,
    operations: Sequence[Operation],
    detectors: Sequence[Any],
    unread: Sequence[Skipped],
    jobs: int = 1,
) -> LearnedThresholds:
    """Learn each detector's threshold from impact-free runs; a budget also sets its safety factor on these runs.

    A threshold that determines its limits in each run learns nothing, but a budget needs the runs. A detector with a
    missing channel does not stop the others. For a budget, `jobs` detectors learn at a time where processes share the
    runs. Raises SignatureError if nothing can be learned, UsageError if there are too few runs for the budget.
    """
    learned = LearnedThresholds({}, [], [], [], {}, set(), {})
    of_run = is_per_run(setup.rule) or (setup.limits_by_hand and not setup.learn)
    if of_run and not setup.budget:
        learned.thresholds.update((detector.name, (setup.rule.fit([]),)) for detector in detectors)
        learned.unused.update(operation.name for operation in operations)
        return learned
    if of_run and not setup.learn:
        raise UsageError(f"a false-alarm budget of {setup.budget} is set on runs", "add impact-free logs: [learn] logs")
    left_out: dict[str, Sequence[Skipped]] = {}
    unused: list[set[str]] = []
    # Without a budget, to learn takes no longer than to start processes. Logs that are scored too need all pairs here.
    at_once = setup.budget and not setup.both and shares_memory()
    learning = _Learning(setup, tuple(operations), tuple(unread), keeps_pairs=bool(setup.both))
    made = in_order(learning, detectors, len(detectors), Workers(jobs if at_once else 1))
    for detector, of_detector in zip(detectors, made, strict=True):
        if of_detector.made is None:
            learned.thresholds[detector.name] = ()
            if of_detector.is_unusable:
                learned.unusable[detector.name] = of_detector.reason
            else:
                unassessable = Finding("detector_unassessable", "", {"reason": of_detector.reason})
                learned.findings.append(RecordingFinding.of(detector.name, unassessable))
            continue
        skipped = [*of_detector.skipped, *of_detector.made.skipped]
        left_out[detector.name] = skipped
        unused.append({item.recording for item in (*skipped, *of_detector.made.creeping)})
        learned.calibration.extend(of_detector.made.calibration)
        learned.thresholds[detector.name] = of_detector.made.thresholds
        learned.findings.extend(of_detector.made.findings)
        learned.pairs[detector.name] = of_detector.pairs
    learned.skipped.extend(left_out_by(left_out))
    learned.unused.update(set.intersection(*unused) if unused else ())
    if learned.unusable and len(learned.unusable) == len(detectors):
        raise _none_usable(learned.unusable, known=bool(operations))
    return learned


@dataclass(frozen=True)
class _Made:
    thresholds: tuple[FittedThreshold, ...]
    skipped: tuple[Skipped, ...]
    creeping: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]
    calibration: tuple[CalibrationResult, ...] = ()


@dataclass(frozen=True)
class _OfDetector:
    """What one detector has learned and the runs left out before, or the reason why it has learned nothing."""

    made: _Made | None
    skipped: list[Skipped] = field(default_factory=list)
    pairs: list[Pair] = field(default_factory=list)
    reason: str = ""
    is_unusable: bool = False


@dataclass(frozen=True)
class _Learning:
    """Learns the thresholds of one detector from all runs."""

    setup: BenchmarkFile
    operations: tuple[Operation, ...]
    unread: tuple[Skipped, ...]
    keeps_pairs: bool

    def __call__(self, detector: Any) -> _OfDetector:
        setup = self.setup
        try:
            pairs, unusable = signals_of(
                self.operations, setup.machine_file.machine, detector, setup.watched, self.unread
            )
            pairs = in_fixed_order(pairs)
            made = _learn(setup, detector.name, pairs, [*self.unread, *unusable])
        except NothingValidError as fault:
            return _OfDetector(None, reason=fault.message)
        except NoUsableRunError as fault:
            return _OfDetector(None, reason=fault.reason, is_unusable=True)
        return _OfDetector(made, unusable, pairs if self.keeps_pairs else [])


def _learn(setup: BenchmarkFile, detector: str, pairs: Sequence[Pair], left_out: Sequence[Skipped] = ()) -> _Made:
    """Learn one detector's thresholds from runs; a budget sets their safety factor on the same runs."""
    fit = fitting(setup.rule)
    fitted = with_left_out(fit, left_out)(pairs)
    findings = fitted.findings(setup.rule, detector)
    if not setup.budget:
        return _Made(fitted.thresholds, fitted.skipped, fitted.creeping, findings)
    made = calibrate(setup.budget, detector, kept(pairs, fitted), fit, setup.activation, setup.split)
    result = CalibrationResult(detector, str(setup.budget), made.factor, made.operations, made.hours, made.alarms)
    thresholds = tuple(item.with_safety_factor(made.factor) for item in fitted.thresholds)
    return _Made(thresholds, fitted.skipped, fitted.creeping, findings, (result,))


@dataclass(frozen=True)
class ThresholdsByLog:
    """The thresholds that apply to each log: for a log in `setup.both`, those learned from the other logs.

    `pairs` are the runs by detector.
    """

    setup: BenchmarkFile
    all_runs: Mapping[str, tuple[FittedThreshold, ...]]
    pairs: Mapping[str, Sequence[Pair]] = field(default_factory=dict)

    @classmethod
    def of(cls, setup: BenchmarkFile, learned: LearnedThresholds) -> ThresholdsByLog:
        """Return the thresholds; the runs are kept only if they are needed again."""
        return cls(setup, learned.thresholds, learned.pairs if setup.both else {})

    def without(
        self, log: Path
    ) -> tuple[Mapping[str, tuple[FittedThreshold, ...]], Mapping[str, list[RecordingFinding]]]:
        """Return the thresholds for a log, which it did not teach, by detector, and why some are missing."""
        if not self.setup.both:
            return self.all_runs, {}
        name = shown_path(log, self.setup.path.parent)
        thresholds, findings = dict(self.all_runs), dict[str, list[RecordingFinding]]()
        for detector, pairs in self.pairs.items():
            others = [pair for pair in pairs if pair[0].whole.name != name]
            if len(others) == len(pairs):
                continue
            try:
                thresholds[detector] = _learn(self.setup, detector, others).thresholds
            except (SignatureError, UsageError) as fault:
                thresholds[detector] = ()
                reason = Finding("nothing_learned_without", "", {"detector": detector, "reason": fault.message})
                findings[detector] = [RecordingFinding.of(name, reason)]
        return thresholds, findings


def _none_usable(unusable: Mapping[str, str], known: bool) -> SignatureError:
    name, reason = next(iter(unusable.items()))
    fault = NoUsableRunError(name if len(unusable) == 1 else f"any of {', '.join(unusable)}", reason)
    others = f"remove {', '.join(unusable)} from `detectors`, or map the channels they need"
    return SignatureError(fault.message, others if known else fault.hint)


def that_can_run(
    detectors: Sequence[Any], operations: Sequence[Operation], machine: Machine
) -> tuple[list[Any], list[RecordingFinding]]:
    """Return the detectors whose channels are all in the first run, and the reasons for the others."""
    able: list[Any] = []
    left_out: list[RecordingFinding] = []
    for detector in detectors:
        try:
            for operation in operations[:1]:
                run_detector(operation, machine, detector)
            able.append(detector)
        except CdtoolError as fault:
            left_out.append(
                RecordingFinding.of(detector.name, Finding("detector_left_out", "", {"reason": fault.message}))
            )
    return able, left_out
