"""Figures of a robot's identification: unseen torque with its residual, and friction over speed, a panel per joint."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.identify.plots import bars, compare, thinned
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer, JointFriction
from cdtool.detectors.look import BLUE
from cdtool.report.number_text import number
from cdtool.report.plots.figures import drawing, label, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _COLUMNS = 9.0, 3
_MEASURED, _MODEL, _OLD = "0.35", BLUE, "0.55"


def draw_unseen_torques(joints: Sequence[tuple[JointIdentification, JointFriction, float]]) -> Figure:
    """Draw per joint measured and predicted torque of parts that the fit did not see, and below them the residuals.

    Of each joint its friction and the deviation between equal runs, which is a band, NaN without any. The friction in
    use is that which the machine file has afterwards, the other one the old or the refitted one; titles have the RMS of
    the residual on all parts.
    """
    with drawing():
        columns, rows = min(_COLUMNS, len(joints)), math.ceil(len(joints) / _COLUMNS)
        figure = new_figure(_WIDTH, 2.7 * rows + 0.2)
        grid = figure.subplots(2 * rows, columns, squeeze=False, height_ratios=[3, 2] * rows)
        # A pair of panels per joint.
        pairs = grid.reshape(rows, 2, columns).transpose(0, 2, 1).reshape(-1, 2)
        for (above, below), joint in zip(pairs, joints, strict=False):
            above.sharex(below)
            _draw_torque(above, below, *joint)
        _finish(figure, pairs[: len(joints)].ravel(), pairs[len(joints) :].ravel())
        return figure


def draw_joint_frictions(joints: Sequence[JointIdentification]) -> Figure:
    """Draw per joint the friction over speed with two standard errors, the friction in use and the other one.

    A model that runs past the bars is wrong in its form, or the friction depends on more than the speed.
    """
    with drawing():
        columns, rows = min(_COLUMNS, len(joints)), math.ceil(len(joints) / _COLUMNS)
        figure = new_figure(_WIDTH, 2.4 * rows + 0.2)
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, joint in zip(grid, joints, strict=False):
            _draw_friction(axes, joint)
        _finish(figure, grid[: len(joints)], grid[len(joints) :])
        return figure


def _finish(figure: Figure, used: Iterable[Axes], empty: Iterable[Axes]) -> None:
    """Add one legend above all panels, and hide those that are empty."""
    named: dict[str, Any] = {}
    for panel in used:
        handles, names = panel.get_legend_handles_labels()
        named = {**dict(zip(names, handles, strict=True)), **named}
    for panel in empty:
        panel.set_visible(False)
    figure.legend(list(named.values()), list(named), loc="outside upper left", ncols=5)


def _title(joint: JointIdentification, friction: JointFriction) -> str:
    unit = joint.units[1]
    if friction.answer is FrictionAnswer.NEW:
        return f"{label(joint.joint, 18)}, new friction: {number(friction.before)} → {number(friction.after)} {unit}"
    return f"{label(joint.joint, 18)}, old friction: {number(friction.before)} {unit}"


def _draw_torque(above: Axes, below: Axes, joint: JointIdentification, friction: JointFriction, floor: float) -> None:
    assert joint.evidence is not None and joint.evidence.unseen is not None
    unseen, unit = joint.evidence.unseen, joint.units[1]
    every = thinned(np.arange(len(unseen.time)))
    time, measured = unseen.time[every], unseen.measured[every]
    new, old = unseen.predicted[every], unseen.previous[every]
    kept, other = (new, old) if friction.answer is FrictionAnswer.NEW else (old, new)
    band = np.full(len(time), floor) if math.isfinite(floor) else None
    axis = f"torque [{unit}]" if unit != "N" else "force [N]"
    compare((above, below), time, (measured, kept), axis, (band, "between equal runs (± 1 st. dev.)"))
    below.plot(time, measured - other, color=_OLD, linewidth=0.8, label="other friction", zorder=1)
    above.tick_params(axis="x", labelbottom=False)
    above.set_title(_title(joint, friction), loc="left")
    below.set_xlabel(f"time in {label(Path(unseen.run).name, 24)} [s]")


def _draw_friction(axes: Axes, joint: JointIdentification) -> None:
    assert joint.robot is not None and joint.evidence is not None and joint.evidence.friction is not None
    curve = joint.evidence.friction
    bars(axes, curve.points, _MEASURED, "mean ± 2 standard errors")
    used, other = (curve.new, curve.previous)
    if joint.robot.answer is not FrictionAnswer.NEW:
        used, other = other, used
    for side in (-1.0, 1.0):
        inside = np.sign(curve.speed) == side
        if not inside.any():
            continue
        axes.plot(curve.speed[inside], other[inside], "--", color=_OLD, linewidth=1.0, label="other friction", zorder=3)
        axes.plot(curve.speed[inside], used[inside], color=_MODEL, linewidth=1.6, label="model", zorder=4)
    axes.set_xlabel(f"speed [{joint.units[2]}/s]")
    axes.set_ylabel(f"friction [{joint.units[1]}]")
    axes.set_title(_title(joint, joint.robot), loc="left")
