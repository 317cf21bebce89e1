"""The thresholds of a benchmark: of each detector, learned from its impact-free runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cdtool.dynamics import Machine
from cdtool.errors import CdtoolError, NothingValidError, SignatureError
from cdtool.evaluation.results import CalibrationResult, RecordingFinding, Skipped
from cdtool.findings import Finding
from cdtool.findings.scoring import DetectorLeftOut, DetectorUnassessable
from cdtool.operations import Operation
from cdtool.pipeline import run_detector
from cdtool.thresholds.base import FittedThreshold
from cdtool.workflows.benchmark.benchmark_file import BenchmarkFile
from cdtool.workflows.benchmark.left_out import LeftOut
from cdtool.workflows.signature.calibration import calibrate, in_fixed_order, kept
from cdtool.workflows.signature.fitting import NoUsableRunError, fitting, signals_of, with_left_out


@dataclass(frozen=True)
class LearnedThresholds:
    """Each detector's thresholds, runs left out, detectors that could judge nothing, and how factors were set.

    `lacking`: the detectors that could not be used on any run, with the reason; they have no threshold.
    `unused`: the runs that every other detector left out.
    """

    thresholds: dict[str, tuple[FittedThreshold, ...]]
    skipped: list[Skipped]
    blind: list[RecordingFinding]
    calibration: list[CalibrationResult]
    lacking: dict[str, str]
    unused: set[str]

    def learned_from(self, operations: Sequence[Operation]) -> list[Operation]:
        """Return the operations that some detector has learned from."""
        return [operation for operation in operations if operation.name not in self.unused]


def learn_thresholds(
    setup: BenchmarkFile, operations: Sequence[Operation], detectors: Sequence[Any], unread: Sequence[Skipped]
) -> LearnedThresholds:
    """Learn each detector's threshold from impact-free runs; with a budget its safety factor is set on them too.

    A detector that lacks a channel stops the others not. Raises SignatureError where nothing can be learned, UsageError
    where the runs are too few for the budget.
    """
    learned = LearnedThresholds({}, [], [], [], {}, set())
    fit = fitting(setup.rule)
    left_out = LeftOut()
    unused: list[set[str]] = []
    for detector in detectors:
        try:
            pairs, unusable = signals_of(operations, setup.machine_file.machine, detector, setup.watched, unread)
            pairs = in_fixed_order(pairs)
            fitted = with_left_out(fit, [*unread, *unusable])(pairs)
        except NothingValidError as fault:
            learned.thresholds[detector.name] = ()
            unassessable = Finding(DetectorUnassessable(fault.message))
            learned.blind.append(RecordingFinding.of(detector.name, unassessable))
            continue
        except NoUsableRunError as fault:
            learned.thresholds[detector.name] = ()
            learned.lacking[detector.name] = fault.reason
            continue
        left_out.add(detector.name, [*unusable, *fitted.skipped])
        unused.append({item.recording for item in [*unusable, *fitted.skipped]})
        thresholds = fitted.thresholds
        if setup.budget:
            made = calibrate(setup.budget, detector.name, kept(pairs, fitted.skipped), fit, setup.activation)
            thresholds = tuple(item.with_safety_factor(made.factor) for item in thresholds)
            learned.calibration.append(
                CalibrationResult(
                    detector.name, str(setup.budget), made.factor, made.operations, made.hours, made.alarms
                )
            )
        learned.thresholds[detector.name] = thresholds
    learned.skipped.extend(left_out.said_once())
    learned.unused.update(set.intersection(*unused) if unused else ())
    if learned.lacking and len(learned.lacking) == len(detectors):
        raise _none_usable(learned.lacking, known=bool(operations))
    return learned


def _none_usable(lacking: Mapping[str, str], known: bool) -> SignatureError:
    name, reason = next(iter(lacking.items()))
    fault = NoUsableRunError(name if len(lacking) == 1 else f"any of {', '.join(lacking)}", reason)
    others = f"take {', '.join(lacking)} out of `detectors`, or map what they need"
    return SignatureError(fault.message, others if known else fault.hint)


def that_can_run(
    detectors: Sequence[Any], operations: Sequence[Operation], machine: Machine
) -> tuple[list[Any], list[RecordingFinding]]:
    """The detectors that the first run holds all channels for, and why not the others."""
    able: list[Any] = []
    left_out: list[RecordingFinding] = []
    for detector in detectors:
        try:
            for operation in operations[:1]:
                run_detector(operation, machine, detector)
            able.append(detector)
        except CdtoolError as fault:
            left_out.append(RecordingFinding.of(detector.name, Finding(DetectorLeftOut(fault.message))))
    return able, left_out
