"""Learning a threshold from impact-free logs for a signature file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, asdict, dataclass
from pathlib import Path

from cdtool.activation import Activation, ActivationSettings
from cdtool.errors import UsageError
from cdtool.evaluation.false_alarm_budget import Budget
from cdtool.evaluation.results import RecordingFinding, Skipped
from cdtool.evaluation.truth.onset import OnsetRule
from cdtool.machine_file import MachineFile, fingerprint, read_machine_file
from cdtool.motion import MotionClass
from cdtool.operations import Operation
from cdtool.signature_file import FactorOrigin, LearnedRun, SignatureFile
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.signature import Signature
from cdtool.workflows.keyword_options import by_keywords
from cdtool.workflows.runs import Progress, RunReading, check_joints, load_runs
from cdtool.workflows.signature.calibration import calibrate, in_fixed_order, kept
from cdtool.workflows.signature.fitting import fitting, for_machine, signals_of, with_left_out
from cdtool.workflows.signature.normal_runs import normal_motions
from cdtool.workflows.signature.threshold_settings import set_by_hand


@dataclass(frozen=True)
class Learned:
    """A signature file's content, how many runs each class gave (None: all classes together), and what was left out."""

    signature: SignatureFile
    runs: tuple[tuple[MotionClass | None, int], ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]


@dataclass(frozen=True)
class LearningOptions:
    """The machine, the detector and how its threshold is learned.

    `rule` is any threshold's with its settings (safety factor, sides, alignment, force ...), a signature's where it is
    None; `joints` are those to watch, all where none is named; `operations`: whole, motion or trigger; `activation` are
    settings other than the default's. `false_alarm_budget`, as 1/300op or 0.1/h, sets the safety factor on these runs
    by cross-validation. A run in which the load cell shows a contact by the `onset` rule is left out.
    """

    machine: str | Path | MachineFile
    detector: str
    _: KW_ONLY
    rule: Threshold | None = None
    joints: Sequence[str] = ()
    operations: str = "whole"
    activation: ActivationSettings | None = None
    false_alarm_budget: str | None = None
    onset: OnsetRule | None = None
    jobs: int = 1
    progress: Progress | None = None


def learn(logs: Sequence[str | Path], options: LearningOptions) -> Learned:
    """Learn one detector's threshold from impact-free logs: a signature for each class of motion, or another rule.

    The options are those of `LearningOptions`. Raises SignatureError where runs are too few, UsageError where they are
    too few for the budget, CdtoolError where nothing can be read. Write the result with
    `cdtool.signature_store.write_signature`.
    """
    machine, joints, operations = options.machine, options.joints, options.operations
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    raised_by = Activation().changed(options.activation or {})  # refuses wrong settings before anything is read
    budget = Budget.parse(options.false_alarm_budget) if options.false_alarm_budget is not None else None
    check_joints(joints, machine_file.machine)
    wanted = for_machine(Signature() if options.rule is None else options.rule, machine_file.machine)
    _refuse_by_hand(wanted, budget)
    instance = machine_file.detector(options.detector)
    reading = RunReading(operations, onset=options.onset, jobs=options.jobs, progress=options.progress)
    runs = load_runs([Path(log) for log in logs], machine_file, reading)
    pairs, skipped = signals_of(runs.operations, machine_file.machine, instance, joints, runs.skipped)
    fit = fitting(wanted)
    fitted = with_left_out(fit, [*runs.skipped, *skipped])(pairs)
    thresholds, origin = fitted.thresholds, FactorOrigin("hand" if set_by_hand(wanted) else "default")
    if budget:
        made = calibrate(budget, instance.name, in_fixed_order(kept(pairs, fitted.skipped)), fit, raised_by)
        thresholds = tuple(item.with_safety_factor(made.factor) for item in thresholds)
        origin = FactorOrigin("budget", str(budget), made.operations, made.alarms)
    signature = SignatureFile(
        machine=machine_file.machine.name,
        machine_fingerprint=fingerprint(machine_file.machine),
        detector=instance.name,
        gains=asdict(instance),
        unit=instance.unit(machine_file.machine),
        joints=pairs[0][1].joints,
        rule=wanted,
        origin=origin,
        activation=raised_by,
        current=thresholds,
        first=thresholds,
        runs=tuple(learned_run(operation) for operation in fitted.used),
        operations=operations,
        plausible=runs.ranges,
        normal=normal_motions(fitted.used),
    )
    counts = zip((getattr(item, "motion", None) for item in thresholds), map(len, fitted.learned_from), strict=True)
    return Learned(signature, tuple(counts), (*runs.skipped, *skipped, *fitted.skipped), runs.findings)


learn_signature = by_keywords(LearningOptions, learn)


def _refuse_by_hand(rule: Threshold, budget: Budget | None) -> None:
    if budget and set_by_hand(rule):
        raise UsageError(
            f"a safety factor or limits set by hand, and a false-alarm budget {budget} that would set them",
            "give one of the two",
        )


def learned_run(operation: Operation) -> LearnedRun:
    """How a signature file notes an operation that it was learned from."""
    return LearnedRun(operation.name, operation.recording.digest, operation.number)
