"""Is the false-alarm probability predicted by `cdtool signature check` right?

    python benchmarks/signature_coverage.py            # seeds 701 702 703 704, about ten minutes
    python benchmarks/signature_coverage.py 705        # another

Simulated gate and arm (trial 1), generalized momentum and friction EKF, each seed: signatures of 14 and of 40 runs from
Simulated gate and arm (trial 1), generalized momentum and friction EKF, each seed: signatures of 14 and of 40 runs from
200 impact-free runs, no run used twice, and 200 others. From each signature's own runs, left out one by one, the safety
factor is predicted that one operation in 10, 30, 100, 300 or 1000 exceeds; then the alarms among the 200 others are
counted. Three distributions of the critical factors: normal (Student's prediction), Gumbel, and the sum of both with
equal variances, which cdtool uses.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import arm_accuracy
import gate_accuracy
import numpy as np
from accuracy import written_setup
from timing import environment, table

from cdtool.alarms.pipeline import judge, run_detector
from cdtool.commands.learning.fitting import Pair
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.signature.coverage import check_coverage
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.commands.simulate.gate_recordings import simulate_gate
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording
from cdtool.results.curves.sweep import critical_factor
from cdtool.statistics.prediction import GUMBEL_SHARE, prediction_of

SEEDS = (701, 702, 703, 704)
LEARNED, OTHERS = 200, 200
SIZES = (14, 40)
DETECTORS = ("gm", "feekf")
TARGETS = (1 / 10, 1 / 30, 1 / 100, 1 / 300, 1 / 1000)
SHARES = {"normal": 0.0, "sum": GUMBEL_SHARE, "gumbel": 1.0}
# Requirement: the sum meets these targets over all cells together, and no cell exceeds them by this much.
ASKED = (1 / 100, 1 / 300)
ONE_CELL = 2.0

BENCHES = {
    "gate": (partial(simulate_gate, seed=0), gate_accuracy.simulate),
    "arm, trial 1": (partial(simulate_arm, seed=0, trial=1), partial(arm_accuracy.simulate, 1)),
}


@dataclass(frozen=True)
class Cell:
    """One machine, detector and number of runs: by target and way, the share of other operations that alarm.

    `left_out` and `fresh` are the mean critical factors of runs left out and of others.
    """

    title: str
    shares: dict[tuple[float, str], float]
    left_out: float
    fresh: float


def main(seeds: tuple[int, ...]) -> int:
    """Print every cell; return 0 if the sum of both meets the required targets."""
    print(f"== predicted chance of a false alarm, seeds {' '.join(map(str, seeds))}\n{environment()}", flush=True)
    found = [cell for title in BENCHES for cell in cells_of(title, seeds)]
    for target in TARGETS:
        print(f"\nfactor for 1 operation in {round(1 / target)}: alarms in 1000 operations, {1000 * target:.1f} asked")
        rows = [(cell.title, *(f"{1000 * cell.shares[target, way]:.1f}" for way in SHARES)) for cell in found]
        mean = [f"{1000 * np.mean([cell.shares[target, way] for cell in found]):.1f}" for way in SHARES]
        table(("", *SHARES), [*rows, ("all", *mean)])
    print("\nmean critical factor, left out and of others")
    table(("", "left out", "others"), [(cell.title, f"{cell.left_out:.2f}", f"{cell.fresh:.2f}") for cell in found])
    held = [kept(found, target) for target in ASKED]
    return 0 if all(held) else 1


def cells_of(title: str, seeds: Sequence[int]) -> Iterator[Cell]:
    """Every detector and number of runs of one machine."""
    write, simulate = BENCHES[title]
    setup = written_setup(write)
    for name in DETECTORS:
        pools = [list(signals(setup, simulate, name, seed)) for seed in seeds]
        for size in SIZES:
            yield measured(setup, pools, size, f"{title}, {name}, {size} runs")


def signals(
    setup: BenchmarkFile, simulate: Callable[[int, str, int], Recording], detector: str, seed: int
) -> Iterator[Pair]:
    machine = setup.machine_file.machine
    for number in range(1, LEARNED + OTHERS + 1):
        recording = machine.referred_to_load(simulate(seed, "free", number))
        for operation in operations_of(recording):
            yield operation, run_detector(operation, machine, setup.machine_file.detector(detector), setup.watched)


def measured(setup: BenchmarkFile, pools: Sequence[Sequence[Pair]], size: int, title: str) -> Cell:
    """One cell over all seeds and as many signatures as the runs to learn from give."""
    alarms: dict[tuple[float, str], list[float]] = {(target, way): [] for target in TARGETS for way in SHARES}
    left_out, fresh = [], []
    for pool in pools:
        others = pool[LEARNED:]
        for begin in range(0, LEARNED - size + 1, size):
            runs = pool[begin : begin + size]
            found = check_coverage(runs, setup.signature, setup.activation)
            critical = np.array([run.critical_factor for run in found.runs])
            fitted = setup.signature.fit([(item.recording.without_ground_truth(), signal) for item, signal in runs])
            judged = [judge(item, "", signal, (fitted,), setup.activation) for item, signal in others]
            factors = np.array([critical_factor(item, setup.activation) for item in judged])
            left_out.append(critical.mean())
            fresh.append(factors.mean())
            for target, way in alarms:
                limit = prediction_of(critical, SHARES[way]).limit_for(target)
                alarms[target, way].append(float(np.mean(factors > limit)))
    shares = {key: float(np.mean(values)) for key, values in alarms.items()}
    return Cell(title, shares, float(np.mean(left_out)), float(np.mean(fresh)))


def kept(found: Sequence[Cell], target: float) -> bool:
    """Print whether the sum meets a target."""
    shares = [cell.shares[target, "sum"] for cell in found]
    good = float(np.mean(shares)) <= target and max(shares) <= ONE_CELL * target
    worst = f"mean {1000 * np.mean(shares):.1f}, worst cell {1000 * max(shares):.1f} of 1000"
    print(f"{'ok  ' if good else 'FAIL'}  1 operation in {round(1 / target)}: {worst}")
    return good


if __name__ == "__main__":
    sys.exit(main(tuple(map(int, sys.argv[1:])) or SEEDS))
