"""Integers of more digits than float64 holds: counted, so that no digit is lost in silence."""

from __future__ import annotations

from typing import Literal

import numpy as np

from cdtool.findings import Finding
from cdtool.findings.containers import RoundedIntegers
from cdtool.recording import FloatArray

# Up to here float64 holds every integer; from there on 64 bits hold none.
_EXACT, _WIDEST = 2.0**53, 2.0**64


def rounded_integers(values: FloatArray) -> int:
    """How many values may be integers that float64 has rounded: those from 2^53 on, as far as 64 bits reach."""
    if not ((values > _EXACT).any() or (values < -_EXACT).any()):  # nearly always: a pass without a copy
        return 0
    size = np.abs(values)
    return int(np.count_nonzero((size > _EXACT) & (size <= _WIDEST)))


def rounding_finding(column: str, count: int, severity: Literal["note", "warning"] = "warning") -> list[Finding]:
    """What is said of a column with so many of them; nothing of none."""
    return [Finding(RoundedIntegers(count), column, severity)] if count else []
