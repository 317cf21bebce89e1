"""`cdtool.score`."""

from __future__ import annotations

from cdtool.base.notebook.presenting import presented
from cdtool.commands.score.score_triggers import score as run_score
from cdtool.commands.scoring.benchmark_result import BenchmarkResult

score = presented(
    run_score,
    lambda done: BenchmarkResult(done.evaluated, done.traces, done.inputs),
    "BenchmarkResult\n    As that of `benchmark`. Of the file's limits, those on `*` and on detectors of the trigger "
    "file are\n    checked.",
)
