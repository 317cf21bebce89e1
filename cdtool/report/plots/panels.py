"""Marks of figures over time: signal with its band, not assessable samples, force, trigger, onset and alarm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.detectors.detection import REASONS, Alarm, Status
from cdtool.report.plots.style import BAND, FORCE, HATCHES, LIMIT_LINE, NOT_ASSESSED, ONSET_DASHES, look_of
from cdtool.results.traces.decimation import decimate, kept_samples
from cdtool.results.traces.trace import Span, StatisticCurve

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

#: A panel has fewer pixels.
PIXELS = 1000


class Legend:
    """The kinds of marks in a figure, each once and in a fixed order."""

    def __init__(self, detector: str | None) -> None:
        self._detector = detector
        self._seen: set[str] = set()

    def add(self, kind: str) -> None:
        """Note that a kind of mark is drawn."""
        self._seen.add(kind)

    def handles(self) -> list[Artist]:
        """Return a handle per kind."""
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch

        colour = look_of(self._detector).colour if self._detector else "0.35"
        known: dict[str, Artist] = {
            "signal": Line2D([], [], color=colour, label="signal"),
            "limit": Line2D([], [], **LIMIT_LINE, label="limit"),
            "band": Patch(facecolor=BAND, edgecolor="none", label="normal band"),
            "onset": Line2D([], [], color=FORCE, linestyle=ONSET_DASHES, linewidth=1.0, label="contact onset"),
            "alarm": Line2D([], [], color=colour, linewidth=2.2, label="alarm"),
            "trigger": Patch(facecolor=colour, alpha=0.25, edgecolor="none", label="trigger on"),
            "raised": Line2D([], [], color=colour, marker="^", markersize=5, linestyle="none", label="trigger raised"),
            "rearmed": Line2D(
                [], [], color=colour, marker="v", markerfacecolor="white", linestyle="none", label="re-armed"
            ),
        }
        for code, reason in REASONS.items():
            known[reason] = Patch(
                facecolor="white",
                edgecolor=NOT_ASSESSED,
                hatch=HATCHES[Status(code)],
                label=f"not assessable: {reason}",
            )
        return [handle for kind, handle in known.items() if kind in self._seen]


def draw_signal(axes: Axes, course: StatisticCurve, detector: str, span: Span, legend: Legend) -> None:
    """Draw signal, limits and normal band of one joint within `span` [s], and where it is not assessable."""
    part = course.within(span)
    if not len(part.time):
        return
    valid = part.status == Status.VALID
    axes.plot(*decimate(part.time, part.value, PIXELS), color=NOT_ASSESSED, linewidth=0.8, zorder=2)
    value = np.where(valid, part.value, np.nan)
    axes.plot(*decimate(part.time, value, PIXELS), color=look_of(detector).colour, zorder=3)
    legend.add("signal")
    _draw_band(axes, part.time, part.lower, part.upper, valid, legend)
    _draw_not_assessable(axes, part.time, part.status, span, legend)


def frame_signal(axes: Axes, courses: Iterable[StatisticCurve], span: Span, headroom: float) -> None:
    """Set the vertical range: all limits and valid values within `span`, excursions up to `headroom` bands beyond."""
    inside: list[float] = []
    bounds: list[float] = []
    for course in courses:
        part = course.within(span)
        valid = part.status == Status.VALID
        assessed = part.value[valid]
        inside += _ends(assessed if len(assessed) else part.value)
        if not len(assessed):
            bounds += _ends(part.value)
        bounds += _ends(part.value[(part.value >= part.lower) & (part.value <= part.upper) & valid])
        bounds += _ends(part.lower) + _ends(part.upper)
    if not inside and not bounds:
        return
    low, high = min(inside + bounds), max(inside + bounds)
    if bounds:
        near, far = min(bounds), max(bounds)
        room = headroom * max(far - near, 1e-12)
        low, high = max(low, near - room), min(high, far + room)
    margin = 0.06 * (high - low) or 0.5 * abs(high) or 1.0
    axes.set_ylim(low - margin, high + margin)


def draw_force(axes: Axes, time: FloatArray, force: FloatArray, span: Span, *, contact: bool) -> None:
    """Draw the load cell (n,) over time (n,) [s], to a tick beyond its peak; without a contact its noise is small."""
    axes.margins(y=0.06 if contact else 1.2)
    part = (time >= span[0]) & (time <= span[1])
    if part.any():
        axes.plot(*decimate(time[part], force[part], PIXELS), color=FORCE, linewidth=0.9)
        if contact:
            cover_peak(axes, float(np.nanmax(force[part], initial=0.0)))


def cover_peak(axes: Axes, highest: float) -> None:
    """Set the ticks of the vertical axis up to one at or beyond the highest value."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    low = axes.get_ylim()[0]
    ticks = MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(low, highest)
    axes.yaxis.set_major_locator(FixedLocator([tick for tick in ticks if tick >= low]))
    axes.set_ylim(low, ticks[-1])


def draw_trigger(axes: Axes, detections: Sequence[Detection], colour: str, legend: Legend) -> None:
    """Draw 1 while an alarm of any joint is raised, until it is re-armed; 0 otherwise.

    A filled mark where it is raised, an open one where it is re-armed. Nothing if a detector could not assess anything.
    """
    for detection in detections:
        time = detection.statistic.time
        if not len(time) or detection.verdict.outcome == "not_assessable":
            continue
        end = float(time[-1])
        held = trigger_spans([alarm.time for alarm in detection.verdict.alarms], detection.verdict.rearmed, end)
        steps: list[Span] = [(float(time[0]), 0.0)]
        for start, release in joined_spans(held):
            steps += [(start, 0.0), (start, 1.0), (release, 1.0)]
            steps += [(release, 0.0)] if release < end else []
        steps += [(end, steps[-1][1])]
        axes.plot(*zip(*steps, strict=True), color=colour, linewidth=1.6)
        raised, armed = [start for start, _ in held], [release for _, release in held if release < end]
        for kind, times in (("raised", raised), ("rearmed", armed)):
            if times:
                legend.add(kind)
        axes.plot(raised, [1.0] * len(raised), "^", color=colour, markersize=5, linestyle="none")
        axes.plot(armed, [0.0] * len(armed), "v", color=colour, markerfacecolor="white", markersize=5, linestyle="none")
    axes.set_ylim(-0.35, 1.35)
    axes.set_yticks([0, 1])


def trigger_spans(alarms: Sequence[float], rearmed: Sequence[float], end: float) -> list[Span]:
    """Return from when to when each alarm is raised [s]: until it is re-armed, `end` if never or unknown."""
    releases = rearmed if len(rearmed) == len(alarms) else [end] * len(alarms)
    return [(start, min(release, end)) for start, release in zip(alarms, releases, strict=True)]


def joined_spans(spans: Sequence[Span]) -> list[Span]:
    """Return the union of the spans: alarms of several joints overlap."""
    found: list[Span] = []
    for start, end in sorted(spans):
        if found and start <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], end))
        else:
            found.append((start, end))
    return found


def draw_onset(axes: Axes, time: float, legend: Legend) -> None:
    """Draw the line of a contact's onset."""
    axes.axvline(time, color=FORCE, linestyle=ONSET_DASHES, linewidth=1.0, zorder=4)
    legend.add("onset")


def draw_alarm(axes: Axes, alarm: Alarm, colour: str, legend: Legend) -> None:
    """Draw the line of an alarm."""
    axes.axvline(alarm.time, color=colour, linewidth=2.2, zorder=4, alpha=0.9)
    legend.add("alarm")


def count_from(axes: Axes, zero: float, step: float) -> None:
    """Label the time axis in milliseconds from `zero` [s], with a tick every `step` [s]."""
    from matplotlib.ticker import MultipleLocator

    axes.xaxis.set_major_locator(MultipleLocator(step, offset=zero))
    axes.xaxis.set_major_formatter(lambda value, _: f"{1e3 * (value - zero):.0f}".replace("-", "−"))


def intervals(mask: BoolArray, time: FloatArray, closer: float) -> list[Span]:
    """Return the intervals of a mask, each sample up to the next; intervals `closer` than this [s] are joined."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    found: list[Span] = []
    for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        start, end = float(time[first]), float(time[min(after, len(time) - 1)])
        if end <= start:
            continue
        if found and start - found[-1][1] < closer:
            found[-1] = (found[-1][0], end)
        else:
            found.append((start, end))
    return found


def _draw_band(
    axes: Axes, time: FloatArray, lower: FloatArray, upper: FloatArray, valid: BoolArray, legend: Legend
) -> None:
    edge_low, edge_high = axes.get_ylim()
    for limit in (lower, upper):
        finite = np.where(np.isfinite(limit), limit, np.nan)
        if np.isfinite(finite).any():
            axes.plot(*decimate(time, finite, PIXELS), **LIMIT_LINE, zorder=3)
            legend.add("limit")
    if not ((np.isfinite(lower) | np.isfinite(upper)) & valid).any():
        return
    low = np.where(np.isneginf(lower), edge_low, lower)
    low[~valid] = np.nan
    high = np.where(np.isposinf(upper), edge_high, upper)
    kept = np.union1d(kept_samples(time, low, PIXELS), kept_samples(time, high, PIXELS))
    axes.fill_between(time[kept], low[kept], high[kept], color=BAND, linewidth=0, zorder=1)
    legend.add("band")


def _draw_not_assessable(axes: Axes, time: FloatArray, status: np.ndarray, span: Span, legend: Legend) -> None:
    for code, reason in REASONS.items():
        column = (span[1] - span[0]) / PIXELS
        found = [item for item in intervals(status == code, time, column) if item[1] - item[0] > 2.0 * column]
        if not found:
            continue
        axes.broken_barh(
            [(start, end - start) for start, end in found],
            (0.0, 1.0),
            transform=axes.get_xaxis_transform(),
            facecolor="none",
            edgecolor=NOT_ASSESSED,
            linewidth=0.0,
            hatch=HATCHES[Status(code)],
            zorder=0.5,
        )
        legend.add(reason)


def _ends(values: FloatArray) -> list[float]:
    """Return the smallest and largest finite value; empty without a finite value."""
    finite = values[np.isfinite(values)]
    return [float(finite.min()), float(finite.max())] if len(finite) else []
