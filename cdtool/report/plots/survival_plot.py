"""Share of the contacts that are still undetected over time: a panel per group, a step curve per detector."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.report.model import AXES
from cdtool.report.number_text import value_and_interval
from cdtool.report.plots.figures import drawing, message_figure, save
from cdtool.report.plots.latency_axis import LatencyAxis
from cdtool.report.plots.side_table import SideColumn, count_cells, keyed_panels
from cdtool.report.plots.style import line_of, look_of
from cdtool.report.writers.base import Image, Report
from cdtool.results.curves.survival_curves import SurvivalCurve, survival_curves
from cdtool.results.evaluated import Evaluated
from cdtool.results.results import grouped
from cdtool.statistics.small_sample import FEWEST

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FIGURES = (
    SideColumn("median\n[ms]", 62),
    SideColumn("detected", 66),
    SideColumn("missed", 38),
    SideColumn("not\nassessable", 50),
    SideColumn("false\nalarms", 34),
)
# With more curves than this, bands would hide each other.
_MOST_BANDS = 3


@drawing()
def survival_figure(evaluated: Evaluated) -> Figure:
    """Return a panel per group with a step curve per detector."""
    curves = survival_curves(evaluated.results)
    groups = list(dict.fromkeys(item.group for item in curves))
    if not groups:
        return message_figure("no contact in any group: no share to show")
    panels_of = {group: [item for item in curves if item.group == group] for group in groups}
    of_contacts = grouped([item for item in evaluated.summaries if item.contacts], "group")
    figure, panels, table = keyed_panels(of_contacts, _FIGURES, (4.6, 1.75), bottom=0.7)
    scale = survival_axis(curves)
    scale.set(panels[-1], "x")
    for axes, (group, items) in zip(panels, panels_of.items(), strict=True):
        _draw_group(axes, items, scale)
        for place, row in enumerate(of_contacts[group]):
            cells, loud = count_cells(row)
            median = value_and_interval(row.median, row.resolution_ms)[0]
            table.write_key(axes, place, row.detector, (median, *cells), (False, *loud))
    panels[-1].set_xlabel(_explained(panels_of.values()), linespacing=1.4)
    return figure


def survival_axis(curves: Sequence[SurvivalCurve]) -> LatencyAxis:
    """Return the axis of the times when contacts were detected and of the ends of monitoring."""
    times = [item.curve.times[1:][np.diff(item.curve.share) < 0.0] for item in curves]
    return LatencyAxis.of(np.concatenate([*times, [item.end for item in curves if item.end > 0.0]]))


def _draw_group(axes: Axes, curves: Sequence[SurvivalCurve], scale: LatencyAxis) -> None:
    seen = [item for item in curves if item.contacts > item.not_assessable]
    for item in seen:
        _draw_curve(axes, item, scale.low, banded=len(seen) <= _MOST_BANDS and _enough(item))
    axes.set_ylim(0.0, 1.06)
    axes.set_xlim(scale.low, scale.high)
    axes.set_yticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
    axes.set_ylabel("still undetected")
    axes.grid(color="0.9", linewidth=0.6)
    if not seen:
        axes.text(0.5, 0.5, "not assessable", transform=axes.transAxes, ha="center", va="center", fontsize=9)


def _enough(item: SurvivalCurve) -> bool:
    """Return whether there are enough contacts for a band."""
    return item.contacts - item.not_assessable >= FEWEST


def _draw_curve(axes: Axes, item: SurvivalCurve, low: float, *, banded: bool) -> None:
    look, curve = look_of(item.detector), item.curve
    # A logarithmic axis has no 0: the curve begins at its left edge.
    times = np.maximum(np.append(curve.times, item.end), low)
    share, below, above = (np.append(line, line[-1]) for line in (curve.share, curve.low, curve.high))
    axes.step(times, share, where="post", **line_of(look), linewidth=1.5, zorder=3)
    if banded:
        axes.fill_between(times, below, above, step="post", color=look.colour, alpha=0.13, linewidth=0, zorder=1)
    falls = np.flatnonzero(np.diff(curve.share) < 0.0) + 1
    shown = falls[np.linspace(0, len(falls) - 1, min(6, len(falls))).astype(int)] if len(falls) else falls
    axes.plot(
        times[shown],
        curve.share[shown],
        look.marker,
        color=look.colour,
        markersize=4.5,
        linestyle="none",
        zorder=4,
        clip_on=False,
    )
    missed = np.unique(item.missed)[:200]
    left = curve.share[np.searchsorted(curve.times, missed, side="right") - 1]
    axes.plot(
        np.maximum(missed, low),
        left,
        look.marker,
        markerfacecolor="white",
        markeredgecolor=look.colour,
        markersize=5.5,
        linestyle="none",
        zorder=5,
        clip_on=False,
    )


def _explained(panels: Collection[Sequence[SurvivalCurve]]) -> str:
    words = []
    if any(len(item.missed) for items in panels for item in items):
        words.append("open mark: missed, at the end of its monitoring")
    few = [items for items in panels if sum(item.contacts > item.not_assessable for item in items) <= _MOST_BANDS]
    if any(_enough(item) for items in few for item in items):
        words.append("band: 95 % at each time")
    if any(not _enough(item) for items in few for item in items):
        words.append(f"no band with fewer than {FEWEST} contacts")
    return "\n".join([AXES["time"], "; ".join(words)]).rstrip()


def write_survival(report: Report, folder: Path) -> list[Image]:
    """Draw survival.png for a report folder if there are contacts; raises CdtoolError (see `save`)."""
    if not report.evaluated.results.contacts:
        return []
    image = Image("survival.png", "share of the contacts that are still undetected over time")
    save(survival_figure(report.evaluated), folder / image.name)
    return [image]
