"""Read a benchmark's results from their file."""

from __future__ import annotations

from pathlib import Path

from cdtool.base.errors import RecordingError
from cdtool.base.files.bounded_loading import MOST_JSON, read_text
from cdtool.base.remote.remote_path import location
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.files.results_file import read_results
from cdtool.results.files.results_folder import PROVENANCE
from cdtool.results.traces.file import read_traces, traces_path
from cdtool.results.traces.trace import Trace


def load_report(results: str | Path) -> tuple[Evaluated, tuple[Trace, ...], str]:
    """Return the results with their statistics, their traces, and a note if there are no traces.

    Parameters
    ----------
    results : str or Path
        A results.json or results.parquet.

    Returns
    -------
    tuple
        Results with statistics, traces, and a note: empty if there are traces.

    Raises
    ------
    RecordingError
        One of the files is damaged.

    Examples
    --------
    `cdtool.read_results` shows its use.
    """
    path = location(results)
    evaluated = evaluate(read_results(path))
    beside = traces_path(path)
    if not beside.exists():
        return evaluated, (), f"{beside} is missing: no plots over time"
    of = path / PROVENANCE if path.is_dir() else path
    return evaluated, read_traces(beside, read_text(of, RecordingError, most=MOST_JSON)), ""
