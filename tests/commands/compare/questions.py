"""The questions in a comparison of two made-up builds."""

from __future__ import annotations

import numpy as np

from cdtool.commands.compare.comparison import BuildComparison
from cdtool.commands.compare.rows import BuildRow, Question
from cdtool.results.results import Results
from tests.synthetic.builds import build_results

KEY = ("momentum", "stiff")


def latencies(n: int = 30, mean: float = 40.0, std: float = 6.0, seed: int = 1) -> list[float]:
    return (np.random.default_rng(seed).normal(mean, std, n)).tolist()


def single(outcomes, **options) -> Results:
    return build_results({KEY: outcomes}, **options)


def row_of(comparison: BuildComparison) -> BuildRow:
    (row,) = comparison.rows
    return row


def asked(comparison: BuildComparison, figure: str) -> Question:
    found = row_of(comparison).question(figure)  # type: ignore[arg-type]
    assert found is not None
    return found
