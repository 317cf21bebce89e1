"""Traces as compact JSON for the HTML report's trigger plots: a curve is a short text of differences.

Conventions: whole numbers of a stated step, as in the file of traces; each is written as its difference from the one
before in base 32, lowest digit first, zigzag signed, all digits but the last marked; "!" is missing, "^" and "_" are
without a limit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from cdtool.base.plain_text import plain
from cdtool.results.traces.file import NO_LIMIT, trace_values
from cdtool.results.traces.trace import Trace

ALPHABET = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
MISSING, ABOVE_ALL, BELOW_ALL = "!", "^", "_"

_BYTES = np.frombuffer(ALPHABET.encode(), dtype=np.uint8)
# Heights [px] of the parts of a trigger plot: load cell, a detector's row, and the time axis.
HEIGHTS = {"force": 138, "row": 120, "axis": 44}


def trace_data(trace: Trace, detectors: Mapping[str, int]) -> dict[str, Any]:
    """One trace as JSON values; `detectors` are numbered."""
    values = trace_values(trace)
    panels = [
        {
            **{key: plain(panel[key]) for key in ("unit", "joint", "verdict", "reason")},
            "detector": detectors[panel["detector"]],
            "seen": [{**seen, "reason": plain(seen["reason"])} for seen in panel["seen"]],
            "alarms": panel["alarms"],
            "false_alarms": panel["false_alarms"],
            "rearmed": panel["rearmed"],
            "why": [plain(line) for line in panel["why"]],
            **{name: _curve(panel[name]) for name in ("time", "value", "lower", "upper")},
            "status": [[code, len(list(same))] for code, same in groupby(panel["status"])],
        }
        for panel in values["panels"]
        if panel["detector"] in detectors
    ]
    return {
        **{key: plain(values[key]) for key in ("recording", "group", "chosen")},
        **{key: values[key] for key in ("start", "end", "contact", "view", "joints")},
        "contacts": [
            {**contact, "found_by": plain(contact["found_by"]), "kind": plain(contact["kind"])}
            for contact in values["contacts"]
        ],
        "force_time": _curve(values["force_time"]),
        "force": _curve(values["force"]),
        "panels": panels,
        "height": plot_height(trace),
    }


def plot_height(trace: Trace) -> int:
    """How high the trigger plot is drawn [px]."""
    return HEIGHTS["force"] * bool(len(trace.force)) + HEIGHTS["row"] * len(trace.panels) + HEIGHTS["axis"]


def packed(numbers: Sequence[int | None]) -> str:
    """Whole numbers as a short text (see above)."""
    marks = np.array([0 if n is None else n for n in numbers], dtype=np.int64)
    absent = np.array([n is None for n in numbers], dtype=bool)
    special = absent | (np.abs(marks) == NO_LIMIT)
    kept = marks[~special]
    steps = np.diff(kept, prepend=0)
    rest = np.where(steps < 0, -2 * steps - 1, 2 * steps)
    digits, more = [], np.ones(len(rest), dtype=bool)
    while more.any():
        later = rest >> 5
        # 0 marks a place without a digit: no letter of the alphabet has that code.
        digits.append(np.where(more, _BYTES[(rest & 31) + 32 * (later > 0)], 0))
        more, rest = more & (later > 0), later
    columns = np.zeros((len(marks), max(len(digits), 1)), dtype=np.uint8)
    columns[special, 0] = ord(ABOVE_ALL)
    columns[marks == -NO_LIMIT, 0] = ord(BELOW_ALL)
    columns[absent, 0] = ord(MISSING)
    for place, digit in enumerate(digits):
        columns[~special, place] = digit
    text = columns.ravel()
    return text[text > 0].tobytes().decode()


def _curve(values: Mapping[str, Any]) -> dict[str, Any]:
    return {"from": values["from"], "step": values["step"], "at": packed(values["at"])}
