"""Does `cdtool compare` find a planted regression, and does it report nothing for equal builds?

    python benchmarks/compare_builds.py           # seeds 901 902 903 904 905 for the planted one
    python benchmarks/compare_builds.py 911 912   # others

Planted: the simulated gate with a debounce of 14 samples instead of 9, FEEKF and GM on the same 30 stiff and 30 soft
impacts of each seed (paired). Equal: two identical builds, signatures included, each on its own 30 + 30 impacts
(unpaired), 100 times. These are drawn without replacement from a pool of 600 + 600, simulated and scored once: within a
comparison no impact is used twice, between comparisons they recur. The same draws, with a debounce of 14 for the new
build, measure how often a regression of 5 ms is found without pairs.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from timing import environment

from cdtool import benchmark, compare, simulate_gate
from cdtool.alarms.activation import Activation
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.results.results import Results

SEEDS = (901, 902, 903, 904, 905)
IMPACTS = 30
GROUPS = ("stiff", "soft")
OLD, NEW = 9, 14
DETECTORS = ("feekf", "gm")
POOL, POOL_SEED = 600, 999
COMPARISONS, QUIET_AT_LEAST = 100, 90


def judged(seed: int, impacts: int) -> tuple[Results, Results]:
    """The old and the new build on the same simulated impacts."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "gate"
        simulate_gate(folder, {"free": 14, **dict.fromkeys(GROUPS, impacts)}, seed=seed)
        setup = read_benchmark_file(folder / "benchmark.toml")
        builds = [replace(setup, activation=Activation(count)) for count in (OLD, NEW)]
        old, new = (benchmark(build, detectors=DETECTORS, jobs=2).results for build in builds)
    return old, new


def of_recordings(results: Results, names: Collection[str]) -> Results:
    """Return the part of results of these recordings; exposure is divided in proportion."""
    kept = [item for item in results.recordings if item.recording in names]
    share = {group: sum(item.group == group for item in kept) for group in GROUPS}
    return replace(
        results,
        recordings=tuple(kept),
        contacts=tuple(item for item in results.contacts if item.recording in names),
        false_alarms=tuple(item for item in results.false_alarms if item.recording in names),
        exposure=tuple(
            replace(
                item,
                recordings=share[item.group],
                operations=share[item.group],
                hours=item.hours * share[item.group] / item.recordings,
            )
            for item in results.exposure
        ),
    )


def planted(seeds: tuple[int, ...]) -> bool:
    """Print the result on each seed; return whether every latency is found to be worse on each."""
    found = 0
    for seed in seeds:
        comparison = compare(*judged(seed, IMPACTS))
        print(f"seed {seed}: {comparison.words}")
        for row in comparison.rows:
            print(f"  {row.group} {row.detector}: {row.words}")
        latencies = [item for row in comparison.rows for item in row.questions if item.figure == "latency_ms"]
        found += comparison.verdict == "worse" and all(item.outcome == "worse" for item in latencies)
    return said(f"planted, paired: {found} of {len(seeds)} seeds found worse, every latency", found == len(seeds))


def quiet() -> bool:
    """Print how often two equal builds on different recordings show no change, and how often 5 ms are found."""
    begin = perf_counter()
    old, new = judged(POOL_SEED, POOL)
    print(f"pool: {POOL} + {POOL} impacts simulated and judged twice in {perf_counter() - begin:.0f} s")
    names = {group: [item.recording for item in old.recordings if item.group == group] for group in GROUPS}
    verdicts: dict[str, Counter[str]] = {"equal": Counter(), "slower": Counter()}
    rng = np.random.default_rng(POOL_SEED)
    for _ in range(COMPARISONS):
        drawn = [rng.permutation(known)[: 2 * IMPACTS] for known in names.values()]
        first = {str(name) for each in drawn for name in each[:IMPACTS]}
        second = {str(name) for each in drawn for name in each[IMPACTS:]}
        before = of_recordings(old, first)
        for kind, after in (("equal", old), ("slower", new)):
            comparison = compare(before, of_recordings(after, second))
            assert not any(row.paired for row in comparison.rows)
            verdicts[kind][comparison.verdict] += 1
    print(f"5 ms slower, unpaired: {counted(verdicts['slower'])}")
    silent = verdicts["equal"]["no change shown"]
    print(f"equal builds, unpaired: {counted(verdicts['equal'])}")
    wanted = f"equal builds, unpaired: no change shown in {silent} of {COMPARISONS}, wanted {QUIET_AT_LEAST}"
    return said(wanted, silent >= QUIET_AT_LEAST)


def counted(verdicts: Counter[str]) -> str:
    return ", ".join(f"{verdict} {count}" for verdict, count in verdicts.most_common())


def said(text: str, good: bool) -> bool:
    print(f"{'ok  ' if good else 'FAIL'}  {text}", flush=True)
    return good


def main(seeds: tuple[int, ...]) -> int:
    """Print both; return 0 if both requirements are met."""
    print(
        f"== comparing builds: {IMPACTS} + {IMPACTS} impacts, debounce {OLD} against {NEW}\n{environment()}", flush=True
    )
    return 0 if planted(seeds) & quiet() else 1


if __name__ == "__main__":
    sys.exit(main(tuple(map(int, sys.argv[1:])) or SEEDS))
