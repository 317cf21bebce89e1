"""The axis of latencies, the same in all figures: linear from 0, logarithmic if they differ more than tenfold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

# The lower end of a logarithmic axis [ms].
FLOOR_MS = 1.0
# Round numbers of a decade; the coarse ones if the ends differ by more than this factor.
_FINE, _COARSE = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0), (1.0, 2.0, 5.0)


def latency_range(values: FloatArray) -> tuple[float, float, bool]:
    """Return beginning and end of the axis [ms] for latencies (n,) [ms], and whether it is logarithmic."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 0.0, 1000.0, False
    lowest, highest = max(float(finite.min()), FLOOR_MS), max(float(finite.max()), FLOOR_MS)
    if highest <= 10.0 * lowest:
        return 0.0, 1.06 * highest, False
    return lowest / 1.15, 1.15 * highest, True


def set_ticks(axis: Axis, low: float, high: float) -> None:
    """Set the ticks of a logarithmic axis of latencies at round numbers from `low` to `high` [ms]."""
    from matplotlib.ticker import FixedLocator, NullLocator

    steps = _FINE if high < 100.0 * low else _COARSE
    ticks = [step * 10.0**power for power in range(8) for step in steps]
    axis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(lambda value, _: f"{value:g}")


def set_latency_scale(axes: Axes, low: float, high: float, logarithmic: bool) -> None:
    """Set the horizontal axis to latencies from `low` to `high` [ms]."""
    if logarithmic:
        axes.set_xscale("log")
        set_ticks(axes.xaxis, low, high)
    axes.set_xlim(low, high)
