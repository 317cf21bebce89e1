"""The whole `cdtool benchmark` of 114 simulated gate recordings: seconds, and the share of each part.

    python benchmarks/whole_benchmark.py [--jobs N]

Reading, detecting and reporting each run from CSV on disk to the report folder with its plots. With more than one job,
reading and detecting are the workers' sums: they may exceed the time on the clock.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from time import perf_counter

from timing import environment, table

from cdtool.report.outputs import write_outputs
from cdtool.report.writers.base import Report
from cdtool.simulation.gate_recordings import write_gate_recordings
from cdtool.workflows.benchmark.benchmark import Benchmark, benchmark

COUNTS = {"free": 14, "holdout": 40, "stiff": 30, "soft": 30}
SEED = 1
ROUNDS = 3


def measure(jobs: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        logs = Path(folder) / "gate"
        begin = perf_counter()
        written = write_gate_recordings(logs, COUNTS, SEED, file_format="csv")
        print(f"{written} recordings simulated and written in {perf_counter() - begin:.1f} s (not counted below)")
        size = sum(path.stat().st_size for path in logs.rglob("*.csv")) * 1e-6
        rows = []
        for number in range(1, ROUNDS + 1):
            begin = perf_counter()
            done = benchmark(logs / "benchmark.toml", jobs=jobs)
            reported = perf_counter()
            write_outputs(Report(done.evaluated, done.traces), [_new_folder(Path(folder), number)])
            end = perf_counter()
            rows.append(_row(number, end - begin, reported - begin, end - reported, done))
        print(f"{size:.0f} MB of CSV, {len(done.results.detectors)} detectors, {jobs} job(s)\n")
        table(("round", "total s", "reading", "detecting", "reporting", "rest", "recordings/s"), rows)
    print("shares of the total; round 1 also compiles or loads kernels and imports pandas and matplotlib")


def _new_folder(parent: Path, number: int) -> Path:
    folder = parent / f"report_{number}"
    folder.mkdir()
    return folder


def _row(number: int, total: float, analysing: float, reporting: float, done: Benchmark) -> tuple[object, ...]:
    reading, detecting = done.seconds["reading"], done.seconds["detecting"]
    rest = max(analysing - reading - detecting, 0.0)
    shares = (f"{100 * part / total:.0f} %" for part in (reading, detecting, reporting, rest))
    return (number, f"{total:.2f}", *shares, f"{sum(COUNTS.values()) / total:.0f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=1, help="logs analysed side by side")
    arguments = parser.parse_args()
    print(f"== cdtool benchmark of {sum(COUNTS.values())} gate recordings\n{environment()}", flush=True)
    measure(arguments.jobs)
