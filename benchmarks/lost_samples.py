"""Do lost samples raise false alarms, and what do they cost in latency? Every detector with every threshold.

    python benchmarks/lost_samples.py --machines gate      # 300 runs to learn from, 300 to judge; 40 minutes a machine
    python benchmarks/lost_samples.py --learn 30 --judge 30 --machines gate --detectors friction_ekf

Each threshold is learned from simulated impact-free runs; its safety factor is that of one alarming operation in 100
(or one of those learned from, if they are fewer), set on each half of them with the other half. Other impact-free
runs are tested twice: unchanged, and with 10 faults each (lost rows, repeated stamps, NaN or lost samples of one
channel, 1 to 50 samples long). Counted are the runs that alarm only with their faults, and only without: a one-sided
exact test shows whether faults add alarms, and Holm's method keeps all tests of a call together at 5 %. Each cell is
tested with the default debounce and without.

Contacts: a fault within half a second of the onset, or at the onset (before, across and after it), may cost its own
length and 20 ms of latency. If the contact itself was in the fault, the evidence is lost, and if the whole log's alarm
is marginal, there is nothing to compare: both are counted separately, see lost_evidence.py. The share of assessable
time in damaged runs is shown, too. Progress goes to stderr. Exit status 1 if a test fails, or if more than `--late` of
all contacts take too long.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, partial
from time import monotonic
from typing import Any

import arm_accuracy
import gate_accuracy
import numpy as np
from accuracy import IMPACTS, written_setup
from damaged_logs import Fault, damaged, filled, random_faults, without
from lost_evidence import Cost, cost_of
from scipy.stats import binomtest
from thresholds import WHITENING, SharedWhitening
from timing import environment, table

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge, run_detector
from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError
from cdtool.commands.learning.fitting import Fit, Pair, fitting
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.commands.simulate.gate_recordings import simulate_gate
from cdtool.detectors import DETECTORS
from cdtool.detectors.detection import Signal
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.curves.false_alarm_budget import Budget, set_factor
from cdtool.results.curves.sweep import critical_factor
from cdtool.statistics.paired import holm
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.sequential import FittedSequential
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.whitening import Whitening
from cdtool.truth.onset import find_contacts

SEED, FAULTS, SIGNIFICANT = 1501, 10, 0.05
MACHINES: Mapping[str, tuple[Any, Any]] = {
    "gate": (partial(simulate_gate, seed=0), gate_accuracy.simulate),
    "T1": (partial(simulate_arm, seed=0, trial=1), partial(arm_accuracy.simulate, 1)),
    "T2": (partial(simulate_arm, seed=0, trial=2), partial(arm_accuracy.simulate, 2)),
}


@dataclass(frozen=True)
class RememberedActivation(Activation):
    """An activation that stores the debounce of each clock."""

    kept: dict[tuple[int, int], Any] = field(default_factory=dict, compare=False)

    def needed(self, time: FloatArray) -> Any:
        key = (time.ctypes.data, len(time))
        if key not in self.kept:
            self.kept[key] = super().needed(time)
        return self.kept[key]


@dataclass(frozen=True)
class RememberedInnovations(Whitening):
    """A whitening that stores the innovations of each signal: three thresholds use the same ones."""

    kept: dict[tuple[int, bytes], Signal] = field(default_factory=dict, compare=False)

    def innovations(self, recording: Recording, signal: Signal) -> Signal:
        # The signals outlive their innovations, so that a place in memory is one signal's; its status may differ.
        key = (signal.values.ctypes.data, signal.status.tobytes())
        if key not in self.kept:
            self.kept[key] = super().innovations(recording, signal)
        return self.kept[key]


@dataclass
class Remembering(SharedWhitening):
    """As SharedWhitening, and the innovations are kept too."""

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSequential:
        """What the rule learns of the runs, or what another has learned of them."""
        fitted = super().fit(pairs)
        runs = tuple(recording.name for recording, _ in pairs)
        if not isinstance(fitted.whitening, RememberedInnovations):
            parts = {item.name: getattr(fitted.whitening, item.name) for item in fields(Whitening)}
            fitted = replace(fitted, whitening=RememberedInnovations(**parts))
            self.learned[runs] = fitted
        return fitted


@dataclass
class Cell:
    """A machine, detector, threshold and debounce: runs that alarm only damaged, only whole, both; contacts."""

    title: str
    added: int = 0
    lost: int = 0
    both: int = 0
    outcomes: dict[str, int] = field(default_factory=dict)
    assessed: list[tuple[float, float]] = field(default_factory=list)

    @property
    def share(self) -> float:
        """Time judged in the damaged runs over that in the whole ones."""
        whole, damaged = np.sum(self.assessed, axis=0)
        return float(damaged / whole) if whole else 1.0

    @property
    def p(self) -> float:
        """One-sided exact test of the runs that differ: as many added as lost, or fewer?"""
        differ = self.added + self.lost
        return float(binomtest(self.added, differ, alternative="greater").pvalue) if differ else 1.0

    @property
    def detected(self) -> int:
        """Contacts that the whole log detects, each with each of its faults."""
        return sum(self.outcomes.values())

    @property
    def late(self) -> int:
        """Return those that cost more than allowed, including missed ones."""
        return self.outcomes.get("late", 0) + self.outcomes.get("missed", 0)

    def __str__(self) -> str:
        alarms = f"+{self.added} -{self.lost} ={self.both}, p {self.p:.2g}"
        late = f"{self.late}/{self.detected} late, {self.outcomes.get('missed', 0)} of them missed, "
        apart = ", ".join(f"{self.outcomes.get(name, 0)} {name}" for name in ("evidence lost", "by a hair"))
        return f"{self.title}: {alarms}, {f'{late}{apart}, ' if self.detected else ''}{100.0 * self.share:.1f} % judged"


@dataclass(frozen=True)
class Bench:
    """A machine's operations: to learn from, to judge whole and damaged, and contacts.

    A contact has copies with a fault each, and beside each the log with the fault filled in, in each way.
    """

    setup: BenchmarkFile
    learned: Sequence[Operation]
    whole: Sequence[Operation]
    damaged: Sequence[Operation]
    contacts: Sequence[tuple[Operation, Contact, Sequence[tuple[Fault, Operation, Sequence[Operation]]]]]


def bench_of(name: str, options: argparse.Namespace) -> Bench:
    """Simulate everything, seeded by machine, group and number."""
    write, simulate = MACHINES[name]
    setup = written_setup(write)
    machine = setup.machine_file.machine

    def operation(raw: Recording) -> Operation:
        raw = without(raw, "reference_") if options.without_reference else raw
        return operations_of(machine.referred_to_load(raw))[0]

    def runs(group: str, seed: int, count: int) -> Iterator[Recording]:
        return (simulate(seed, group, number) for number in range(1, count + 1))

    learned = [operation(raw) for raw in runs("free", options.seed, options.learn)]
    judged = list(runs("holdout", options.seed, options.judge))
    rng = np.random.default_rng([options.seed, 1])
    spoilt = [damaged(raw, random_faults(raw, FAULTS, rng)) for raw in judged]
    contacts = []
    for group in IMPACTS:
        for raw in runs(group, options.seed, options.contacts):
            whole = operation(raw)
            contact = find_contacts(whole.recording, setup.onset)[0]
            # Two of three faults at the onset.
            faults = [at_contact(raw, contact.start, i % 3 < 2, rng) for i in range(options.copies)]
            copies = [
                (item, operation(damaged(raw, [item])), [operation(log) for log in filled(raw, item)])
                for item in faults
            ]
            contacts.append((whole, contact, copies))
    return Bench(setup, learned, [operation(raw) for raw in judged], [operation(raw) for raw in spoilt], contacts)


def at_contact(raw: Recording, onset: float, close: bool, rng: np.random.Generator) -> Fault:
    """Return a fault within half a second of the onset; `close`: just before it, across it, or soon after it."""
    fault = random_faults(raw, 1, rng)[0]
    length = fault.count * raw["speed"].period
    first, last = (-length - 0.005, 0.02) if close else (-0.5, 0.5)
    return replace(fault, start=float(onset + rng.uniform(first, last)))


def cells_of(name: str, bench: Bench, options: argparse.Namespace) -> Iterator[Cell]:
    """Every detector with every threshold, with the default debounce and with none."""
    setup = bench.setup
    machine = setup.machine_file.machine
    budget = Budget(max(1.0 / 100.0, 1.0 / options.learn), "operation")
    for detector_name in options.detectors:
        detector = setup.machine_file.detector(detector_name)

        def signal(operation: Operation, detector: Any = detector) -> Pair:
            return operation, run_detector(operation, machine, detector, setup.watched)

        def signals(operations: Sequence[Operation], signal: Any = signal) -> list[Pair]:
            return [signal(item) for item in operations]

        try:
            learned = [signal(item) for item in bench.learned]
        except CdtoolError as fault:
            print(f"{name} {detector_name}: left out: {fault.message}", flush=True)
            continue
        whole, spoilt = ([signal(item) for item in items] for items in (bench.whole, bench.damaged))
        contacts = []
        for item, contact, copies in bench.contacts:
            pairs = [(fault, signal(copy), cache(partial(signals, logs))) for fault, copy, logs in copies]
            contacts.append((signal(item), contact, pairs))
        usual = RememberedActivation(**{item.name: getattr(setup.activation, item.name) for item in fields(Activation)})
        activations = (usual, replace(setup.activation, debounce=1))
        shared: dict[tuple[str, ...], FittedSequential] = {}
        for threshold in options.thresholds:
            rule = with_context(THRESHOLDS.load(threshold)(), setup.signature.sides, setup.signature)
            rule = setup.signature if threshold == "signature" else rule
            fit = fitting(Remembering(rule, shared) if threshold in WHITENING else rule)
            title = f"{name} {detector.short_name} {threshold}"
            began = monotonic()
            try:
                cells = judged_cells(title, detector_name, fit, budget, activations, (learned, whole, spoilt, contacts))
            except CdtoolError as fault:
                print(f"{title}: left out: {fault.message}", flush=True)
                continue
            print(f"{monotonic() - began:6.1f} s  {title}", file=sys.stderr, flush=True)
            yield from cells


def judged_cells(
    title: str,
    detector: str,
    fit: Fit,
    budget: Budget,
    activations: Sequence[Activation],
    runs: tuple[Sequence[Pair], Sequence[Pair], Sequence[Pair], Sequence[Any]],
) -> list[Cell]:
    """Test one detector with one threshold: each log is evaluated once for all debounces; limits scale."""
    learned, whole, spoilt, contacts = runs

    def judged(fitted: Sequence[Any], pair: Pair) -> Detection:
        operation, signal = pair
        return judge(operation, detector, signal, fitted, activations[0])

    held_out = []
    for half in range(2):
        fitted = fit(learned[1 - half :: 2]).thresholds
        held_out += [judged(fitted, pair) for pair in learned[half::2]]
    factors = [set_factor(budget, detector, held_out, activation).factor for activation in activations]
    del held_out
    fitted = fit(learned).thresholds
    cells = [Cell(f"{title}{', debounce 1' if item.debounce == 1 else ''}") for item in activations]
    tried = list(zip(cells, activations, factors, strict=True))
    for before, after in zip(whole, spoilt, strict=True):
        found = judged(fitted, before), judged(fitted, after)
        for cell, activation, factor in tried:
            alarms = [critical_factor(item, activation) > factor for item in found]
            cell.both += all(alarms)
            cell.added += alarms[1] and not alarms[0]
            cell.lost += alarms[0] and not alarms[1]
            cell.assessed.append((found[0].assessed_seconds, found[1].assessed_seconds))
    for pair, contact, copies in contacts:
        one = judged(fitted, pair)
        for fault, copy, logs in copies:
            other, length = judged(fitted, copy), fault.count * pair[0].recording["speed"].period
            whole_again = cache(lambda logs=logs: [judged(fitted, item) for item in logs()])
            for cell, activation, factor in tried:
                cost = cost_of(one, other, contact, (fault.start, length), activation, factor, whole_again)
                count_contact(cell, cost, fault, contact, pair[0].name)
    return cells


def count_contact(cell: Cell, cost: Cost | None, fault: Fault, contact: Contact, name: str) -> None:
    """Add a contact to the cell's outcomes; late or possibly late ones are reported on stderr."""
    if cost is None:
        return
    cell.outcomes[cost.outcome] = cell.outcomes.get(cost.outcome, 0) + 1
    if cost.outcome != "in time":
        times = (cost.whole, cost.damaged, cost.reachable, cost.filled, fault.start)
        whole, damaged, reachable, filled_in, start = (f"{1e3 * (item - contact.start):.0f}" for item in times)
        print(
            f"  {cost.outcome}: {cell.title}, {name}: {whole} -> {damaged} ms, reachable {reachable}, "
            f"filled in {filled_in}; "
            f"{fault.kind} {fault.channel} x{fault.count} at {start} ms",
            file=sys.stderr,
            flush=True,
        )


def main(options: argparse.Namespace) -> int:
    """Print every cell as soon as it is finished, then the tests."""
    print(f"== lost samples, seed {options.seed}, {options.learn} runs learned from, {options.judge} judged")
    print(f"{environment()}\n", flush=True)
    cells = []
    for name in options.machines:
        began = monotonic()
        bench = bench_of(name, options)
        print(f"{monotonic() - began:6.1f} s  {name}: simulated", file=sys.stderr, flush=True)
        for cell in cells_of(name, bench, options):
            cells.append(cell)
            print(cell, flush=True)
    if not cells:
        print("error: no cell could be tried")
        return 1
    adjusted = holm([cell.p for cell in cells])
    failing = [
        (cell.title, f"{cell.added}", f"{cell.lost}", f"{p:.2g}")
        for cell, p in zip(cells, adjusted, strict=True)
        if p < SIGNIFICANT
    ]
    print()
    if failing:
        table(("more false alarms with faults", "added", "lost", "p (Holm)"), failing)
    added, lost, both, detected, late = (
        sum(getattr(cell, name) for cell in cells) for name in ("added", "lost", "both", "detected", "late")
    )
    missed, unseen, hair = (
        sum(cell.outcomes.get(name, 0) for cell in cells) for name in ("missed", "evidence lost", "by a hair")
    )
    runs = len(cells) * options.judge
    print(f"{len(cells)} cells, {runs} runs: {added + both} alarm with faults, {lost + both} without,")
    print(f"{added} only with faults, {lost} only without; smallest p by Holm {min(adjusted):.3g};")
    print(f"{len(failing)} cells have more false alarms with faults (Holm, 5 % together)")
    if detected:
        print(f"{detected} contacts with a fault: {late} later than its length and 20 ms, {missed} of them missed;")
        print(f"in {unseen} others the evidence lay in the fault, {hair} were detected by a hair")
        slow = sorted((c for c in cells if c.late), key=lambda c: -c.late / c.detected)[:5]
        if slow:
            print(f"most of them: {', '.join(f'{c.title} {c.late}/{c.detected}' for c in slow)}")
    good = not failing and late <= options.late * detected
    print("ok" if good else "FAIL")
    return 0 if good else 1


def _options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--learn", type=int, default=300, help="impact-free runs to learn from")
    parser.add_argument("--judge", type=int, default=300, help="impact-free runs that are judged")
    parser.add_argument("--contacts", type=int, default=20, help="stiff contacts, and as many soft ones")
    parser.add_argument("--copies", type=int, default=6, help="faults tried on each contact")
    parser.add_argument("--late", type=float, default=0.002, help="share of all contacts that may take longer")
    parser.add_argument("--machines", nargs="+", choices=list(MACHINES), default=["gate", "T1"])
    parser.add_argument("--detectors", nargs="+", choices=DETECTORS.names(), default=list(DETECTORS.names()))
    parser.add_argument("--thresholds", nargs="+", choices=THRESHOLDS.names(), default=list(THRESHOLDS.names()))
    parser.add_argument("--without-reference", action="store_true", help="the four measured channels only")
    return parser.parse_args(words)


if __name__ == "__main__":
    sys.exit(main(_options(sys.argv[1:])))
