"""Figures of an impact's mechanics: force and speed over time (thesis 3.2), restitution (3.4), force loops (3.5).

`draw_impact_figures` redraws all figures of the two chapters on impacts into a folder.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.base.files.foreign import FIGURES
from cdtool.base.files.locks import is_temporary
from cdtool.base.files.writing import replaced_folder
from cdtool.base.plain_text import plain
from cdtool.commands.study.sensor_plot import plot_ranking
from cdtool.commands.study.transmission_plots import plot_elastic_bode, plot_impact, plot_rigid_bode
from cdtool.impact.examples import chapter_4 as example
from cdtool.impact.impact import Impact
from cdtool.impact.sensor_ranking import rank_sensors
from cdtool.report.plots.figures import drawing, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cdtool.impact.examples.chapter_3 import RestitutionCurve

_FIRST, _SECOND, _THIRD = "#0072B2", "#D55E00", "#009E73"
_COLOURS = (_FIRST, _SECOND, _THIRD)
_LINES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.5)))
_TAKEN, _GIVEN = "#CFE0EE", "#F6D9C6"
_GUIDE: dict[str, Any] = {"color": "0.6", "linewidth": 0.7, "linestyle": (0, (3, 2)), "zorder": 1}
_HALO = {"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 1.0}
DEPTHS = (0.1e-6, 1e-6, 10e-6, 50e-6, 91e-6)
"""Penetrations about which figure 4.4 is drawn [m]."""
SPEED = 0.25
"""Speed of the load at them [m/s]; the thesis does not state the speed of its figure."""
SHARES = (0.01, 0.1, 1.0, 10.0)
"""Stiffnesses of the contact in figure 4.7 as shares of the limit 4.36."""


def plot_force_and_speed(impact: Impact) -> Figure:
    """Draw figure 3.2 for an impact of two bodies: force and impulses, speeds, force over penetration with its work."""
    with drawing():
        figure = new_figure(11.0, 3.5)
        force, speeds, work = figure.subplots(1, 3)
        _draw_force(force, impact)
        _draw_speeds(speeds, impact)
        _draw_work(work, impact)
    return figure


def plot_restitution(curves: Sequence[RestitutionCurve]) -> Figure:
    """Draw figure 3.4: restitution over the approach speed, exact and by 3.21, one colour per contact."""
    with drawing():
        figure = new_figure(6.4, 3.9)
        axes = figure.subplots()
        for curve, colour in zip(curves, _COLOURS, strict=False):
            axes.plot(curve.variable, curve.exact, color=colour, linewidth=1.6)
            axes.plot(curve.variable, curve.hunt_crossley, color=colour, linewidth=0.9, linestyle=(0, (4, 2)))
            _name(axes, (curve.variable[-1], curve.exact[-1]), curve.name, colour, (4, 0), va="center")
        axes.plot([], [], color="0.3", linewidth=1.6, label="Hunt-Crossley, exact")
        axes.plot([], [], color="0.3", linewidth=0.9, linestyle=(0, (4, 2)), label="e = 1 - α v (3.21)")
        axes.legend(loc="upper right")
        axes.set_xlabel("approach speed v [m/s]")
        _restitution_axis(axes, float(curves[0].variable[-1]))
    return figure


def plot_damping(curve: RestitutionCurve, at: FloatArray, simulated: FloatArray) -> Figure:
    """Draw restitution over the damping number: exact, simulated (n,) at `at` (n,), and by 3.21 and 3.22."""
    with drawing():
        figure = new_figure(6.4, 3.9)
        axes = figure.subplots()
        axes.plot(curve.variable, curve.exact, color=_FIRST, linewidth=1.6, label="exact relation")
        axes.plot(at, simulated, "o", color=_FIRST, markerfacecolor="white", markersize=5, label="simulated impacts")
        axes.plot(
            curve.variable, curve.hunt_crossley, color=_SECOND, linestyle=(0, (5, 2)), label="Hunt-Crossley (3.21)"
        )
        axes.plot(
            curve.variable,
            curve.lankarani_nikravesh,
            color=_THIRD,
            linestyle=(0, (2, 1.5)),
            label="Lankarani-Nikravesh (3.22)",
        )
        axes.legend(loc="upper right")
        axes.set_xlabel("damping number x = (μ/k) v")
        _restitution_axis(axes, float(curve.variable[-1]))
    return figure


def plot_loops(panels: Mapping[str, Mapping[str, Impact]]) -> Figure:
    """Draw figure 3.5: force over penetration, a panel per family of laws; the area of a loop is the energy lost."""
    with drawing():
        figure = new_figure(11.0, 3.7)
        row = figure.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False)[0]
        for axes, (title, impacts) in zip(row, panels.items(), strict=True):
            for (name, impact), colour, line in zip(impacts.items(), _COLOURS, _LINES, strict=False):
                depth, force = _closed(impact)
                lost = 1e3 * max(impact.energy_loss, 0.0) * impact.kinetic[0]
                axes.fill(depth, force, color=colour, alpha=0.13, linewidth=0)
                axes.plot(
                    depth, force, color=colour, linestyle=line, linewidth=1.5, label=f"{name}: {lost:.0f} mJ lost"
                )
                _arrow(axes, impact, colour)
            axes.set_title(title, loc="left", fontweight="bold")
            axes.set_xlabel("penetration δ [mm]")
            axes.legend(loc="upper left", handlelength=1.4)
        row[0].set_ylabel("force [N]")
        row[0].set_xlim(left=0.0)
        row[0].set_ylim(0.0, 1.32 * row[0].get_ylim()[1])
    return figure


def write_impact_plots(folder: Path) -> list[Path]:
    """Write figures 3.2, 3.4, 3.5 and restitution over damping, of cdtool's example impacts, to an existing folder."""
    from cdtool.impact.examples.chapter_3 import (
        loops,
        restitution_over_damping,
        restitution_over_speed,
        simulated_restitution,
        two_bodies,
    )

    numbers = np.array([0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0])
    figures = {
        "impact_course.png": plot_force_and_speed(two_bodies()),
        "impact_restitution.png": plot_restitution(restitution_over_speed()),
        "impact_loops.png": plot_loops(loops()),
        "impact_damping.png": plot_damping(restitution_over_damping(), numbers, simulated_restitution(numbers)),
    }
    for name, figure in figures.items():
        save(figure, folder / name)
    return [folder / name for name in figures]


def _draw_force(axes: Axes, impact: Impact) -> None:
    time, turn = 1e3 * (impact.time - impact.time[0]), impact.turn
    for part, colour, text in (
        (slice(0, turn + 1), _TAKEN, f"$p_c$\n{impact.impulse[turn]:.2f} N s"),
        (slice(turn, None), _GIVEN, f"$p_f - p_c$\n{impact.impulse[-1] - impact.impulse[turn]:.2f} N s"),
    ):
        axes.fill_between(time[part], impact.force[part], color=colour, linewidth=0)
        middle = float(np.average(time[part], weights=np.maximum(impact.force[part], 1e-12)))
        axes.text(middle, 0.3 * impact.peak_force, text, ha="center", va="center", fontsize=8, parse_math=True)
    axes.plot(time, impact.force, color="black", linewidth=1.4)
    _moments(axes, time, turn)
    axes.set_ylim(0.0, 1.15 * impact.peak_force)
    axes.set_ylabel("force [N]")
    _time_axis(axes, f"impulse: $e = (p_f - p_c)/p_c$ = {impact.restitution.poisson:.2f}")


def _draw_speeds(axes: Axes, impact: Impact) -> None:
    time = 1e3 * (impact.time - impact.time[0])
    relative = impact.speeds[:, 1] - impact.speeds[:, 0]
    lines = (
        (impact.speeds[:, 0], _FIRST, "$V_1$"),
        (impact.speeds[:, 1], _SECOND, "$V_2$"),
        (relative, "black", "$v = V_2 - V_1$"),
    )
    axes.axhline(0.0, color="0.6", linewidth=0.7, zorder=1)
    for values, colour, name in lines:
        axes.plot(time, values, color=colour, linewidth=1.4)
        _name(axes, (time[-1], values[-1]), name, colour, (4, 0), va="center")
    _moments(axes, time, impact.turn)
    axes.set_ylabel("speed [m/s]")
    _time_axis(axes, f"speed: $e = -v_f/v_i$ = {impact.restitution.newton:.2f}")


def _draw_work(axes: Axes, impact: Impact) -> None:
    depth, turn = 1e3 * impact.penetration, impact.turn
    axes.fill_between(depth[: turn + 1], impact.force[: turn + 1], color=_TAKEN, linewidth=0)
    axes.fill_between(depth[turn:], impact.force[turn:], color=_GIVEN, linewidth=0)
    axes.plot(depth, impact.force, color="black", linewidth=1.4)
    taken, back = impact.contact_work[turn], impact.contact_work[turn] - impact.contact_work[-1]
    top = impact.peak_force
    _name(axes, (0.03 * depth[turn], 0.86 * top), f"$|W_c|$ = {1e3 * taken:.0f} mJ taken in", "black", (0, 0))
    _name(axes, (0.03 * depth[turn], 0.78 * top), f"{1e3 * (taken - back):.0f} mJ of them lost", _FIRST, (0, 0))
    _name(axes, (0.83 * depth[turn], 0.16 * top), f"$W_{{rs}}$\n{1e3 * back:.0f} mJ", "black", (0, 0), ha="center")
    axes.axvline(depth[turn], **_GUIDE)
    _name(axes, (depth[turn], 0.0), r"$\delta_c$", "0.3", (3, 4))
    _name(axes, (depth[-1], 0.0), r"$\delta_f$", "0.3", (-4, 4), ha="right")
    axes.set_xlim(0.0, 1.12 * depth[turn])
    axes.set_ylim(0.0, 1.15 * top)
    axes.set_xlabel("penetration δ [mm]")
    axes.set_ylabel("force [N]")
    axes.set_title(f"work: $e^2 = W_{{rs}}/|W_c|$ = {impact.restitution.stronge**2:.2f}", loc="left", parse_math=True)


def _moments(axes: Axes, time: FloatArray, turn: int) -> None:
    """Draw t_c and t_f with their names."""
    for at, name in ((time[turn], "$t_c$"), (time[-1], "$t_f$")):
        axes.axvline(at, **_GUIDE)
        axes.annotate(
            name, (at, 1.0), xycoords=("data", "axes fraction"), xytext=(2, -2), textcoords="offset points", fontsize=8,
            va="top", color="0.3", annotation_clip=False, parse_math=True,
        )  # fmt: skip
    axes.set_xlim(0.0, 1.3 * time[-1])


def _time_axis(axes: Axes, title: str) -> None:
    axes.set_xlabel("time from the first touch [ms]")
    axes.set_title(title, loc="left", parse_math=True)


def _restitution_axis(axes: Axes, right: float) -> None:
    axes.set_xlim(0.0, right)
    axes.set_ylim(0.0, 1.02)
    axes.set_ylabel("restitution e")
    axes.grid(color="0.9", linewidth=0.6)


def _closed(impact: Impact) -> tuple[FloatArray, FloatArray]:
    """Return penetration [mm] and force [N] from the surface and back to it, so that a step of the force is drawn."""
    depth = 1e3 * np.concatenate(([0.0], impact.penetration))
    return depth, np.concatenate(([0.0], impact.force))


def _arrow(axes: Axes, impact: Impact, colour: str) -> None:
    """Draw the direction of the loop: an arrow while the bodies approach, another while they separate."""
    depth = 1e3 * impact.penetration
    for at in (int(0.55 * impact.turn), impact.turn + int(0.45 * (len(depth) - impact.turn))):
        axes.annotate(
            "",
            (depth[at + 6], impact.force[at + 6]),
            xytext=(depth[at], impact.force[at]),
            arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 0.0, "mutation_scale": 11},
        )


def _name(
    axes: Axes,
    place: tuple[float, float],
    text: str,
    colour: str,
    offset: tuple[float, float],
    ha: str = "left",
    va: str = "bottom",
) -> None:
    axes.annotate(
        text, place, xytext=offset, textcoords="offset points", ha=ha, va=va, fontsize=8, color=colour, bbox=_HALO,
        annotation_clip=False, parse_math=True,
    )  # fmt: skip


def draw_impact_figures(target: Path, *, force: bool = False) -> list[Path]:
    """Draw figures 3.2, 3.4, 3.5 (see `write_impact_plots`), 4.3, 4.4, 4.7 and 4.10 into a folder; return their files.

    A folder that contains only figures of cdtool is replaced as a whole, another one only with `force`: then files with
    other names stay. Raises CdtoolError if it cannot write.
    """
    with replaced_folder(target, lambda old: _only_figures(old, force=force)) as folder:
        written = _draw(folder)
    return [target / path.name for path in written]


def _only_figures(folder: Path, *, force: bool) -> bool:
    for path in sorted(folder.iterdir()):
        if is_temporary(path.name) or (path.suffix in FIGURES and FIGURES[path.suffix].is_kind_of(path)):
            continue
        if force:
            return False
        raise UsageError(
            f"{plain(path)}: is not a cdtool figure, and the folder would be replaced as a whole",
            "choose another folder, or keep its other files with --force",
        )
    return True


def _draw(folder: Path) -> list[Path]:
    course, rigid, elastic = (folder / f"transmission_{name}.png" for name in ("course", "rigid", "elastic"))
    plot_impact(example.impact(), course)
    states = [(depth, SPEED) for depth in DEPTHS]
    plot_rigid_bode(example.TRANSMISSION, example.CONTACT, states, rigid)
    plot_elastic_bode(example.ELASTIC, SHARES, elastic)
    ranking = folder / "sensor_ranking.png"
    plot_ranking(rank_sensors(example.RANKED, example.SENSORS), ranking)
    return [*write_impact_plots(folder), course, rigid, elastic, ranking]
