"""Comparison of two builds: the work of `cdtool compare`."""

from __future__ import annotations

from pathlib import Path

from cdtool.base.remote.remote_path import location
from cdtool.commands.compare.comparison import BuildComparison, compare_builds
from cdtool.commands.compare.rows import RELEVANT_CHANGE
from cdtool.results.comparison import SIGNIFICANT
from cdtool.results.files.results_file import read_results
from cdtool.results.results import Results


def compare(
    old: str | Path | Results,
    new: str | Path | Results,
    *,
    significance: float = SIGNIFICANT,
    relevant_change: float = RELEVANT_CHANGE,
) -> BuildComparison:
    """Compare the results of two builds.

    Parameters
    ----------
    old, new : str, Path or Results
        A results.json, or the results in memory.
    significance : float, optional
        Family-wise error rate of "worse" and "better".
    relevant_change : float, optional
        The smallest change for the worse that matters, as a share; see `compare_builds`.

    Returns
    -------
    BuildComparison
        One row per detector and group, and the verdict over all of them.

    Raises
    ------
    RecordingError
        A file is not a results file.
    ConfigurationError
        A setting differs that defines the results.
    UsageError
        The two results have no detector and group in common, or a share is outside its range.

    Examples
    --------
    >>> import cdtool
    >>> results = cdtool.score("docs/examples/triggers.csv", "sample_logs/gate/benchmark.toml").evaluated.results
    >>> comparison = cdtool.compare(results, results)
    >>> comparison.verdict, len(comparison.rows)
    ('no change shown', 3)
    """
    return compare_builds(_results(old), _results(new), significance, relevant_change)


def _results(source: str | Path | Results) -> Results:
    return source if isinstance(source, Results) else read_results(location(source))
