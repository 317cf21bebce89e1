"""Traces beside results.json: gzipped JSON of the fields of `Trace`, with NaN and infinity as Python writes them."""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.files.bounded_loading import MOST_JSON, ContentError, read_bytes, unpack_json
from cdtool.base.files.typed_json import encoded, typed
from cdtool.results.traces.trace import Trace

# Of the layout of the traces: a change of it counts on.
SCHEMA_VERSION = 4
# The name of the file in a results.parquet.
TRACES_IN_FOLDER = "results.traces.json.gz"

# Beyond this from its begin [s] a time is damaged.
_LONGEST = 1e9


@dataclass(frozen=True)
class TraceFile:
    """The content of a file of traces; `results_sha256` is the hash of the results file that they belong to."""

    schema_version: int
    results_sha256: str
    traces: tuple[Trace, ...]


def traces_path(results: Path) -> Path:
    """Return where the traces of a results file are stored.

    Parameters
    ----------
    results : Path
        The results file, or the folder results.parquet.

    Returns
    -------
    Path
        The file of the traces, in the same folder.

    Examples
    --------
    >>> traces_path(Path("results.json")).name
    'results.traces.json.gz'
    """
    return results / TRACES_IN_FOLDER if results.is_dir() else results.with_name(f"{results.stem}.traces.json.gz")


def encode_traces(traces: Sequence[Trace], results_sha256: str = "") -> bytes:
    """Return traces as gzipped JSON.

    Parameters
    ----------
    traces : sequence of Trace
        The traces of a benchmark.
    results_sha256 : str
        The hash of the results file that they belong to.

    Returns
    -------
    bytes
        The content of the file; equal for equal traces.

    Examples
    --------
    >>> encode_traces([]) == encode_traces([])
    True
    """
    text = encoded(TraceFile(SCHEMA_VERSION, results_sha256, tuple(traces)))
    return gzip.compress(text.encode(), compresslevel=6, mtime=0)


def read_traces(path: Path, results: str | None = None) -> tuple[Trace, ...]:
    """Read a file of traces.

    Parameters
    ----------
    path : Path
        The file.
    results : str, optional
        The text of the results file that it must belong to.

    Returns
    -------
    tuple of Trace
        The traces.

    Raises
    ------
    RecordingError
        The file is not a traces file, is damaged, is of an unknown version, or belongs to other results.

    Examples
    --------
    >>> _ = Path("results.traces.json.gz").write_bytes(encode_traces([]))
    >>> read_traces(Path("results.traces.json.gz"))
    ()
    """
    content, again = read_bytes(path, RecordingError, most=MOST_JSON), "run cdtool benchmark again"
    try:
        values = unpack_json(content)
        version = values.get("schema_version") if isinstance(values, dict) else None
        if version not in (None, SCHEMA_VERSION):
            words = f"schema_version is {version}; this version of cdtool reads {SCHEMA_VERSION}"
            raise RecordingError(f"{path}: {words}", again)
        found = typed(TraceFile, values, "traces")
        for trace in found.traces:
            _check(trace)
    except ContentError as fault:
        raise RecordingError(f"{path}: damaged, or not a traces file: {fault}", again) from fault
    except ValueError as fault:
        raise RecordingError(f"{path}: damaged, or not a traces file", again) from fault
    if results is not None and hashlib.sha256(results.encode("utf-8", "replace")).hexdigest() != found.results_sha256:
        raise RecordingError(f"{path}: belongs to other results", "put the two files of one benchmark together")
    return found.traces


def _check(trace: Trace) -> None:
    """Raise ValueError for a trace that cannot be drawn."""
    _check_curves(trace.start, trace.force_time, trace.force)
    known = [trace.start, trace.end, *trace.view, *(time for item in trace.contacts for time in (item.start, item.end))]
    if (not trace.contacts and trace.contact != -1) or trace.contact not in range(-1, len(trace.contacts)):
        raise ValueError(f"contact {trace.contact} of {len(trace.contacts)}")
    for panel in trace.panels:
        course = panel.course
        _check_curves(trace.start, course.time, course.value, course.lower, course.upper, course.status)
        if len(panel.seen) != len(trace.contacts):
            raise ValueError(f"{len(panel.seen)} outcomes of {len(trace.contacts)} contacts")
        known += [*panel.alarms, *panel.false_alarms]
    if not all(abs(time - trace.start) < _LONGEST for time in known) or trace.joints < 1:
        raise ValueError("a time or number that no operation has")


def _check_curves(start: float, time: FloatArray, *curves: npt.NDArray[Any]) -> None:
    if time.ndim != 1 or any(curve.shape != time.shape for curve in curves):
        raise ValueError("curves of different lengths")
    if not np.all(np.abs(time - start) < _LONGEST) or np.any(np.diff(time) < 0.0):
        raise ValueError("times that do not increase")
