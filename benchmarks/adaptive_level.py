"""What happens to signatures when friction, speed, mass or sensors of a machine change, with adaptive_level.

    python benchmarks/adaptive_level.py                                   # seeds 601 to 605, 100 runs a change
    python benchmarks/adaptive_level.py --seeds 1 --runs 10 --impacts 4 --machines T1 --changes 1

Each seed: 14 free runs to learn from, and of each changed machine other impact-free runs, stiff and soft impacts, and
the same impacts early, in the first second of the motion, through the files, simulated and scored by the functions of
`cdtool simulate` and `cdtool benchmark`. The machine file is that of the unchanged machine. It is a simulation, and no
evidence about a real machine. With the machine "emps", force pulses on a real axis: those of `emps_pulses.py`, judged
by signatures of four strokes each way.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections import defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import fmean

import emps_pulses
from timing import environment, table

from cdtool import benchmark, simulate_arm, simulate_gate
from cdtool.alarms.activation import Activation
from cdtool.alarms.judgement import judged
from cdtool.commands.learning.fitting import fitting
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.commands.simulate.arm_parameters import ArmParameters
from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.simulate.gate_model import GateParameters
from cdtool.detectors.momentum import Momentum
from cdtool.recordings.operations import operations_of
from cdtool.thresholds.signature import Signature

FIRST_SEED = 601
REACH = 6.0  # spreads
CHANGES = {
    "as learned": ChangedMachine(),
    "friction +20 %": ChangedMachine(friction=1.2),
    "friction -20 %": ChangedMachine(friction=0.8),
    "speed +3 %": ChangedMachine(speed=1.03),
    "mass +10 %": ChangedMachine(mass=1.1),
    "current +0.1 A": ChangedMachine(current_offset=0.1),
    "acceleration +0.05 m/s2": ChangedMachine(acceleration_offset=0.05),
    "motor +10 K": ChangedMachine(warming=10.0),
}
# Of runs with friction +20 %: the most that may alarm, and the most that the latency may grow as learned.
MOST_ALARMS, MOST_SLOWER = 0.05, 0.15
GROUPS = ("stiff", "soft", "early stiff", "early soft")
CHECKED = ("momentum", "friction_ekf")
MACHINES = ("gate", "T1", "T2", "emps")
# An obstacle this close to the start is touched in the first second of the motion.
EARLY_POSITION, EARLY_ANGLE = 0.05, math.radians(50.0)
BANDWIDTH = 20.0  # rad/s: of the momentum observer on the real axis
FILE = """machine = "learned/machine.toml"
detectors = ["gm", "feekf", "igm", "pi", "pt"]

[learn]
logs = ["learned/free/*.csv"]

[holdout]
logs = ["changed/holdout/*.csv"]

[impacts.stiff]
logs = ["changed/stiff/*.csv"]

[impacts.soft]
logs = ["changed/soft/*.csv"]

[impacts."early stiff"]
logs = ["early/stiff/*.csv"]

[impacts."early soft"]
logs = ["early/soft/*.csv"]

[onset]
above_n = {above}
back_to_n = {back_to}
"""


@dataclass(frozen=True)
class WithEarlyContact(ChangedMachine):
    """A changed machine whose obstacle is close to the start."""

    def gate(self, new: GateParameters) -> GateParameters:
        """Return the gate that was `new`."""
        return super().gate(replace(new, obstacle_position=EARLY_POSITION))

    def arm(self, new: ArmParameters) -> ArmParameters:
        """Return the arm that was `new`."""
        return super().arm(replace(new, obstacle_angle=(EARLY_ANGLE, EARLY_ANGLE)))


@dataclass
class Tally:
    """Of one detector with one kind of signature: runs, those that alarm, missed contacts, latencies [ms] by group."""

    runs: int = 0
    alarming: int = 0
    missed: int = 0
    latencies: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))

    def mean(self, group: str) -> float:
        """Return the mean latency [ms] of a group."""
        return fmean(self.latencies[group]) if self.latencies[group] else math.nan


def simulate(folder: Path, machine: str, seed: int, changed: ChangedMachine, options: argparse.Namespace) -> None:
    """Write what the signatures are learned from, the changed machine, and the benchmark file."""
    impacts = dict.fromkeys(("stiff", "soft"), options.impacts)
    for name, item, counts in (
        ("learned", ChangedMachine(), {"free": 14}),
        ("changed", changed, {"holdout": options.runs, **impacts}),
        ("early", WithEarlyContact(**vars(changed)), impacts),
    ):
        if machine == "gate":
            simulate_gate(folder / name, counts, seed=seed, changed=item)
        else:
            simulate_arm(folder / name, counts, seed=seed, trial=1 if machine == "T1" else 2, changed=item)
    above, back_to = (20.0, 8.0) if machine == "gate" else (0.5, 0.25)
    (folder / "benchmark.toml").write_text(FILE.format(above=above, back_to=back_to), encoding="utf-8")


def score(folder: Path, reach: float, tallies: dict[str, Tally]) -> None:
    """Add the results of the recordings in a folder, with signatures of that `adaptive_level`."""
    setup = read_benchmark_file(folder / "benchmark.toml")
    results = benchmark(replace(setup, rule=replace(setup.rule, adaptive_level=reach)), jobs=2).results
    for contact in results.contacts:
        if contact.latency_ms is not None:
            tallies[contact.detector].latencies[contact.group].append(contact.latency_ms)
        tallies[contact.detector].missed += contact.outcome == "missed"
    holdout = [alarm for alarm in results.false_alarms if alarm.group == "holdout"]
    alarming = {(alarm.detector, alarm.recording, alarm.operation) for alarm in holdout}
    for exposure in results.exposure:
        if exposure.group == "holdout":
            tallies[exposure.detector].runs += exposure.operations
            tallies[exposure.detector].alarming += sum(name == exposure.detector for name, *_ in alarming)


def shown(tally: Tally) -> list[str]:
    """Return the cells of a table."""
    return [f"{tally.alarming} of {tally.runs}", *(f"{tally.mean(group):.0f}" for group in GROUPS), str(tally.missed)]


def measure(machine: str, options: argparse.Namespace) -> list[str]:
    """Print a table per change of a simulated machine, and return what misses the targets on the gate."""
    faults = []
    learned: dict[str, Tally] = {}
    for name, changed in list(CHANGES.items())[: options.changes]:
        found = {reach: defaultdict[str, Tally](Tally) for reach in (0.0, REACH)}
        for seed in range(FIRST_SEED, FIRST_SEED + options.seeds):
            with tempfile.TemporaryDirectory() as folder:
                simulate(Path(folder), machine, seed, changed, options)
                for reach, tallies in found.items():
                    score(Path(folder), reach, tallies)
        still, following = found.values()
        learned = learned or still
        print(f"\n{machine}, {name}", flush=True)
        head = ("detector", "alarming", *GROUPS, "missed", "alarming", *GROUPS, "missed")
        table(head, [(detector, *shown(still[detector]), *shown(following[detector])) for detector in still])
        is_checked = machine == "gate" and name in ("as learned", "friction +20 %", "friction -20 %")
        for detector in CHECKED if is_checked else ():
            tally = following[detector]
            if tally.alarming > MOST_ALARMS * tally.runs:
                faults.append(f"{name}: {detector} alarms in {tally.alarming} of {tally.runs} runs")
            for group in GROUPS[:2]:
                if tally.mean(group) > (1.0 + MOST_SLOWER) * learned[detector].mean(group):
                    faults.append(f"{name}: {detector} needs {tally.mean(group):.0f} ms for {group} contacts")
    print("\nleft: adaptive_level 0, right:", REACH)
    return faults


def measure_real(folder: Path) -> None:
    """Print how soon signatures of a real axis see pulses of 176 N: recorded ones, and injected ones."""
    if not folder.is_dir():
        print(f"\nemps: skipped, {folder} is not there")
        return
    machine_file = emps_pulses.identified(folder)
    machine, model = emps_pulses.model_of(machine_file)
    axes = emps_pulses.compared(folder, machine_file, model)
    observer = Momentum(bandwidth=BANDWIDTH)
    signals = [observer.signal(item, machine).changed(joints=item.joints) for item in (axes.injected, axes.recorded)]
    free = observer.signal(axes.free, machine).changed(joints=axes.free.joints)
    strokes = operations_of(axes.free, "motion")
    pairs = [(item, free.part(free.rows(item.recording.start, item.recording.end))) for item in strokes]
    rows = []
    for reach in (0.0, REACH):
        learned = fitting(Signature(sides="two", force=True, adaptive_level=reach))(pairs).thresholds
        for name, recording, signal in zip(
            ("injected", "recorded"), (axes.injected, axes.recorded), signals, strict=True
        ):
            statistic, band = judged(recording, signal, learned, "motion").evaluated
            crossings = [item.time for item in Activation().alarms(statistic, band)[1]]
            pulses = [statistic.time[part] for part in axes.sections]
            after = [
                [1e3 * (time - clock[0]) for time in crossings if clock[0] <= time <= clock[-1]] for clock in pulses
            ]
            times = [item[0] for item in after if item]
            mean = f"{fmean(times):.1f}" if times else "none"
            rows.append((name, f"{reach:g}", len(axes.sections), len(times), mean))
    print("\nemps, momentum")
    table(("pulses", "adaptive_level", "number", "seen", "mean ms"), rows)


def main(arguments: list[str]) -> int:
    """Print the tables, and 1 where a checked detector alarms too often or becomes too slow on the gate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--runs", type=int, default=20, help="impact-free runs of each seed and change")
    parser.add_argument("--impacts", type=int, default=10, help="impacts of each kind, seed and change")
    parser.add_argument("--machines", nargs="+", choices=MACHINES, default=list(MACHINES))
    parser.add_argument("--changes", type=int, default=len(CHANGES), help="only the first of the changes")
    parser.add_argument("--data", type=Path, default=emps_pulses.DATA, help="recordings of the real axis")
    options = parser.parse_args(arguments)
    print(environment())
    faults = []
    for machine in options.machines:
        if machine == "emps":
            measure_real(options.data)
        else:
            faults += measure(machine, options)
    print(*faults, sep="\n")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
