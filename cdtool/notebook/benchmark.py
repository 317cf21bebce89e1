"""`cdtool.benchmark`."""

from __future__ import annotations

from cdtool.notebook.benchmark_result import BenchmarkResult
from cdtool.notebook.presenting import presented
from cdtool.workflows.benchmark.benchmark import benchmark as run_benchmark

benchmark = presented(
    run_benchmark,
    BenchmarkResult.of,
    "BenchmarkResult\n    DataFrames, figures and reports. Logs that cannot be read or scored are in `skipped`; so is "
    "a detector\n    without one of its channels, all contacts of which are not assessable.",
)
