"""The thesis's figures 4.3, 4.4 and 4.7: a simulated impact, its frequencies, and how the motor responds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import counted
from cdtool.impact.contact_laws.base import ContactLaw
from cdtool.impact.linearised import (
    linearised_contact,
    motor_by_penetration,
    motor_by_torque,
    penetration_by_momentum,
    undamped,
)
from cdtool.impact.rigidity import rigidity
from cdtool.impact.transmissions.transfer import Transfer, second_order
from cdtool.impact.transmissions.transmission import ElasticTransmission, RigidTransmission
from cdtool.impact.transmissions.transmission_simulation import SimulatedMotion
from cdtool.report.plots.figures import drawing, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FORCE, _DEPTH, _SPEED = "black", "#0072B2", "#D55E00"
_SERIES = ("#0072B2", "#009E73", "#E69F00", "#D55E00", "#B0569B")
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
    from matplotlib.ticker import FuncFormatter

    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(_power))
    axes.grid(color="0.92", linewidth=0.6)


def _power(value: float, _: int | None) -> str:
    """Return a power of ten as "10⁻³", because the style turns formulas off."""
    return "10" + f"{round(np.log10(value))}".translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
