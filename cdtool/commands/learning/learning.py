"""Learn a threshold from impact-free logs for a signature file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cdtool.alarms.activation import Activation
from cdtool.base.errors import UsageError
from cdtool.base.remote.remote_path import location
from cdtool.base.settings import Place
from cdtool.commands.judging.log_groups import Split
from cdtool.commands.judging.part_to_learn_from import PartToLearnFrom
from cdtool.commands.judging.runs import RunReading, Runs, load_runs, several_logs
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.settings_table import LearningTable, read_settings
from cdtool.commands.learning.calibration import calibrate, in_fixed_order, kept
from cdtool.commands.learning.fitting import fitting, for_machine, signals_of, with_left_out
from cdtool.commands.learning.normal_runs import normal_motions
from cdtool.detectors.base import Detector
from cdtool.execution.workers import Workers
from cdtool.formats.machine_file import MachineFile, fingerprint, machine_parameters, read_machine_file
from cdtool.formats.signature_file import FactorOrigin, LearnedRun, SignatureFile
from cdtool.formats.signature_store import read_signature, write_signature
from cdtool.machines.dynamics import Machine
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.thresholds.base import Threshold, set_by_hand
from cdtool.thresholds.signature import Signature


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
        return f"LearnedSignature({self.signature.detector}, {self.signature.threshold}: {classes}{skipped})"

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
    settings: Mapping[str, Any] | None = None,
    false_alarm_budget: str | None = None,
    jobs: int = 1,
    workers: Workers | None = None,
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
        Any threshold with its settings, in place of the keys `threshold` and `signature`; by default a `Signature`.
    settings : mapping, optional
        Values in place of the defaults of keys of the benchmark file, as `--set` has them: {"signature.sides": "two",
        "operations": "motion", "learn.until": "onset", "to": "3s"}.
    false_alarm_budget : str, optional
        As "1/300op" or "0.1/h": sets the safety factor by cross-validation on these runs.
    jobs : int, optional
        Number of logs read at a time.
    workers : Workers, optional
        In place of `jobs`: also the longest time for a log, how often it is tried again, or a cluster.

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
    budget = Budget.parse(false_alarm_budget) if false_alarm_budget is not None else None
    table, place = read_settings(LearningTable, settings or {})
    table.check_joints(place, machine_file.machine)
    place.tried(None, table.run_cut, place)
    section, rules = place.tried(LogSection(), table.section, place), place.tried(ScoringRules(), table.rules, place)
    otherwise: Threshold = Signature()
    wanted = place.tried(otherwise, _rule, rule, table, machine_file.machine, place)
    place.finish()
    instance = machine_file.detector(detector)
    _refuse_by_hand(wanted, budget)
    paths = [location(log) for log in several_logs(logs)]
    guard = table.learn.guard
    part = PartToLearnFrom(rules, dict.fromkeys(paths, section), guard)
    workers = (workers or Workers(jobs)).limited_by(table.execution)
    reading = RunReading(
        table.operations,
        onset=rules.onset,
        part=part if guard is not None or section or rules.labels else None,
        workers=workers,
    )
    runs = load_runs(paths, machine_file, reading)
    setting = Setting(table.joints, table.operations, table.activation, budget, table.learn.split)
    return learned_from_runs(runs, machine_file, instance, wanted, setting)


def _rule(rule: Threshold | None, table: LearningTable, machine: Machine, place: Place) -> Threshold:
    """Return the threshold to learn: a given one, or that of the settings. Raises ConfigurationError."""
    if rule is None:
        return table.rule(place, table.signature.sided(machine.default_sides))
    for name in ("threshold", "signature"):
        if any(key.partition(".")[0] == name for key in place.by_option):
            place.note(name, "cannot be combined with the argument rule", "omit one of the two")
    return for_machine(rule, machine)


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
