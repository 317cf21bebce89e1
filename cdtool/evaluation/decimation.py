"""Min-max decimation to the pixels of a plot: a spike of one sample stays visible, a million samples draw fast."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.errors import UsageError
from cdtool.recording import FloatArray

IndexArray = npt.NDArray[np.intp]


def decimate(time: FloatArray, values: FloatArray, pixels: int) -> tuple[FloatArray, FloatArray]:
    """At most 4 * pixels samples of `values` (n,) that draw alike; short series are returned as they are.

    Kept are the first and the last sample, and of each column of pixels its least and largest value and one NaN where
    there is one: a gap stays a gap. `time` increases strictly. Raises UsageError for fewer than 2 pixels.
    """
    kept = kept_samples(time, values, pixels)
    return time[kept], values[kept]


def kept_samples(time: FloatArray, values: FloatArray, pixels: int) -> IndexArray:
    """The indices that `decimate` keeps, in order of time."""
    if pixels < 2:
        raise UsageError(f"pixels is {pixels}", "a plot is at least 2 pixels wide")
    if len(time) <= 4 * pixels:
        return np.arange(len(time))
    missing = np.isnan(values)
    low, high = np.where(missing, np.inf, values), np.where(missing, -np.inf, values)
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], pixels + 1)[1:-1])
    bounds = np.unique([0, *edges.tolist(), len(time)])
    kept = {0, len(time) - 1}
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        if missing[first:last].any():
            kept.add(first + int(missing[first:last].argmax()))
            if missing[first:last].all():
                continue
        kept.add(_present(low, missing, first, last, smallest=True))
        kept.add(_present(high, missing, first, last, smallest=False))
    return np.array(sorted(kept))


def _present(values: FloatArray, missing: npt.NDArray[np.bool_], first: int, last: int, *, smallest: bool) -> int:
    part = values[first:last]
    best = int(part.argmin() if smallest else part.argmax())
    if missing[first + best]:  # every present value is infinite: any of them will do
        best = int((~missing[first:last]).argmax())
    return first + best
