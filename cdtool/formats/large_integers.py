"""Count integers with more digits than float64 can hold, so that no digit is lost silently."""

from __future__ import annotations

from typing import Literal

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding

# float64 represents every integer up to the first value; 64-bit integers are below the second.
_EXACT, _WIDEST = 2.0**53, 2.0**64


def rounded_integers(values: FloatArray) -> int:
    """Return how many values may be integers rounded by float64: from 2^53 up to the largest 64-bit integer."""
    if not ((values > _EXACT).any() or (values < -_EXACT).any()):  # the usual case, without a copy
        return 0
    size = np.abs(values)
    return int(np.count_nonzero((size > _EXACT) & (size <= _WIDEST)))


def rounding_finding(column: str, count: int, severity: Literal["note", "warning"] = "warning") -> list[Finding]:
    """Return the finding on a column with that many rounded values; empty for none."""
    return [Finding("rounded_integers", column, {"count": count}, severity)] if count else []
