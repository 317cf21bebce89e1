"""A signature: mean and limits along the stroke, as first learned and now, and the number of runs at each location."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.report.plots.figures import drawing, label, new_figure, save, unit_label
from cdtool.report.plots.style import BAND, LIMIT, NOT_ASSESSED, look_of
from cdtool.results.traces.decimation import decimate
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature_curve import Curve

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PIXELS = 1000
_MOST_ROWS = 6
_BAND_HEIGHT, _COUNT_HEIGHT = 1.7, 0.5
_NOW = (0, (4, 2))
_FIRST = (0, (1, 1.5))

Pair = tuple[FittedSignature, FittedSignature]


def plot_signature(
    current: Sequence[FittedSignature], first: Sequence[FittedSignature], unit: str, detector: str, path: Path
) -> None:
    """Draw a row per class of motion and joint, up to six; raises UsageError, CdtoolError (see `save`).

    Left is the time while accelerating, right the travel after it; if the signature uses only one of them, that one.
    """
    with drawing():
        save(_figure(list(zip(current, first, strict=True)), unit, detector), path)


def _figure(pairs: Sequence[Pair], unit: str, detector: str) -> Figure:
    rows = [(pair, joint) for pair in pairs for joint in range(len(pair[0].joints))]
    shown = rows[:_MOST_ROWS]
    # All signatures of a file have the same rule, so that all rows have the same axes.
    axes = _axes_of(pairs[0][0])
    heights = (_BAND_HEIGHT, _COUNT_HEIGHT) * len(shown)
    widths = [1.0 if name == "time" else 2.6 for name in axes]
    figure = new_figure(9.5, 1.2 + 0.25 * len(shown) + sum(heights))
    panels = figure.subplots(
        len(heights), len(axes), squeeze=False, sharex="col", height_ratios=heights, width_ratios=widths
    )
    for row, (pair, joint) in enumerate(shown):
        bands, counts = panels[2 * row], panels[2 * row + 1]
        for band, count, name in zip(bands, counts, axes, strict=True):
            _draw_lines(band, pair, name, joint, detector)
            _draw_count(count, pair, name, joint)
        _align(bands)
        for band, name in zip(bands, axes, strict=True):
            _fill_band(band, pair[0], name, joint)
        bands[0].set_ylabel(f"{label(detector, 24)}\n[{unit_label(unit)}]")
        counts[0].set_ylabel("runs")
        bands[0].set_title(_title(pair[0], joint), loc="left", fontweight="bold")
    for panel, name in zip(panels[-1], axes, strict=True):
        panel.set_xlabel("time since the motion began [s]" if name == "time" else "travel [m or rad]")
    if len(rows) > len(shown):
        more = f"{len(rows) - len(shown)} more classes and joints are not drawn"
        figure.suptitle(more, fontsize=9, x=0.01, ha="left")
    figure.align_ylabels()
    figure.legend(handles=_handles(shown, detector), loc="outside lower left", ncols=5)
    return figure


def _title(signature: FittedSignature, joint: int) -> str:
    sign = {1: "+", -1: "\u2212", 0: "±"}[signature.watched]
    limit = f"limit: mean {sign} {signature.safety_factor:.4g} spreads"
    return f"{label(signature.joints[joint], 30)}, {signature.motion.described}: {signature.runs} runs, {limit}"


def _updated(pair: Pair) -> bool:
    """Return whether runs were added since the first signature."""
    return any(
        not np.array_equal(_curve(pair[0], name).squares, _curve(pair[1], name).squares) for name in _axes_of(pair[0])
    )


def _axes_of(signature: FittedSignature) -> tuple[str, ...]:
    return {"time": ("time",), "position": ("travel",)}.get(signature.alignment, ("time", "travel"))


def _curve(signature: FittedSignature, name: str) -> Curve:
    return signature.by_time if name == "time" else signature.by_position


def _draw_lines(axes: Axes, pair: Pair, name: str, joint: int, detector: str) -> None:
    """Draw mean and limits now, and the limits as first learned if they were different."""
    current, first = pair
    curve = _curve(current, name)
    mean, _ = curve.band(current.pooled)
    lower, upper = (limit[:, joint] for limit in current.limits(curve))
    grid = curve.grid
    axes.plot(*decimate(grid, mean[:, joint], _PIXELS), color=look_of(detector).colour, zorder=3)
    for limit in (lower, upper):
        _draw_limit(axes, grid, limit, _NOW, LIMIT)
    if _updated(pair):
        old = _curve(first, name)
        for limit in first.limits(old):
            _draw_limit(axes, old.grid, limit[:, joint], _FIRST, "black")
    axes.margins(x=0.01)


def _fill_band(axes: Axes, signature: FittedSignature, name: str, joint: int) -> None:
    """Fill the normal band, to the panel's edge on a side without a limit; hatched where no limit is known."""
    curve = _curve(signature, name)
    lower, upper = (limit[:, joint] for limit in signature.limits(curve))
    low, high = axes.get_ylim()
    filled = np.where(np.isneginf(lower), low, lower), np.where(np.isposinf(upper), high, upper)
    axes.fill_between(curve.grid, *filled, color=BAND, linewidth=0, zorder=0.5)
    _hatch(axes, curve.grid, np.isnan(lower))
    axes.set_ylim(low, high)


def _hatch(axes: Axes, grid: FloatArray, where: BoolArray) -> None:
    axes.fill_between(
        grid,
        0.0,
        1.0,
        where=where.tolist(),
        transform=axes.get_xaxis_transform(),
        facecolor="none",
        edgecolor=NOT_ASSESSED,
        hatch="////",
        linewidth=0.0,
    )


def _draw_limit(
    axes: Axes, grid: FloatArray, limit: FloatArray, dashes: tuple[int, tuple[float, ...]], colour: str
) -> None:
    finite = np.where(np.isfinite(limit), limit, np.nan)
    if np.isfinite(finite).any():
        axes.plot(*decimate(grid, finite, _PIXELS), color=colour, linestyle=dashes, linewidth=1.0, zorder=4)


def _draw_count(axes: Axes, pair: Pair, name: str, joint: int) -> None:
    """Draw the number of valid runs at each location; hatched where there were too few."""
    curve = _curve(pair[0], name)
    count = curve.count[:, joint]
    axes.fill_between(curve.grid, count, step="mid", color="0.75", linewidth=0)
    axes.axhline(curve.enough, color=LIMIT, linestyle=(0, (4, 2)), linewidth=0.9)
    _hatch(axes, curve.grid, count < curve.enough)
    axes.set_ylim(0.0, 1.15 * max(float(count.max(initial=0.0)), 1.0))


def _align(panels: Sequence[Axes]) -> None:
    """Set the same range of the signal left and right."""
    ranges = np.array([axes.get_ylim() for axes in panels])
    for axes in panels:
        axes.set_ylim(float(ranges[:, 0].min()), float(ranges[:, 1].max()))


def _handles(rows: Sequence[tuple[Pair, int]], detector: str) -> list[Artist]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [
        Line2D([], [], color=look_of(detector).colour, label="mean"),
        Line2D([], [], color=LIMIT, linestyle=_NOW, linewidth=1.0, label="limit; runs needed for one"),
        Patch(facecolor=BAND, edgecolor="none", label="normal band"),
    ]
    if any(_updated(pair) for pair, _ in rows):
        handles.append(Line2D([], [], color="black", linestyle=_FIRST, linewidth=1.0, label="limit as first learned"))
    handles.append(Patch(facecolor="white", edgecolor=NOT_ASSESSED, hatch="////", label="no limit: too few runs"))
    return handles
