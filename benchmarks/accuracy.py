"""Shared parts of the accuracy benchmarks: simulated runs in memory, detectors, signatures, scores, orders, rows.

Machine, gains, signature, onset and monitored joints are read from the machine.toml and benchmark.toml written by
`cdtool simulate`, so there is one definition. Only the recordings are not written to disk.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, stdev

from cdtool.alarms.pipeline import detect_operation
from cdtool.base.errors import NothingValidError
from cdtool.commands.learning.fitting import fit_operations
from cdtool.commands.scoring.benchmark_file import HOLDOUT, BenchmarkFile, read_benchmark_file
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import FittedThreshold
from cdtool.truth.matching import match
from cdtool.truth.onset import find_contacts

IMPACTS = ("stiff", "soft")
HEADS = ("missed", "false", "reference", "worst seed")
WITHIN = 0.25
FALSE_ALARMS_ALLOWED = 1


@dataclass(frozen=True)
class Bench:
    """A simulated machine: its two files, the number of runs per seed in each group, and one run as logged.

    `simulate` takes seed, group and number from 1.
    """

    setup: BenchmarkFile
    counts: Mapping[str, int]
    simulate: Callable[[int, str, int], Recording]


@dataclass(frozen=True)
class Cell:
    """One kind of impact in a table: title, group, and the reference [ms] by detector, fastest first."""

    title: str
    group: str
    reference: Mapping[str, float]
    average: Callable[[Sequence[float]], float] = mean

    def of(self, score: Score) -> float:
        """Return the average latency of a score [ms]; infinite without a detection."""
        latencies = score.latencies[self.group]
        return self.average(latencies) if latencies else float("inf")


@dataclass
class Score:
    """One detector on one seed: latencies [ms], misses and contacts not assessable by group, all its false alarms."""

    latencies: dict[str, list[float]] = field(default_factory=lambda: {group: [] for group in IMPACTS})
    missed: dict[str, int] = field(default_factory=lambda: dict.fromkeys(IMPACTS, 0))
    not_assessable: dict[str, int] = field(default_factory=lambda: dict.fromkeys(IMPACTS, 0))
    false_alarms: int = 0


Scores = Mapping[int, Mapping[str, Score]]
"""By seed and the detector's short name."""


def written_setup(write: Callable[[Path, Mapping[str, int]], int]) -> BenchmarkFile:
    """Return the benchmark file and machine file that a simulator writes with its recordings."""
    with tempfile.TemporaryDirectory() as folder:
        # The fewest runs of a valid benchmark: two to learn from, one of every other group, since groups cannot be
        # empty.
        write(Path(folder), {"free": 2, HOLDOUT: 1, **dict.fromkeys(IMPACTS, 1)})
        return read_benchmark_file(Path(folder) / "benchmark.toml")


def score_seed(bench: Bench, seed: int, detectors: Sequence[str]) -> dict[str, Score]:
    """Simulate every run of a seed and score each detector on all of them."""
    machine = bench.setup.machine_file.machine
    operations: dict[str, list[Operation]] = {}
    for group, count in bench.counts.items():
        logs = (bench.simulate(seed, group, number) for number in range(1, count + 1))
        operations[group] = [item for log in logs for item in operations_of(machine.referred_to_load(log))]
    return {name: _score(bench.setup, operations, name) for name in detectors}


def _score(setup: BenchmarkFile, operations: Mapping[str, Sequence[Operation]], name: str) -> Score:
    machine, detector = setup.machine_file.machine, setup.machine_file.detector(name)
    thresholds: tuple[FittedThreshold, ...] = ()
    try:
        fitted = fit_operations(operations["free"], machine, detector, setup.signature, watched=setup.watched)
        if fitted.skipped:
            sys.exit(f"error: {fitted.skipped[0].recording}: {fitted.skipped[0].reason}")
        thresholds = fitted.thresholds
    except NothingValidError:
        pass  # as in `cdtool benchmark`: without a band no contact is assessable
    score = Score()
    for group in (HOLDOUT, *IMPACTS):
        for operation in operations[group]:
            detection = detect_operation(operation, machine, detector, thresholds, setup.activation, setup.watched)
            contacts = [] if group == HOLDOUT else find_contacts(operation.recording, setup.onset)
            if len(contacts) != (group != HOLDOUT):
                sys.exit(f"error: {operation.name}: {len(contacts)} contacts found")
            matching = match(detection.verdict, contacts, detection.statistic)
            score.false_alarms += len(matching.false_alarms)
            for item in matching.matches:
                if item.outcome == "detected":
                    score.latencies[group].append(1e3 * item.latency)
                elif item.outcome == "missed":
                    score.missed[group] += 1
                else:
                    score.not_assessable[group] += 1
    return score


def rows(cell: Cell, scores: Scores) -> list[tuple[object, ...]]:
    """Return a row per detector: average of each seed and of all impacts, misses, false alarms, the reference."""
    return [_row(cell, name, [by_name[name] for by_name in scores.values()]) for name in next(iter(scores.values()))]


def _row(cell: Cell, name: str, of_seeds: Sequence[Score]) -> tuple[object, ...]:
    pooled = [latency for score in of_seeds for latency in score.latencies[cell.group]]
    average = f"{cell.average(pooled):.1f}" if pooled else "-"
    if cell.average is mean and len(pooled) > 1:
        average += f" +- {stdev(pooled):.1f}"
    # The references are means: next to a median they would mislead.
    reference = cell.reference.get(name) if cell.average is mean else None
    worst = max((cell.of(score) / reference - 1.0 for score in of_seeds), key=abs) if reference else 0.0
    return (
        f"{cell.title} {name}",
        *(f"{cell.of(score):.0f}" if score.latencies[cell.group] else "-" for score in of_seeds),
        average,
        sum(score.missed[cell.group] for score in of_seeds),
        sum(score.false_alarms for score in of_seeds),
        f"{reference:.1f}" if reference else "-",
        f"{100 * worst:+.0f} %" if reference else "-",
    )


def near(cell: Cell, scores: Scores) -> bool:
    """Whether every seed's average lies within WITHIN of the reference, for every detector that has one."""
    return all(
        abs(cell.of(by_name[name]) / reference - 1.0) <= WITHIN
        for by_name in scores.values()
        for name, reference in cell.reference.items()
    )


def ordered(cell: Cell, scores: Scores) -> bool:
    """Print the order of the detectors on every seed; return whether it is always that of the reference."""
    wanted = list(cell.reference)
    held = True
    for seed, by_name in scores.items():
        averages = {name: cell.of(by_name[name]) for name in wanted}
        order = sorted(wanted, key=lambda name: averages[name])
        good = order == wanted
        held &= good
        found = _chain(order)
        if not good:
            found += f"   wanted {_chain(wanted)}: {', '.join(f'{name} {averages[name]:.2f}' for name in order)}"
        print(f"{cell.title:5s} seed {seed}: {found}")
    return held


def order_wanted(cell: Cell) -> str:
    """Return the required order in words."""
    return f"order {cell.title} {'<'.join(cell.reference)}"


def _chain(names: Sequence[str]) -> str:
    return " < ".join(names)


def not_detected(cell: Cell, scores: Scores, detectors: Sequence[str]) -> int:
    """Return the contacts missed or not assessable, over all seeds and the named detectors."""
    of_all = (by_name[name] for by_name in scores.values() for name in detectors)
    return sum(score.missed[cell.group] + score.not_assessable[cell.group] for score in of_all)


def print_false_alarms(scores: Scores, where: str = "") -> None:
    """Return a line per detector with false alarms, by seed."""
    for name in next(iter(scores.values())):
        alarms = {seed: by_name[name].false_alarms for seed, by_name in scores.items()}
        if any(alarms.values()):
            print(
                f"false alarms of {name}{where}: " + ", ".join(f"{n} on seed {seed}" for seed, n in alarms.items() if n)
            )


def conclude(wanted: Sequence[tuple[str, bool]], seeds: Sequence[int]) -> int:
    """Print which requirements are met; return the exit status, 0 if all are."""
    held = all(good for _, good in wanted)
    print()
    for text, good in wanted:
        print(f"{'ok  ' if good else 'FAIL'}  {text}")
    print(
        f"{'ok  ' if held else 'FAIL'}  {'all' if held else 'not all'} of it held on seeds {' '.join(map(str, seeds))}"
    )
    return 0 if held else 1
