"""Which sensor detects an impact first: figure 4.10 of the thesis with times, and the contact force until then."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.detectors.look import BLUE, OCHRE, PLUM, RUST, TEAL
from cdtool.impact.sensor_ranking import Ranking, SensorResponse
from cdtool.report.number_text import number, short
from cdtool.report.plots.figures import drawing, label, new_figure, save
from cdtool.report.plots.style import FORCE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Kinds of sensor by location, from the contact to the controller.
_COLOURS = {
    "contact_force": RUST,
    "drive_force": OCHRE,
    "load_acceleration": TEAL,
    "motor_position": BLUE,
    "motor_force": PLUM,
}


def plot_ranking(ranking: Ranking, path: Path) -> None:
    """Draw the contact force, and below it a row per sensor up to its detection of the impact; the fastest on top.

    Raises UsageError, CdtoolError (see `save`).
    """
    with drawing():
        figure = new_figure(9.0, 2.9 + 0.36 * len(ranking.responses))
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.8, 0.34 * len(ranking.responses)))
        end = _end(ranking)
        _draw_force(upper, ranking, end)
        for row, response in enumerate(ranking.responses):
            _draw_row(lower, row, response, end)
        lower.set_ylim(len(ranking.responses) - 0.4, -0.6)
        names = [f"{label(response.sensor.name)}\n{label(response.sensor.place)}" for response in ranking.responses]
        lower.set_yticks(range(len(names)), names, fontsize=7.5)
        lower.tick_params(axis="y", length=0)
        lower.spines["left"].set_visible(False)
        lower.set_xlim(0.0, end)
        lower.grid(axis="x", color="0.9", linewidth=0.6)
        lower.set_xlabel(
            f"time since the touch until the deviation exceeds {ranking.factor:g} σ of noise and the resolution [ms]"
        )
        case = ranking.case
        moving = f"{short(case.transmission.load_mass)} kg at {short(case.speed)} m/s"
        title = f"{moving} on {number(case.obstacle.stiffness)} N/m"
        upper.set_title(title, loc="left", fontweight="bold")
        save(figure, path)


def _end(ranking: Ranking) -> float:
    seen = [1e3 * response.time for response in ranking.responses if response.time is not None]
    window = 1e3 * ranking.case.window
    return window if len(seen) < len(ranking.responses) else min(1.7 * max(seen), window)


def _draw_force(axes: Axes, ranking: Ranking, end: float) -> None:
    time = 1e3 * ranking.time
    shown = time <= end
    axes.plot(time[shown], ranking.contact_force[shown], color=FORCE)
    for response in ranking.responses:
        if response.time is not None and response.force is not None:
            colour = _COLOURS[response.sensor.quantity]
            axes.plot(1e3 * response.time, response.force, "o", color=colour, markersize=5, clip_on=False, zorder=3)
    axes.set_ylabel("contact force [N]")
    axes.set_ylim(0.0, 1.12 * max(float(np.max(ranking.contact_force[shown])), 1e-9))
    axes.grid(color="0.92", linewidth=0.6)


def _draw_row(axes: Axes, row: int, response: SensorResponse, end: float) -> None:
    colour = _COLOURS[response.sensor.quantity]
    if response.time is None:
        axes.plot([0.0, end], [row, row], color=colour, linewidth=1.2, linestyle=(0, (1, 2)))
        axes.text(0.5 * end, row - 0.08, "does not detect it", ha="center", va="bottom", fontsize=7.5)
        return
    at = 1e3 * response.time
    axes.barh(row, at, height=0.42, color=colour)
    words = f"{number(at)} ms, {number(response.force)} N"
    if (response.peak_so_far or 0.0) > 1.05 * (response.force or 0.0):
        words += f" (up to {number(response.peak_so_far)} N before)"
    right = at < 0.6 * end
    axes.text(
        at + (0.008 if right else -0.008) * end,
        row,
        f"{words}; limited by {response.limited_by}" if right else words,
        ha="left" if right else "right",
        va="center",
        fontsize=7.5,
        color="black" if right else "white",
    )
