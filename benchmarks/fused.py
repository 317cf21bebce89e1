"""How early `fused` sees simulated contacts at a false-alarm budget, and how often it alarms on changed machines.

    python benchmarks/fused.py                                    # the gate, 200 free runs to learn from
    python benchmarks/fused.py --cells gate T1 T2 --free 1000 --fresh 1000 --impacts 100 --seeds 701 702

Limits are set at 1/100, and at 1/1000 from 1,000 free runs on, by the folds of `cdtool learn`, on whole operations:
start and settled phase together, debounce 3. The free runs, fresh ones and impacts of a seed have no random number in
common. `--detector friction_ekf --threshold glr` measures another detector likewise. It is a simulation, and no
evidence about a real machine.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
from timing import environment, table

from cdtool.activation import Activation
from cdtool.detection import Signal
from cdtool.evaluation.sweep import critical_factor
from cdtool.evaluation.truth.onset import find_contacts
from cdtool.evaluation.truth.onset_rule import OnsetRule
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.motion import motion_class
from cdtool.operations import Operation
from cdtool.pipeline import judge, run_detector
from cdtool.recording import Recording
from cdtool.simulation import arm_recordings, gate_recordings
from cdtool.simulation.arm_model import simulate_arm_run
from cdtool.simulation.arm_parameters import ArmParameters
from cdtool.simulation.changed_machine import ChangedMachine
from cdtool.simulation.gate_model import GateParameters, simulate_gate_run
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.base import FittedThreshold
from cdtool.thresholds.contract import checked_fit
from cdtool.thresholds.own_rule import rule_for
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.signature import Signature

FIRST_SEED = 701
WINDOW = 1.0
FOLDS = 5
GROUPS = ("stiff", "soft", "very soft")
GATES = {"very soft": GateParameters(bumper_stiffness=8e3)}
# A softer bumper that bottoms out earlier.
ARMS = {"very soft": ArmParameters(bumper_stiffness=100.0, bumper_travel=5e-3)}
CHANGES = {
    "friction +20 %": ChangedMachine(friction=1.2),
    "friction -20 %": ChangedMachine(friction=0.8),
    "speed +10 %": ChangedMachine(speed=1.1),
    "speed -10 %": ChangedMachine(speed=0.9),
    "speed +20 %": ChangedMachine(speed=1.2),
    "speed -20 %": ChangedMachine(speed=0.8),
}
STREAMS = ("free", "fresh", *GROUPS)
ACTIVATION = Activation(debounce=3)


@dataclass(frozen=True)
class Run:
    """A simulated operation with the detector's signal; `onset` [s] on the load cell, NaN without a contact."""

    operation: Operation
    signal: Signal
    onset: float


@dataclass(frozen=True)
class Cell:
    """A simulated machine, "gate", or the arm in trial "T1" or "T2", one seed and one detector."""

    name: str
    seed: int
    detector: str
    without: tuple[str, ...] = ()

    @property
    def onset(self) -> OnsetRule:
        """Return the rule for the onset on the load cell."""
        return OnsetRule(20.0, 8.0) if self.name == "gate" else OnsetRule(0.5, 0.25)

    @cached_property
    def machine_file(self) -> MachineFile:
        """Return the machine file of the unchanged machine, as `cdtool simulate` writes it."""
        from cdtool import simulate_arm, simulate_gate

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "one"
            if self.name == "gate":
                simulate_gate(path, {"free": 1}, seed=1)
            else:
                simulate_arm(path, {"free": 1}, seed=1, trial=int(self.name[1]))  # type: ignore[arg-type]
            return read_machine_file(path / "machine.toml")

    def recording(self, group: str, number: int, changed: ChangedMachine) -> Recording:
        """Return a recording on the load side."""
        rng = np.random.default_rng([self.seed, STREAMS.index(group), number])
        kind: Any = "none" if group in ("free", "fresh") else group.removeprefix("very ")
        if self.name == "gate":
            gate = GATES.get(group, GateParameters())
            run = changed.logged_gate(simulate_gate_run(changed.gate(gate), rng, kind), 0.56)
            return gate_recordings.as_recording(run, f"{group} {number}", gate)
        arm, trial = ARMS.get(group, ArmParameters()), int(self.name[1])
        moved = simulate_arm_run(changed.arm(arm), rng, trial, kind)  # type: ignore[arg-type]
        logged = arm_recordings.as_recording(changed.logged_arm(moved, arm.torque_constant), f"{group} {number}")
        return self.machine_file.machine.referred_to_load(logged)

    def runs(self, group: str, count: int, changed: ChangedMachine | None = None) -> Iterator[Run]:
        """Yield the runs of a group."""
        machine = self.machine_file.machine
        detector = self.machine_file.detector(self.detector)
        for number in range(count):
            recording = self.recording(group, number, changed or ChangedMachine())
            onset = find_contacts(recording, self.onset)[0].start if group in GROUPS else math.nan
            seen = recording.without_ground_truth()
            seen = replace(seen, channels={k: v for k, v in seen.channels.items() if k not in self.without})
            operation = Operation(seen, motion_class(seen))
            signal = run_detector(operation, machine, detector)
            # What nothing reads any more would fill the memory.
            channels = {name: seen.channels[name] for name in ("speed", "position")}
            yield Run(replace(operation, recording=replace(seen, channels=channels)), signal, onset)


def crossings(run: Run, fitted: FittedThreshold) -> list[float]:
    """Return the times of all crossings [s]."""
    detection = judge(run.operation, "it", run.signal, (fitted,), ACTIVATION)
    return [item.time for item in detection.verdict.crossings]


def limits(free: Sequence[Run], rule: Any) -> dict[float, float]:
    """Return the safety factor of each budget that the free runs allow, each run judged by the others' model."""
    critical = []
    for fold in range(FOLDS):
        others = [(run.operation.recording, run.signal) for i, run in enumerate(free) if i % FOLDS != fold]
        fitted = checked_fit(rule, others)
        for run in free[fold::FOLDS]:
            detection = judge(run.operation, "it", run.signal, (fitted,), ACTIVATION)
            critical.append(critical_factor(detection, ACTIVATION))
    ordered = sorted(critical, reverse=True)
    allowed = {budget: math.floor(budget * (len(ordered) + 1) + 1e-9) for budget in (1e-2, 1e-3)}
    return {budget: ordered[count - 1] * (1.0 + 1e-9) for budget, count in allowed.items() if count >= 1}


def measure(cell: Cell, options: argparse.Namespace) -> None:
    """Print the results of a cell."""
    wanted = THRESHOLDS.load(options.threshold)()
    sides = "one"
    rule = with_context(rule_for(cell.machine_file.detector(cell.detector), wanted), sides, Signature(sides=sides))
    if options.order and hasattr(rule, "order"):
        rule = replace(rule, order=options.order)
    free = list(cell.runs("free", options.free))
    began = time.process_time()
    fitted = checked_fit(rule, [(run.operation.recording, run.signal) for run in free])
    fit_time = time.process_time() - began
    began = time.process_time()
    for run in free[:20]:
        fitted.evaluate(run.operation.recording, run.signal)
    pace = 1e-6 * sum(len(run.signal.time) for run in free[:20]) / (time.process_time() - began)
    print(f"\n{cell.name}, seed {cell.seed}: CPU time: learned in {fit_time:.1f} s, judged at {pace:.2f} M samples/s")
    sys.stdout.flush()
    factors = limits(free, rule)
    del free
    contacts = {group: list(cell.runs(group, options.impacts)) for group in GROUPS}
    fresh = list(cell.runs("fresh", options.fresh))
    rows = []
    for budget, factor in factors.items():
        at_limit = fitted.with_safety_factor(factor)
        row = [f"1/{1.0 / budget:.0f}", f"{factor:.2f}"]
        for group in GROUPS:
            latencies, missed, early = [], 0, 0
            for run in contacts[group]:
                times = crossings(run, at_limit)
                after = [item for item in times if run.onset <= item <= run.onset + WINDOW]
                missed += not after
                early += any(item < run.onset for item in times)
                latencies += [1e3 * (after[0] - run.onset)] if after else []
            row.append(
                f"{fmean(latencies):.1f} ms, {missed} missed, {early} early" if latencies else f"{missed} missed"
            )
        row.append(f"{sum(bool(crossings(run, at_limit)) for run in fresh)} of {len(fresh)}")
        rows.append(row)
    table(("budget", "limit", *GROUPS, "fresh runs with an alarm"), rows)
    if not options.changed:
        return
    at_limit = fitted.with_safety_factor(factors[max(factors)])
    rows = []
    for name, changed in CHANGES.items():
        alarms = unassessable = 0
        for run in cell.runs("fresh", options.changed, changed):
            verdict = judge(run.operation, "it", run.signal, (at_limit,), ACTIVATION).verdict
            alarms += bool(verdict.alarms)
            unassessable += verdict.outcome == "not_assessable"
        row = [name, f"{alarms} of {options.changed}", str(unassessable)]
        if name.startswith("friction"):
            some = [run for group in GROUPS for run in cell.runs(group, options.changed // 5, changed)]
            hits = [any(run.onset <= item <= run.onset + WINDOW for item in crossings(run, at_limit)) for run in some]
            row.append(f"{hits.count(False)} of {len(hits)}")
        rows.append([*row, "-"][:4])
    table(("changed machine, 1/100", "alarming", "not assessable", "contacts missed"), rows)


def main(arguments: list[str]) -> int:
    """Print a table for each cell and seed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", nargs="+", default=["gate"], choices=("gate", "T1", "T2"))
    parser.add_argument("--seeds", nargs="+", type=int, default=[FIRST_SEED])
    parser.add_argument("--free", type=int, default=200, help="impact-free runs to learn from")
    parser.add_argument("--fresh", type=int, default=200, help="other impact-free runs")
    parser.add_argument("--impacts", type=int, default=30, help="impacts of each kind")
    parser.add_argument("--changed", type=int, default=30, help="runs of each changed machine; 0: none")
    parser.add_argument("--detector", default="fused")
    parser.add_argument("--threshold", default="glr", help="of a detector without its own")
    parser.add_argument("--without", nargs="+", default=[], help="channels that are not mapped")
    parser.add_argument("--order", type=int, help="of the autoregression")
    options = parser.parse_args(arguments)
    print(environment())
    for name in options.cells:
        for seed in options.seeds:
            measure(Cell(name, seed, options.detector, tuple(options.without)), options)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
