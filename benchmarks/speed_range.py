"""What signatures do at speeds between two learned ones, with speed_range, and beside one learned at that very speed.

    python benchmarks/speed_range.py                                      # seeds 601 to 605, 100 runs a speed
    python benchmarks/speed_range.py --seeds 1 --runs 10 --impacts 4 --machines gate --speeds 0.9 1.0

Each seed: 14 free runs at 0.8 and 14 at 1.2 of the nominal speed (--learned) to learn from, for comparison 14 at the
tested speed, and at that speed other impact-free runs, stiff and soft impacts. A share not assessable is that of
the samples in motion. --stribeck-speed: up to about this speed [m/s] the gate's friction falls as the speed rises,
instead of up to 0.02 m/s; it is then far from linear between the learned speeds. All of it is a simulation, and no
evidence about a real machine.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
from timing import environment, table

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge, run_detector
from cdtool.commands.simulate import arm_recordings, gate_recordings
from cdtool.commands.simulate.arm_model import simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters
from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.detectors.detection import Signal, Status
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.motion import motion_class
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import FittedThreshold
from cdtool.thresholds.signature import Signature
from cdtool.truth.onset import find_contacts
from cdtool.truth.onset_rule import OnsetRule

FIRST_SEED = 601
LEARNED = (0.8, 1.2)
SPEEDS = (0.8, 0.9, 1.0, 1.1, 1.2, 0.7, 1.3)
MACHINES = ("gate", "T1", "T2")
DETECTORS = ("momentum", "friction_ekf", "inertial_momentum", "pure_inertia", "pure_torque")
GROUPS = ("stiff", "soft")
# No run of a group has a random number in common with one of another.
STREAMS = ("free", "fresh", *GROUPS)
# Alarms count at most this long after the onset of a contact [s].
WINDOW = 1.0
RUNS = 14
# Of runs within the range: the most that may alarm, and the most that the latency may be above that of a signature of
# the same speed, at the learned speeds.
MOST_ALARMS, MOST_SLOWER = 0.05, 0.05


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
    gate: GateParameters

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
        kind: Any = group if group in GROUPS else "none"
        if self.name == "gate":
            run = changed.logged_gate(simulate_gate_run(changed.gate(self.gate), rng, kind), 0.56)
            return gate_recordings.as_recording(run, f"{group} {number}", self.gate)
        arm, trial = ArmParameters(), int(self.name[1])
        moved = simulate_arm_run(changed.arm(arm), rng, trial, kind)  # type: ignore[arg-type]
        logged = arm_recordings.as_recording(changed.logged_arm(moved, arm.torque_constant), f"{group} {number}")
        return self.machine_file.machine.referred_to_load(logged)

    def runs(self, group: str, count: int, changed: ChangedMachine) -> Iterator[Run]:
        """Yield the runs of a group."""
        machine = self.machine_file.machine
        detector = self.machine_file.detector(self.detector)
        for number in range(count):
            recording = self.recording(group, number, changed)
            onset = find_contacts(recording, self.onset)[0].start if group in GROUPS else math.nan
            seen = recording.without_ground_truth()
            operation = Operation(seen, motion_class(seen))
            signal = run_detector(operation, machine, detector)
            # What nothing reads any more would fill the memory.
            channels = {name: seen.channels[name] for name in ("speed", "position")}
            yield Run(replace(operation, recording=replace(seen, channels=channels)), signal, onset)


@dataclass
class Tally:
    """Of one kind of signature: runs, those that alarm, shares not assessable, missed contacts, latencies [ms]."""

    runs: int = 0
    alarming: int = 0
    missed: int = 0
    unassessed: list[float] = field(default_factory=list)
    latencies: dict[str, list[float]] = field(default_factory=lambda: {group: [] for group in GROUPS})

    def mean(self, group: str) -> float:
        """Return the mean latency [ms] of a group."""
        return fmean(self.latencies[group]) if self.latencies[group] else math.nan

    def add(self, run: Run, group: str, thresholds: Sequence[FittedThreshold]) -> None:
        """Add the result of a run: an impact-free one, or one of a group of impacts."""
        detection = judge(run.operation, "it", run.signal, thresholds, Activation())
        times = [alarm.time for alarm in detection.verdict.alarms]
        if group in GROUPS:
            after = [time for time in times if run.onset <= time <= run.onset + WINDOW]
            self.missed += not after
            self.latencies[group] += [1e3 * (after[0] - run.onset)] if after else []
            return
        self.runs += 1
        self.alarming += bool(times)
        status = detection.statistic.status[:, 0]
        moves = status != Status.NO_LIMIT
        self.unassessed.append(float(np.mean(status[moves] == Status.OTHER_SPEED)))

    def shown(self) -> list[str]:
        """Return the cells of a table."""
        share = f"{100.0 * fmean(self.unassessed):.0f} %"
        return [
            f"{self.alarming} of {self.runs}",
            share,
            *(f"{self.mean(group):.1f}" for group in GROUPS),
            f"{self.missed}",
        ]


def learned(cell: Cell, speed: float) -> FittedThreshold:
    """Return the signature of one speed."""
    rule = Signature(sides=cell.machine_file.machine.default_sides, speed_range=True)
    runs = cell.runs("free", RUNS, ChangedMachine(speed=speed))
    return rule.fit([(run.operation.recording, run.signal) for run in runs])


def measure(name: str, detector: str, options: argparse.Namespace) -> list[str]:
    """Print a table of a detector on a machine, and return what misses the targets."""
    gate = GateParameters(stribeck_speed=options.stribeck_speed)
    tallies = {speed: (Tally(), Tally()) for speed in options.speeds}
    counts = {"fresh": options.runs, **dict.fromkeys(GROUPS, options.impacts)}
    for seed in range(FIRST_SEED, FIRST_SEED + options.seeds):
        cell = Cell(name, seed, detector, gate)
        ends = [learned(cell, speed) for speed in options.learned]
        for speed, (own, between) in tallies.items():
            same = dict(zip(options.learned, ends, strict=True)).get(speed) or learned(cell, speed)
            for group, count in counts.items():
                for run in cell.runs(group, count, ChangedMachine(speed=speed)):
                    own.add(run, group, [same])
                    between.add(run, group, ends)
    print(f"\n{name}, {detector}", flush=True)
    head = ("speed", "alarming", "n.a.", *GROUPS, "missed", "alarming", "n.a.", *GROUPS, "missed")
    table(head, [(f"{speed:g}", *own.shown(), *between.shown()) for speed, (own, between) in tallies.items()])
    return [
        f"{name}, {detector}, {speed:g}: {fault}"
        for speed, (own, between) in tallies.items()
        for fault in faults(speed, own, between, options.learned)
    ]


def faults(speed: float, own: Tally, between: Tally, ends: Sequence[float]) -> list[str]:
    """Return what misses the targets at a speed, learned at the speeds `ends`."""
    found = []
    if min(ends) <= speed <= max(ends) and between.alarming > MOST_ALARMS * between.runs:
        found.append(f"{between.alarming} of {between.runs} runs alarm")
    for group in GROUPS if speed in ends else ():
        if between.mean(group) > (1.0 + MOST_SLOWER) * own.mean(group):
            found.append(f"{group} contacts {between.mean(group):.1f} ms, not {own.mean(group):.1f} ms")
    return found


def main(arguments: list[str]) -> int:
    """Print a table per machine and detector, and 1 where one alarms too often or becomes too slow."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--runs", type=int, default=20, help="impact-free runs of each seed and speed")
    parser.add_argument("--impacts", type=int, default=10, help="impacts of each kind, seed and speed")
    parser.add_argument("--machines", nargs="+", choices=MACHINES, default=list(MACHINES))
    parser.add_argument("--speeds", nargs="+", type=float, default=list(SPEEDS), help="shares of the nominal speed")
    parser.add_argument("--learned", nargs="+", type=float, default=list(LEARNED), help="speeds to learn from")
    parser.add_argument("--detectors", nargs="+", default=list(DETECTORS), help="full names")
    parser.add_argument("--stribeck-speed", type=float, default=GateParameters.stribeck_speed)
    options = parser.parse_args(arguments)
    print(environment())
    found = [
        fault
        for name in options.machines
        for detector in options.detectors
        for fault in measure(name, detector, options)
    ]
    print(
        "\nleft: learned at that speed; right: learned at", " and ".join(map(str, options.learned)), "with speed_range"
    )
    print(*found, sep="\n")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
