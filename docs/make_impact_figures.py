"""Draw the figures of docs/impact.md and docs/study.md: python docs/make_impact_figures.py [FOLDER]

Figures 3.2, 3.4 and 3.5 of the thesis are drawn for example impacts, since the thesis has no numbers for them; 4.3,
4.4, 4.7 and 4.10 for the drive of its Table 4.1 (cdtool/impact/examples/chapter_4.py).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import FuncFormatter
from scipy.optimize import brentq

from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import counted
from cdtool.commands.study.sensor_plot import plot_ranking
from cdtool.detectors.look import BLUE, OCHRE, PLUM, RUST, TEAL
from cdtool.impact.bodies import Bodies
from cdtool.impact.collision import collide
from cdtool.impact.contact_laws.base import ContactLaw
from cdtool.impact.contact_laws.hertz import Hertz
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.contact_laws.hysteresis_damping import HysteresisDamping
from cdtool.impact.contact_laws.kelvin_voigt import KelvinVoigt
from cdtool.impact.examples import chapter_4 as example
from cdtool.impact.impact import Impact
from cdtool.impact.linearised import (
    linearised_contact,
    motor_by_penetration,
    motor_by_torque,
    penetration_by_momentum,
    undamped,
)
from cdtool.impact.restitution import (
    damping_for_restitution,
    hunt_crossley_restitution,
    kelvin_voigt_restitution,
)
from cdtool.impact.rigidity import rigidity
from cdtool.impact.sensor_ranking import rank_sensors
from cdtool.impact.transmissions.transfer import Transfer, second_order
from cdtool.impact.transmissions.transmission import ElasticTransmission, RigidTransmission
from cdtool.impact.transmissions.transmission_simulation import SimulatedMotion
from cdtool.report.plots.figures import drawing, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BODIES = Bodies(mass_1=1.0, speed_1=0.5)
_STIFFNESS = 1e8
_RESTITUTION = 0.7


@dataclass(frozen=True)
class RestitutionCurve:
    """e over a variable (n,): exact; by 3.21 and 3.22 if they define one (else NaN)."""

    name: str
    variable: FloatArray
    exact: FloatArray
    hunt_crossley: FloatArray
    lankarani_nikravesh: FloatArray


def two_bodies() -> Impact:
    """Figure 3.2: body 1 runs into body 2, the contact keeps a dent, and half of the relative energy is lost."""
    bodies = Bodies(mass_1=2.0, speed_1=0.6, mass_2=3.0, speed_2=0.1)
    deepest = Hertz(_STIFFNESS).greatest_penetration(bodies.effective_mass, bodies.approach_speed)
    return collide(Hertz(_STIFFNESS, permanent_indentation=0.5 * deepest), bodies).first


def loops() -> dict[str, dict[str, Impact]]:
    """Figure 3.5: the same body on contacts that all rebound with e = 0.7; by panel, by law."""
    mass, speed = _BODIES.effective_mass, _BODIES.approach_speed
    deepest = Hertz(_STIFFNESS).greatest_penetration(mass, speed)
    linear = mass * (speed / deepest) ** 2  # as deep as Hertz's spring, without damping
    laws: dict[str, dict[str, ContactLaw]] = {
        "Hertz": {
            "permanent indentation (3.16)": Hertz(_STIFFNESS, permanent_indentation=(1.0 - _RESTITUTION**2) * deepest),
            "none (3.13)": Hertz(_STIFFNESS),
        },
        "Linear spring": {
            "Kelvin-Voigt (3.17)": KelvinVoigt(linear, 2.0 * _damping_ratio() * math.sqrt(linear * mass)),
            "hysteresis damping (3.18)": HysteresisDamping(
                linear, damping_for_restitution(_RESTITUTION, speed, linear)
            ),
        },
        "Hunt-Crossley": {
            "e = 0.7 (3.19)": HuntCrossley(_STIFFNESS, damping_for_restitution(_RESTITUTION, speed, _STIFFNESS)),
            "e = 0.3 (3.19)": HuntCrossley(_STIFFNESS, damping_for_restitution(0.3, speed, _STIFFNESS)),
        },
    }
    return {panel: {name: collide(law, _BODIES).first for name, law in group.items()} for panel, group in laws.items()}


def restitution_over_speed() -> list[RestitutionCurve]:
    """Figure 3.4: e of Hunt-Crossley contacts over the approach speed [m/s], by alpha of e = 1 - alpha v [s/m]."""
    speed = np.linspace(0.0, 6.0, 301)
    return [_curve(f"α = {alpha:g} s/m", speed, 1.5 * alpha) for alpha in (0.08, 0.2, 0.5)]


def restitution_over_damping() -> RestitutionCurve:
    """Return e over the damping number x = (mu/k) v, exact and by 3.21 and 3.22."""
    return _curve("exact", np.linspace(0.0, 2.5, 501), 1.0)


def simulated_restitution(damping_numbers: FloatArray) -> FloatArray:
    """e (n,) of simulated Hunt-Crossley impacts with these damping numbers (n,)."""
    speed = _BODIES.approach_speed
    laws = (HuntCrossley(_STIFFNESS, float(x) * _STIFFNESS / speed) for x in damping_numbers)
    return np.array([collide(law, _BODIES).first.restitution.newton for law in laws])


def _curve(name: str, variable: FloatArray, scale: float) -> RestitutionCurve:
    x = scale * variable
    first_order = np.where(x <= 1.5, 1.0 - x / 1.5, np.nan)
    with np.errstate(invalid="ignore"):
        second = np.sqrt(1.0 - x / 0.75)
    return RestitutionCurve(name, variable, hunt_crossley_restitution(x), first_order, second)


def _damping_ratio() -> float:

    return float(brentq(lambda zeta: float(kelvin_voigt_restitution(zeta)) - _RESTITUTION, 0.0, 1.0))


_FIRST, _SECOND, _THIRD = BLUE, RUST, TEAL
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
        axes.plot([], [], color="0.3", linewidth=0.9, linestyle=(0, (4, 2)), label="e = 1 − α v (3.21)")
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


_FORCE, _DEPTH, _SPEED = "black", BLUE, RUST
_SERIES = (BLUE, TEAL, OCHRE, RUST, PLUM)
_DASHES = ("-", (0, (6, 2)), (0, (3, 1.5)), (0, (5, 1.5, 1, 1.5)), (0, (1, 1)))
_BEFORE_MS = 4.0


def plot_impact(motion: SimulatedMotion, path: Path) -> None:
    """Draw figure 4.3: force, penetration and speed, the whole event at the left, its first contact at the right.

    Raises UsageError, CdtoolError (see `save`).
    """
    first, last = motion.contacts[0], motion.contacts[-1]
    whole = 1e3 * (last.start - first.start) * 1.55 + 1.0
    time = 1e3 * (motion.time - first.start)
    curves = (
        (motion.force, "force F [N]", _FORCE),
        (1e3 * motion.penetration, "penetration δ [mm]", _DEPTH),
        (motion.load_speed, "speed of the load [m/s]", _SPEED),
    )
    with drawing():
        figure = new_figure(9.0, 5.6)
        panels = figure.subplots(3, 2, sharex="col", width_ratios=(1.7, 1.0))
        spans = ((-_BEFORE_MS, whole), (-0.15 * 1e3 * first.duration, 1.25e3 * first.duration))
        for row, (values, name, colour) in zip(panels, curves, strict=True):
            for axes, span in zip(row, spans, strict=True):
                shown = (time >= span[0]) & (time <= span[1])
                axes.plot(time[shown], values[shown], color=colour)
                axes.axhline(0.0, color="0.7", linewidth=0.6, zorder=0)
                axes.set_xlim(*span)
                axes.grid(color="0.92", linewidth=0.6)
            row[0].set_ylabel(name)
        for axes in panels[1]:
            axes.set_ylim(-0.55 * 1e3 * first.max_penetration, 1.15 * 1e3 * first.max_penetration)
        panels[0, 0].set_title("the whole event", loc="left", fontweight="bold")
        panels[0, 1].set_title("its first contact", loc="left", fontweight="bold")
        panels[0, 1].annotate(
            f"{first.peak_force:.1f} N\n{1e3 * first.max_penetration:.4f} mm, {1e3 * first.duration:.3f} ms\n"
            f"energy lost: {100.0 * first.energy_loss:.1f} %",
            (0.5, 0.1),
            xycoords="axes fraction",
            ha="center",
            fontsize=8,
        )
        panels[2, 1].annotate(
            f"{first.approach_speed:.3f} m/s before,\n{first.final_speed:.3f} m/s after".replace("-", "\N{MINUS SIGN}"),
            (0.04, 0.1),
            xycoords="axes fraction",
            fontsize=8,
        )
        panels[0, 0].annotate(
            f"{counted(len(motion.contacts), 'contact')}, the last one stays",
            (0.97, 0.85),
            xycoords="axes fraction",
            ha="right",
            fontsize=8,
        )
        panels[2, 0].set_xlabel(f"time since the touch at {1e3 * first.start:.1f} ms [ms]")
        panels[2, 1].set_xlabel("time since the touch [ms]")
        save(figure, path)


def plot_rigid_bode(
    transmission: RigidTransmission, law: ContactLaw, states: Sequence[tuple[float, float]], path: Path
) -> None:
    """Draw figure 4.4: motor angle by torque, before the impact and about `states` (penetration [m], rate [m/s]) of it.

    Raises UsageError, CdtoolError (see `save`).
    """
    frequency = np.geomspace(10.0, 1e5, 1500)
    with drawing():
        figure = new_figure(9.0, 5.4)
        panels = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
        _bode(panels, motor_by_torque(transmission), frequency, "before the impact", "0.45", "-")
        for i, (depth, rate) in enumerate(states):
            about = motor_by_torque(transmission, linearised_contact(law, depth, rate))
            found = second_order(about)
            words = f"δ = {1e6 * depth:g} µm: ωₙ = {found.natural_frequency:.0f} rad/s, ξ = {found.damping_ratio:.3f}"
            _bode(panels, about, frequency, words, _SERIES[i % len(_SERIES)], _DASHES[i % len(_DASHES)])
        panels[0].set_ylabel("|Δθ / Δτ| [rad/(N m)]")
        title = f"about these penetrations, at {states[0][1]:g} m/s"
        panels[0].legend(loc="lower left", title=title, alignment="left", title_fontsize=8)
        panels[0].set_ylim(1e-9, 10.0)
        _finish_bode(panels)
        save(figure, path)


def plot_elastic_bode(transmission: ElasticTransmission, shares: Sequence[float], path: Path) -> None:
    """Draw figure 4.7: penetration by momentum for contacts of these shares of the limit 4.36, motor by penetration.

    Without damping, as in the thesis. Raises UsageError, CdtoolError (see `save`).
    """
    free = undamped(transmission)
    own = free.transmission_frequency
    frequency = _with(np.geomspace(0.03, 20.0, 1500) * own, own)
    limit = rigidity(free, 1.0).limit
    with drawing():
        figure = new_figure(9.0, 5.8)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
        for i, share in enumerate(shares):
            contact = share * limit
            found = rigidity(free, contact)
            frequencies = _with(frequency, found.lower_resonance, found.upper_resonance)
            size = np.abs(penetration_by_momentum(free, contact).response(frequencies))
            lower_share, ratio = found.lower_resonance / own, found.motion_ratio
            words = f"Kc = {share:g} of the limit: ω₁ = {lower_share:.2f} ωₐ, θr/δ = {ratio:.3g}"
            upper.loglog(frequencies / own, size, color=_SERIES[i], linestyle=_DASHES[i], label=words)
            lower.axvline(lower_share, color=_SERIES[i], linestyle=_DASHES[i], linewidth=0.9)
            lower.plot(lower_share, ratio, "o", color=_SERIES[i], markersize=5, zorder=3)
        follow = np.abs(motor_by_penetration(free).response(frequency)) * free.ratio
        lower.loglog(frequency / own, follow, color="black")
        lower.axhline(1.0, color="0.7", linewidth=0.6, zorder=0)
        upper.set_ylabel("|Gcδ| [m/(N s)]")
        lower.set_ylabel("r |Gδθ|: motor by load")
        upper.set_ylim(1e-8, 1e-2)
        lower.set_ylim(1e-3, 100.0)
        lower.set_xlabel(
            f"frequency over ωₐ = √(k/J) = {own:.4g} rad/s of the drive; coloured: ω₁, where the load swings"
        )
        upper.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        for axes in (upper, lower):
            _log_axes(axes)
        upper.set_xlim(0.03, 20.0)
        save(figure, path)


def _with(frequency: FloatArray, *peaks: float) -> FloatArray:
    # Close to a peak, but never on it: without damping it is infinite.
    near = np.geomspace(1e-9, 0.02, 200)
    points = [peak * (1.0 + sign * near) for peak in peaks for sign in (-1.0, 1.0)]
    return np.unique(np.concatenate([frequency, *points]))


def _bode(
    panels: Sequence[Axes], transfer: Transfer, frequency: FloatArray, words: str, colour: str, dashes: object
) -> None:
    answer = transfer.response(frequency)
    look = {"color": colour, "linestyle": dashes}
    panels[0].loglog(frequency, np.abs(answer), label=words, **look)
    panels[1].semilogx(frequency, np.degrees(np.unwrap(np.angle(answer))), **look)


def _finish_bode(panels: Sequence[Axes]) -> None:
    panels[1].set_ylabel("phase [°]")
    panels[1].set_yticks([0, -45, -90, -135, -180])
    panels[1].set_xlabel("frequency [rad/s]")
    panels[1].set_xlim(10.0, 1e5)
    panels[1].grid(color="0.92", linewidth=0.6)
    _log_axes(panels[0])


def _log_axes(axes: Axes) -> None:

    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(_power))
    axes.grid(color="0.92", linewidth=0.6)


def _power(value: float, _: int | None) -> str:
    """Return a power of ten as "10⁻³", because the style turns formulas off."""
    return "10" + f"{round(np.log10(value))}".translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def draw(folder: Path) -> None:
    """Draw all figures into an existing folder."""
    numbers = np.array([0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0])
    save(plot_force_and_speed(two_bodies()), folder / "impact_course.png")
    save(plot_restitution(restitution_over_speed()), folder / "impact_restitution.png")
    save(plot_loops(loops()), folder / "impact_loops.png")
    damping = plot_damping(restitution_over_damping(), numbers, simulated_restitution(numbers))
    save(damping, folder / "impact_damping.png")
    plot_impact(example.impact(), folder / "transmission_course.png")
    states = [(depth, SPEED) for depth in DEPTHS]
    plot_rigid_bode(example.TRANSMISSION, example.CONTACT, states, folder / "transmission_rigid.png")
    plot_elastic_bode(example.ELASTIC, SHARES, folder / "transmission_elastic.png")
    plot_ranking(rank_sensors(example.RANKED, example.SENSORS), folder / "sensor_ranking.png")


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("images"))
