"""Traces as compact JSON for the HTML report's trigger plots: a curve is a short text of differences.

Conventions: whole numbers of a stated step; each is written as its difference from the one
before in base 32, lowest digit first, zigzag signed, all digits but the last marked; "!" is missing, "^" and "_" are
without a limit.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.files.strict_json import finite
from cdtool.base.files.typed_json import plain as values_of
from cdtool.base.plain_text import plain
from cdtool.report.number_text import number
from cdtool.report.plots.figures import unit_label
from cdtool.report.plots.trace_words import UNKNOWN, LatencyTexts, rows_in_order, trace_words, triggers_of, verdict_of
from cdtool.results.traces.trace import LEVELS, TIME_DECIMALS, Panel, Trace

ALPHABET = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
MISSING, ABOVE_ALL, BELOW_ALL = "!", "^", "_"

_BYTES = np.frombuffer(ALPHABET.encode(), dtype=np.uint8)
# Heights [px] of the parts of a trigger plot: load cell, a detector's row, and the time axis.
HEIGHTS = {"force": 138, "row": 120, "axis": 44}


def trace_data(trace: Trace, detectors: Mapping[str, int], texts: LatencyTexts = UNKNOWN) -> dict[str, Any]:
    """One trace as JSON values, its rows in the order of the plot; `detectors` are numbered."""
    # Neighbouring times are at most so many steps apart that the page's 32-bit numbers hold them.
    time_step = max(10.0**-TIME_DECIMALS, (trace.end - trace.start) / 1e9)
    made: dict[str, Any] = {
        **{key: plain(getattr(trace, key)) for key in ("recording", "group", "chosen")},
        **{key: getattr(trace, key) for key in ("start", "end", "contact", "view", "joints")},
        "contacts": [
            {**values_of(contact), "found_by": plain(contact.found_by), "kind": plain(contact.kind)}
            for contact in trace.contacts
        ],
        "force_time": _curve(trace.force_time, trace.start, time_step),
        "force": packed_curve(trace.force),
        "panels": [
            {
                **_panel(panel, detectors[panel.detector], _curve(panel.course.time, trace.start, time_step)),
                "words": [plain(words) for words in verdict_of(trace, panel, texts)],
                "held": triggers_of(trace, panel, (trace.start, trace.end)),
            }
            for panel in rows_in_order(trace)
            if panel.detector in detectors
        ],
        "words": [*map(plain, trace_words(trace)), *_onset_words(trace)],
        "height": plot_height(trace),
    }
    return {key: finite(value) for key, value in made.items()}


def _panel(panel: Panel, detector: int, time: Mapping[str, Any]) -> dict[str, Any]:
    course = panel.course
    scale = _scale(course.value, course.lower, course.upper)
    return {
        "joint": plain(panel.joint),
        "unit": unit_label(panel.unit),
        "detector": detector,
        "seen": [values_of(seen) for seen in panel.seen],
        "alarms": panel.alarms,
        "false_alarms": panel.false_alarms,
        "why": [plain(line) for line in panel.why],
        "time": time,
        **{name: _curve(getattr(course, name), *scale) for name in ("value", "lower", "upper")},
        "status": [[code, len(list(same))] for code, same in groupby(course.status.tolist())],
    }


def _onset_words(trace: Trace) -> list[str]:
    contact = trace.shown
    if contact is None:
        return []
    exact = number(1e3 * contact.uncertainty, 2)
    return [f"onset {contact.start:.3f} s ({plain(contact.found_by)}, ± {exact} ms)"]


def plot_height(trace: Trace) -> int:
    """How high the trigger plot is drawn [px]."""
    return HEIGHTS["force"] * bool(len(trace.force)) + HEIGHTS["row"] * len(trace.panels) + HEIGHTS["axis"]


def packed(numbers: FloatArray) -> str:
    """Whole numbers (n,), NaN and infinity as a short text (see above)."""
    known = np.isfinite(numbers)
    steps = np.diff(numbers[known].astype(np.int64), prepend=0)
    rest = np.where(steps < 0, -2 * steps - 1, 2 * steps)
    digits, more = [], np.ones(len(rest), dtype=bool)
    while more.any():
        later = rest >> 5
        # 0 marks a place without a digit: no letter of the alphabet has that code.
        digits.append(np.where(more, _BYTES[(rest & 31) + 32 * (later > 0)], 0))
        more, rest = more & (later > 0), later
    columns = np.zeros((len(numbers), max(len(digits), 1)), dtype=np.uint8)
    for place, digit in enumerate(digits):
        columns[known, place] = digit
    columns[np.isnan(numbers), 0] = ord(MISSING)
    columns[numbers == np.inf, 0] = ord(ABOVE_ALL)
    columns[numbers == -np.inf, 0] = ord(BELOW_ALL)
    text = columns.ravel()
    return text[text > 0].tobytes().decode()


def packed_curve(values: FloatArray) -> dict[str, Any]:
    """Return a curve (n,) with its least value and the step in which it is written."""
    return _curve(values, *_scale(values))


def _scale(*curves: FloatArray) -> tuple[float, float]:
    """Return the least value of curves, and the step in which they are written."""
    present = np.concatenate(curves)
    present = present[np.isfinite(present)]
    step = float(f"{np.ptp(present) / LEVELS:.6g}") if len(present) else 0.0
    return (float(present.min()) if len(present) else 0.0), step or 1.0


def _curve(values: FloatArray, low: float, step: float) -> dict[str, Any]:
    return {"from": low, "step": step, "at": packed(np.round((values - low) / step))}
