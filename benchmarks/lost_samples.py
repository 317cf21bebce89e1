"""Do lost samples raise false alarms, and what do they cost in latency? Every detector with every threshold.

    python benchmarks/lost_samples.py                          # gate and arm, 300 runs to learn from, 300 to judge
    python benchmarks/lost_samples.py --learn 30 --judge 30 --machines gate --detectors friction_ekf

Simulated impact-free runs teach each threshold and set its safety factor for one alarming operation in 100 (or one of
those learned from, where they are fewer). Other impact-free runs are judged twice: as they are, and with 10 faults each
(lost rows, repeated stamps, NaN or lost samples of one channel, 1 to 50 samples long). Counted are the runs that alarm
only with their faults, and only without: an exact test of one side says whether faults add alarms, Holm's method keeps
all the tests together at 5 %. Each cell is tried with the default debounce and with none.

Contacts: a fault at the onset (before, across and after it) may cost the gap and 20 ms of latency. Contacts that take
longer, or are missed only with the fault, are counted. Where all that shows a contact lies in the gap (the pulse of an
accelerometer) no method can be that fast: the 20 ms then count from the alarm of the whole log's statistic, not looked
at during the gap. The share of time that is judged in damaged runs is shown, too.
Exit status 1 where a test fails, or where more than `--late` of all contacts take too long.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import arm_accuracy
import gate_accuracy
import numpy as np
from accuracy import IMPACTS, written_setup
from damaged_logs import Fault, damaged, random_faults, without
from scipy.stats import binomtest
from timing import environment, table

from cdtool.activation import Activation
from cdtool.detection import Alarm, Status
from cdtool.detectors import DETECTORS
from cdtool.errors import CdtoolError
from cdtool.evaluation.false_alarm_budget import Budget
from cdtool.evaluation.statistics.paired import holm
from cdtool.evaluation.truth.onset import find_contacts
from cdtool.operations import Operation, operations_of
from cdtool.pipeline import Detection, judge, run_detector
from cdtool.recording import Recording
from cdtool.simulation.arm_recordings import write_arm_recordings
from cdtool.simulation.gate_recordings import write_gate_recordings
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.settings import with_context
from cdtool.workflows.benchmark_file import BenchmarkFile
from cdtool.workflows.calibration import calibrate
from cdtool.workflows.fitting import Pair, fitting

SEED, FAULTS, SIGNIFICANT = 1501, 10, 0.05
MACHINES: Mapping[str, tuple[Any, Any]] = {
    "gate": (partial(write_gate_recordings, seed=0), gate_accuracy.simulate),
    "T1": (partial(write_arm_recordings, seed=0, trial=1), partial(arm_accuracy.simulate, 1)),
    "T2": (partial(write_arm_recordings, seed=0, trial=2), partial(arm_accuracy.simulate, 2)),
}
# What a fault may cost beyond its own length [s].
ALLOWED = 0.02


@dataclass
class Cell:
    """A machine, detector, threshold and debounce: runs that alarm only damaged, only whole, both; contacts."""

    title: str
    added: int = 0
    lost: int = 0
    both: int = 0
    detected: int = 0
    late: int = 0
    missed: int = 0
    worst: float = 0.0
    assessed: list[tuple[float, ...]] = field(default_factory=list)

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


@dataclass(frozen=True)
class Bench:
    """A machine's operations: to learn from, to judge whole and damaged, and contacts, each with its damaged copies."""

    setup: BenchmarkFile
    learned: Sequence[Operation]
    whole: Sequence[Operation]
    damaged: Sequence[Operation]
    contacts: Sequence[tuple[Operation, float, Sequence[tuple[Fault, Operation]]]]


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
            onset = find_contacts(whole.recording, setup.onset)[0].start
            faults = [at_onset(raw, onset, rng) for _ in range(options.copies)]
            copies = [(fault, operation(damaged(raw, [fault]))) for fault in faults]
            contacts.append((whole, onset, copies))
    return Bench(setup, learned, [operation(raw) for raw in judged], [operation(raw) for raw in spoilt], contacts)


def at_onset(raw: Recording, onset: float, rng: np.random.Generator) -> Fault:
    """A fault that ends just before the onset, holds it, or begins up to 20 ms after it."""
    fault = random_faults(raw, 1, rng)[0]
    length = fault.count * raw["speed"].period
    return replace(fault, start=float(onset + rng.uniform(-length - 0.005, 0.02)))


def cells_of(name: str, bench: Bench, options: argparse.Namespace) -> Iterator[Cell]:
    """Every detector with every threshold, with the default debounce and with none."""
    setup = bench.setup
    machine = setup.machine_file.machine
    budget = Budget(max(1.0 / 100.0, 1.0 / options.learn), "operation")
    for detector_name in options.detectors:
        detector = setup.machine_file.detector(detector_name)

        def signal(operation: Operation, detector: Any = detector) -> Pair:
            return operation, run_detector(operation, machine, detector, setup.watched)

        try:
            learned = [signal(item) for item in bench.learned]
        except CdtoolError as fault:
            print(f"{name} {detector_name}: left out: {fault.message}", flush=True)
            continue
        whole, spoilt = ([signal(item) for item in items] for items in (bench.whole, bench.damaged))
        contacts = [
            (signal(item), onset, [(fault, signal(copy)) for fault, copy in copies])
            for item, onset, copies in bench.contacts
        ]
        for threshold in options.thresholds:
            rule = with_context(THRESHOLDS.load(threshold)(), setup.signature.sides, setup.signature)
            fit = fitting(setup.signature if threshold == "signature" else rule)
            for activation in (setup.activation, replace(setup.activation, debounce=1)):
                title = f"{name} {detector.short_name} {threshold}{', debounce 1' if activation.debounce == 1 else ''}"
                cell = Cell(title)
                try:
                    factor = calibrate(budget, detector_name, learned, fit, activation).factor
                    fitted = [item.with_safety_factor(factor) for item in fit(learned).thresholds]
                except CdtoolError as fault:
                    print(f"{title}: left out: {fault.message}", flush=True)
                    break
                judged = partial(judged_pair, detector_name, fitted, activation)
                count_alarms(cell, whole, spoilt, judged)
                count_contacts(cell, contacts, judged, activation)
                yield cell


def judged_pair(detector: str, fitted: Sequence[Any], activation: Activation, pair: Pair) -> Detection:
    """An operation and its signal with the fitted threshold."""
    operation, signal = pair
    return judge(operation, detector, signal, fitted, activation)


Judged = Callable[[Pair], Detection]


def count_alarms(cell: Cell, whole: Sequence[Pair], spoilt: Sequence[Pair], judged: Judged) -> None:
    """Impact-free runs, pair by pair; and how many of their samples can be judged."""
    for before, after in zip(whole, spoilt, strict=True):
        found = judged(before), judged(after)
        without_faults, with_faults = (bool(item.verdict.alarms) for item in found)
        cell.both += with_faults and without_faults
        cell.added += with_faults and not without_faults
        cell.lost += without_faults and not with_faults
        cell.assessed.append(tuple(item.assessed_seconds for item in found))


def count_contacts(cell: Cell, contacts: Sequence[Any], judged: Judged, activation: Activation) -> None:
    """Contacts that are detected in the whole log within 1 s: with each fault, how much later?

    Where the whole log's own statistic, not looked at during the gap, alarms even later, the evidence lay in the gap:
    then the 20 ms count from that alarm.
    """
    for whole, onset, copies in contacts:
        found = judged(whole)
        before = first_crossing(found.verdict.crossings, onset)
        if before > onset + 1.0:
            continue
        for fault, copy in copies:
            end = fault.start + fault.count * whole[0].recording["speed"].period
            status = found.statistic.status.copy()
            status[(found.statistic.time >= fault.start) & (found.statistic.time <= end)] = Status.GAP
            seen, _ = activation.alarms(replace(found.statistic, status=status), found.band)[::-1]
            reachable = max(before + end - fault.start, first_crossing(seen, onset))
            cost = first_crossing(judged(copy).verdict.crossings, onset) - reachable
            if np.isfinite(reachable):
                cell.detected += 1
                cell.missed += bool(np.isinf(cost))
                cell.late += bool(cost > ALLOWED + 1e-9)
                cell.worst = max(cell.worst, cost if np.isfinite(cost) else 0.0)


def first_crossing(crossings: Sequence[Alarm], since: float) -> float:
    """The first at or after `since` [s]; infinite without one."""
    return min((alarm.time for alarm in crossings if alarm.time >= since), default=np.inf)


def main(options: argparse.Namespace) -> int:
    """Print every cell as soon as it is through, then the tests."""
    print(f"== lost samples, seed {options.seed}, {options.learn} runs learned from, {options.judge} judged")
    print(f"{environment()}\n", flush=True)
    cells = []
    for name in options.machines:
        bench = bench_of(name, options)
        for cell in cells_of(name, bench, options):
            cells.append(cell)
            late = f"{cell.late}/{cell.detected} late, {cell.missed} missed, " if cell.detected else ""
            alarms = f"+{cell.added} -{cell.lost} ={cell.both}, p {cell.p:.2g}"
            print(f"{cell.title}: {alarms}, {late}{100.0 * cell.share:.1f} % judged", flush=True)
    if not cells:
        print("error: no cell could be tried")
        return 1
    adjusted = holm([cell.p for cell in cells])
    failing = [
        (cell.title, f"{cell.added}", f"{cell.lost}", f"{p:.2g}") for cell, p in zip(cells, adjusted, strict=True)
    ]
    failing = [row for row, p in zip(failing, adjusted, strict=True) if p < SIGNIFICANT]
    print()
    if failing:
        table(("more false alarms with faults", "added", "lost", "p (Holm)"), failing)
    total = [sum(getattr(cell, name) for cell in cells) for name in ("added", "lost", "detected", "late", "missed")]
    print(f"{len(cells)} cells: {total[0]} runs alarm only with faults, {total[1]} only without;")
    print(f"{len(failing)} cells have more false alarms with faults (Holm, 5 % together)")
    if total[2]:
        print(f"{total[2]} contacts with a fault: {total[3]} later than the gap and 20 ms, {total[4]} of them missed;")
        slow = sorted((c for c in cells if c.late), key=lambda c: -c.late / c.detected)[:5]
        if slow:
            print(f"most of them: {', '.join(f'{c.title} {c.late}/{c.detected}' for c in slow)}")
    good = not failing and total[3] <= options.late * total[2]
    print("ok" if good else "FAIL")
    return 0 if good else 1


def _options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--learn", type=int, default=300, help="impact-free runs to learn from")
    parser.add_argument("--judge", type=int, default=300, help="impact-free runs that are judged")
    parser.add_argument("--contacts", type=int, default=20, help="stiff contacts, and as many soft ones")
    parser.add_argument("--copies", type=int, default=5, help="faults tried on each contact")
    parser.add_argument("--late", type=float, default=0.02, help="share of all contacts that may take longer")
    parser.add_argument("--machines", nargs="+", choices=list(MACHINES), default=["gate", "T1"])
    parser.add_argument("--detectors", nargs="+", choices=DETECTORS.names(), default=list(DETECTORS.names()))
    parser.add_argument("--thresholds", nargs="+", choices=THRESHOLDS.names(), default=list(THRESHOLDS.names()))
    parser.add_argument("--without-reference", action="store_true", help="the four measured channels only")
    return parser.parse_args(words)


if __name__ == "__main__":
    sys.exit(main(_options(sys.argv[1:])))
