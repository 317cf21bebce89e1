"""What one more recording costs `cdtool benchmark`: five detectors on 7 s of a gate at 1 kHz, read from CSV.

CPU time from the first scored log to the last, per log: start-up, learning, final statistics and reports are not in it.
The peer is `bare_script.py`; the limit of 12 ms is for a machine on which it takes 3.3 ms, so the two are compared. 200
and 2,000 recordings, with one job and with two, at least five rounds; every run is a new process. Two bare scripts at
once show how much two jobs can gain on this machine: its cores may share parts.

python benchmarks/whole_benchmark.py            # some minutes; 1 GB in the temporary folder
python benchmarks/whole_benchmark.py --guard    # 50 recordings in one process, half a minute
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import perf_counter, process_time

from timing import Spread, main, ratio, table, verdict

from cdtool.commands.scoring.benchmark import benchmark
from cdtool.commands.simulate.gate_recordings import simulate_gate
from cdtool.execution.workers import Workers

COUNTS = {"free": 14, "holdout": 66, "stiff": 67, "soft": 67}
COPIES = 10
SEED = 1
ROUNDS = 5
# Logs are read by pandas: 1.35 times the 12 ms, where the bare script takes 3.3 ms, that compiled readers took.
AT_MOST_OF_BARE = 7.0
AT_LEAST_FASTER = 1.8
AT_MOST_MIB, AT_MOST_MORE_MIB = 350.0, 250.0
# The guard, with few recordings in one process, is at 8 to 10: it fails where a recording costs a half more.
GUARD_COUNTS = {"free": 11, "holdout": 17, "stiff": 17, "soft": 16}
GUARD_ROUNDS = 3
GUARD_AT_MOST = 14.0

_RUN = "import json, sys; from whole_benchmark import run; print(json.dumps(run(sys.argv[1], int(sys.argv[2]))))"
_BARE = "import sys; from whole_benchmark import bare; print(bare(sys.argv[1]))"


def run(folder: str, jobs: int) -> dict[str, float]:
    """Return CPU time [s] of this process and time on the clock [s] per scored log, and peak memory [MiB]."""
    import resource

    seen: list[tuple[int, float, float]] = []

    def progress(number: int, _: int) -> None:
        if number == 1:  # of the runs that are learned from, then of the logs that are scored
            seen.clear()
        seen.append((number, process_time(), perf_counter()))

    done = benchmark(Path(folder) / "benchmark.toml", workers=Workers(jobs, progress=progress))
    # Workers start with the first logs; afterwards each log that comes back took its share of the time.
    first, last = seen[2 * jobs], seen[-1]
    logs = last[0] - first[0]
    assert last[0] == len(done.results.recordings)
    peaks = [resource.getrusage(who).ru_maxrss / 1024.0 for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return {
        "cpu": (last[1] - first[1]) / logs,
        "clock": (last[2] - first[2]) / logs,
        "logs": logs,
        "peak": peaks[0],
        "worker": peaks[1] if jobs > 1 else 0.0,
    }


def bare(folder: str) -> float:
    """Return the CPU time of the bare script per scored log [s]."""
    import bare_script  # loads pandas, which cdtool does not: it would count as memory of the benchmark

    return bare_script.cost(*_logs(Path(folder)))


def _logs(folder: Path) -> tuple[list[Path], list[Path]]:
    scored = [path for group in ("holdout", "stiff", "soft") for path in sorted((folder / group).glob("*.csv"))]
    return sorted((folder / "free").glob("*.csv")), scored


def measure() -> bool:
    with tempfile.TemporaryDirectory() as name:
        few, many = Path(name) / "200", Path(name) / "2000"
        simulate_gate(few, COUNTS, SEED, file_format="csv")
        _multiply(few, many)
        found: dict[str, list[dict[str, float]]] = {"200, 1 job": [], "2000, 1 job": [], "2000, 2 jobs": []}
        peers, together = [], []
        for number in range(-1, ROUNDS):
            made = {
                "200, 1 job": _in_process(_RUN, few, 1),
                "2000, 1 job": _in_process(_RUN, many, 1),
                "2000, 2 jobs": _in_process(_RUN, many, 2),
            }
            peer = float(_in_process(_BARE, few))
            with ThreadPoolExecutor(2) as pool:
                pair = [float(text) for text in pool.map(partial(_in_process, _BARE), [few, few])]
            if number >= 0:
                peers.append(peer)
                together.append(sum(pair) / 2.0)
                for key, text in made.items():
                    found[key].append(json.loads(text))
            print(f"round {number + 1} of {ROUNDS}", file=sys.stderr, flush=True)
    faster = ratio([2.0 * peer for peer in peers], together)
    print(f"the machine: two bare scripts at once do {faster} times the work of one")
    return _judged(found, peers)


def _judged(found: dict[str, list[dict[str, float]]], peers: list[float]) -> bool:
    few, alone, together = found["200, 1 job"], found["2000, 1 job"], found["2000, 2 jobs"]
    further = [
        (more["cpu"] * more["logs"] - less["cpu"] * less["logs"]) / (more["logs"] - less["logs"])
        for less, more in zip(few, alone, strict=True)
    ]
    held = [
        verdict(f"CPU time per recording / bare script, {key}", ratio(cost, peers), AT_MOST_OF_BARE, at_most=True)
        for key, cost in (
            ("200", [item["cpu"] for item in few]),
            ("2000", [item["cpu"] for item in alone]),
            ("from 200 to 2000", further),
        )
    ]
    faster = ratio([item["clock"] for item in alone], [item["clock"] for item in together])
    held.append(verdict("1 job / 2 jobs, time on the clock", faster, AT_LEAST_FASTER))
    for key, each in (("200", few), ("2000", alone)):
        held.append(verdict(f"memory, {key}, MiB", _spread(each, "peak"), AT_MOST_MIB, at_most=True))
    more = _spread(together, "worker")
    held.append(verdict("memory of a worker, MiB", more, AT_MOST_MORE_MIB, at_most=True))
    rows = [
        (key, _spread(each, "cpu", 1e3), _spread(each, "clock", 1e3), _spread(each, "peak"))
        for key, each in found.items()
    ]
    rows.append(("each from 200 to 2000, 1 job", Spread.of([1e3 * item for item in further]), "", ""))
    rows.append(("bare script", Spread.of([1e3 * item for item in peers]), "", ""))
    print()
    table(("recordings", "CPU ms (low-high)", "clock ms (low-high)", "peak MiB (low-high)"), rows)
    print("per recording. With 2 jobs the CPU time is that of the first process, without its workers'.")
    return all(held)


def _spread(each: list[dict[str, float]], key: str, times: float = 1.0) -> Spread:
    return Spread.of([times * item[key] for item in each])


def _multiply(few: Path, many: Path) -> None:
    """Write each scored log several times, each with another last digit in a cell: equal logs are refused."""
    shutil.copytree(few, many, ignore=shutil.ignore_patterns("contacts.csv"))
    for path in _logs(many)[1]:
        head, first, rest = path.read_text(encoding="utf-8").split("\n", 2)
        for copy in range(1, COPIES):
            text = f"{head}\n{first[:-1]}{copy}\n{rest}"
            path.with_name(f"{path.stem}_{copy}.csv").write_text(text, encoding="utf-8", newline="\n")


def _in_process(code: str, *arguments: object) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        check=True,
        capture_output=True,
        text=True,
        cwd=Path(__file__).parent,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    return done.stdout.splitlines()[-1]


def guard() -> bool:
    """Compare with the bare script in this process, in turns: the ratio of two costs, whatever the machine's speed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        simulate_gate(folder, GUARD_COUNTS, SEED, file_format="csv")
        pairs = [(run(str(folder), 1)["cpu"], bare(str(folder))) for _ in range(1 + GUARD_ROUNDS)][1:]
    ours, theirs = (min(each) for each in zip(*pairs, strict=True))
    smallest = Spread.of([ours / theirs])
    print(f"cdtool {1e3 * ours:.1f} ms of CPU time per recording, bare script {1e3 * theirs:.1f} ms")
    return verdict("cdtool benchmark / bare script, smallest CPU time", smallest, GUARD_AT_MOST, at_most=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--guard", action="store_true", help="only the ratio to the bare script, in one process")
    chosen = parser.parse_args()
    main("cdtool benchmark, per recording", guard if chosen.guard else measure)
