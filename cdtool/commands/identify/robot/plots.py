"""Figures of a robot's identification: unseen torque with its residual, and friction over speed, a panel per joint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdtool.commands.identify.robot.robot_evidence import (
    FrictionAnswer,
    FrictionDecision,
    JointFrictionCurve,
    UnseenTorque,
)
from cdtool.detectors.look import BLUE, RED
from cdtool.report.number_text import number
from cdtool.report.plots.figures import drawing, label, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _COLUMNS = 9.0, 3
_MEASURED, _UNDER, _MODEL, _RESIDUAL, _OLD, _BAND = "0.35", "0.6", BLUE, RED, "0.55", "0.85"
_MOST_POINTS = 2000


@dataclass(frozen=True, eq=False)
class JointPanel:
    """What is drawn of a joint: its name, the decision on its friction, units of torque and travel, and the curves."""

    name: str
    decision: FrictionDecision
    units: tuple[str, str]
    unseen: UnseenTorque | None = None
    friction: JointFrictionCurve | None = None


def draw_unseen_torques(panels: Sequence[JointPanel]) -> Figure:
    """Draw per joint measured and predicted torque of parts that the fit did not see, and below them the residuals.

    The friction in use is that which the machine file has afterwards, the other one the old or the refitted one; titles
    have the RMS of the residual on all parts. The band is the deviation between equal runs, where there are any.
    """
    shown = [panel for panel in panels if panel.unseen is not None]
    with drawing():
        columns = min(_COLUMNS, len(shown))
        rows = math.ceil(len(shown) / columns)
        figure = new_figure(_WIDTH, 2.7 * rows + 0.2)
        grid = figure.subplots(2 * rows, columns, squeeze=False, height_ratios=[3, 2] * rows)
        axes: list[Axes] = []
        for place, panel in enumerate(shown):
            row, column = divmod(place, columns)
            above, below = grid[2 * row, column], grid[2 * row + 1, column]
            above.sharex(below)
            _draw_torque(above, below, panel)
            axes += [above, below]
        for place in range(len(shown), rows * columns):
            row, column = divmod(place, columns)
            grid[2 * row, column].set_visible(False)
            grid[2 * row + 1, column].set_visible(False)
        _name_lines(figure, axes)
        return figure


def draw_joint_frictions(panels: Sequence[JointPanel]) -> Figure:
    """Draw per joint the friction over speed with two standard errors, the friction in use and the other one.

    A model that runs past the bars is wrong in its form, or the friction depends on more than the speed.
    """
    shown = [panel for panel in panels if panel.friction is not None]
    with drawing():
        columns = min(_COLUMNS, len(shown))
        rows = math.ceil(len(shown) / columns)
        figure = new_figure(_WIDTH, 2.4 * rows + 0.2)
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for place, panel in enumerate(shown):
            _draw_friction(grid[place], panel)
        for axes in grid[len(shown) :]:
            axes.set_visible(False)
        _name_lines(figure, list(grid[: len(shown)]))
        return figure


def _name_lines(figure: Figure, axes: Sequence[Axes]) -> None:
    """Add one legend above all panels."""
    named: dict[str, Any] = {}
    for panel in axes:
        handles, names = panel.get_legend_handles_labels()
        named = {**dict(zip(names, handles, strict=True)), **named}
    figure.legend(list(named.values()), list(named), loc="outside upper left", ncols=5)


def _title(panel: JointPanel) -> str:
    decision, unit = panel.decision, panel.units[0]
    if _is_new(panel):
        return f"{label(panel.name, 18)}, new friction: {number(decision.before)} → {number(decision.after)} {unit}"
    return f"{label(panel.name, 18)}, old friction: {number(decision.before)} {unit}"


def _is_new(panel: JointPanel) -> bool:
    return panel.decision.answer is FrictionAnswer.NEW


def _draw_torque(above: Axes, below: Axes, panel: JointPanel) -> None:
    unseen = panel.unseen
    assert unseen is not None
    every = slice(None, None, max(len(unseen.time) // _MOST_POINTS, 1))
    time, measured = unseen.time[every], unseen.measured[every]
    new, old = unseen.predicted[every], unseen.previous[every]
    kept, other = (new, old) if _is_new(panel) else (old, new)
    above.plot(time, measured, color=_UNDER, linewidth=2.2, label="measured")
    above.plot(time, kept, color=_MODEL, linewidth=1.0, label="model, friction in use")
    above.set_ylabel(f"torque [{panel.units[0]}]" if panel.units[0] != "N" else "force [N]")
    above.tick_params(axis="x", labelbottom=False)
    above.set_title(_title(panel), loc="left")
    if math.isfinite(panel.decision.floor):
        floor = panel.decision.floor
        below.axhspan(-floor, floor, color=_BAND, linewidth=0, label="between equal runs (± 1 st. dev.)")
    below.plot(time, measured - other, color=_OLD, linewidth=0.8, label="residual, other friction")
    below.plot(time, measured - kept, color=_RESIDUAL, linewidth=0.9, label="residual, friction in use")
    below.axhline(0.0, color="0.3", linewidth=0.6)
    below.set_ylabel(f"residual [{panel.units[0]}]")
    below.set_xlabel(f"time in {label(Path(unseen.run).name, 24)} [s]")


def _draw_friction(axes: Axes, panel: JointPanel) -> None:
    curve = panel.friction
    assert curve is not None
    points = curve.points
    axes.errorbar(
        points.abscissa,
        points.mean,
        yerr=2.0 * np.nan_to_num(points.standard_error),
        fmt="o",
        color=_MEASURED,
        markersize=3,
        linewidth=0.8,
        capsize=1.5,
        label="measured, mean ± 2 standard errors",
        zorder=2,
    )
    used, other = (curve.new, curve.previous) if _is_new(panel) else (curve.previous, curve.new)
    for side in (-1.0, 1.0):
        inside = np.sign(curve.speed) == side
        if not inside.any():
            continue
        axes.plot(curve.speed[inside], other[inside], "--", color=_OLD, linewidth=1.0, label="other friction", zorder=3)
        axes.plot(curve.speed[inside], used[inside], color=_MODEL, linewidth=1.6, label="friction in use", zorder=4)
    axes.set_xlabel(f"speed [{panel.units[1]}/s]")
    axes.set_ylabel(f"friction [{panel.units[0]}]")
    axes.set_title(_title(panel), loc="left")
