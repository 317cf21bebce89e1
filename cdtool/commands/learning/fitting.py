"""Fit a threshold to impact-free runs: signals of a detector, classes of motion, runs used and left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

from cdtool.alarms.pipeline import run_detector_on_each
from cdtool.base.errors import CdtoolError, SignatureError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import counted, reason_line
from cdtool.commands.learning.grouping import by_class
from cdtool.detectors.detection import Signal
from cdtool.machines.dynamics import Machine
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.speed_range import in_ranges
from cdtool.recordings.operations import Operation
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.thresholds.base import FittedThreshold, Threshold, is_per_run
from cdtool.thresholds.common_class import SPEED_TOLERANCE
from cdtool.thresholds.contract import checked_fit
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.signature import Signature

Pair = tuple[Operation, Signal]

#: A stroke is at creep speed below this share of the speed of another one in its log: end positions are approached at
#: a tenth to a third of the nominal speed, and opening and closing differ by less than a factor of two.
_CREEP = 0.5


class NoUsableRunError(SignatureError):
    """A detector cannot be used on any run, mostly because of a missing channel; `reason` is that of the first run."""

    def __init__(self, detector: str, reason: str) -> None:
        first = f"; first reason: {reason}" if reason else ""
        super().__init__(f"{detector} cannot be used on any run{first}", "" if reason else "check with cdtool info")
        self.reason = reason


@dataclass(frozen=True)
class Fitted:
    """Fitted thresholds with the operations that each was learned from, and the operations left out.

    `creeping` are left out too: slow strokes in logs of which a faster one was learned.
    """

    thresholds: tuple[FittedThreshold, ...]
    learned_from: tuple[tuple[Operation, ...], ...]
    skipped: tuple[Skipped, ...]
    creeping: tuple[Skipped, ...] = ()

    def findings(self, rule: Threshold, detector: str) -> tuple[RecordingFinding, ...]:
        """Return the creeping strokes, and the speeds that a rule without classes of motion pools.

        With `speed_range`, each motion that it cannot serve, as it was learned at a single speed.
        """
        reasons = Counter(item.reason for item in self.creeping)
        creeping = tuple(
            RecordingFinding.of(detector, Finding("creep_not_learned", "", {"strokes": count, "reason": reason}))
            for reason, count in reasons.items()
        )
        if not getattr(rule, "speed_range", False):
            pooled = () if getattr(rule, "by_class", False) or is_per_run(rule) else _pooled(rule, self.used)
            return (*creeping, *(RecordingFinding.of(detector, item) for item in pooled))
        motions = [motion for item in self.thresholds if (motion := getattr(item, "motion", None))]
        single = [motions[numbers[0]].described for numbers in in_ranges(motions) if len(numbers) == 1]
        return (
            *creeping,
            *(RecordingFinding.of(detector, Finding("single_speed", "", {"motion": motion})) for motion in single),
        )

    @property
    def used(self) -> tuple[Operation, ...]:
        """Return all operations that were learned from."""
        return tuple(operation for operations in self.learned_from for operation in operations)


def _pooled(rule: Threshold, operations: Sequence[Operation]) -> list[Finding]:
    """Return the slowest and the fastest runs of each motion whose speeds are those of two classes."""
    motions = [item.motion for item in operations if "speed" in item.recording and item.motion.direction]
    kinds: dict[tuple[int, int], list[MotionClass]] = {}
    for motion in sorted(motions, key=lambda motion: motion.nominal_speed):
        kinds.setdefault((motion.joint, motion.direction), []).append(motion)
    return [
        Finding(
            "speeds_pooled", "", {"threshold": rule.name, "slowest": kind[0].described, "fastest": kind[-1].described}
        )
        for kind in kinds.values()
        if not kind[0].matches(kind[-1], SPEED_TOLERANCE)
    ]


Fit = Callable[[Sequence[Pair]], Fitted]


def fitting(rule: Threshold) -> Fit:
    """Return how the rule learns from runs: each class of motion separately if `by_class`, all together otherwise.

    The function raises SignatureError if nothing can be learned.
    """
    by_class = getattr(rule, "by_class", False)
    return lambda pairs: _fit_classes(rule, pairs) if by_class else _fit_all(rule, pairs)


def signals_of(
    operations: Sequence[Operation],
    machine: Machine,
    detector: Any,
    watched: Sequence[str] = (),
    unread: Sequence[Skipped] = (),
) -> tuple[list[Pair], list[Skipped]]:
    """Return a detector's signal of each operation, and what was left out; NoUsableRunError if no run remains.

    `unread`: what was left out before, used as the reason in that error.
    """
    skipped: list[Skipped] = []
    refused: list[CdtoolError] = []
    pairs: list[Pair] = []
    for _, of_log in groupby(operations, key=lambda operation: id(operation.whole)):
        cut = list(of_log)
        try:
            pairs += zip(cut, run_detector_on_each(cut, machine, detector, watched), strict=True)
        except CdtoolError as fault:
            refused.append(fault)
            skipped += [Skipped(operation.name, str(fault)) for operation in cut]
    if not pairs:
        reasons = [*(fault.message for fault in refused), *(item.reason for item in unread)]
        raise NoUsableRunError(detector.name, reasons[0] if reasons else "")
    return pairs, skipped


def with_left_out(fit: Fit, skipped: Sequence[Skipped]) -> Fit:
    """Return the same fit, with an error for too few runs that also states how many were left out before."""

    def told(pairs: Sequence[Pair]) -> Fitted:
        try:
            return fit(pairs)
        except SignatureError as fault:
            if skipped and type(fault) is SignatureError:
                before = f"left out before: {counted(len(skipped), 'run')}"
                told = SignatureError(f"{fault.message}; {before}", fault.hint)
                told.add_note(reason_line("left out", skipped[0].recording, skipped[0].reason))
                raise told from fault
            raise

    return told


def fit_operations(
    operations: Sequence[Operation],
    machine: Machine,
    detector: Any,
    rule: Threshold,
    unread: Sequence[Skipped] = (),
    watched: Sequence[str] = (),
) -> Fitted:
    """Learn the rule from impact-free operations of a machine with a detector; raises SignatureError."""
    pairs, skipped = signals_of(operations, machine, detector, watched, unread)
    fitted = fitting(for_machine(rule, machine))(pairs)
    return replace(fitted, skipped=(*skipped, *fitted.skipped))


def for_machine(rule: Threshold, machine: Machine) -> Threshold:
    """Return the rule with the machine's default sides if it has none, also in its signature."""
    sides = machine.default_sides
    return with_context(rule, sides, Signature(sides=sides))


def _fit_all(rule: Threshold, pairs: Sequence[Pair]) -> Fitted:
    return Fitted((_fit(rule, pairs),), (tuple(operation for operation, _ in pairs),), ())


def _fit_classes(rule: Threshold, pairs: Sequence[Pair]) -> Fitted:
    fitted: list[FittedThreshold] = []
    used: list[tuple[Operation, ...]] = []
    skipped: list[Skipped] = []
    refused: list[tuple[CdtoolError, list[Operation]]] = []
    classes, odd = by_class([operation for operation, _ in pairs])
    skipped += odd
    signals = {id(operation): signal for operation, signal in pairs}
    for operations in classes:
        members = [(operation, signals[id(operation)]) for operation in operations]
        try:
            fitted.append(_fit(rule, members))
            used.append(tuple(operation for operation, _ in members))
        except SignatureError as fault:
            # A stray run of another class does not stop the others; without a class to learn it is an error.
            refused.append((fault, operations))
    if not fitted and not refused:
        raise SignatureError("no impact-free run to learn from", "add runs")
    if not fitted:
        raise refused[0][0]
    creeping: list[Skipped] = []
    learned = sorted((item for of_class in used for item in of_class), key=lambda item: item.motion.nominal_speed)
    speeds = {id(item.whole): item.motion.nominal_speed for item in learned}  # the highest of each log
    for failure, operations in refused:
        is_creep = all(item.motion.nominal_speed < _CREEP * speeds.get(id(item.whole), 0.0) for item in operations)
        reason = f"runs {operations[0].motion.described}: {failure.message}"
        (creeping if is_creep else skipped).extend(Skipped(item.name, reason) for item in operations)
    return Fitted(tuple(fitted), tuple(used), tuple(skipped), tuple(creeping))


def _fit(rule: Threshold, pairs: Sequence[Pair]) -> FittedThreshold:
    return checked_fit(rule, [(item.recording.without_ground_truth(), each) for item, each in pairs])
