"""The axis of latencies, the same in all figures and pages: from a tick at or before all values to one at or beyond."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from cdtool.base.arrays import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The lower end of a logarithmic axis [ms].
FLOOR_MS = 1.0
#: If latencies differ more than fivefold, a linear axis would press most of them together.
_WIDE = 5.0
# Round numbers of a decade; the coarse ones if the ends differ more than fiftyfold.
_FINE, _COARSE = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0), (1.0, 2.0, 5.0)


@dataclass(frozen=True)
class LatencyAxis:
    """Its ticks [ms] in ascending order, the ends of the axis among them; linear axes begin at 0."""

    ticks: tuple[float, ...]
    logarithmic: bool

    @classmethod
    def of(cls, values: FloatArray) -> LatencyAxis:
        """Return the axis for latencies (n,) [ms]; those that are not finite do not count."""
        finite = np.maximum(values[np.isfinite(values)], FLOOR_MS)
        lowest, highest = (float(finite.min()), float(finite.max())) if len(finite) else (1000.0, 1000.0)
        logarithmic = highest > _WIDE * lowest
        steps = _FINE if logarithmic and highest < 50.0 * lowest else _COARSE
        rounded = [step * 10.0**power for power in range(-1, 10) for step in steps]
        if logarithmic:
            first = max(tick for tick in rounded if tick <= lowest)
            last = min(tick for tick in rounded if tick >= highest)
            return cls(tuple(tick for tick in rounded if first <= tick <= last), True)
        width = next(step for step in rounded if 6.0 * step >= highest)
        return cls(tuple(width * i for i in range(math.ceil(highest / width) + 1)), False)

    @property
    def low(self) -> float:
        """The beginning of the axis [ms]; on a logarithmic one, shorter latencies are drawn there."""
        return self.ticks[0]

    @property
    def high(self) -> float:
        """The end of the axis [ms]."""
        return self.ticks[-1]

    def set(self, axes: Axes, which: Literal["x", "y"]) -> None:
        """Set scale and ticks of an axis of a figure, not its ends: there may be more room than for latencies."""
        from matplotlib.ticker import FixedLocator, NullLocator

        if self.logarithmic:
            axes.set(**{f"{which}scale": "log"})
        axis = axes.xaxis if which == "x" else axes.yaxis
        axis.set_major_locator(FixedLocator(self.ticks))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(lambda value, _: f"{value:g}")
