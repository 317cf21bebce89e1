"""Count integers with more digits than float64 can hold, so that no digit is lost silently."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from cdtool.base.findings import Finding

# float64 represents every integer up to the first value; 64-bit integers are below the second.
_EXACT, _WIDEST = 2**53, 2**64


def rounded_integers(values: npt.NDArray[Any]) -> int:
    """Return how many values may be integers rounded by float64: from 2^53 up to the largest 64-bit integer."""
    above, below = values > _EXACT, values < -_EXACT
    if not (above.any() or below.any()):  # the usual case
        return 0
    return int(np.count_nonzero((above & (values <= _WIDEST)) | (below & (values >= -_WIDEST))))


def rounding_finding(column: str, count: int, severity: Literal["note", "warning"] = "warning") -> list[Finding]:
    """Return the finding on a column with that many rounded values; empty for none."""
    return [Finding("rounded_integers", column, {"count": count}, severity)] if count else []
