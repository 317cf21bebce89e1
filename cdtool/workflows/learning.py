"""Learning and updating signatures from impact-free logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from cdtool.activation import Activation
from cdtool.detection import Signal
from cdtool.errors import CdtoolError, SignatureError
from cdtool.evaluation.results import Skipped
from cdtool.machine_file import MachineFile, fingerprint, read_machine_file
from cdtool.motion import MotionClass
from cdtool.operations import Operation
from cdtool.pipeline import detect_operation, run_detector
from cdtool.recording import Recording
from cdtool.signature_store import (
    LearnedRun,
    SignatureFile,
    read_signature,
    update_signature,
    with_run,
)
from cdtool.thresholds.common_class import SPEED_TOLERANCE
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature import Signature
from cdtool.workflows.runs import Progress, check_joints, load_runs

Fitted = TypeVar("Fitted", covariant=True)


class RuleOf(Protocol[Fitted]):
    """A threshold's rule, by what it makes of impact-free runs."""

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> Fitted:
        """Learn from impact-free runs."""
        ...


@dataclass(frozen=True)
class Learned:
    """A signature file's content, how many runs each class gave, and what was left out."""

    signature: SignatureFile
    runs: tuple[tuple[MotionClass, int], ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[Skipped, ...]


def learn_signature(
    logs: Sequence[str | Path],
    machine: str | Path | MachineFile,
    detector: str,
    *,
    rule: Signature | None = None,
    joints: Sequence[str] = (),
    operations: str = "whole",
    debounce: int | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Learned:
    """Learn the normal band of one detector from impact-free logs: one signature for each class of motion.

    `rule` holds the signature's settings (safety factor, sides, alignment, force ...); `joints` are those to watch, all
    where none is named. Raises SignatureError where runs
    are too few, CdtoolError where nothing can be read. Write the result with `cdtool.signature_store.write_signature`.
    """
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    Activation(debounce)  # refuses a wrong debounce before anything is read
    check_joints(joints, machine_file.machine)
    runs = load_runs([Path(log) for log in logs], machine_file, operations, jobs=jobs, progress=progress)
    fitted, used, skipped = fit_signatures(
        runs.operations,
        machine_file.machine,
        machine_file.detector(detector),
        rule or Signature(),
        runs.skipped,
        watched=joints,
    )
    signature = signature_file(machine_file, detector, debounce, fitted, used)
    counts = tuple((item.motion, item.runs) for item in fitted)
    return Learned(signature, counts, (*runs.skipped, *skipped), runs.findings)


def fit_signatures(
    operations: Sequence[Operation],
    machine: Any,
    detector: Any,
    rule: Signature,
    unread: Sequence[Skipped] = (),
    watched: Sequence[str] = (),
) -> tuple[tuple[FittedSignature, ...], list[Operation], list[Skipped]]:
    """A signature for each class, the runs used and those left out; raises SignatureError."""
    pairs, skipped = signals_of(operations, machine, detector, watched, unread)
    fitted, used, refused = fit_classes(pairs, rule.for_machine(machine.default_sides))
    return fitted, used, [*skipped, *refused]


def signals_of(
    operations: Sequence[Operation],
    machine: Any,
    detector: Any,
    watched: Sequence[str] = (),
    unread: Sequence[Skipped] = (),
) -> tuple[list[tuple[Operation, Signal]], list[Skipped]]:
    """A detector's signal of each operation, and what was left out; raises SignatureError where none is left.

    `unread`: what was left out before, for the reason in that error.
    """
    skipped: list[Skipped] = []
    pairs: list[tuple[Operation, Signal]] = []
    for operation in operations:
        try:
            pairs.append((operation, run_detector(operation, machine, detector, watched)))
        except CdtoolError as fault:
            skipped.append(Skipped(operation.name, str(fault)))
    if not pairs:
        reasons = [*unread, *skipped]
        reason = f"; first reason: {reasons[0].reason}" if reasons else ""
        raise SignatureError(f"no run to learn {detector.name} from{reason}", "check with cdtool info")
    return pairs, skipped


def fit_classes(
    pairs: Sequence[tuple[Operation, Signal]], rule: RuleOf[Fitted]
) -> tuple[tuple[Fitted, ...], list[Operation], list[Skipped]]:
    """What the rule learns of each class of motion, the runs used and those left out; raises SignatureError."""
    fitted: list[Fitted] = []
    used: list[Operation] = []
    skipped: list[Skipped] = []
    refused: list[CdtoolError] = []
    for members in _by_class(pairs):
        try:
            fitted.append(rule.fit([(item.recording.without_ground_truth(), signal) for item, signal in members]))
            used += [item for item, _ in members]
        except SignatureError as fault:
            # A stray run of another class does not stop the others; without any class to learn it is an error.
            refused.append(fault)
            motion = members[0][0].motion.described
            skipped += [Skipped(item.name, f"runs {motion}: {fault.message}") for item, _ in members]
    if not fitted:
        raise refused[0]
    return tuple(fitted), used, skipped


def signature_file(
    machine_file: MachineFile,
    detector: str,
    debounce: int | None,
    fitted: tuple[FittedSignature, ...],
    used: Sequence[Operation],
) -> SignatureFile:
    """The content of a signature file for freshly learned signatures."""
    instance = machine_file.detector(detector)
    return SignatureFile(
        machine=machine_file.machine.name,
        machine_fingerprint=fingerprint(machine_file.machine),
        detector=instance.name,
        gains=asdict(instance),
        unit=instance.unit(machine_file.machine),
        debounce=debounce,
        current=fitted,
        first=fitted,
        runs=tuple(_learned_run(operation) for operation in used),
    )


def update_with_runs(
    path: str | Path,
    logs: Sequence[str | Path],
    machine: str | Path | MachineFile,
    *,
    operations: str = "whole",
    forget: float | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> tuple[SignatureFile, tuple[str, ...], tuple[Skipped, ...]]:
    """Add impact-free runs to a signature file, by Welford or by forgetting (`forget`: effective number of runs).

    A run with an alarm, one that is in the signature already, and one that cannot be assessed are refused. Returns the
    new file, the runs added and those refused with the reason. Raises SignatureError where the file does not belong.
    """
    if forget is not None and not forget > 1.0:
        raise SignatureError(f"forget is {forget}", "an effective number of runs above 1, e.g. 20 to 50")
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    detector = machine_file.detector(read_signature(path).detector)
    runs = load_runs([Path(log) for log in logs], machine_file, operations, jobs=jobs, progress=progress)
    added: list[str] = []
    refused = list(runs.skipped)

    def change(signature: SignatureFile) -> SignatureFile:
        signature.check(machine_file.machine, detector)
        for operation in runs.operations:
            try:
                signature = _with_operation(signature, operation, machine_file.machine, detector, forget)
                added.append(operation.name)
            except CdtoolError as fault:
                refused.append(Skipped(operation.name, fault.message))
        return signature

    return update_signature(path, change), tuple(added), tuple(refused)


def _with_operation(
    signature: SignatureFile, operation: Operation, machine: Any, detector: Any, forget: float | None
) -> SignatureFile:
    run = _learned_run(operation)
    if any((item.sha256, item.operation) == (run.sha256, run.operation) for item in signature.runs):
        raise SignatureError("this run is in the signature already")
    activation = Activation(signature.debounce)
    detection = detect_operation(operation, machine, detector, signature.current, activation, signature.joints)
    if detection.verdict.outcome == "alarm":
        raise SignatureError(f"alarm at {detection.verdict.alarms[0].time:.3f} s: not an impact-free run")
    if detection.verdict.outcome == "not assessable":
        raise SignatureError(f"not assessable: {detection.verdict.reason}")
    index = next(
        i for i, item in enumerate(signature.current) if item.motion.matches(operation.motion, SPEED_TOLERANCE)
    )
    recording = operation.recording.without_ground_truth()
    signal = run_detector(operation, machine, detector, signature.joints)
    updated = signature.current[index].with_run(recording, signal, forget)
    return with_run(signature, index, updated, run)


def _learned_run(operation: Operation) -> LearnedRun:
    return LearnedRun(operation.name, operation.recording.digest, operation.number)


def _by_class(pairs: Sequence[tuple[Operation, Signal]]) -> list[list[tuple[Operation, Signal]]]:
    classes: list[list[tuple[Operation, Signal]]] = []
    for pair in pairs:
        for members in classes:
            if pair[0].motion.matches(members[0][0].motion, 2.0 * SPEED_TOLERANCE):
                members.append(pair)
                break
        else:
            classes.append([pair])
    return classes
