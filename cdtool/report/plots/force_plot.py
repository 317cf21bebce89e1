"""Force over the time since the contact began, with its stepped limits: a panel per group of contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.plain_text import counted
from cdtool.detectors.detection import Status
from cdtool.report.model import AXES
from cdtool.report.number_text import beside, number, spoken
from cdtool.report.plots.figures import drawing, label, message_figure, new_figure, save, slug, write
from cdtool.report.plots.labels import LineLabel, place_labels
from cdtool.report.plots.panels import cover_peak
from cdtool.report.plots.style import BAND, HATCHES, LIMIT_LINE, NOT_ASSESSED, WORST, look_of
from cdtool.report.plots.trace_words import UNKNOWN, LatencyTexts
from cdtool.report.writers.base import Image, Report
from cdtool.results.results import Results, grouped
from cdtool.results.traced_force import TracedForce, force_profiles, traced_forces
from cdtool.results.traces.decimation import kept_samples
from cdtool.truth.force.limits import ForceProfile
from cdtool.truth.force.verdict import StepVerdict

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PALE = "0.72"
#: More pale curves are one grey area.
_MOST_CURVES = 100
#: Lines that fit beside the curve.
_ALARMS_LISTED = 4
# A record that covers this share of the time axis is drawn as if it covered all of it.
WHOLE = 0.99
_UNSEEN = HATCHES[Status.GAP]
_ORDER = ("fail", "not_assessable", "pass")
# The first part of the time axis [s] is the shortest of these with alarms and first peak; the rest is compressed.
_VIEWS = (0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 5.0)
_TICKS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)


@drawing()
def force_figure(
    groups: Mapping[str, Sequence[TracedForce]], profile: ForceProfile, texts: LatencyTexts = UNKNOWN
) -> Figure:
    """Return a panel for each group of contacts: its worst contact coloured, the others grey.

    The worst contact fails with the largest share of a limit. Right of the first grey line time is compressed: each
    of the later limits has an equal width.
    """
    shown = [group for group, curves in groups.items() if curves]
    if not shown:
        return message_figure("no contact with a load-cell force")
    ranked = [sorted(groups[group], key=badness) for group in shown]
    nodes = _time_nodes(ranked, profile)
    figure = new_figure(9.5, 1.5 + 2.3 * len(shown))
    rows = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for axes, group, curves in zip(rows, shown, ranked, strict=True):
        _set_time(axes, nodes)
        _draw_limits(axes, profile, nodes)
        axes.set_ylim(bottom=0.0)
        cover_peak(axes, max(_highest(curves), 1.1 * profile.steps[0].at_most_n))
        _draw_curves(axes, curves)
        axes.set_ylabel(AXES["force"])
        axes.set_title(label(group, 60), loc="left", fontweight="bold")
        _write_outcomes(axes, curves, texts)
    rows[-1].set_xlabel(AXES["time"] + ("; compressed right of the first grey line" if len(nodes) > 2 else ""))
    figure.suptitle(f"{label(profile.title, 70)}", fontsize=10, x=0.01, ha="left")
    footer = "evidence, not a certificate" + (f"; {profile.warning}" if profile.warning else "")
    figure.legend(
        handles=_handles(ranked, nodes[-1]),
        loc="outside lower left",
        ncols=5,
        title=f"{label(profile.source, 130)}\n{footer}",
        title_fontsize=7,
        alignment="left",
    )
    figure.draw_without_rendering()
    for axes, curves in zip(rows, ranked, strict=True):
        _name_limits(axes, curves, profile, nodes)
    return figure


def badness(curve: TracedForce) -> tuple[int, float]:
    """Return by what contacts are ordered, the worst first: it fails with the largest share of a limit."""
    return _ORDER.index(curve.verdict.outcome), -curve.verdict.utilisation


def _highest(curves: Sequence[TracedForce]) -> float:
    return max(float(np.max(curve.force)) for curve in curves)


def _draw_limits(axes: Axes, profile: ForceProfile, nodes: Sequence[float]) -> None:
    """Draw the stepped limit and the allowed forces below it."""
    begins = [step.from_s for step in profile.steps]
    forces = [step.at_most_n for step in profile.steps]
    times, heights = [*begins, nodes[-1]], [*forces, forces[-1]]
    axes.fill_between(times, heights, step="post", color=BAND, linewidth=0, zorder=0.4)
    axes.step(times, heights, where="post", **LIMIT_LINE, zorder=2)


def _name_limits(axes: Axes, curves: Sequence[TracedForce], profile: ForceProfile, nodes: Sequence[float]) -> None:
    """Write the limit of each step, in the first part of the time axis with the name of the step."""
    ends = [*(step.from_s for step in profile.steps[1:]), nodes[-1]]
    names = [label(step.name, 22) if step.from_s < nodes[1] else "" for step in profile.steps]
    labels = [
        LineLabel(f"{name} ≤ {step.at_most_n:g} N".lstrip(), step.from_s, end, step.at_most_n)
        for step, end, name in zip(profile.steps, ends, names, strict=True)
    ]
    place_labels(axes, labels, [(curve.time, curve.force) for curve in curves[:_MOST_CURVES]])


def _draw_curves(axes: Axes, curves: Sequence[TracedForce]) -> None:
    """Draw the worst contact on top, the next ones grey, the rest paler."""
    for rank, curve in reversed(list(enumerate(curves[:_MOST_CURVES]))):
        colour, width = (WORST, 1.5) if rank == 0 else ("0.45", 0.8) if rank < 6 else (_PALE, 0.5)
        # As many samples as the plot is wide in pixels.
        kept = kept_samples(axes.xaxis.get_transform().transform(curve.time), curve.force, 700)
        axes.plot(curve.time[kept], curve.force[kept], color=colour, linewidth=width, zorder=4 if rank == 0 else 3)
    worst = curves[0]
    end = axes.get_xlim()[1]
    if worst.verdict.end < WHOLE * end:
        axes.axvspan(worst.verdict.end, end, fill=False, edgecolor=NOT_ASSESSED, linewidth=0, hatch=_UNSEEN, zorder=0.6)
    seen = [step for step in worst.verdict.steps if math.isfinite(step.peak)]
    if seen:
        peak = max(seen, key=lambda step: step.peak)
        _point(axes, (peak.peak_at, peak.peak), f"{number(peak.peak)} N at {number(1e3 * peak.peak_at)} ms", 4)
    for step in worst.verdict.steps:
        if step.time_budget == worst.verdict.time_budget and math.isfinite(step.time_budget):
            place = (step.time_budget, step.step.at_most_n)
            axes.plot(*place, "o", markersize=5, markerfacecolor="white", markeredgecolor=WORST, zorder=6)
            lift = -4 if step.step.at_most_n > 0.15 * axes.get_ylim()[1] else 14  # clear of the time axis
            _point(axes, place, f"{number(1e3 * step.time_budget)} ms", lift)
    for detector, time in worst.alarms.items():
        if not time <= worst.time[-1]:
            continue
        force = float(np.interp(time, worst.time, worst.force))
        look = look_of(detector)
        axes.plot(
            max(time, 0.0), force, look.marker, color=look.colour, markersize=7, markeredgecolor="white", zorder=7
        )


def _point(axes: Axes, place: tuple[float, float], text: str, lift: float) -> None:
    axes.annotate(
        text,
        place,
        xytext=(8, lift),
        textcoords="offset points",
        va="top" if lift < 0.0 else "bottom",
        fontsize=8,
        color=WORST,
        bbox={"facecolor": "white", "alpha": 0.75, "linewidth": 0, "pad": 1.0},
        zorder=8,
    )


def _write_outcomes(axes: Axes, curves: Sequence[TracedForce], texts: LatencyTexts) -> None:
    """Write right of a panel how many contacts meet the limits, and each step of the worst contact."""
    worst = curves[0]
    outcomes = [curve.verdict.outcome for curve in curves]
    counts = ", ".join(f"{outcomes.count(outcome)} {spoken(outcome)}" for outcome in _ORDER if outcome in outcomes)
    lines = [f"{counted(len(curves), 'contact')}:", *fill(counts, 30).splitlines()]
    lines.append(f"worst: {label(worst.name, 26)}")
    lines += [_step_text(step) for step in worst.verdict.steps]
    if math.isfinite(worst.verdict.time_budget):
        lines.append(f"first exceeded after {number(1e3 * worst.verdict.time_budget)} ms")
    alarms = sorted(worst.alarms.items(), key=lambda item: item[1])
    late = [(detector, texts.text(worst.group, worst.recording, detector, time)) for detector, time in alarms]
    lines += [f"alarm {label(detector, 18)} {words} ms" for detector, words in late[:_ALARMS_LISTED]]
    if len(alarms) > _ALARMS_LISTED:
        lines.append(f"and {len(alarms) - _ALARMS_LISTED} later")
    for text, lift, size, weight in (
        (spoken(worst.verdict.outcome), 0, 10, "bold"),
        ("\n".join(lines), -15, 8, "normal"),
    ):
        write(axes, text, (1.0, 1.0), (10, lift), va="top", fontsize=size, fontweight=weight)


def _step_text(step: StepVerdict) -> str:
    name = label(step.step.name, 22)
    if step.outcome == "not_assessable":
        return f"{name}: not assessable"
    return f"{name}: {beside(step.peak, step.step.at_most_n)} of {step.step.at_most_n:g} N"


def _handles(ranked: Sequence[Sequence[TracedForce]], end: float) -> list[Artist]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [
        Line2D([], [], color=WORST, linewidth=1.5, label="worst contact"),
        Patch(facecolor=BAND, edgecolor="none", label="allowed"),
    ]
    if any(len(curves) > 1 for curves in ranked):
        handles.insert(1, Line2D([], [], color="0.45", linewidth=0.8, label="other contacts"))
    if any(curves[0].verdict.end < WHOLE * end for curves in ranked):
        text = "worst contact's record has ended"
        handles.append(Patch(facecolor="white", edgecolor=NOT_ASSESSED, hatch=_UNSEEN, label=text))
    detectors = dict.fromkeys(name for curves in ranked for name in curves[0].alarms)
    for name in detectors:
        look = look_of(name)
        text = f"alarm {label(name, 24)}"
        handles.append(Line2D([], [], color=look.colour, marker=look.marker, linestyle="none", label=text))
    return handles


def _time_nodes(ranked: Sequence[Sequence[TracedForce]], profile: ForceProfile) -> list[float]:
    """Return where the scale of the time axis changes [s]: 0, the end of its first part, later limits, the end."""
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


def _set_time(axes: Axes, nodes: Sequence[float]) -> None:
    """Set a time axis that is linear between its nodes; nothing beyond its end is drawn."""
    from matplotlib.ticker import FixedLocator, NullLocator

    # The first view, in which contacts rise, has most of the axis.
    shares = np.linspace(0.72, 1.0, len(nodes) - 1) if len(nodes) > 2 else np.array([1.0])
    times, places = np.asarray(nodes), np.concatenate(([0.0], shares))
    to_place, to_time = partial(np.interp, xp=times, fp=places), partial(np.interp, xp=places, fp=times)
    axes.set_xscale("function", functions=(to_place, to_time))
    axes.set_xlim(nodes[0], nodes[-1])
    step = next((step for step in _TICKS if nodes[1] / step <= 8.01), _TICKS[-1])  # 8 ticks, and rounding
    ticks = [tick for tick in np.arange(0.0, nodes[1], step).tolist() if nodes[1] - tick > 0.6 * step]
    axes.xaxis.set_major_locator(FixedLocator([*ticks, *nodes[1:]]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(lambda value, _: f"{1e3 * value:.0f}")
    for bend in nodes[1:-1]:
        axes.axvline(bend, color="0.75", linewidth=0.7, zorder=0.5)


def _rounded_up(time: float) -> float:
    """Return a time rounded up to two digits, for the last label of the axis."""
    digit = 10.0 ** (math.floor(math.log10(time)) - 1)
    return round(math.ceil(time / digit - 1e-9) * digit, 9)


def write_forces(report: Report, folder: Path) -> list[Image]:
    """Draw forces.png for a report folder, forces_<profile>.png with several profiles; raises CdtoolError (see `save`).

    Only if there are force limits and curves.
    """
    results = report.evaluated.results
    curves = traced_forces(results, report.traces)
    used = {name: [item for item in curves if item.verdict.profile == name] for name in force_profiles(results)}
    shown = {name: items for name, items in used.items() if items}
    images, taken = [], set[str]()
    for name, items in shown.items():
        file = "forces.png" if len(shown) == 1 else f"forces_{slug(name, taken)}.png"
        judged = sum(row.profile == name for row in results.forces)
        images.append(Image(file, _force_caption(results, name, len(items), judged)))
        save(
            force_figure(grouped(items, "group"), force_profiles(results)[name], LatencyTexts.of(results)),
            folder / file,
        )
    return images


def _force_caption(results: Results, profile: str, drawn: int, judged: int) -> str:
    caption = f"contact force over time against {profile}"
    if drawn < judged:
        caption += f": the {drawn} of {judged} contacts with stored curves"
    if results.provenance.get("mass_before_cell_kg"):
        caption += "; curves as the load cell measured them, verdicts corrected for the mass before it"
    return caption
