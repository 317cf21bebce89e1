"""`cdtool.score`."""

from __future__ import annotations

from cdtool.notebook.benchmark_result import BenchmarkResult
from cdtool.notebook.presenting import presented
from cdtool.workflows.score_triggers import score as run_score

score = presented(
    run_score,
    lambda done: BenchmarkResult(done.evaluated, done.traces, done.inputs),
    "BenchmarkResult\n    As that of `benchmark`. Of the file's limits, those on `*` and on detectors of the trigger "
    "file are\n    checked.",
)
