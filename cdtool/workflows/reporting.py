"""Read a benchmark's results from their file."""

from __future__ import annotations

from pathlib import Path

from cdtool.bounded_loading import MOST_JSON, read_text
from cdtool.errors import RecordingError
from cdtool.evaluation.evaluated import Evaluated, evaluate
from cdtool.evaluation.results_file import read_results
from cdtool.evaluation.results_folder import PROVENANCE
from cdtool.evaluation.traces.file import read_traces, traces_path
from cdtool.evaluation.traces.trace import Trace
from cdtool.remote.remote_path import location


def load_report(results: str | Path) -> tuple[Evaluated, tuple[Trace, ...], str]:
    """Return the results with their statistics, their traces, and a note if there are no traces.

    Raises RecordingError if either file is damaged.
    """
    path = location(results)
    evaluated = evaluate(read_results(path))
    beside = traces_path(path)
    if not beside.exists():
        return evaluated, (), f"{beside} is missing: no plots over time"
    of = path / PROVENANCE if path.is_dir() else path
    return evaluated, read_traces(beside, read_text(of, RecordingError, most=MOST_JSON)), ""
