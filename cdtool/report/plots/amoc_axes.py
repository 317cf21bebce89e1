"""The axes of the plot of latency against false alarms: rates, and left of them a zone without a false alarm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cdtool.evaluation.amoc import AmocCurve, AmocPoint
from cdtool.recording import FloatArray
from cdtool.report.plots.figures import between
from cdtool.report.plots.latency_axis import FLOOR_MS, set_ticks
from cdtool.report.plots.style import BAND

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Share of a panel's width for the points without a false alarm.
_ZONE = 0.27


@dataclass(frozen=True)
class RateFrame:
    """The horizontal axis: a zone without a false alarm from `left` to `least`, then rates up to `most`.

    In the zone each detector has a column of its own: a point's place there is no rate.
    """

    left: float
    least: float
    most: float
    columns: tuple[str, ...]

    def x(self, detector: str, points: Sequence[AmocPoint]) -> FloatArray:
        """Where the points of a detector are drawn."""
        share = (self.columns.index(detector) + 0.5) / len(self.columns)
        column = self.left * (self.least / self.left) ** share
        return np.array([point.rate if point.false_alarms else column for point in points])

    def shade(self, axes: Axes) -> None:
        """Mark the zone."""
        axes.axvspan(self.left, self.least, color=BAND, linewidth=0, zorder=0)


def rate_frame(curves: Sequence[AmocCurve]) -> RateFrame:
    """Rates begin a little below that of one single false alarm."""
    exposures = [item.hours if item.per == "hour" else float(item.operations) for item in curves]
    least = 1.0 / max(exposures) / 1.6
    most = max([10.0 * least, *(1.6 * point.rate for item in curves for point in item.points)])
    columns = tuple(dict.fromkeys(item.detector for item in curves))
    return RateFrame(least / (most / least) ** (_ZONE / (1.0 - _ZONE)), least, most, columns)


def set_rates(axes: Axes, frame: RateFrame) -> None:
    """Make the horizontal axis one of rates."""
    from matplotlib.ticker import FixedLocator, NullFormatter

    axes.set_xscale("log")
    axes.set_xlim(frame.left, frame.most)
    decades = range(math.ceil(math.log10(frame.least)), math.floor(math.log10(frame.most)) + 1)
    minor = [step * 10.0**power for power in (*decades, decades.start - 1) for step in range(2, 10)]
    axes.xaxis.set_major_locator(FixedLocator([10.0**power for power in decades]))
    axes.xaxis.set_minor_locator(FixedLocator([tick for tick in minor if frame.least <= tick <= frame.most]))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:.12g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def set_latencies(axes: Axes, low: float, high: float, logarithmic: bool) -> None:
    """Make the vertical axis one of latencies [ms]."""
    if logarithmic:
        axes.set_yscale("log")
        set_ticks(axes.yaxis, low, high)
    # Room above the highest point for an arrow.
    axes.set_ylim(low, high * (high / low) ** 0.08 if logarithmic else 1.08 * high)
    axes.set_ylabel("median latency [ms]")
    axes.grid(color="0.9", linewidth=0.6)


def explain(axes: Axes, curves: Sequence[AmocCurve], *, floored: bool) -> None:
    """Below the zone what no false alarm means, below the rates what they are and what the marks mean.

    `floored`: the axis of latencies is logarithmic, so that medians below its floor are drawn there.
    """
    hours, bounds = [item.hours for item in curves], [item.at_most for item in curves]
    per, counts = curves[0].per, sorted({item.operations for item in curves})
    operations = f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else str(counts[0])
    zone = "\n".join(
        (
            f"none in {operations} operations,",
            f"{between(min(hours), max(hours))} h",
            f"(at most {between(min(bounds), max(bounds))} per {per})",
        )
    )
    rates = f"false alarms per {per}"
    for text, share, lift, size, side in (
        (zone, 0.5 * _ZONE, -4.0, 7.5, "center"),
        (rates, _ZONE + 0.5 * (1.0 - _ZONE), -22.0, 9.0, "center"),
        (_marks(curves, floored), 0.0, -46.0, 8.0, "left"),
    ):
        axes.annotate(
            text,
            (share, 0.0),
            xycoords="axes fraction",
            xytext=(0.0, lift),
            textcoords="offset points",
            ha=side,
            va="top",
            fontsize=size,
            linespacing=1.35,
            annotation_clip=False,
        )


def _marks(curves: Sequence[AmocCurve], floored: bool) -> str:
    points = [point for item in curves for point in item.points]
    words = ["mark: one safety factor, the large one is in use"]
    if any(point.missed for point in points):
        words.append("open: contacts were missed")
    if any(math.isinf(point.median) for point in points):
        words.append("arrow: the median is not reached, half of them or more were missed")
    if floored and any(point.median < FLOOR_MS for point in points):
        words.append(f"medians below {FLOOR_MS:.0f} ms are drawn there")
    return "; ".join(words)
