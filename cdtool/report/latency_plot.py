"""Latency of every detector in every group: each contact a mark, quartiles and median, and what was not detected."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.evaluation.results import ContactResult, Results
from cdtool.evaluation.statistics import Summary, summarise
from cdtool.recording import FloatArray
from cdtool.report.figures import drawing, label, new_figure, save
from cdtool.report.style import look_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FLOOR_MS = 1.0
# Columns of figures right of the data: heading, distance from the axes [points].
_COLUMNS = (("median\nms", 34), ("detected", 86), ("missed", 138), ("not\nassessable", 192))
_MOST_MARKS = 400
_GOLDEN = 0.6180339887


def plot_latencies(results: Results, path: Path) -> None:
    """Draw a panel a group and a row a detector; raises UsageError, CdtoolError (see `save`).

    Quartiles and median are those of the detected contacts: they are to be read beside the counts at the right.
    """
    with drawing():
        save(_figure(results), path)


def _figure(results: Results) -> Figure:
    summaries = [item for item in summarise(results) if item.contacts]
    groups = [group for group in results.groups if any(item.group == group for item in summaries)]
    if not groups:
        figure = new_figure(9.0, 1.2)
        figure.text(0.5, 0.5, "no contact in any group: there is no latency to show", ha="center", va="center")
        return figure
    latencies = {(item.detector, item.group): _latencies(item, results.contacts) for item in summaries}
    everything = np.concatenate(list(latencies.values()))
    counts = [sum(item.group == group for item in summaries) for group in groups]
    figure = new_figure(9.5, 1.2 + sum(0.35 + 0.36 * count for count in counts))
    panels = figure.subplots(len(groups), 1, sharex=True, squeeze=False, height_ratios=[0.6 + n for n in counts])[:, 0]
    logarithmic = _set_scale(panels[-1], everything)
    for axes, group in zip(panels, groups, strict=True):
        _draw_group(axes, [item for item in summaries if item.group == group], latencies, logarithmic)
        axes.set_title(label(group, 60), loc="left", fontweight="bold")
    for heading, offset in _COLUMNS:
        _write(panels[0], heading, (1.0, 1.0), offset, va="bottom", lift=4)
    note = f" (below {_FLOOR_MS:.0f} ms drawn there)" if logarithmic and np.any(everything < _FLOOR_MS) else ""
    panels[-1].set_xlabel(
        f"latency from contact onset to alarm [ms]{note}\nmark: one contact; black: median and quartiles"
    )
    return figure


def _draw_group(
    axes: Axes, rows: Sequence[Summary], latencies: dict[tuple[str, str], FloatArray], logarithmic: bool
) -> None:
    for i, row in enumerate(rows):
        values = latencies[row.detector, row.group]
        _draw_row(axes, i, row.detector, np.maximum(values, _FLOOR_MS) if logarithmic else values)
        cells = (
            f"{row.median_ms:.3g}" if row.detected else "–",
            f"{row.detected} of {row.contacts}",
            str(row.missed),
            str(row.not_assessable),
        )
        for (_, offset), cell, loud in zip(_COLUMNS, cells, (0, 0, row.missed, row.not_assessable), strict=True):
            _write(axes, cell, (1.0, i), offset, va="center", bold=bool(loud))
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_yticks(range(len(rows)), [label(row.detector, 28) for row in rows])
    axes.tick_params(axis="y", length=0, labelsize=9)
    axes.grid(axis="x", color="0.88", linewidth=0.6)


def _draw_row(axes: Axes, row: int, detector: str, values: FloatArray) -> None:
    if not len(values):
        return
    look = look_of(detector)
    ordered = np.sort(values)
    if len(ordered) > _MOST_MARKS:
        ordered = ordered[np.linspace(0, len(ordered) - 1, _MOST_MARKS).astype(int)]
    # A low-discrepancy sequence spreads the marks evenly, without chance.
    height = row + 0.5 * (np.arange(len(ordered)) * _GOLDEN % 1.0 - 0.5)
    axes.plot(
        ordered, height, look.marker, color=look.colour, markersize=4, alpha=0.65, markeredgewidth=0, linestyle="none"
    )
    low, median, high = np.percentile(values, (25, 50, 75))
    axes.plot([low, high], [row, row], color="black", linewidth=1.4, zorder=3)
    axes.plot([median, median], [row - 0.32, row + 0.32], color="black", linewidth=1.8, zorder=4)


def _set_scale(axes: Axes, values: FloatArray) -> bool:
    if not len(values):
        axes.set_xlim(0.0, 1000.0)
        return False
    lowest, highest = max(float(values.min()), _FLOOR_MS), float(values.max())
    if highest <= 10.0 * lowest:
        axes.set_xlim(0.0, 1.06 * max(highest, _FLOOR_MS))
        return False
    from matplotlib.ticker import FixedLocator, NullFormatter

    axes.set_xscale("log")
    low, high = lowest / 1.15, highest * 1.15
    ticks = [base * 10.0**power for power in range(8) for base in (1, 1.5, 2, 3, 5, 7)]
    axes.xaxis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlim(low, high)
    return True


def _write(
    axes: Axes, text: str, at: tuple[float, float], offset: float, *, va: str, lift: float = 0.0, bold: bool = False
) -> None:
    axes.annotate(
        text,
        at,
        xycoords=axes.get_yaxis_transform() if va == "center" else "axes fraction",
        xytext=(offset, lift),
        textcoords="offset points",
        ha="center",
        va=va,
        fontsize=9 if va == "center" else 8,
        fontweight="bold" if bold else "normal",
        annotation_clip=False,
    )


def _latencies(summary: Summary, contacts: Sequence[ContactResult]) -> FloatArray:
    return np.array(
        [
            item.latency_ms
            for item in contacts
            if item.detector == summary.detector and item.group == summary.group and item.latency_ms is not None
        ],
        dtype=np.float64,
    )
