"""`cdtool.benchmark`."""

from __future__ import annotations

from cdtool.base.notebook.presenting import presented
from cdtool.commands.scoring.benchmark import benchmark as run_benchmark
from cdtool.commands.scoring.benchmark_result import BenchmarkResult

benchmark = presented(
    run_benchmark,
    BenchmarkResult.of,
    "BenchmarkResult\n    DataFrames, figures and reports. Logs that cannot be read or scored are in `skipped`; so is "
    "a detector\n    without one of its channels, all contacts of which are not assessable.",
)
