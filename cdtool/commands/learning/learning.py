"""Learn a threshold from impact-free logs for a signature file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cdtool.alarms.activation import Activation, ActivationSettings
from cdtool.base.errors import UsageError
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.log_groups import Split
from cdtool.commands.judging.part_to_learn_from import PartToLearnFrom
from cdtool.commands.judging.runs import RunReading, Runs, check_joints, load_runs, several_logs
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.learning.calibration import calibrate, in_fixed_order, kept
from cdtool.commands.learning.fitting import fitting, for_machine, signals_of, with_left_out
from cdtool.commands.learning.normal_runs import normal_motions
from cdtool.commands.learning.threshold_settings import set_by_hand
from cdtool.detectors.base import Detector
from cdtool.execution.workers import Progress, Workers
from cdtool.formats.machine_file import MachineFile, fingerprint, machine_parameters, read_machine_file
from cdtool.formats.signature_file import FactorOrigin, LearnedRun, SignatureFile
from cdtool.formats.signature_store import read_signature, write_signature
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.signature import Signature
from cdtool.truth.onset import OnsetRule


@dataclass(frozen=True)
class LearnedSignature:
    """The content of a signature file, the number of runs per class (None: all classes), and what was left out."""

    signature: SignatureFile
    runs: tuple[tuple[MotionClass | None, int], ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]

    def __repr__(self) -> str:
        classes = ", ".join(
            f"{motion.described if motion else 'any motion'} from {runs} runs" for motion, runs in self.runs
        )
        skipped = f", {len(self.skipped)} left out" if self.skipped else ""
        return f"Learned({self.signature.detector}, {self.signature.threshold}: {classes}{skipped})"

    def save(self, path: str | Path) -> None:
        """Write the signature file, as `cdtool learn-signature -o` does; raises SignatureError."""
        write_signature(path, self.signature)


def signature_of(given: str | Path | LearnedSignature | SignatureFile) -> SignatureFile:
    """Return the content of a signature file, read or just learned; raises SignatureError."""
    if isinstance(given, LearnedSignature):
        return given.signature
    return given if isinstance(given, SignatureFile) else read_signature(given)


def learn_signature(  # noqa: PLR0913  # the public function: a keyword for each setting
    logs: Sequence[str | Path],
    machine: str | Path | MachineFile,
    detector: str | Detector,
    *,
    rule: Threshold | None = None,
    joints: Sequence[str] = (),
    section: LogSection = LogSection(),
    guard: float | None = None,
    operations: str = "whole",
    activation: ActivationSettings | None = None,
    false_alarm_budget: str | None = None,
    onset: OnsetRule | None = None,
    jobs: int = 1,
    workers: Workers | None = None,
    progress: Progress | None = None,
) -> LearnedSignature:
    """Learn the threshold of one detector from impact-free logs.

    Parameters
    ----------
    logs : sequence of str or Path
        Impact-free logs.
    machine : str, Path or MachineFile
        The machine file.
    detector : str or Detector
        Name or short name of the detector, or a detector of your own.
    rule : Threshold, optional
        Any threshold with its settings; by default a `Signature`.
    joints : sequence of str, optional
        The joints to monitor; all by default.
    section : LogSection, optional
        The part of each log that is learned from; the whole log by default.
    guard : float, optional
        Learn from each log up to this long [s] before its first contact on the load cell, label or event; by default a
        run with a contact is left out.
    operations : str, optional
        How the logs are cut into operations: whole, motion or trigger; or into runs: column:NAME, label:NAME or
        clock-reset.
    activation : ActivationSettings, optional
        Settings of the activation that replace the default: debounce [samples], rearm [s], hysteresis [share], latch.
    false_alarm_budget : str, optional
        As "1/300op" or "0.1/h": sets the safety factor by cross-validation on these runs.
    onset : OnsetRule, optional
        The rule by which a contact shows on the load cell; a run with a contact is left out.
    jobs : int, optional
        Number of logs read at a time.
    workers : Workers, optional
        In place of `jobs`: also the longest time for a log, how often it is tried again, or a cluster.
    progress : callable, optional
        Called after each log with the number done and the total.

    Returns
    -------
    LearnedSignature
        The content of a signature file, with one threshold per class of motion if the rule distinguishes classes, and
        the runs left out. `save` writes the file; `cdtool.detect` also takes it as it is.

    Raises
    ------
    SignatureError
        There are too few runs, or the detector is not assessable in them.
    UsageError
        No log is given, or a path in place of a list; there are too few runs for the false-alarm budget, or the safety
        factor is set twice.
    CdtoolError
        No log can be read.

    Examples
    --------
    >>> import cdtool
    >>> from pathlib import Path
    >>> free = sorted(Path("sample_logs/gate/free").iterdir())
    >>> learned = cdtool.learn_signature(free, "sample_logs/gate/machine.toml", "momentum")
    >>> [(motion.described, runs) for motion, runs in learned.runs]
    [('forward at 0.201 m/s', 10)]
    """
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    raised_by = Activation().changed(activation or {})  # refuses wrong settings before reading
    budget = Budget.parse(false_alarm_budget) if false_alarm_budget is not None else None
    check_joints(joints, machine_file.machine)
    instance = machine_file.detector(detector)
    wanted = for_machine(Signature() if rule is None else rule, machine_file.machine)
    _refuse_by_hand(wanted, budget)
    paths = [location(log) for log in several_logs(logs)]
    if guard is not None and not guard >= 0.0:
        raise UsageError(f"guard is {guard:g} s", "give 0 s or more")
    part = None
    if guard is not None or section:
        part = PartToLearnFrom(ScoringRules(onset or OnsetRule()), dict.fromkeys(paths, section), guard)
    reading = RunReading(operations, onset=onset, part=part, workers=workers or Workers(jobs), progress=progress)
    runs = load_runs(paths, machine_file, reading)
    return learned_from_runs(
        runs, machine_file, instance, wanted, Setting(joints, operations, raised_by, budget, Split.RECORDING)
    )


@dataclass(frozen=True)
class Setting:
    """What a signature is learned with beside its rule: joints, how logs are cut, activation, budget, and its folds."""

    joints: Sequence[str]
    operations: str
    activation: Activation
    budget: Budget | None
    split: Split


def learned_from_runs(
    runs: Runs, machine_file: MachineFile, instance: Any, rule: Threshold, setting: Setting
) -> LearnedSignature:
    """Learn the threshold of a detector from runs that have been read; raises as `learn_signature`."""
    joints, operations, budget = setting.joints, setting.operations, setting.budget
    pairs, skipped = signals_of(runs.operations, machine_file.machine, instance, joints, runs.skipped)
    fit = fitting(rule)
    fitted = with_left_out(fit, [*runs.skipped, *skipped])(pairs)
    thresholds, origin = fitted.thresholds, FactorOrigin("hand" if set_by_hand(rule) else "default")
    if budget:
        made = calibrate(
            budget, instance.name, in_fixed_order(kept(pairs, fitted)), fit, setting.activation, setting.split
        )
        thresholds = tuple(item.with_safety_factor(made.factor) for item in thresholds)
        origin = FactorOrigin("budget", str(budget), made.operations, made.alarms)
    signature = SignatureFile(
        machine=machine_file.machine.name,
        machine_fingerprint=fingerprint(machine_file.machine),
        detector=instance.name,
        gains=asdict(instance),
        unit=instance.unit(machine_file.machine),
        joints=pairs[0][1].joints,
        rule=rule,
        origin=origin,
        activation=setting.activation,
        current=thresholds,
        first=thresholds,
        runs=tuple(learned_run(operation) for operation in fitted.used),
        operations=operations,
        plausible=runs.ranges.all,
        normal=normal_motions(fitted.used),
        machine_parameters=machine_parameters(machine_file.machine),
    )
    counts = zip((getattr(item, "motion", None) for item in thresholds), map(len, fitted.learned_from), strict=True)
    findings = (*runs.findings, *fitted.findings(rule, instance.name))
    return LearnedSignature(signature, tuple(counts), (*runs.skipped, *skipped, *fitted.skipped), findings)


def _refuse_by_hand(rule: Threshold, budget: Budget | None) -> None:
    if budget and set_by_hand(rule):
        raise UsageError(
            f"a safety factor or limits set by hand cannot be combined with a false-alarm budget {budget}",
            "give one of the two",
        )


def learned_run(operation: Operation) -> LearnedRun:
    """Return the entry of an operation in the list of runs of a signature file."""
    return LearnedRun(operation.name, operation.recording.digest, operation.number)
