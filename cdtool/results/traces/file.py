"""Traces beside results.json: gzipped strict JSON, arrays as whole numbers of a stated step.

Conventions: a curve is {"from": a, "step": b, "at": [...]}: value = a + b * number, null = missing, +-1 000 000 000 =
without a limit. A panel's value and limits share one step, so that what is above a limit stays above it.
"""

from __future__ import annotations

import gzip
import hashlib
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.files.bounded_loading import MOST_JSON, ContentError, read_bytes, unpack_json
from cdtool.base.files.strict_json import finite, strict_json
from cdtool.base.files.typed_json import plain, typed
from cdtool.recordings.recording import Contact
from cdtool.results.traces.trace import ContactOutcome, Panel, StatisticCurve, Trace

SCHEMA_VERSION = 3
NO_LIMIT = 1_000_000_000
_OPERATION = re.compile(r"(?<=#)\d+\Z")
# The name of the file in a results.parquet.
TRACES_IN_FOLDER = "results.traces.json.gz"

# Steps over the range of a panel; a plot has fewer pixels.
_LEVELS = 8000
_TIME_STEP = 1e-5
# Beyond this from its begin [s], or beyond this value, a curve is damaged.
_LONGEST, _LARGEST = 1e9, 1e300


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


def encode_traces(traces: Sequence[Trace], results: str = "", results_sha256: str = "") -> bytes:
    """Return traces as gzipped JSON.

    Parameters
    ----------
    traces : sequence of Trace
        The traces of a benchmark.
    results : str
        The text of the results file that they belong to.
    results_sha256 : str
        Its hash, in place of the text.

    Returns
    -------
    bytes
        The content of the file; equal for equal traces.

    Examples
    --------
    >>> encode_traces([]) == encode_traces([])
    True
    """
    values = {
        "schema_version": SCHEMA_VERSION,
        "results_sha256": results_sha256 or _digest(results),
        "traces": [trace_values(trace) for trace in traces],
    }
    return gzip.compress(strict_json(values, compact=True).encode("utf-8"), compresslevel=6, mtime=0)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()


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
    content = read_bytes(path, RecordingError, most=MOST_JSON)
    try:
        values = unpack_json(content)
        if values["schema_version"] != SCHEMA_VERSION:
            raise RecordingError(
                f"{path}: schema_version is {values['schema_version']}; this version of cdtool reads {SCHEMA_VERSION}",
                "run cdtool benchmark again",
            )
        if results is not None and values["results_sha256"] != _digest(results):
            raise RecordingError(f"{path}: belongs to other results", "put the two files of one benchmark together")
        return tuple(_checked(_trace(item)) for item in values["traces"])
    except ContentError as fault:
        raise RecordingError(f"{path}: damaged, or not a traces file: {fault}", "run cdtool benchmark again") from fault
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError) as fault:
        raise RecordingError(f"{path}: damaged, or not a traces file", "run cdtool benchmark again") from fault


def _checked(trace: Trace) -> Trace:
    """Return the trace; raises ValueError for one that cannot be drawn."""
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
    return trace


def _check_curves(start: float, time: FloatArray, *curves: npt.NDArray[Any]) -> None:
    if time.ndim != 1 or any(curve.shape != time.shape for curve in curves):
        raise ValueError("curves of different lengths")
    if not np.all(np.abs(time - start) < _LONGEST) or np.any(np.diff(time) < 0.0):
        raise ValueError("times that do not increase")


def as_read(traces: Sequence[Trace]) -> tuple[Trace, ...]:
    """Return traces as their file returns them, rounded: figures are equal before and after storing.

    Parameters
    ----------
    traces : sequence of Trace
        The traces of a benchmark.

    Returns
    -------
    tuple of Trace
        The same, with values rounded as in the file.

    Examples
    --------
    >>> as_read([])
    ()
    """
    return tuple(_trace(trace_values(trace)) for trace in traces)


def trace_values(trace: Trace) -> dict[str, Any]:
    """Return one trace as JSON values.

    Parameters
    ----------
    trace : Trace
        The trace.

    Returns
    -------
    dict
        Its values; curves are coded in whole steps of their range.

    Examples
    --------
    `encode_traces` writes them.
    """
    low, step = _scale([trace.force])
    # So that no time is as many steps as stand for "no limit": 1e-5 s up to 10,000 s.
    time_step = max(_TIME_STEP, 10.0 ** (math.floor(math.log10(max(trace.end - trace.start, 1.0))) - 8))
    return {
        "recording": trace.recording,
        "operation": trace.operation,
        "group": trace.group,
        "start": trace.start,
        "end": trace.end,
        "contacts": finite(plain(trace.contacts, tuple[Contact, ...])),
        "contact": trace.contact,
        "view": list(trace.view),
        "joints": trace.joints,
        "chosen": trace.chosen,
        "force_time": _coded(trace.force_time, trace.start, time_step),
        "force": _coded(trace.force, low, step),
        "panels": [_panel_values(panel, trace.start, time_step) for panel in trace.panels],
    }


def _panel_values(panel: Panel, start: float, time_step: float) -> dict[str, Any]:
    course = panel.course
    low, step = _scale([course.value, course.lower, course.upper])
    return {
        "detector": panel.detector,
        "unit": panel.unit,
        "joint": panel.joint,
        "verdict": panel.verdict,
        "reason": panel.reason,
        "seen": finite(plain(panel.seen, tuple[ContactOutcome, ...])),
        "alarms": list(panel.alarms),
        "false_alarms": list(panel.false_alarms),
        "why": list(panel.why),
        "rearmed": [time if math.isfinite(time) else None for time in panel.rearmed],
        "time": _coded(course.time, start, time_step),
        "value": _coded(course.value, low, step),
        "lower": _coded(course.lower, low, step),
        "upper": _coded(course.upper, low, step),
        "status": course.status.tolist(),
    }


def _trace(values: dict[str, Any]) -> Trace:
    recording = str(values["recording"])
    return Trace(
        recording=recording,
        group=str(values["group"]),
        start=float(values["start"]),
        end=float(values["end"]),
        contacts=tuple(typed(Contact, _numbers(item), "contact") for item in values["contacts"]),
        contact=int(values["contact"]),
        view=(float(values["view"][0]), float(values["view"][1])),
        force_time=_decoded(values["force_time"]),
        force=_decoded(values["force"]),
        panels=tuple(_panel(item) for item in values["panels"]),
        joints=int(values["joints"]),
        chosen=str(values["chosen"]),
        # In files of earlier versions only the name has it.
        operation=int(values.get("operation", (_OPERATION.search(recording) or "0")[0])),
    )


def _panel(values: dict[str, Any]) -> Panel:
    time, value, lower, upper = (_decoded(values[name]) for name in ("time", "value", "lower", "upper"))
    return Panel(
        detector=str(values["detector"]),
        unit=str(values["unit"]),
        joint=str(values["joint"]),
        course=StatisticCurve(time, value, lower, upper, np.array(values["status"], dtype=np.uint8)),
        verdict=str(values["verdict"]),
        reason=str(values["reason"]),
        seen=tuple(typed(ContactOutcome, _numbers(item), "seen") for item in values["seen"]),
        alarms=tuple(map(float, values["alarms"])),
        false_alarms=tuple(map(float, values["false_alarms"])),
        why=tuple(map(str, values["why"])),
        # Files of earlier versions have none.
        rearmed=tuple(math.inf if time is None else float(time) for time in values.get("rearmed", ())),
    )


def _scale(arrays: Sequence[FloatArray]) -> tuple[float, float]:
    present = np.concatenate(arrays) if arrays else np.empty(0)
    present = present[np.isfinite(present)]
    if not len(present):
        return 0.0, 1.0
    low, high = float(present.min()), float(present.max())
    # Few digits: a trace that was read comes out as the same bytes again.
    step = float(f"{(high - low) / _LEVELS:.6g}")
    return low, step if step > 0.0 and math.isfinite(step) else 1.0


def _coded(values: FloatArray, low: float, step: float) -> dict[str, Any]:
    numbers = np.where(np.isfinite(values), np.round((np.where(np.isfinite(values), values, low) - low) / step), 0.0)
    numbers = np.where(np.isinf(values), np.copysign(NO_LIMIT, values), numbers)
    whole = numbers.astype(np.int64).tolist()
    missing = np.isnan(values)
    return {"from": low, "step": step, "at": [None if gone else n for gone, n in zip(missing, whole, strict=True)]}


def _decoded(values: dict[str, Any]) -> FloatArray:
    numbers = np.array([math.nan if n is None else n for n in values["at"]], dtype=np.float64)
    present = np.isfinite(numbers)
    low, step = float(values["from"]), float(values["step"])
    if not (abs(low) < _LARGEST and 0.0 < step < _LARGEST / NO_LIMIT and np.all(np.abs(numbers[present]) <= NO_LIMIT)):
        raise ValueError(f"a curve from {low:g} in steps of {step:g}")
    decoded = low + step * numbers
    return np.where(np.abs(numbers) == NO_LIMIT, np.copysign(np.inf, numbers), decoded)


def _numbers(values: dict[str, Any]) -> dict[str, Any]:
    """Return the inverse of `finite`: every null of a contact or an outcome is an unknown number."""
    return {key: math.nan if item is None else item for key, item in values.items()}
