"""Verdicts with and without reference channels: order, means, and contacts from 0.05 m of travel on.

    python benchmarks/without_reference.py                 # seeds 601 602 603 604 605
    python benchmarks/without_reference.py --impacts 2 701

The simulated gate and both trials of the simulated arm are learned from and hit twice with the same seeds: once with
logged references, once with only the four measured channels. Every detector except desired dynamics, which needs a
reference, must show the same order and means within 5 % or one sample, and no contact may be not assessable because of
the class of motion. Then the gate is hit at 0.05 to 0.3 m of travel, during or just after its acceleration. Exits with
1 if a requirement is not met.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from cdtool.commands.scoring.benchmark import benchmark
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.commands.simulate.gate_model import GateParameters
from cdtool.commands.simulate.gate_recordings import simulate_gate
from cdtool.results.results import Results

DETECTORS = ("pi", "feekf", "gm", "igm", "pt", "vo", "eo", "dd", "kmo")
EARLY = (0.05, 0.1, 0.15, 0.2, 0.3)
WITHIN = 0.05


def results_of(folder: Path) -> Results:
    """The results of a folder's benchmark with every detector."""
    return benchmark(folder / "benchmark.toml", detectors=DETECTORS).results


def means(results: Results) -> dict[tuple[str, str], float]:
    """Mean latency [ms] by group and detector, where every contact was detected."""
    found: dict[tuple[str, str], list[float]] = {}
    for item in results.contacts:
        found.setdefault((item.group, item.detector), []).append(
            item.latency_ms if item.latency_ms is not None else float("nan")
        )
    return {key: sum(values) / len(values) for key, values in found.items() if all(v == v for v in values)}


def other_speed(results: Results) -> Iterator[str]:
    """Contacts that are not assessable because of the class of motion."""
    for item in results.contacts:
        if item.outcome == "not_assessable" and item.reason and "speed" in item.reason:
            yield f"{item.recording}, {item.detector}: {item.reason}"


def compare(name: str, seed: int, impacts: int, folder: Path) -> list[str]:
    """What differs between the two ways to log."""
    writers = {
        "gate": simulate_gate,
        "arm, trial 1": partial(simulate_arm, trial=1),
        "arm, trial 2": partial(simulate_arm, trial=2),
    }
    counts = {"free": 14, "holdout": 0, "stiff": impacts, "soft": impacts}
    both = []
    for references in (True, False):
        writers[name](folder / str(references), counts, seed, references=references)
        both.append(results_of(folder / str(references)))
    with_them, without = (means(item) for item in both)
    faults = [f"{name}, seed {seed}: {text}" for text in other_speed(both[1])]
    for key in sorted(with_them.keys() | without.keys()):
        ours, theirs = with_them.get(key), without.get(key)
        if ours is None or theirs is None or abs(ours - theirs) > max(WITHIN * ours, 1.0):
            faults.append(f"{name}, seed {seed}, {key}: mean {ours} ms with references, {theirs} ms without")
    for group in {group for group, _ in with_them}:
        order = [
            sorted((d for g, d in known if g == group), key=lambda d, known=known: known[group, d])
            for known in (with_them, without)
        ]
        if order[0] != order[1]:
            faults.append(f"{name}, seed {seed}, {group}: another order of the detectors")
    largest = max((abs(with_them[key] - without[key]) for key in with_them.keys() & without.keys()), default=0.0)
    print(f"{name}, seed {seed}: {len(with_them)} means compared, the largest difference {largest:.2f} ms", flush=True)
    return faults


def early(seed: int, folder: Path) -> list[str]:
    """Contacts while the gate accelerates: detected, missed and not assessable, and those of another speed."""
    faults = []
    base = GateParameters()
    for place in EARLY:
        gate = replace(base, obstacle_position=place, obstacle_scatter=0.002)
        target = folder / f"{place}"
        simulate_gate(target, {"free": 14, "stiff": 2, "soft": 2}, seed, parameters=gate, references=False)
        results = results_of(target)
        counts = dict.fromkeys(("detected", "missed", "not_assessable"), 0)
        for item in results.contacts:
            counts[item.outcome] += 1
        faults += [f"gate at {place} m, seed {seed}: {text}" for text in other_speed(results)]
        print(f"gate hit at {place} m, seed {seed}: {counts}", flush=True)
    return faults


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seeds", nargs="*", type=int, default=[601, 602, 603, 604, 605])
    parser.add_argument("--impacts", type=int, default=6, help="impacts per group and seed")
    chosen = parser.parse_args()
    faults = []
    for seed in chosen.seeds:
        with tempfile.TemporaryDirectory() as folder:
            for name in ("gate", "arm, trial 1", "arm, trial 2"):
                faults += compare(name, seed, chosen.impacts, Path(folder) / name)
            faults += early(seed, Path(folder) / "early")
    print("\n".join(faults) or "same order and means, no contact not assessable because of its class")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
