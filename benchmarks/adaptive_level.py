"""What happens to signatures when friction, speed, mass or sensors of the simulated gate change, with adaptive_level.

    python benchmarks/adaptive_level.py                                   # seeds 601 to 605, 100 runs a change
    python benchmarks/adaptive_level.py --seeds 1 --runs 10 --impacts 4

Each seed: 14 free runs to learn from, and of each changed gate other impact-free runs, stiff and soft impacts, through
the files, simulated and scored by the functions of `cdtool simulate gate` and `cdtool benchmark`. The machine file is
that of the unchanged gate. It is a simulation, and no evidence about a real gate.
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

from timing import environment, table

from cdtool import benchmark, simulate_gate
from cdtool.simulation.changed_machine import ChangedMachine
from cdtool.workflows.benchmark.benchmark_file import read_benchmark_file

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
GROUPS = ("stiff", "soft")
CHECKED = ("momentum", "friction_ekf")
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

[onset]
above_n = 20.0
back_to_n = 8.0
"""


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


def simulate(folder: Path, seed: int, changed: ChangedMachine, runs: int, impacts: int) -> None:
    """Write what the signatures are learned from, the changed gate, and the benchmark file."""
    simulate_gate(folder / "learned", {"free": 14}, seed=seed)
    counts = {"holdout": runs, "stiff": impacts, "soft": impacts}
    simulate_gate(folder / "changed", counts, seed=seed, changed=changed)
    (folder / "benchmark.toml").write_text(FILE, encoding="utf-8")


def score(folder: Path, reach: float, tallies: dict[str, Tally]) -> None:
    """Add the results of the recordings in a folder, with signatures of that `adaptive_level`."""
    setup = read_benchmark_file(folder / "benchmark.toml")
    results = benchmark(replace(setup, rule=replace(setup.rule, adaptive_level=reach)), jobs=2).results
    for contact in results.contacts:
        if contact.latency_ms is not None:
            tallies[contact.detector].latencies[contact.group].append(contact.latency_ms)
        tallies[contact.detector].missed += contact.outcome == "missed"
    alarming = {(alarm.detector, alarm.recording) for alarm in results.false_alarms if alarm.group == "holdout"}
    for exposure in results.exposure:
        if exposure.group == "holdout":
            tallies[exposure.detector].runs += exposure.operations
            tallies[exposure.detector].alarming += sum(name == exposure.detector for name, _ in alarming)


def shown(tally: Tally) -> list[str]:
    """Return the cells of a table."""
    return [f"{tally.alarming} of {tally.runs}", *(f"{tally.mean(group):.0f}" for group in GROUPS), str(tally.missed)]


def main(arguments: list[str]) -> int:
    """Print a table per change, and 1 where a checked detector alarms too often or becomes too slow."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--runs", type=int, default=20, help="impact-free runs of each seed and change")
    parser.add_argument("--impacts", type=int, default=10, help="impacts of each kind, seed and change")
    options = parser.parse_args(arguments)
    print(environment())
    faults = []
    learned: dict[str, Tally] = {}
    for name, changed in CHANGES.items():
        found = {reach: defaultdict[str, Tally](Tally) for reach in (0.0, REACH)}
        for seed in range(FIRST_SEED, FIRST_SEED + options.seeds):
            with tempfile.TemporaryDirectory() as folder:
                simulate(Path(folder), seed, changed, options.runs, options.impacts)
                for reach, tallies in found.items():
                    score(Path(folder), reach, tallies)
        still, following = found.values()
        learned = learned or still
        print(f"\n{name}")
        head = ("detector", "alarming", *GROUPS, "missed", "alarming", *GROUPS, "missed")
        table(head, [(detector, *shown(still[detector]), *shown(following[detector])) for detector in still])
        for detector in CHECKED if name in ("as learned", "friction +20 %", "friction -20 %") else ():
            tally = following[detector]
            if tally.alarming > MOST_ALARMS * tally.runs:
                faults.append(f"{name}: {detector} alarms in {tally.alarming} of {tally.runs} runs")
            for group in GROUPS:
                if tally.mean(group) > (1.0 + MOST_SLOWER) * learned[detector].mean(group):
                    faults.append(f"{name}: {detector} needs {tally.mean(group):.0f} ms for {group} contacts")
    print("\nleft: adaptive_level 0, right:", REACH)
    print(*faults, sep="\n")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
