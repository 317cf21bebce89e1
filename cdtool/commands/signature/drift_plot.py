"""A season of runs against a signature: margin used and deviation run by run, and a map of the stroke over the runs."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import counted
from cdtool.commands.signature.audit import DriftAudit, JointDrift
from cdtool.commands.signature.words import verdicts
from cdtool.report.plots.figures import drawing, label, new_figure, save, unit_label
from cdtool.report.plots.style import DEVIATION_COLOURS, LIMIT, NOT_ASSESSED

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_RUN, _ALARM, _PLACE = "#0072B2", "#D55E00", "#B0569B"
_MOST_JOINTS = 3
_WIDTH, _HEIGHTS = 8.5, (1.5, 1.5, 2.4)
# The colour scale of the map spans at least this many spreads, so that noise is pale.
_LEAST_RANGE = 2.0
_VERDICTS, _LINE = 4, 105


def plot_drift(audit: DriftAudit, path: Path) -> None:
    """Draw up to three joints, those with a change first; raises UsageError, CdtoolError (see `save`).

    In the map a growing obstruction is a stripe along the runs, and a drift of the whole stroke a change of its colour.
    """
    with drawing():
        save(_figure(audit), path)


def _figure(audit: DriftAudit) -> Figure:
    joints = sorted(audit.joints, key=lambda item: (not item.shown, -_largest_margin(item)))[:_MOST_JOINTS]
    lines = [line for joint in joints for line in _verdict_lines(joint, named=len(audit.joints) > 1)]
    heading = [
        f"{audit.motion.described}, {counted(len(audit.names), 'run')}, safety factor {audit.safety_factor:.4g}",
        *lines,
    ]
    if len(joints) < len(audit.joints):
        heading.append(f"{counted(len(audit.joints) - len(joints), 'more joint', 'are')} not drawn")
    width = max(_WIDTH, 5.0 * len(joints))
    text = "\n".join(fill(line, round(_LINE * width / _WIDTH)) for line in heading)
    figure = new_figure(width, 0.9 + sum(_HEIGHTS) + 0.17 * (text.count("\n") + 1))
    rows = figure.subplots(3, len(joints), sharex=True, squeeze=False, height_ratios=_HEIGHTS)
    reach = max([_LEAST_RANGE, *(_range(joint.deviation) for joint in joints)])
    for column, joint in enumerate(joints):
        margin, deviation, places = rows[:, column]
        _draw_margin(margin, joint)
        _draw_deviation(deviation, joint)
        image = _draw_map(places, audit, joint, reach)
        if len(joints) > 1:
            margin.set_title(label(joint.joint, 30), loc="left", fontweight="bold")
        places.set_xlabel("run")
    colours = figure.colorbar(image, ax=rows[2].tolist(), pad=0.01, aspect=18)
    colours.set_label("deviation [spreads]", fontsize=8)
    figure.align_ylabels()
    figure.suptitle(text, fontsize=9, x=0.01, ha="left")
    figure.legend(handles=_handles(joints), loc="outside lower left", ncols=6)
    return figure


def _verdict_lines(joint: JointDrift, *, named: bool) -> list[str]:
    name = f"{label(joint.joint, 24)}: " if named else ""
    return [f"{name}{label(line, 220)}" for line in verdicts(joint)[:_VERDICTS]]


def _largest_margin(joint: JointDrift) -> float:
    return max(run.margin_used for run in joint.runs)


def _numbers(joint: JointDrift) -> FloatArray:
    return np.arange(1.0, len(joint.runs) + 1.0)


def _draw_margin(axes: Axes, joint: JointDrift) -> None:
    """Draw the largest debounced share of the limit in each run; runs with an alarm have their own mark."""
    used = np.array([100.0 * run.margin_used for run in joint.runs])
    alarm = np.array([run.alarm for run in joint.runs])
    numbers = _numbers(joint)
    axes.plot(numbers[~alarm], used[~alarm], "o", color=_RUN, markersize=3.5)
    axes.plot(numbers[alarm], used[alarm], "^", color=_ALARM, markersize=5)
    axes.axhline(100.0, color=LIMIT, linestyle=(0, (4, 2)), linewidth=1.0)
    known = used[np.isfinite(used)]
    axes.set_ylim(min([0.0, *known]), 1.12 * max([100.0, *known]))
    axes.set_ylabel("of the limit [%]")
    axes.grid(axis="y", color="0.92", linewidth=0.6)


def _draw_deviation(axes: Axes, joint: JointDrift) -> None:
    """Draw the deviation of the whole stroke by run with its drift or step, and that of the location that changes."""
    numbers = _numbers(joint)
    axes.axhline(0.0, color="0.8", linewidth=0.8)
    axes.plot(numbers, [run.overall for run in joint.runs], "o", color=_RUN, markersize=3.5)
    if joint.overall is not None:
        _draw_change(axes, joint, _RUN)
    if joint.local is not None and joint.local.place is not None:
        axes.plot(numbers, joint.at_place(joint.local.place), "D", color=_PLACE, markersize=3)
    axes.set_ylabel("deviation\n[spreads]")
    axes.grid(axis="y", color="0.92", linewidth=0.6)


def _draw_change(axes: Axes, joint: JointDrift, colour: str) -> None:
    trend, step = joint.course.trend, joint.course.step
    runs = np.arange(len(joint.runs), dtype=np.float64)
    if joint.course.kind == "drift" and trend is not None:
        middle = 0.5 * (len(runs) - 1)
        axes.plot(runs + 1.0, trend.at(0.0) + trend.slope.value * runs, color=colour, linewidth=1.4)
        # Both bounds of the slope, about the middle of the season.
        low, high = (trend.at(middle) + slope * (runs - middle) for slope in (trend.slope.low, trend.slope.high))
        axes.fill_between(runs + 1.0, low, high, color=colour, alpha=0.13, linewidth=0)
    elif joint.course.kind == "step" and step is not None:
        edge = step.run + 0.5
        levels = [step.before, step.before, step.after, step.after]
        axes.plot([1.0, edge, edge, len(runs)], levels, color=colour, linewidth=1.4)


def _draw_map(axes: Axes, audit: DriftAudit, joint: JointDrift, reach: float) -> Any:
    """Draw the deviation as colour by location and run; hatched where no sample was valid."""
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.ticker import MaxNLocator

    places = audit.places
    half = 0.5 * float(places[1] - places[0]) if len(places) > 1 else 0.5
    low, high = (float(places[0]) - half, float(places[-1]) + half) if len(places) else (0.0, 1.0)
    axes.set_facecolor("white")
    axes.patch.set_hatch("////")
    axes.patch.set_edgecolor(NOT_ASSESSED)
    image = axes.imshow(
        joint.deviation.T if joint.deviation.size else np.full((1, len(joint.runs)), np.nan),
        cmap=LinearSegmentedColormap.from_list("deviation", DEVIATION_COLOURS),
        vmin=-reach,
        vmax=reach,
        aspect="auto",
        origin="lower",
        interpolation="nearest",
        extent=(0.5, len(joint.runs) + 0.5, low, high),
    )
    if joint.local is not None and joint.local.place is not None:
        edge = axes.get_yaxis_transform()
        axes.plot([0.0], [joint.local.place], ">", color=_PLACE, markersize=8, transform=edge, clip_on=False)
    name = "travel" if audit.axis == "travel" else "time"
    axes.set_ylabel(f"{name} [{unit_label(audit.unit)}]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    return image


def _range(deviation: FloatArray) -> float:
    """Return the range that nearly all of the map is within; single cells may exceed the colour scale."""
    known = np.abs(deviation[np.isfinite(deviation)])
    return float(np.quantile(known, 0.995)) if len(known) else 0.0


def _handles(joints: list[JointDrift]) -> list[Artist]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [
        Line2D([], [], color=_RUN, marker="o", markersize=3.5, linestyle="none", label="run, whole stroke"),
        Line2D([], [], color=LIMIT, linestyle=(0, (4, 2)), linewidth=1.0, label="limit"),
    ]
    if any(run.alarm for joint in joints for run in joint.runs):
        handles.append(Line2D([], [], color=_ALARM, marker="^", markersize=5, linestyle="none", label="alarm"))
    if any(joint.overall for joint in joints):
        handles.append(Line2D([], [], color=_RUN, linewidth=1.4, label="drift or step shown"))
    if any(joint.local for joint in joints):
        handles.append(
            Line2D([], [], color=_PLACE, marker="D", markersize=3, linestyle="none", label="location that changes")
        )
    if any(np.isnan(joint.deviation).any() for joint in joints):
        handles.append(Patch(facecolor="white", edgecolor=NOT_ASSESSED, hatch="////", label="not assessable"))
    return handles
