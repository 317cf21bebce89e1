"""ChoiceResults of a tuning: the candidates that none beats in every group, and the cost around the choice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cdtool.commands.tune.search.objective import Goal
from cdtool.commands.tune.search.tuned import FLAT, Sensitivity, TunedDetector
from cdtool.detectors.look import BLUE, RED
from cdtool.report.number_text import short
from cdtool.report.plots.figures import drawing, label, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COSTS = {
    Goal.LATENCY: "mean latency [ms]",
    Goal.P95: "95th percentile [ms]",
    Goal.FORCE: "mean force at the alarm [N]",
}
_OTHERS, _TRIED, _COLUMNS = "0.45", "0.75", 3


def draw_pareto(tuned: TunedDetector, groups: Sequence[str], goal: Goal) -> Figure:
    """Draw the costs of the first two groups: what none beats in every group, the choice, and the default."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    with drawing():
        figure = new_figure(5.2, 3.6)
        axes = figure.subplots()
        others = [costs[:2] for costs in tuned.tried_costs if len(costs) > 1]
        axes.plot(*zip(*others, strict=True), ".", color=_TRIED, markersize=4, label="tried")
        points = [(point.costs[0], point.costs[1]) for point in tuned.pareto]
        axes.plot(*zip(*points, strict=True), "o-", color=_OTHERS, markersize=4, label="not beaten in every group")
        for figures, style, words in (
            (tuned.default_apparent, "s", "default"),
            (tuned.apparent, "D", "chosen"),
        ):
            if figures is not None:
                first, second = (_cost(figures.groups[name], goal) for name in groups[:2])
                axes.plot([first], [second], style, color=RED if words == "default" else BLUE, label=words)
        axes.set_xlabel(f"{label(groups[0])}: {_COSTS[goal]}")
        axes.set_ylabel(f"{label(groups[1])}: {_COSTS[goal]}")
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(base=10.0, subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FuncFormatter(_plain))
            axis.set_minor_formatter(NullFormatter())
        axes.legend()
        return figure


def _plain(value: float, place: int) -> str:  # noqa: ARG001  the formatter gives the place too
    return short(value)


def _cost(figures: object, goal: Goal) -> float:
    name = {Goal.LATENCY: "mean_ms", Goal.P95: "p95_ms", Goal.FORCE: "force_n"}[goal]
    return float(getattr(figures, name))


def draw_sensitivity(sensitivities: Sequence[Sensitivity]) -> Figure:
    """Draw the cost over each gain and setting, everything else as chosen; the shaded part is at most 5 % worse."""
    shown = [item for item in sensitivities if len(item.tried) > 1]
    with drawing():
        columns = min(_COLUMNS, len(shown))
        rows = math.ceil(len(shown) / columns)
        figure = new_figure(2.9 * columns + 0.3, 2.3 * rows + 0.2)
        grid = figure.subplots(rows, columns, squeeze=False)
        for place in range(rows * columns):
            axes = grid[place // columns, place % columns]
            if place < len(shown):
                _draw_setting(axes, shown[place])
            else:
                axes.set_visible(False)
        grid[0, 0].set_ylabel("cost over that of the choice")
        return figure


def _draw_setting(axes: Axes, item: Sensitivity) -> None:
    values = [one.value for one in item.tried]
    axes.axhspan(1.0, 1.0 + FLAT, color="0.92", linewidth=0.0)
    axes.plot(values, [one.cost_ratio for one in item.tried], "o-", color=_OTHERS, markersize=4)
    axes.plot([item.chosen], [1.0], "D", color=BLUE)
    if min(values) > 0.0 and max(values) / min(values) >= 4.0:
        axes.set_xscale("log")
    low, high = min(values), max(values)
    ticks = sorted({low, item.chosen, high})
    axes.set_xticks(ticks, [short(tick) for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set_xlabel(label(item.name.replace("_", " ")) + (" (at the edge)" if item.is_at_edge else ""))
