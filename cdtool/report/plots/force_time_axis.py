"""The time axis of forces: what happens first in full, each of the later limits compressed to an equal width."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cdtool.evaluation.force.limits import ForceProfile

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdtool.report.plots.force_plot import ForceCurve

# The first part of the time axis [s] is the shortest of these that shows what happens; what follows is compressed.
_VIEWS = (0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 5.0)
_VIEW_SHARE = 0.72
_TICKS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
_MOST_TICKS = 8.01


def time_nodes(ranked: Sequence[Sequence[ForceCurve]], profile: ForceProfile) -> list[float]:
    """Where the time axis bends [s]: 0, the end of its first part, the later limits' beginnings, the end."""
    moments = [0.0]
    for curves in ranked:
        worst = curves[0]
        moments += [1.15 * time for time in worst.alarms.values() if math.isfinite(time)]
        moments += [2.0 * step.peak_at for step in worst.verdict.steps[:1] if math.isfinite(step.peak_at)]
    view = next((view for view in _VIEWS if view >= max(moments)), _VIEWS[-1])
    later = [step.from_s for step in profile.steps if step.from_s > view]
    ends = [float(curve.time[-1]) for curves in ranked for curve in curves]
    end = _rounded_up(max([1e-3, 1.2 * profile.steps[-1].from_s, *ends]))
    return [0.0, end] if not later and end <= 2.0 * view else [0.0, view, *later, end]


def set_time(axes: Axes, nodes: Sequence[float]) -> None:
    """A time axis that is linear between its bends; nothing beyond its end is drawn."""
    from matplotlib.ticker import FixedLocator, NullLocator

    shares = np.linspace(_VIEW_SHARE, 1.0, len(nodes) - 1) if len(nodes) > 2 else np.array([1.0])
    times, places = np.asarray(nodes), np.concatenate(([0.0], shares))
    to_place, to_time = partial(np.interp, xp=times, fp=places), partial(np.interp, xp=places, fp=times)
    axes.set_xscale("function", functions=(to_place, to_time))
    axes.set_xlim(nodes[0], nodes[-1])
    step = next((step for step in _TICKS if nodes[1] / step <= _MOST_TICKS), _TICKS[-1])
    ticks = [tick for tick in np.arange(0.0, nodes[1], step).tolist() if nodes[1] - tick > 0.6 * step]
    axes.xaxis.set_major_locator(FixedLocator([*ticks, *nodes[1:]]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(lambda value, _: f"{1e3 * value:.0f}")
    for bend in nodes[1:-1]:
        axes.axvline(bend, color="0.75", linewidth=0.7, zorder=0.5)


def _rounded_up(time: float) -> float:
    """To two digits, for the axis's last label."""
    digit = 10.0 ** (math.floor(math.log10(time)) - 1)
    return round(math.ceil(time / digit - 1e-9) * digit, 9)
