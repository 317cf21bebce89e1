"""Check the coverage and drift of a signature, and add runs to it without learning a fault.

What to do with a signature, from the coverage of its runs and the drift of a season.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

from cdtool.alarms.pipeline import detect_operation, run_detector
from cdtool.base.errors import CdtoolError, SignatureError, UsageError
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.runs import RunReading, load_runs, several_logs
from cdtool.commands.judging.settings_table import UpkeepTable, read_settings
from cdtool.commands.learning.fitting import Pair, signals_of
from cdtool.commands.learning.learning import learned_run
from cdtool.commands.learning.normal_runs import with_operation
from cdtool.commands.signature.coverage import SignatureCoverage, check_coverage
from cdtool.commands.signature.drift import DriftAudit, audit_drift
from cdtool.commands.signature.words import place_of
from cdtool.execution.workers import Workers
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.formats.signature_file import SignatureFile, with_run
from cdtool.formats.signature_store import read_signature, rewrite_signature
from cdtool.machines.dynamics import Machine
from cdtool.recordings.motion.motion_class import MotionClass
from cdtool.recordings.motion.speed_course import TOLERANCE
from cdtool.recordings.operations import Operation
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.statistics.trends import LEAST_RUNS
from cdtool.thresholds.common_class import SPEED_TOLERANCE
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.guarded_update import CAP, RESERVE, guarded
from cdtool.thresholds.signature import Signature


def advice(coverage: SignatureCoverage | None, drift: DriftAudit | None) -> str:
    """Return what to do with a signature, the most urgent step first.

    Parameters
    ----------
    coverage : Coverage or None
        What the runs show that it was learned from.
    drift : DriftAudit or None
        What the runs since then show.

    Returns
    -------
    str
        One line.

    Notes
    -----
    Resistance that grows at one location comes before everything: relearned, an obstruction would be normal. Then a
    drift of the whole stroke; too few runs are reported only if neither is shown, because a relearned signature is
    checked again. Alarms without a drift are left to `cdtool explain`. A season that is too short to show a drift is
    not a reason to keep a signature.

    Examples
    --------
    >>> advice(None, None)
    'nothing was assessable'
    """
    if coverage is None and drift is None:
        return "nothing was assessable"
    steps = []
    if drift is not None:
        steps += _inspect(drift)
        if any(item.overall and (item.overall.outward or not item.two_sided) for item in drift.joints):
            steps.append("relearn from the latest runs" if not steps else "then relearn")
        elif drift.alarms and not steps:
            steps.append("analyse the alarms with cdtool explain: no drift is shown")
    if coverage is not None and not coverage.enough and (drift is None or not drift.drifts):
        steps.append(_more(coverage))
    if not steps and coverage is None and drift is not None and not any(item.course.trend for item in drift.joints):
        return f"too few runs for advice: give at least {LEAST_RUNS} new ones, or those learned from"
    return "; ".join(steps) if steps else "keep the signature"


def _inspect(drift: DriftAudit) -> list[str]:
    places = dict.fromkeys(
        place_of(item.local.place, drift.axis, drift.unit)
        for item in drift.joints
        if item.local is not None and item.local.place is not None
    )
    return [f"inspect the machine {' and '.join(places)} before anything is learned"] if places else []


def _more(coverage: SignatureCoverage) -> str:
    if coverage.more_runs is None:
        return "raise the safety factor, or add runs and check again"
    return f"add at least {coverage.more_runs} runs, or raise the safety factor"


# False-alarm probability per operation that the runs must demonstrate, and the smallest one that can be required.
TARGET, LEAST_TARGET = 1e-3, 1e-9


@dataclass(frozen=True)
class CheckedClass:
    """One class of motion: coverage by the runs learned from, drift in later runs; None without such runs.

    `signature` is the current one, `first` the one first learned.
    """

    signature: FittedSignature
    first: FittedSignature
    coverage: SignatureCoverage | None
    drift: DriftAudit | None

    @property
    def advice(self) -> str:
        """Return what to do, in one line."""
        return advice(self.coverage, self.drift)


@dataclass(frozen=True, repr=False)
class Checked:
    """The result of checking a signature, per class, and what was left out."""

    file: SignatureFile
    classes: tuple[CheckedClass, ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]

    def __repr__(self) -> str:
        return f"Checked({self.file!r}: {'; '.join(item.advice for item in self.classes)})"


@dataclass(frozen=True, repr=False)
class Updated:
    """A signature file after an update, the runs added, those refused with the reason, and warnings about the logs."""

    file: SignatureFile
    added: tuple[str, ...]
    refused: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...] = ()

    def __repr__(self) -> str:
        return f"Updated({self.file!r}: {len(self.added)} added, {len(self.refused)} refused)"


def signatures_in(file: SignatureFile) -> tuple[tuple[FittedSignature, FittedSignature], ...]:
    """Return the current and the first signature of each class; SignatureError if the file has another threshold.

    A threshold without a curve along the stroke cannot be compared with the runs of a season.
    """
    pairs: list[tuple[FittedSignature, FittedSignature]] = []
    for current, first in zip(file.current, file.first, strict=True):
        ours = isinstance(file.rule, Signature)
        if not ours or not isinstance(current, FittedSignature) or not isinstance(first, FittedSignature):
            raise SignatureError(
                f"{file.source or 'file'}: contains the threshold {file.threshold}, not a signature",
                "relearn it with learn-signature: such a threshold cannot be updated run by run",
            )
        pairs.append((current, first))
    return tuple(pairs)


def no_signature_for(motion: MotionClass, signatures: Sequence[FittedSignature]) -> str:
    """Return in words why none of the signatures is compared with a run of this class of motion.

    Between speeds learned with `speed_range` a run is assessed, but there is no level of its own to have drifted from.
    """
    ours = (motion.direction, motion.joint)
    of_range = [item.motion for item in signatures if item.speed_range]
    speeds = [item.nominal_speed for item in of_range if (item.direction, item.joint) == ours]
    if speeds and min(speeds) < motion.nominal_speed < max(speeds):
        return f"runs {motion.described}, between learned speeds: only runs at a learned speed are compared"
    return f"no signature for its class: runs {motion.described}"


def check_signature(  # the public function: a keyword for each setting
    path: str | Path,
    logs: Sequence[str | Path],
    machine: str | Path | MachineFile,
    *,
    target: float = TARGET,
    settings: Mapping[str, Any] | None = None,
    jobs: int = 1,
    workers: Workers | None = None,
) -> Checked:
    """Check a signature against impact-free logs: do its runs suffice, and has the machine drifted since?

    Parameters
    ----------
    path : str or Path
        The signature file.
    logs : sequence of str or Path
        Impact-free logs in order of time; those that the signature was learned from are recognised by content.
    machine : str, Path or MachineFile
        The machine file.
    target : float, optional
        The chance of a false alarm per operation that the runs have to show.
    settings : mapping, optional
        Values in place of the defaults of [onset], as {"onset.above_n": 20.0}; a run with a contact is left out. And of
        [execution].
    jobs : int, optional
        Number of logs read at a time.
    workers : Workers, optional
        In place of `jobs`: also the longest time for a log, how often it is tried again, or a cluster.

    Returns
    -------
    Checked
        For each class of motion the coverage (each run learned from is assessed by a signature of the others), the
        drift in the other logs, and advice.

    Raises
    ------
    SignatureError
        The file does not belong to the machine, or contains another threshold.
    UsageError
        The target is not a chance.
    CdtoolError
        No log can be read.

    Examples
    --------
    >>> import cdtool
    >>> from cdtool.formats.signature_store import write_signature
    >>> from pathlib import Path
    >>> free, machine = sorted(Path("sample_logs/gate/free").iterdir()), "sample_logs/gate/machine.toml"
    >>> write_signature("gate.gm.json", cdtool.learn_signature(free, machine, "momentum").signature)
    >>> coverage = cdtool.check_signature("gate.gm.json", free, machine).classes[0].coverage
    >>> len(coverage.runs), coverage.alarms, coverage.enough
    (10, 0, True)
    """
    if not LEAST_TARGET <= target < 1.0:
        raise UsageError(f"target is {target:g}", f"give a probability from {LEAST_TARGET:g} to below 1")
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    file = read_signature(path)
    signatures = signatures_in(file)
    detector = machine_file.detector(file.detector)
    file.check(machine_file.machine, detector)
    reading = _reading(file, settings, workers or Workers(jobs))
    runs = load_runs([location(log) for log in several_logs(logs)], machine_file, reading, file.plausible)
    pairs, unusable = signals_of(runs.operations, machine_file.machine, detector, file.joints, runs.skipped)
    skipped = [*runs.skipped, *unusable]
    known = {(run.sha256, run.operation) for run in file.runs}
    learned = [(item.recording.digest, item.number) in known for item, _ in pairs]
    if 0 < sum(learned) < len(file.runs):
        some = f"only {sum(learned)} of the {counted(len(file.runs), 'run')} learned from are given"
        skipped.append(Skipped(str(path), f"{some}; coverage is that of a signature of these runs only"))
    classes, served = [], set()
    for current, first in signatures:
        own = [i for i, (item, _) in enumerate(pairs) if current.motion.matches(item.motion, SPEED_TOLERANCE)]
        served.update(own)
        taught, season = (
            [pairs[i] for i in own if learned[i]],
            [pairs[i] for i in own if not learned[i]],
        )
        classes.append(
            CheckedClass(
                current,
                first,
                _tried(
                    partial(check_coverage, taught, _rule_of(file, current), file.activation, target), taught, skipped
                ),
                _tried(partial(audit_drift, current, season, file.activation), season, skipped),
            )
        )
    skipped += [
        Skipped(item.name, no_signature_for(item.motion, [current for current, _ in signatures]))
        for i, (item, _) in enumerate(pairs)
        if i not in served
    ]
    return Checked(file, tuple(classes), tuple(skipped), runs.findings)


def _rule_of(file: SignatureFile, current: FittedSignature) -> Signature:
    """Return the rule as used by the file: with the safety factor set by a budget, and for any number of runs."""
    return replace(cast(Signature, file.rule), safety_factor=current.safety_factor, force=True)


def _tried(work: Any, pairs: Sequence[Pair], skipped: list[Skipped]) -> Any:
    """Return the result of the work; None without runs, or if there are too few, which is reported."""
    if not pairs:
        return None
    try:
        return work()
    except SignatureError as fault:
        skipped.append(Skipped(f"{counted(len(pairs), 'run')}, {pairs[0][0].name} first", str(fault)))
        return None


def update_signature(  # noqa: PLR0913  # the public function: a keyword for each setting
    path: str | Path,
    logs: Sequence[str | Path],
    machine: str | Path | MachineFile,
    *,
    forget: float | None = None,
    cap: float = CAP,
    reserve: float = RESERVE,
    settings: Mapping[str, Any] | None = None,
    jobs: int = 1,
    workers: Workers | None = None,
) -> Updated:
    """Add impact-free runs to a signature file.

    Parameters
    ----------
    path : str or Path
        The signature file; it is replaced.
    logs : sequence of str or Path
        Impact-free logs in order of time; those that the signature was learned from are recognised by content.
    machine : str, Path or MachineFile
        The machine file.
    forget : float, optional
        Effective number of runs, above 1: older runs are forgotten. By default all runs count equally.
    cap : float, optional
        The deviation of a run counts up to this many spreads.
    reserve : float, optional
        No run may move a limit further than this many spreads from where it was first learned.
    settings : mapping, optional
        Values in place of the defaults of [onset], as {"onset.above_n": 20.0}; a run with a contact is left out. And of
        [execution].
    jobs : int, optional
        Number of logs read at a time.
    workers : Workers, optional
        In place of `jobs`: also the longest time for a log, how often it is tried again, or a cluster.

    Returns
    -------
    Updated
        The new content, the runs added, and those refused with the reason: a run that moves a limit too far, has an
        alarm or a contact, is already in the signature, ends early or is not assessable.

    Raises
    ------
    SignatureError
        The file does not belong to the machine, or contains another threshold.
    UsageError
        A setting is outside its range.

    Notes
    -----
    Mean and variance are updated by Welford's recursion, or with `forget` by exponential forgetting.

    Examples
    --------
    >>> import cdtool
    >>> from cdtool.formats.signature_store import write_signature
    >>> from pathlib import Path
    >>> free, machine = sorted(Path("sample_logs/gate/free").iterdir()), "sample_logs/gate/machine.toml"
    >>> write_signature("season.json", cdtool.learn_signature(free, machine, "momentum").signature)
    >>> updated = cdtool.update_signature("season.json", ["sample_logs/gate/holdout/03.csv", free[0]], machine)
    >>> len(updated.added), [skipped.reason for skipped in updated.refused]
    (1, ['this run is already in the signature'])
    """
    if forget is not None and not forget > 1.0:
        raise UsageError(f"forget is {forget:g}", "give an effective number of runs above 1, e.g. 20 to 50")
    for name, value in (("cap", cap), ("reserve", reserve)):
        if not value > 0.0:
            raise UsageError(f"{name} is {value:g}", "give a number of spreads above 0")
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    stored = read_signature(path)
    detector = machine_file.detector(stored.detector)
    reading = _reading(stored, settings, workers or Workers(jobs))
    runs = load_runs([location(log) for log in several_logs(logs)], machine_file, reading, stored.plausible)
    added: list[str] = []
    refused = list(runs.skipped)

    def change(file: SignatureFile) -> SignatureFile:
        signatures_in(file)
        file.check(machine_file.machine, detector)
        for operation in runs.operations:
            try:
                file = _with_operation(file, operation, machine_file.machine, detector, (forget, cap, reserve))
                added.append(operation.name)
            except CdtoolError as fault:
                refused.append(Skipped(operation.name, str(fault)))
        return file

    return Updated(rewrite_signature(path, change), tuple(added), tuple(refused), runs.findings)


def _reading(file: SignatureFile, settings: Mapping[str, Any] | None, workers: Workers) -> RunReading:
    """Return how logs are read: cut as for learning, since strokes cut differently are not comparable."""
    table, place = read_settings(UpkeepTable, settings or {})
    place.finish()
    workers = workers.limited_by(table.execution)
    return RunReading(file.operations, onset=table.onset, workers=workers)


def _with_operation(
    file: SignatureFile, operation: Operation, machine: Machine, detector: Any, guard: tuple[float | None, float, float]
) -> SignatureFile:
    run = learned_run(operation)
    if any((item.sha256, item.operation) == (run.sha256, run.operation) for item in file.runs):
        raise SignatureError("this run is already in the signature")
    detection = detect_operation(operation, machine, detector, file.current, file.activation, file.joints)
    if detection.verdict.outcome == "alarm":
        raise SignatureError(f"alarm at {detection.verdict.alarms[0].time:.3f} s: not an impact-free run")
    if detection.verdict.outcome == "not_assessable":
        raise SignatureError(f"not assessable: {detection.verdict.reason}")
    pairs = signatures_in(file)
    # With `speed_range` a run between two classes is assessed, too, and would teach the nearer one another speed.
    tolerance = TOLERANCE if pairs[0][0].speed_range else SPEED_TOLERANCE
    own = [i for i, (item, _) in enumerate(pairs) if item.motion.matches(operation.motion, tolerance)]
    if not own:
        known = " and ".join(item.motion.described for item, _ in pairs)
        raise SignatureError(f"no signature for its class: runs {operation.motion.described}, learned {known}")
    index = own[0]
    current, first = pairs[index]
    recording = operation.recording.without_ground_truth()
    forget, cap, reserve = guard
    signal = run_detector(operation, machine, detector, file.joints)
    updated = guarded(first, current, recording, signal, forget, cap, reserve)
    return with_run(file, index, updated, run, with_operation(file, operation, cap, forget))
