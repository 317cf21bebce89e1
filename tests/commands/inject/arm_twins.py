"""Injected and true contacts of the simulated arm: the same runs with the same noise, hit and not hit.

Every free run has a true twin: the same seed, simulated with the obstacle. The contact is injected into the free run
with the simulator's own parameters, and both are judged by the same detectors with the same signatures. Gains,
signature, watched joint and debounce are those of the files that `cdtool simulate arm` writes; latencies count from
the exact contact. The simulator's friction differs by 5 % from run to run, which the model does not know.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdtool.alarms.pipeline import detect_operation
from cdtool.base.errors import CdtoolError
from cdtool.commands.inject.injected_logs import injected_recording
from cdtool.commands.inject.robot_contact import RobotLog, robot_contact
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.commands.simulate.arm_model import Impact, simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.detectors.base import Detector
from cdtool.machines.axis_model.axis_run import axis_run
from cdtool.machines.planar_arm import PlanarArm
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import FittedThreshold
from tests.fitted_runs import fit_operations
from tests.machines.robot_model.arm_as_model import arm_as_model, arm_obstacle, arm_point
from tests.synthetic.arm_as_recording import as_recording

LEARNED = 14
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
    with tempfile.TemporaryDirectory() as folder:
        simulate_arm(Path(folder), {"free": 2, "holdout": 1, "stiff": 1, "soft": 1}, seed=0, trial=trial)
        return read_benchmark_file(Path(folder) / "benchmark.toml")


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
