"""Thresholds of a benchmark: learned from impact-free runs, and set for a false-alarm budget by cross-validation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from cdtool.activation import Activation
from cdtool.detection import Signal
from cdtool.errors import CdtoolError, NothingValidError, SignatureError, UsageError
from cdtool.evaluation.false_alarm_budget import Budget, set_factor
from cdtool.evaluation.results import CalibrationResult, Skipped
from cdtool.operations import Operation
from cdtool.pipeline import Detection, judge, run_detector
from cdtool.thresholds.base import FittedThreshold
from cdtool.workflows.benchmark_file import BenchmarkFile
from cdtool.workflows.learning import fit_classes, signals_of

# Runs are judged by what the other nine tenths teach.
FOLDS = 10

Pair = tuple[Operation, Signal]
Fit = Callable[[Sequence[Pair]], tuple[tuple[FittedThreshold, ...], list[Skipped]]]


@dataclass(frozen=True)
class LearnedThresholds:
    """Each detector's thresholds, runs left out, detectors that could judge nothing, and how factors were set."""

    thresholds: dict[str, tuple[FittedThreshold, ...]]
    skipped: list[Skipped]
    blind: list[Skipped]
    calibration: list[CalibrationResult]


def learn_thresholds(
    setup: BenchmarkFile, operations: Sequence[Operation], detectors: Sequence[Any], unread: Sequence[Skipped]
) -> LearnedThresholds:
    """Learn each detector's threshold from impact-free runs; with a budget its safety factor is set on them too.

    Raises SignatureError where nothing can be learned, UsageError where the runs are too few for the budget.
    """
    learned = LearnedThresholds({}, [], [], [])
    # The order of the files must not decide which runs judge which.
    operations = sorted(operations, key=lambda item: (item.recording.digest, item.number, item.name))
    fit = _fit_by_class(setup.rule) if getattr(setup.rule, "by_class", False) else _fit_one(setup.rule)
    for detector in detectors:
        try:
            pairs, left_out = signals_of(operations, setup.machine_file.machine, detector, setup.watched, unread)
            fitted, refused = fit(pairs)
        except NothingValidError as fault:
            learned.thresholds[detector.name] = ()
            learned.blind.append(Skipped(detector.name, f"not assessable: {fault.message}"))
            continue
        learned.skipped.extend([*left_out, *refused])
        if setup.budget:
            used = {item.recording for item in refused}
            kept = [pair for pair in pairs if pair[0].name not in used]
            row = _calibrate(setup.budget, detector.name, kept, fit, Activation(setup.debounce))
            learned.calibration.append(row)
            fitted = tuple(item.with_safety_factor(row.safety_factor) for item in fitted)
        learned.thresholds[detector.name] = fitted
    return learned


def _fit_by_class(rule: Any) -> Fit:
    def fit(pairs: Sequence[Pair]) -> tuple[tuple[FittedThreshold, ...], list[Skipped]]:
        fitted, _, refused = fit_classes(pairs, rule)
        return fitted, refused

    return fit


def _fit_one(rule: Any) -> Fit:
    def fit(pairs: Sequence[Pair]) -> tuple[tuple[FittedThreshold, ...], list[Skipped]]:
        return (rule.fit([(item.recording.without_ground_truth(), signal) for item, signal in pairs]),), []

    return fit


def _calibrate(
    budget: Budget, detector: str, pairs: Sequence[Pair], fit: Fit, activation: Activation
) -> CalibrationResult:
    """Set the factor on every run, each judged by thresholds that were learned from runs of other folds."""
    if budget.per == "operation":
        budget.check(len(pairs), detector)
    detections: list[Detection] = []
    for fold in range(FOLDS):
        others = [pair for i, pair in enumerate(pairs) if i % FOLDS != fold]
        try:
            fitted, refused = fit(others)
        except SignatureError as fault:
            raise _too_few(budget, detector, fault.message) from fault
        if refused:
            raise _too_few(budget, detector, refused[0].reason)
        held_out = [pair for i, pair in enumerate(pairs) if i % FOLDS == fold]
        detections += [judge(operation, detector, signal, fitted, activation) for operation, signal in held_out]
    made = set_factor(budget, detector, detections, activation)
    return CalibrationResult(detector, str(budget), made.factor, made.operations, made.hours, made.alarms)


def _too_few(budget: Budget, detector: str, why: str) -> UsageError:
    return UsageError(
        f"false-alarm budget {budget}: {detector} cannot learn from nine tenths of the runs: {why}",
        "add runs to [learn] (of each class of motion), or do without a budget",
    )


def that_can_run(
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
