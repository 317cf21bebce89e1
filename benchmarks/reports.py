"""Every report of 5,000 recordings and 5 detectors: seconds and size of each, after detection.

    python benchmarks/reports.py [--recordings N]

The rows are drawn at random (seeded); the traces are real ones of the sample gate, copied to as many as a benchmark
keeps. Targets: all reports together under 60 s, the HTML file under 15 MB.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from timing import environment, table

from cdtool.commands.scoring.benchmark import benchmark
from cdtool.commands.scoring.benchmark_result import BenchmarkResult
from cdtool.report.outputs import write_outputs
from cdtool.report.writers.base import Report
from cdtool.results.evaluated import evaluate
from cdtool.results.results import ContactResult, ExposureResult, FalseAlarmResult, RecordingResult, Results
from cdtool.results.traces.choice import MOST_KEPT

DETECTORS = ("pure_inertia", "friction_ekf", "momentum", "inertial_momentum", "pure_torque")
GROUPS = ("stiff", "soft", "holdout")
MEDIAN_MS = {"stiff": (27.0, 33.0, 63.0, 33.0, 149.0), "soft": (391.0, 82.0, 118.0, 88.0, 202.0)}
MOST_SECONDS, MOST_MEGABYTES = 60.0, 15.0
SAMPLE = Path(__file__).parent.parent / "sample_logs" / "gate" / "benchmark.toml"


def many(done: BenchmarkResult, recordings: int) -> Results:
    """Results of that many recordings: one contact each in two groups, none in the hold-out."""
    rng = np.random.default_rng(1)
    rows, contacts, false_alarms = [], [], []
    for number in range(recordings):
        group = GROUPS[number % 3]
        name = f"{group}/machine-{number % 7}/2026-11-{1 + number % 28:02d}/run_{number:05d}.csv"
        rows.append(RecordingResult(name, group, f"{number:064x}", 8.2, 1, int(group != "holdout")))
        for column, detector in enumerate(DETECTORS):
            if group == "holdout":
                if rng.random() < 0.002:
                    false_alarms.append(FalseAlarmResult(name, group, detector, "gate", 3.0, "above", 2.0, 1.0))
                continue
            latency = MEDIAN_MS[group][column] * float(np.exp(0.2 * rng.normal()))
            contacts.append(_contact(name, group, detector, latency, missed=bool(rng.random() < 0.01)))
    each = recordings // 3
    exposure = [ExposureResult(group, name, each, each, each * 8.0 / 3600.0) for group in GROUPS for name in DETECTORS]
    return replace(
        done.results,
        detectors=DETECTORS,
        groups=GROUPS,
        recordings=tuple(rows),
        contacts=tuple(contacts),
        false_alarms=tuple(false_alarms),
        exposure=tuple(exposure),
    )


def _contact(name: str, group: str, detector: str, latency: float, *, missed: bool) -> ContactResult:
    return ContactResult(
        recording=name,
        group=group,
        detector=detector,
        joint=None if missed else "gate",
        onset_s=5.0,
        onset_uncertainty_s=0.0015,
        alarm_s=None if missed else 5.0 + 1e-3 * latency,
        latency_ms=None if missed else latency,
        outcome="missed" if missed else "detected",
        force_at_alarm_n=None if missed else 20.0 * latency,
        peak_force_n=3600.0,
        watched_ms=1000.0,
        resolution_ms=2.0,
        side=None if missed else "above",
        statistic=None if missed else 2.0,
        limit=None if missed else 1.0,
    )


def main(recordings: int) -> int:
    print(environment())
    done = benchmark(SAMPLE)
    results = many(done, recordings)
    scored = [item.recording for item in results.recordings]
    traces = tuple(
        replace(done.traces[i % len(done.traces)], recording=scored[i * recordings // MOST_KEPT])
        for i in range(min(MOST_KEPT, recordings))
    )
    begin = perf_counter()
    evaluated = evaluate(results)
    seconds = perf_counter() - begin
    rows: list[tuple[object, ...]] = [("statistics", f"{seconds:.1f}", "")]
    largest = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for name in ("results.json", "report.html", "summary.md", "junit.xml", "contacts.csv", "latency.png", "all"):
            target = Path(folder) / name
            begin = perf_counter()
            write_outputs(Report(evaluated, traces), [target])
            took = perf_counter() - begin
            size = 1e-6 * sum(path.stat().st_size for path in (target.rglob("*") if target.is_dir() else [target]))
            largest = max(largest, size if name.endswith(".html") else 0.0)
            seconds += took
            rows.append((name if name != "all" else "a folder with all of it", f"{took:.1f}", f"{size:.2f}"))
    print(f"{recordings} recordings, {len(results.contacts)} rows of contacts, {len(traces)} traces\n")
    table(("report", "seconds", "MB"), rows)
    held = seconds < MOST_SECONDS and largest < MOST_MEGABYTES
    bars = f"{seconds:.1f} s (under {MOST_SECONDS:.0f}), HTML {largest:.2f} MB (under {MOST_MEGABYTES:.0f})"
    print(f"all together {bars}")
    print("ok" if held else "FAIL")
    return 0 if held else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=5000)
    sys.exit(main(parser.parse_args().recordings))
