"""The thresholds of a benchmark, learned for each detector from its impact-free runs."""

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
from cdtool.thresholds.base import FittedThreshold, is_per_run
from cdtool.workflows.benchmark.benchmark_file import BenchmarkFile
from cdtool.workflows.benchmark.left_out import LeftOut
from cdtool.workflows.signature.calibration import calibrate, in_fixed_order, kept
from cdtool.workflows.signature.fitting import NoUsableRunError, fitting, signals_of, with_left_out


@dataclass(frozen=True)
class LearnedThresholds:
    """Each detector's thresholds, runs left out, detectors that were not assessable, and how factors were set.

    `unusable` maps the detectors that could not be used on any run to the reason; they have no threshold. `unused`: the
    runs that every other detector left out.
    """

    thresholds: dict[str, tuple[FittedThreshold, ...]]
    skipped: list[Skipped]
    not_assessable: list[RecordingFinding]
    calibration: list[CalibrationResult]
    unusable: dict[str, str]
    unused: set[str]

    def learned_from(self, operations: Sequence[Operation]) -> list[Operation]:
        """Return the operations that at least one detector learned from."""
        return [operation for operation in operations if operation.name not in self.unused]


def learn_thresholds(
    setup: BenchmarkFile, operations: Sequence[Operation], detectors: Sequence[Any], unread: Sequence[Skipped]
) -> LearnedThresholds:
    """Learn each detector's threshold from impact-free runs; a budget also sets its safety factor on these runs.

    A threshold that determines its limits in each run learns nothing, but a budget needs the runs.

    A detector with a missing channel does not stop the others. Raises SignatureError if nothing can be learned,
    UsageError if there are too few runs for the budget.
    """
    learned = LearnedThresholds({}, [], [], [], {}, set())
    if is_per_run(setup.rule) and not setup.budget:
        learned.thresholds.update((detector.name, (setup.rule.fit([]),)) for detector in detectors)
        learned.unused.update(operation.name for operation in operations)
        return learned
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
            learned.not_assessable.append(RecordingFinding.of(detector.name, unassessable))
            continue
        except NoUsableRunError as fault:
            learned.thresholds[detector.name] = ()
            learned.unusable[detector.name] = fault.reason
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
    learned.skipped.extend(left_out.combined())
    learned.unused.update(set.intersection(*unused) if unused else ())
    if learned.unusable and len(learned.unusable) == len(detectors):
        raise _none_usable(learned.unusable, known=bool(operations))
    return learned


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
            left_out.append(RecordingFinding.of(detector.name, Finding(DetectorLeftOut(fault.message))))
    return able, left_out
