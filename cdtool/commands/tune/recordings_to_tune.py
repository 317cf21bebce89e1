"""The recordings of a benchmark file that detectors are tuned on, each in a fold."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import counted
from cdtool.commands.judging.log_groups import Split, split_names
from cdtool.commands.judging.matched_log import CutLog, contacts_by_operation, force_curves
from cdtool.commands.judging.runs import Runs, load_runs
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.scoring import logs_to_score
from cdtool.commands.tune.search.recordings import FreeRun, StruckLog, TuningRecordings
from cdtool.execution.workers import Workers, in_order
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.results import RecordingFinding, Skipped

# A choice is checked on a fifth of the recordings, five times: four fifths still set a limit.
FOLDS = 5
# To check a limit on runs that did not set it, a fifth of them is set aside.
_TO_CHECK = FOLDS / (FOLDS - 1)


@dataclass(frozen=True)
class ReadRecordings:
    """The runs learned from as they were read, and the recordings to tune on with what was left out of them."""

    runs: Runs
    recordings: TuningRecordings
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]


def read_recordings(setup: BenchmarkFile, budget: Budget, seed: int, workers: Workers) -> ReadRecordings:
    """Read the impact-free runs and the logs with contacts of a benchmark file.

    The hold-out and changed conditions of the machine are not touched: they show what was tuned as it is for others.

    Raises UsageError if there are too few runs for the budget, or no contacts.
    """
    runs = load_runs(setup.learn, setup.machine_file, setup.run_reading(workers))
    check_enough(budget, runs.operations)
    listed = [(name, path) for name in setup.groups_of_impacts for path in setup.impacts[name].logs]
    read = in_order(_Reading(setup), listed, len(listed), workers)
    struck: list[StruckLog] = []
    skipped: list[Skipped] = []
    for made in read:
        struck += [item for item in made if isinstance(item, StruckLog)]
        skipped += [item for item in made if isinstance(item, Skipped)]
    if not struck:
        raise UsageError(f"{setup.path}: no contact to tune on", "add logs with contacts under [impacts], or [inject]")
    checkable = is_checkable(budget, runs.operations)
    recordings = in_folds(runs.operations, struck, setup.split, seed, budget, is_nested=checkable)
    changed = len({item.condition for item in setup.conditions})
    unused = [Finding("conditions_not_tuned_on", "", {"count": changed})] if changed else []
    findings = (*runs.findings, *(RecordingFinding.of(str(setup.path), item) for item in unused))
    return ReadRecordings(runs, recordings, (*runs.skipped, *skipped), findings)


@dataclass(frozen=True)
class _Reading:
    """Reads a log with contacts, given with its group, or each of its runs."""

    setup: BenchmarkFile

    def __call__(self, item: tuple[str, Path]) -> list[StruckLog | Skipped]:
        group, path = item
        found: list[StruckLog | Skipped] = []
        for log in logs_to_score(self.setup, group, path):
            found += [log] if isinstance(log, Skipped) else [*self._struck(group, path, log)]
        return found

    def _struck(self, group: str, path: Path, log: CutLog) -> list[StruckLog | Skipped]:
        rules = self.setup.rules_of(group)
        inside: list[tuple[Contact, ...]] = [
            tuple(contact for contact in contacts if not contact.in_progress)
            for contacts in contacts_by_operation(log.operations, log.contacts)
        ]
        if not any(inside):
            return [Skipped(log.recording.name, "no contact with a known onset is inside an operation")]
        curves, _ = force_curves(log.recording, log.contacts, rules.mass_before_cell)
        number = {contact: index for index, contact in enumerate(log.contacts, 1)}
        of_contacts = tuple(tuple(curves.get(number[contact]) for contact in contacts) for contacts in inside)
        made_from = self.setup.impacts[group].made_from.get(path)
        source = "" if made_from is None else str(made_from)
        return [StruckLog(tuple(log.operations), tuple(inside), of_contacts, group, rules.window, 0, source)]


def check_enough(budget: Budget, operations: Sequence[Operation]) -> None:
    """Raise UsageError if there are too few impact-free runs to set a limit for the budget, with how many are needed.

    A budget per hour is checked with the time that a detector could monitor.
    """
    if budget.per != "operation" or len(operations) >= budget.needed:
        return
    many = counted(len(operations), "impact-free run")
    needed = f"{budget.needed:.0f} are needed to set the limit, {to_check(budget):.0f} to check it"
    sure = ""
    if budget.confidence is None:
        sure = f", {Budget(budget.rate, budget.per, 0.95).needed:.0f} to be 95 % sure of it"
    hint = "add runs to [learn], or choose a larger budget"
    raise UsageError(f"{many} for a false-alarm budget of {budget}: {needed}{sure}", hint)


def to_check(budget: Budget) -> float:
    """Return the exposure that is needed to set a limit without a fifth of it, and to check it on that."""
    exchangeable = budget.needed + 1.0 if budget.per == "operation" and budget.confidence is None else budget.needed
    return math.ceil(_TO_CHECK * exchangeable - 1e-9) if budget.per == "operation" else _TO_CHECK * exchangeable


def is_checkable(budget: Budget, operations: Sequence[Operation]) -> bool:
    """Return whether there are enough runs to check a limit on runs that did not set it."""
    if budget.per == "operation":
        return len(operations) >= to_check(budget)
    return sum(item.recording.duration for item in operations) / 3600.0 >= to_check(budget)


def in_folds(
    free: Sequence[Operation],
    struck: Sequence[StruckLog],
    split: Split,
    seed: int,
    budget: Budget,
    *,
    is_nested: bool,
) -> TuningRecordings:
    """Return the recordings dealt to up to five folds, in an order that depends on their content and the seed only.

    Contacts of each group are dealt evenly. What stays together by `split` is in one fold, and so are parts of one
    recording, and injected contacts with the impact-free log that they were put into. Raises UsageError as
    `split_names`.
    """

    def order(operation: Operation) -> tuple[str, int, str]:
        own = hashlib.sha256(f"{seed} {operation.recording.digest}".encode()).hexdigest()
        return own, operation.number, operation.name

    ordered = sorted(free, key=order)
    learned = {item.whole.source: item for item in ordered}
    origin_of = {id(log): _origin(log, learned) for log in struck}
    names: dict[int, str] = {}
    if split is not Split.RECORDING:
        split_names(split, ordered)
        both = [*ordered, *origin_of.values()]
        names = dict(zip(map(id, both), split_names(split, both), strict=True))
    fold_of: dict[str, int] = {}

    def fold(operation: Operation, dealt: int) -> int:
        name = names.get(id(operation)) or operation.whole.digest or operation.whole.name
        return fold_of.setdefault(name, dealt % FOLDS)

    runs = [FreeRun(item, fold(item, len(fold_of))) for item in ordered]
    by_group: dict[str, list[StruckLog]] = {}
    for log in struck:
        by_group.setdefault(log.group, []).append(log)
    placed = []
    for members in by_group.values():
        for number, log in enumerate(sorted(members, key=lambda item: order(item.operations[0]))):
            placed.append((log, fold(origin_of[id(log)], number if not names else len(fold_of))))
    made = TuningRecordings(
        tuple(runs),
        tuple(replace(log, fold=number) for log, number in placed),
        max(number + 1 for number in fold_of.values()),
        is_nested=True,
    )
    return replace(made, is_nested=is_nested and not made.why_not_nested(budget))


def _origin(log: StruckLog, learned: Mapping[str, Operation]) -> Operation:
    """Return the operation whose fold a log is in: the impact-free one its contacts were put into, or its own."""
    first = log.operations[0]
    if not log.made_from or log.made_from in learned:
        return learned.get(log.made_from, first)
    # The log is not learned from: what was put into it stays together, under its name.
    return replace(first, recording=replace(first.whole, source=log.made_from, name=log.made_from, digest=""), log=None)
