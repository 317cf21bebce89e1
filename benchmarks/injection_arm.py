"""Injected against true latencies on the simulated arm, trial 1 and 2: the same runs with the same noise, hit and not.

Every free run has a true twin: the same seed, simulated with the obstacle. The contact is injected into the free run
with the simulator's own parameters, and both are judged by the same detectors with the same signatures. Gains,
signature, watched joint and debounce are those of the files that `cdtool simulate arm` writes; latencies count from
the exact contact. The simulator's friction differs by 5 % from run to run, which the model does not know.

Required are the detectors of those files; the others are shown. A detector that misses a part of the true contacts is
near its limit: there a single contact may be missed in one run and not in its twin, so that misses are only counted.

python benchmarks/injection_arm.py                # 5 seeds, 8 pairs each: 3 min
python benchmarks/injection_arm.py --seeds 1 --pairs 4
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from accuracy import written_setup
from timing import main

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from cdtool.alarms.pipeline import detect_operation  # noqa: E402
from cdtool.base.errors import CdtoolError  # noqa: E402
from cdtool.commands.inject.injected_logs import injected_recording  # noqa: E402
from cdtool.commands.inject.robot_contact import RobotLog, robot_contact  # noqa: E402
from cdtool.commands.learning.fitting import fit_operations  # noqa: E402
from cdtool.commands.scoring.benchmark_file import BenchmarkFile  # noqa: E402
from cdtool.commands.simulate.arm_model import Impact, simulate_arm_run  # noqa: E402
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial  # noqa: E402
from cdtool.commands.simulate.arm_recordings import as_recording, simulate_arm  # noqa: E402
from cdtool.detectors import DETECTORS  # noqa: E402
from cdtool.detectors.base import Detector  # noqa: E402
from cdtool.machines.axis_model.axis_run import axis_run  # noqa: E402
from cdtool.machines.planar_arm import PlanarArm  # noqa: E402
from cdtool.recordings.operations import operations_of  # noqa: E402
from cdtool.recordings.recording import Recording  # noqa: E402
from cdtool.thresholds.base import FittedThreshold  # noqa: E402
from tests.machines.robot_model.arm_as_model import arm_as_model, arm_obstacle, arm_point  # noqa: E402

SEEDS, PAIRS, LEARNED = 5, 8, 14
FIRST_SEED = 7100
TRIALS: tuple[Trial, ...] = (1, 2)
KINDS: tuple[Impact, ...] = ("stiff", "soft")
# Of the mean paired difference: share of the true latency, and [ms].
SHARE, LEAST = 0.15, 4.0
ARM = ArmParameters()


@dataclass(frozen=True)
class Latencies:
    """Injected and true latencies [ms] of one detector, pair by pair; NaN where the contact is missed."""

    injected: np.ndarray
    true: np.ndarray

    @property
    def differences(self) -> np.ndarray:
        """Of the pairs that are detected in both."""
        difference = np.asarray(self.injected - self.true, dtype=np.float64)
        return np.asarray(difference[np.isfinite(difference)])

    @property
    def difference(self) -> float:
        return float(np.mean(self.differences)) if len(self.differences) else math.nan

    @property
    def standard_error(self) -> float:
        known = self.differences
        return float(np.std(known, ddof=1) / math.sqrt(len(known))) if len(known) > 1 else 0.0

    @property
    def limit(self) -> float:
        detected = self.true[np.isfinite(self.true)]
        return max(SHARE * float(np.mean(detected)), LEAST) if len(detected) else math.nan

    @property
    def agrees(self) -> bool:
        """Whether no detector gains or loses a miss, and the mean difference is within its limit."""
        same_misses = bool(np.array_equal(np.isnan(self.injected), np.isnan(self.true)))
        return same_misses and (not len(self.differences) or abs(self.difference) <= self.limit)


def setup_of(trial: Trial) -> BenchmarkFile:
    """Return machine and rules as `cdtool simulate arm` writes them."""
    return written_setup(partial(simulate_arm, seed=0, trial=trial))


def simulated(trial: Trial, seed: tuple[int, ...], impact: Impact) -> tuple[Recording, float | None]:
    run = simulate_arm_run(ARM, np.random.default_rng(seed), trial, impact)
    return as_recording(run, impact), run.contact_start


def pair(setup: BenchmarkFile, trial: Trial, seed: tuple[int, ...], kind: Impact) -> tuple[Recording, Recording, float]:
    """Return the run with the injected contact and its true twin, as logged, and the time of the contact [s]."""
    machine = setup.machine_file.machine
    assert isinstance(machine, PlanarArm)
    hit, start = simulated(trial, seed, kind)
    free, _ = simulated(trial, seed, "none")
    assert start is not None
    loaded = machine.referred_to_load(free)
    log = RobotLog(tuple(axis_run(loaded, joint) for joint in (0, 1)), free["acceleration"].unit)
    duration = hit.end - start
    contact = robot_contact(
        log, arm_as_model(machine, ARM), arm_point(ARM, trial), arm_obstacle(ARM, kind), start, duration
    )
    return injected_recording(free, machine, contact.changes, contact.force, (0, 1)), hit, start


def compare(trial: Trial, seed: int, kind: Impact, pairs: int, names: tuple[str, ...]) -> dict[str, Latencies]:
    """The latencies of every detector that has a normal band, on injected and true contacts of one seed."""
    setup = setup_of(trial)
    machine = setup.machine_file.machine
    learned = [simulated(trial, (seed, number), "none")[0] for number in range(LEARNED)]
    operations = [item for log in learned for item in operations_of(machine.referred_to_load(log))]
    judges: dict[str, tuple[Detector, tuple[FittedThreshold, ...]]] = {}
    for name in names:
        detector = setup.machine_file.detector(name)
        try:
            fitted = fit_operations(operations, machine, detector, setup.signature, watched=setup.watched)
        except CdtoolError:
            continue  # as in `cdtool benchmark`: without a band no contact is assessable
        judges[name] = detector, fitted.thresholds
    found: dict[str, list[list[float]]] = {name: [] for name in judges}
    for number in range(pairs):
        *both, start = pair(setup, trial, (seed, 1000 + number), kind)
        for name, (detector, thresholds) in judges.items():
            found[name].append([_latency(setup, item, detector, thresholds, start) for item in both])
    return {name: Latencies(*np.array(items).T) for name, items in found.items()}


def _latency(
    setup: BenchmarkFile, log: Recording, detector: Detector, thresholds: tuple[FittedThreshold, ...], start: float
) -> float:
    machine = setup.machine_file.machine
    operation = operations_of(machine.referred_to_load(log))[0]
    verdict = detect_operation(operation, machine, detector, thresholds, setup.activation, setup.watched).verdict
    after = [alarm.time for alarm in verdict.alarms if alarm.time > start]
    return 1e3 * (after[0] - start) if after else math.nan


def measure(seeds: int, pairs: int, names: tuple[str, ...]) -> bool:
    met = True
    for trial in TRIALS:
        required = setup_of(trial).detectors
        for kind in KINDS:
            merged: dict[str, list[Latencies]] = {}
            for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                for name, item in compare(trial, seed, kind, pairs, names).items():
                    merged.setdefault(name, []).append(item)
            print(f"\ntrial {trial}, {kind}")
            for name, items in merged.items():
                both = Latencies(
                    np.concatenate([item.injected for item in items]), np.concatenate([item.true for item in items])
                )
                is_required = name in required
                show(name, both, is_required)
                met &= both.agrees or not is_required
    return met


def show(name: str, both: Latencies, is_required: bool) -> None:
    misses = [int(np.isnan(values).sum()) for values in (both.injected, both.true)]
    words = ("ok   " if both.agrees else "WORSE") if is_required else ("     " if both.agrees else "other")
    line = f"{words} {name:18s} misses {misses[0]:2d} and {misses[1]:2d} of {len(both.true)}"
    if len(both.differences):
        known = np.isfinite(both.injected) & np.isfinite(both.true)
        line += f", injected {np.mean(both.injected[known]):6.1f} true {np.mean(both.true[known]):6.1f} ms"
        line += f", difference {both.difference:+5.1f} +- {both.standard_error:.1f} of {both.limit:.1f}"
    print(line, flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--pairs", type=int, default=PAIRS)
    parser.add_argument("--detectors", default=",".join(DETECTORS.usable_names()))
    chosen = parser.parse_args()
    wanted = tuple(chosen.detectors.split(","))
    main("injected and true latencies of the arm", lambda: measure(chosen.seeds, chosen.pairs, wanted))
