"""`cdtool.read_results`."""

from __future__ import annotations

from pathlib import Path

from cdtool.base.remote.remote_path import location
from cdtool.commands.scoring.benchmark_result import BenchmarkResult
from cdtool.results.files.reading import load_report


def read_results(file: str | Path) -> BenchmarkResult:
    """Read the results of a benchmark from their file.

    Parameters
    ----------
    file : str or Path
        A results.json or results.parquet that `cdtool benchmark -o` or `BenchmarkResult.save` wrote. The curves of the
        trigger plots are read from the file results.traces.json.gz beside it, if it is there.

    Returns
    -------
    BenchmarkResult
        The results, without the recordings.

    Raises
    ------
    RecordingError
        The file is damaged, or is not a results file.

    Examples
    --------
    >>> import cdtool
    >>> scored = cdtool.score("docs/examples/triggers.csv", "sample_logs/gate/benchmark.toml")
    >>> _ = scored.save("results.json")
    >>> cdtool.read_results("results.json").contacts.equals(scored.contacts)
    True
    """
    evaluated, traces, _ = load_report(file)
    return BenchmarkResult(evaluated, traces, (location(file),))
