"""A forecast of false alarms: the share of the limit that runs use, and the share of them that alarm.

Both over the temperature and over the date (or the runs): what was seen as points, what is expected as bands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import timedelta
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from cdtool.evaluation.statistics.interval import Interval
from cdtool.evaluation.upkeep.forecast import Forecast, ForecastCurve
from cdtool.evaluation.upkeep.forecast_words import headlines
from cdtool.evaluation.upkeep.season_model import SeasonRun
from cdtool.recording import FloatArray
from cdtool.report.plots.figures import drawing, label, new_figure, save
from cdtool.report.plots.style import LIMIT

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_RUN, _ALARM, _EXPECTED, _RELEARN = "#0072B2", "#D55E00", "0.35", "#B0569B"
_WIDTH, _HEIGHTS, _LINE = 9.5, (2.5, 1.5), 126


def plot_forecast(found: Forecast, path: Path) -> None:
    """Draw the forecast of one class of motion; raises UsageError, CdtoolError (see `save`)."""
    with drawing():
        save(_figure(found), path)


def _figure(found: Forecast) -> Figure:
    lines = [f"{found.motion.described}, safety factor {found.safety_factor:.4g}", *headlines(found)]
    text = "\n".join(fill(label(line, 300), _LINE) for line in lines)
    figure = new_figure(_WIDTH, 1.0 + sum(_HEIGHTS) + 0.17 * (text.count("\n") + 1))
    columns = 2 if found.by_temperature else 1
    axes = figure.subplots(2, columns, sharex="col", sharey="row", squeeze=False, height_ratios=_HEIGHTS)
    if found.by_temperature:
        temperatures = [run.temperature for run in (*found.runs, *found.left_out)]
        _draw_column(axes[:, 0], found, temperatures, found.by_temperature, found.by_temperature.at)
        _draw_range(axes[:, 0], found)
        axes[1, 0].set_xlabel("temperature [°C]")
    times = [_at(found, run.time) for run in (*found.runs, *found.left_out)]
    ahead = [_at(found, time) for time in found.by_time.at.tolist()]
    _draw_column(axes[:, -1], found, times, found.by_time, ahead)
    _draw_relearn(axes[:, -1], found)
    _label_times(axes[1, -1], found)
    axes[0, 0].set_ylabel("of the limit [%]")
    axes[1, 0].set_ylabel("runs with a\nfalse alarm [%]")
    _set_heights(axes, found)
    figure.align_ylabels()
    figure.suptitle(text, fontsize=9, x=0.01, ha="left")
    figure.legend(handles=_handles(found), loc="outside lower left", ncols=4)
    return figure


def _draw_column(
    pair: Any, found: Forecast, seen: Sequence[Any], curve: ForecastCurve, at: Sequence[Any] | FloatArray
) -> None:
    """Draw both panels along one axis: runs at `seen`, expectation at `at`."""
    used, share = pair
    runs: tuple[SeasonRun, ...] = (*found.runs, *found.left_out)
    for alarm, mark, colour, size in ((False, "o", _RUN, 3.0), (True, "^", _ALARM, 4.5)):
        rows = [i for i, run in enumerate(runs) if run.demand.alarm is alarm]
        values = [100.0 * runs[i].demand.critical_factor / found.safety_factor for i in rows]
        used.plot([seen[i] for i in rows], values, mark, color=colour, markersize=size, zorder=3)
    percent = 100.0 / found.safety_factor
    used.fill_between(at, percent * curve.low, percent * curve.high, color=_EXPECTED, alpha=0.16, linewidth=0)
    used.plot(at, percent * curve.middle, color=_EXPECTED)
    used.axhline(100.0, color=LIMIT, linestyle=(0, (4, 2)), linewidth=1.0)
    value, low, high = 100.0 * curve.share.T
    share.fill_between(at, low, high, color=_ALARM, alpha=0.2, linewidth=0)
    share.plot(at, value, color=_ALARM)
    share.axhline(100.0 * found.budget, color=LIMIT, linestyle=":", linewidth=1.2)
    for axes in pair:
        axes.grid(axis="y", color="0.92", linewidth=0.6)


def _draw_range(pair: Any, found: Forecast) -> None:
    """Mark the coming temperatures, those that were not seen, and where the budget is exceeded."""
    curve = found.by_temperature
    if curve is None or found.seen_temperatures is None or found.coming_temperatures is None:
        return
    low, high = found.seen_temperatures
    for axes in pair:
        for start, end in ((curve.at[0], low), (high, curve.at[-1])):
            if end > start:
                axes.axvspan(start, end, color="0.5", alpha=0.1, linewidth=0)
        for crossing in (found.colder, found.warmer):
            if crossing is not None:
                _draw_bound(axes, crossing, (float(curve.at[0]), float(curve.at[-1])), lambda value: value)
    pair[1].plot(found.coming_temperatures, (0.0, 0.0), color="black", linewidth=3.0, solid_capstyle="butt", zorder=4)


def _draw_relearn(pair: Any, found: Forecast) -> None:
    for axes in pair:
        ends = float(found.by_time.at[0]), found.ends
        _draw_bound(axes, found.relearn_by, ends, lambda value: _at(found, value))


def _draw_bound(axes: Axes, bound: Interval, ends: tuple[float, float], at: Any) -> None:
    """Draw a vertical line with its interval, as far as it is within both ends of the range."""
    if math.isfinite(bound.value):
        axes.axvline(at(bound.value), color=_RELEARN, linewidth=1.2)
    low, high = max(bound.low, ends[0]), min(bound.high, ends[1])
    if math.isfinite(bound.value) and high > low:
        axes.axvspan(at(low), at(high), color=_RELEARN, alpha=0.1, linewidth=0)


def _at(found: Forecast, time: float) -> Any:
    return time if found.origin is None else found.origin + timedelta(days=time)


def _label_times(axes: Axes, found: Forecast) -> None:
    if found.origin is None:
        axes.set_xlabel("run")
        return
    import matplotlib.dates

    dates: Any = matplotlib.dates
    locator = dates.AutoDateLocator(minticks=3, maxticks=7)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(dates.ConciseDateFormatter(locator))
    axes.set_xlabel("date")


def _set_heights(axes: Any, found: Forecast) -> None:
    """Set the vertical ranges: extreme runs that nothing explains may exceed them."""
    curves = [curve for curve in (found.by_temperature, found.by_time) if curve is not None]
    used = [100.0 * run.demand.critical_factor / found.safety_factor for run in found.runs]
    tops = [100.0 * float(curve.high.max()) / found.safety_factor for curve in curves]
    lows = [100.0 * float(curve.low.min()) / found.safety_factor for curve in curves]
    axes[0, 0].set_ylim(min([0.0, *used, *lows]), 1.08 * max([100.0, *used, *tops]))
    most = max(float(curve.share.max()) for curve in curves)
    axes[1, 0].set_ylim(0.0, min(108.0 * max(most, 1.5 * found.budget), 104.0))


def _handles(found: Forecast) -> list[Artist]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [
        Line2D([], [], color=_RUN, marker="o", markersize=3, linestyle="none", label="run"),
        Line2D([], [], color=_EXPECTED, label="expected runs"),
        Patch(facecolor=_EXPECTED, alpha=0.16, label="95 % of them"),
        Line2D([], [], color=LIMIT, linestyle=(0, (4, 2)), linewidth=1.0, label="limit"),
        Line2D([], [], color=_ALARM, label="expected false alarms, 95 % interval"),
        Line2D([], [], color=LIMIT, linestyle=":", label="budget"),
    ]
    if any(run.demand.alarm for run in (*found.runs, *found.left_out)):
        handles.insert(1, Line2D([], [], color=_ALARM, marker="^", markersize=4, linestyle="none", label="alarm"))
    if any(item is not None and math.isfinite(item.value) for item in (found.colder, found.warmer, found.relearn_by)):
        handles.append(Line2D([], [], color=_RELEARN, label="budget exceeded from here, 95 % interval"))
    if found.coming_temperatures:
        handles.append(Line2D([], [], color="black", linewidth=3.0, label="coming temperatures"))
    if found.beyond > 0.0:
        handles.append(Patch(facecolor="0.5", alpha=0.15, label="not seen, extrapolated"))
    return handles
