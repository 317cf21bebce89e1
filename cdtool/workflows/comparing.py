"""Comparison of two builds: the work of `cdtool compare`."""

from __future__ import annotations

from pathlib import Path

from cdtool.evaluation.builds.comparison import BuildComparison, compare_builds
from cdtool.evaluation.builds.rows import RELEVANT_CHANGE
from cdtool.evaluation.comparison import SIGNIFICANT
from cdtool.evaluation.results import Results
from cdtool.evaluation.results_file import read_results


def compare(
    old: str | Path | Results,
    new: str | Path | Results,
    *,
    significance: float = SIGNIFICANT,
    relevant_change: float = RELEVANT_CHANGE,
) -> BuildComparison:
    """Compare the results of two builds, each given as the path of results.json or as `Results`.

    Raises RecordingError if a file is not a results file; otherwise as `compare_builds`.
    """
    return compare_builds(_results(old), _results(new), significance, relevant_change)


def _results(source: str | Path | Results) -> Results:
    return source if isinstance(source, Results) else read_results(Path(source))
