"""What `cdtool tune` finds on the simulated gate, checked on fresh recordings, and how long it takes.

    python benchmarks/tuning.py                                           # seeds 801 to 805, 200 free runs, 30 + 30
    python benchmarks/tuning.py --seeds 801 --free 60 --impacts 6 --fresh 40 --budget 1/20op

Each seed: free runs and impacts to tune FEEKF and IGM on, and others, of another seed, to check the better of the two:
its latencies, and its alarms in fresh impact-free runs. Everything goes through the files, by the functions of
`cdtool simulate gate`, `cdtool tune` and `cdtool benchmark`. It is a simulation, and no evidence about a real gate.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from time import perf_counter

from timing import environment, table

from cdtool import benchmark, simulate_gate, tune
from cdtool.commands.scoring.benchmark_file import HOLDOUT, ImpactGroup, read_benchmark_file
from cdtool.commands.tune.files import open_folder, write_tuning
from cdtool.execution.workers import Workers

SEEDS, FRESH = (801, 802, 803, 804, 805), 100_000
DETECTORS = ("friction_ekf", "inertial_momentum")
# At 1/100 with 200 free runs: mean latencies [ms], alarms of 1000 fresh runs, seconds per detector, nested over fresh.
MOST = {"stiff": 16.0, "soft": 62.0}
MOST_ALARMS, MOST_SECONDS, NESTED_OFF = 0.022, 180.0, 0.10


@dataclass
class Checked:
    """Of one seed: the better detector, nested and fresh mean latencies [ms], alarms in fresh runs, seconds."""

    words: str
    nested: dict[str, float]
    fresh: dict[str, float]
    missed: int
    alarming: int
    runs: int
    seconds: dict[str, float]


def check(folder: Path, seed: int, free: int, impacts: int, fresh: int, budget: str) -> Checked:
    """Tune each detector on recordings of a seed, and check the better one on those of another."""
    simulate_gate(folder / "gate", {"free": free, "holdout": 1, "stiff": impacts, "soft": impacts}, seed=seed)
    counts = {"holdout": fresh, "stiff": impacts, "soft": impacts}
    simulate_gate(folder / "fresh", counts, seed=seed + FRESH)
    seconds, made = {}, []
    for name in DETECTORS:
        begin = perf_counter()
        file = folder / "gate" / "benchmark.toml"
        target = folder / name
        searches = open_folder(target, ())
        done = tune(file, budget, detectors=(name,), journals=searches, workers=Workers(2))
        write_tuning(done, target)
        seconds[name] = perf_counter() - begin
        made.append((done.detectors[0], target))
    tuned, target = min(made, key=lambda item: item[0].honest.score)
    setup = read_benchmark_file(target / "benchmark.toml")
    groups = {
        name: ImpactGroup(tuple(sorted((folder / "fresh" / name).iterdir())), 1.0, is_impact_free=name == HOLDOUT)
        for name in ("stiff", "soft", HOLDOUT)
    }
    results = benchmark(replace(setup, impacts=groups), jobs=2).results
    latencies: dict[str, list[float]] = {"stiff": [], "soft": []}
    for contact in results.contacts:
        latencies[contact.group].append(1000.0 if contact.latency_ms is None else contact.latency_ms)
    return Checked(
        f"{tuned.detector} {tuned.choice.rule.name}",
        {name: item.mean_ms for name, item in tuned.honest.groups.items()},
        {name: fmean(values) for name, values in latencies.items()},
        sum(contact.outcome == "missed" for contact in results.contacts),
        len({(alarm.recording, alarm.operation) for alarm in results.false_alarms if alarm.group == HOLDOUT}),
        fresh,
        seconds,
    )


def faults_of(found: list[Checked]) -> list[str]:
    """Return what is not as it should be at 1/100 with 200 free runs."""
    faults = []
    for group, most in MOST.items():
        fresh, nested = fmean(item.fresh[group] for item in found), fmean(item.nested[group] for item in found)
        if fresh > most:
            faults.append(f"{group}: {fresh:.1f} ms on fresh recordings")
        if abs(nested / fresh - 1.0) > NESTED_OFF:
            faults.append(f"{group}: nested {nested:.1f} ms, fresh {fresh:.1f} ms")
    alarms, runs = sum(item.alarming for item in found), sum(item.runs for item in found)
    if alarms > MOST_ALARMS * runs:
        faults.append(f"{alarms} of {runs} fresh runs alarm")
    longest = max(value for item in found for value in item.seconds.values())
    return [*faults, *([f"a detector took {longest:.0f} s"] if longest > MOST_SECONDS else [])]


def main(arguments: list[str]) -> int:
    """Print a row per seed, and 1 if anything is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--free", type=int, default=200, help="impact-free runs to tune on")
    parser.add_argument("--impacts", type=int, default=30, help="impacts of each kind, to tune on and to check on")
    parser.add_argument("--fresh", type=int, default=200, help="impact-free runs to check on")
    parser.add_argument("--budget", default="1/100op")
    options = parser.parse_args(arguments)
    print(environment())
    found = []
    for seed in options.seeds:
        with tempfile.TemporaryDirectory() as folder:
            found.append(check(Path(folder), seed, options.free, options.impacts, options.fresh, options.budget))
        item = found[-1]
        means = [
            f"{kind} {group} {values[group]:.1f}"
            for kind, values in (("nested", item.nested), ("fresh", item.fresh))
            for group in MOST
        ]
        took = [f"{name} {value:.0f} s" for name, value in item.seconds.items()]
        print(
            seed,
            item.words,
            *means,
            f"{item.missed} missed, {item.alarming} of {item.runs} alarm",
            *took,
            sep="; ",
            flush=True,
        )
    head = ("choice", "nested stiff", "soft", "fresh stiff", "soft", "missed", "alarming", "longest [s]")
    rows = [
        (
            item.words,
            *(f"{item.nested[group]:.1f}" for group in MOST),
            *(f"{item.fresh[group]:.1f}" for group in MOST),
            str(item.missed),
            f"{item.alarming} of {item.runs}",
            f"{max(item.seconds.values()):.0f}",
        )
        for item in found
    ]
    table(head, rows)
    faults = faults_of(found) if (options.free, options.budget) == (200, "1/100op") else []
    print(*faults, sep="\n")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
