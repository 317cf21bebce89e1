"""All detectors below one load-cell curve: when each raises an alarm (thesis figures 5.7 and 5.8)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from cdtool.report.model import AXES
from cdtool.report.plots.figures import (
    Margins,
    drawing,
    label,
    save,
    slug,
    stacked_panels,
    text_width,
    unit_label,
    write,
)
from cdtool.report.plots.panels import (
    Legend,
    count_from,
    draw_force,
    draw_onset,
    draw_signal,
    frame_signal,
)
from cdtool.report.plots.style import LIMIT_LINE, look_of
from cdtool.report.plots.trace_words import (
    LatencyTexts,
    rows_in_order,
    trace_words,
    triggers_of,
    verdict_of,
)
from cdtool.report.writers.base import Image, Report
from cdtool.results.results import Results
from cdtool.results.traces.trace import Panel, Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_STEPS = (0.01, 0.02, 0.05, 0.1, 0.2)
#: Points, chosen by eye.
_NAME_SIZE, _VERDICT_SIZE, _DETAIL_SIZE = 9, 10, 8
# From the axis to the name of a row, past the numbers of its ticks; from the axis to a verdict [points].
_TICKS, _AWAY = 44.0, 8.0
#: As many as are beside each other in 9 in.
_LEGEND_COLUMNS = 4


@drawing()
def trigger_figure(trace: Trace, results: Results) -> Figure:
    """Return the load cell with onset and force limit, below it a row per detector, the fastest first."""
    contact, rows, texts = trace.shown, rows_in_order(trace), LatencyTexts.of(results)
    forced = len(trace.force) > 0
    heights = [0.98] * forced + [0.66] * len(rows)
    figure, panels = stacked_panels(9.0, heights, _margins(trace, rows, texts), gap=0.14)
    legend = Legend(None)
    if forced:
        draw_force(panels[0], trace.force_time, trace.force, trace.view, contact=contact is not None)
        _draw_limits(panels[0], trace, results, legend)
        _name(panels[0], "load cell\n[N]")
    for axes, row in zip(panels[int(forced) :], rows, strict=True):
        _draw_row(axes, trace, row, legend, _verdict(trace, row, texts))
    for axes in panels:
        if contact:
            draw_onset(axes, contact.start, legend)
    panels[-1].set_xlim(trace.view)
    panels[-1].set_xlabel(AXES["time"] if contact else "time [s]")
    if contact:
        step = next((step for step in _STEPS if (trace.view[1] - trace.view[0]) / step <= 12), _STEPS[-1])
        count_from(panels[-1], contact.start, step)
    height = figure.get_figheight()
    title = "  ·  ".join([label(trace.recording, 45), *(label(words, 35) for words in trace_words(trace))])
    figure.text(0.01, 1.0 - 0.06 / height, title, fontsize=10, ha="left", va="top")
    figure.legend(handles=legend.handles(), loc="lower left", ncols=_LEGEND_COLUMNS, borderaxespad=0.2)
    return figure


def _margins(trace: Trace, rows: Sequence[Panel], texts: LatencyTexts) -> Margins:
    """Return margins for the names at the left, the verdicts at the right, and the longest possible legend."""
    names = [_row_name(trace, row) for row in rows]
    verdicts = [_verdict(trace, row, texts) for row in rows]
    verdict = text_width([words for words, _ in verdicts], _VERDICT_SIZE)
    # Bold letters are wider than measured.
    right = max(1.2 * verdict, text_width([detail for _, detail in verdicts], _DETAIL_SIZE))
    left = text_width([*names, "load cell"], _NAME_SIZE) + _TICKS / 72.0
    kinds = 5 + len({code for row in rows for code in row.course.within(trace.view).status.tolist() if code})
    return Margins(left + 0.08, right + _AWAY / 72.0 + 0.1, 0.34, 0.52 + 0.18 * math.ceil(kinds / _LEGEND_COLUMNS))


def _draw_row(axes: Axes, trace: Trace, row: Panel, legend: Legend, outcome: tuple[str, str]) -> None:
    span, (verdict, detail) = trace.view, outcome
    frame_signal(axes, [row.course], span, headroom=1.5)
    draw_signal(axes, row.course, row.detector, span, legend)
    axes.locator_params(axis="y", nbins=3)
    colour = look_of(row.detector).colour
    for start, end in triggers_of(trace, row, span):
        axes.axvspan(max(start, span[0]), end, color=colour, alpha=0.25, linewidth=0, zorder=1.5)
        if span[0] <= start <= span[1]:
            axes.axvline(start, color=colour, linewidth=2.2, zorder=4)
        legend.add("trigger")
    _name(axes, _row_name(trace, row))
    side = "bottom" if detail else "center"
    write(axes, verdict, (1.0, 0.5), (_AWAY, 0), va=side, fontsize=_VERDICT_SIZE, fontweight="bold")
    write(axes, detail, (1.0, 0.5), (_AWAY, -3), va="top", fontsize=_DETAIL_SIZE)


def _verdict(trace: Trace, row: Panel, texts: LatencyTexts) -> tuple[str, str]:
    verdict, detail = verdict_of(trace, row, texts)
    return verdict, fill(label(detail, 66), 24, break_on_hyphens=False)


def _row_name(trace: Trace, row: Panel) -> str:
    joint = f" {label(row.joint, 14)}" if trace.joints > 1 else ""
    return f"{label(row.detector, 24)}\n[{unit_label(row.unit)}]{joint}"


def _name(axes: Axes, text: str) -> None:
    """Write the names of rows aligned with each other, whatever the numbers of the ticks."""
    write(axes, text, (0.0, 0.5), (-_TICKS, 0), ha="right", va="center", fontsize=_NAME_SIZE)


def _draw_limits(axes: Axes, trace: Trace, results: Results, legend: Legend) -> None:
    """Draw the allowed forces from the shown contact on, on the side to which it presses."""
    steps = results.provenance.get("force_profiles", {}).get(trace.group, {}).get("steps", ())
    if not steps or trace.shown is None:
        return
    side = -1.0 if -trace.force.min() > trace.force.max() else 1.0
    times = [trace.shown.start + step["from_s"] for step in steps]
    forces = [side * step["at_most_n"] for step in steps]
    axes.step([*times, max(trace.end, times[-1])], [*forces, forces[-1]], where="post", **LIMIT_LINE, zorder=2)
    legend.add("limit")


def write_triggers(report: Report, folder: Path) -> list[Image]:
    """Draw triggers_<group>.png of an operation per group for a report folder; raises CdtoolError (see `save`)."""
    images, taken = [], set[str]()
    for group in report.evaluated.results.groups:
        of_group = [trace for trace in report.traces if trace.group == group]
        if of_group:
            trace = most_informative(of_group)
            name = f"triggers_{slug(group, taken)}.png"
            images.append(Image(name, f"{trace.recording}: all detectors", group))
            save(trigger_figure(trace, report.evaluated.results), folder / name)
    return images


def most_informative(traces: Sequence[Trace]) -> Trace:
    """Return the trace with a contact, then of most detectors, then with most assessable ones; the first of equals.

    `traces` is not empty.
    """
    return max(
        traces,
        key=lambda trace: (
            trace.shown is not None,
            len(trace.panels),
            sum(not panel.is_not_assessable for panel in trace.panels),
        ),
    )
