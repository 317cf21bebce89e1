"""Figures of an identification that show the misfit: residuals of unseen runs, friction, starts, controller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import counted
from cdtool.commands.identify.axis.speed_controller import ControllerComparison
from cdtool.commands.identify.axis.two_mass import StartComparison
from cdtool.commands.identify.evidence import CrossValidation, ForceEvidence, FrictionCurve
from cdtool.detectors.look import BLUE, RUST
from cdtool.report.number_text import number
from cdtool.report.plots.figures import drawing, log_label, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Inches, as the other plots of a page.
_WIDTH = 9.0
_MEASURED, _UNDER, _MODEL, _RESIDUAL, _BAND = "0.35", "0.6", BLUE, RUST, "0.85"


def draw_unseen_run(validation: CrossValidation, unit: str) -> Figure:
    """Draw measured and predicted force of the run that is described worst, and below them the residual, in motion.

    The band is the deviation between equal strokes: what is left over beyond it is the model's.
    """
    unseen = validation.worst
    index = _thinned(np.arange(len(unseen.time)))
    time = unseen.time[index]
    measured, predicted = (_gaps(time, values[index]) for values in (unseen.measured, unseen.predicted))
    what = f"run with the largest error of {unseen.of_runs}" if unseen.of_runs > 1 else "parts of the only run"
    floor = np.full(len(time), validation.floor) if validation.repeats else None
    with drawing():
        figure = new_figure(_WIDTH, 4.6)
        panels = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        _compare(
            panels, time, (measured, predicted), f"force [{unit}]", (floor, "between equal motions (± 1 st. dev.)")
        )
        title = f"{log_label(unseen.run)}, left out of the fit ({what}): {number(unseen.error)} {unit} RMS"
        panels[0].set_title(title, loc="left")
        for panel in panels:
            panel.legend(loc="upper right", ncols=2)
        return figure


def draw_friction(shown: ForceEvidence, units: tuple[str, str, str]) -> Figure:
    """Draw the friction over speed with the model, and the rest over position; `units` of force, speed and travel.

    Bars are two standard errors between strokes. The left panel has the measured force minus that of the inertia; a
    model that runs past the bars is wrong in its form. The right one has what the model leaves over along the travel:
    a profile there is friction that depends on the position.
    """
    force, speed, travel = units
    curve = shown.friction_curve
    with drawing():
        figure = new_figure(_WIDTH, 3.4)
        left, right = figure.subplots(1, 2)
        every = _thinned(np.arange(len(shown.speed)))
        left.plot(shown.speed[every], shown.friction[every], ".", color="0.8", markersize=1.5, zorder=1)
        _bars(left, curve, _MEASURED, "measured, mean ± 2 standard errors")
        for side in (1.0, -1.0):
            inside = np.sign(shown.speed) == side
            if inside.any():
                x, y = _model_curve(shown.speed[inside], (shown.friction - shown.residual)[inside])
                left.plot(x, y, color=_MODEL, linewidth=1.6, zorder=3, label="model")
        left.set_xlabel(f"speed [{speed}]")
        left.set_ylabel(f"friction [{force}]")
        _fit_to(left, curve)
        _legend_once(left)
        names = {1: "forward", -1: "backward"}
        for direction, item in shown.position_curves.items():
            look = (_RESIDUAL, names[direction], "o-") if direction > 0 else (_MODEL, names[direction], "s--")
            _bars(right, item, *look[:2], line=look[2])
        right.axhline(0.0, color="0.3", linewidth=0.6)
        right.set_xlabel(f"position [{travel}]")
        right.set_ylabel(f"residual [{force}]")
        _legend_once(right)
        left.set_title("Friction over speed", loc="left")
        right.set_title("What the model leaves over, along the travel", loc="left")
        return figure


def draw_starts(start: StartComparison, units: tuple[str, str, str]) -> Figure:
    """Draw the mean of aligned starts against the model that it drives; the band is the deviation between runs.

    `units` of force, speed and travel. The lowest panel of each channel is the difference.
    """
    force, speed, travel = units
    ensemble = start.ensemble
    names = [name for name in ("speed", "torque", "acceleration") if name in start.modelled]
    of_channel = {"speed": speed, "torque": force, "acceleration": f"{travel}/s²"}
    titles = {"speed": "speed", "torque": "force", "acceleration": "acceleration"}
    time = ensemble.period * (np.arange(len(ensemble), dtype=np.float64) - ensemble.start_index)
    with drawing():
        figure = new_figure(_WIDTH, 4.4)
        panels = figure.subplots(2, len(names), sharex=True, squeeze=False, height_ratios=(3, 2))
        for column, name in zip(panels.T, names, strict=True):
            lines = ensemble.mean[name], start.modelled[name]
            band = ensemble.deviation[name] if ensemble.count > 1 else None
            axis = f"{titles[name]} [{of_channel[name]}]"
            _compare(column, time, lines, axis, (band, "between runs (± 1 st. dev.)"))
            column[1].set_xlabel("time from the start of the motion [s]")
        panels[0, 0].legend(loc="lower right")
        panels[1, 0].legend(loc="upper right")
        direction = "forward" if ensemble.direction > 0 else "backward"
        starts, top = counted(ensemble.count, "start"), f"{number(ensemble.nominal_speed)} {speed}"
        title = f"Mean of {starts} {direction} to {top}, and the model driven by its force"
        figure.suptitle(title, fontsize=9, x=0.01, ha="left")
        return figure


def draw_controller(compared: ControllerComparison, unit: str) -> Figure:
    """Draw the logged command and the identified controller's, and their difference."""
    index = _thinned(np.arange(len(compared.time)))
    lines = compared.measured[index], compared.computed[index]
    name = "torque reference" if compared.is_command else "force"
    with drawing():
        figure = new_figure(_WIDTH, 4.2)
        panels = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        _compare(panels, compared.time[index], lines, f"{name} [{unit}]")
        error = number(float(np.sqrt(np.mean((compared.measured - compared.computed) ** 2))))
        panels[0].set_title(f"{name}, difference {error} {unit} RMS", loc="left")
        panels[0].legend(loc="upper right", ncols=2)
        return figure


def _compare(
    panels: Sequence[Axes],
    time: FloatArray,
    lines: tuple[FloatArray, FloatArray],
    axis: str,
    band: tuple[FloatArray | None, str] = (None, ""),
) -> None:
    """Draw measured and modelled lines (n,) above, and below them their difference over a band of what is usual."""
    (above, below), (measured, modelled), (usual, name) = panels, lines, band
    above.plot(time, measured, color=_UNDER, linewidth=2.5, label="measured")
    above.plot(time, modelled, color=_MODEL, linestyle=(0, (4, 1.5)), linewidth=1.3, label="model")
    above.set_ylabel(axis)
    if usual is not None:
        below.fill_between(time, -usual, usual, color=_BAND, linewidth=0, label=name)
    below.plot(time, measured - modelled, color=_RESIDUAL, linewidth=0.9, label="measured − model")
    below.axhline(0.0, color="0.3", linewidth=0.6)
    below.set_ylabel(f"difference {axis[axis.index('[') :]}")
    below.set_xlabel("time [s]")


def _thinned(index: np.ndarray[Any, np.dtype[np.int64]]) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return indices, evenly left out if they are more than a picture shows."""
    return index[:: max(len(index) // 4000, 1)]  # more points than pixels only make a picture large


def _gaps(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return values (n,) with NaN before a step in time that is longer than five usual ones: no line is drawn there."""
    if len(time) < 3:
        return values
    steps = np.diff(time, prepend=time[0])
    return np.where(steps > 5.0 * float(np.median(steps[1:])), np.nan, values)


def _bars(axes: Axes, curve: FrictionCurve, colour: str, name: str, *, line: str = "") -> None:
    """Draw a curve with two standard errors."""
    errors = 2.0 * np.nan_to_num(curve.standard_error)
    axes.errorbar(
        curve.abscissa,
        curve.mean,
        yerr=errors,
        fmt=line or "o",
        color=colour,
        markersize=2.5 if line else 4,
        linewidth=0.8,
        capsize=0 if line else 2,
        label=name,
        zorder=2,
    )


def _model_curve(speed: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the modelled force over speed: its mean in narrow intervals, as the regression has it."""
    edges = np.linspace(float(speed.min()), float(speed.max()), 41)
    interval = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, 39)
    counts = np.bincount(interval, minlength=40)
    filled = counts > 0
    sums, speeds = (
        np.bincount(interval, weights=force, minlength=40),
        np.bincount(interval, weights=speed, minlength=40),
    )
    return speeds[filled] / counts[filled], sums[filled] / counts[filled]


def _fit_to(axes: Axes, curve: FrictionCurve) -> None:
    """Set the range of the force to that of the means, so that single points do not hide them."""
    low, high = float(np.min(curve.mean)), float(np.max(curve.mean))
    margin = 0.3 * (high - low) if high > low else 0.3 * max(abs(high), 1e-9)
    axes.set_ylim(low - margin, high + margin)


def _legend_once(axes: Axes) -> None:
    handles, names = axes.get_legend_handles_labels()
    kept = dict(zip(names, handles, strict=True))
    if kept:
        axes.legend(list(kept.values()), list(kept), loc="best")
