"""The measured force-time curves of a point as vector drawings: a panel per repetition, with its limits and values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import plain
from cdtool.commands.protocol.assessment.assessment import LAST_STEP_S, PointAssessment, Repetition, required_record
from cdtool.commands.protocol.document.blocks import CurveDrawing
from cdtool.commands.protocol.document.words import Words
from cdtool.report.plots.figures import drawing, new_figure, svg_text, text_width, write
from cdtool.report.plots.style import FORCE, LIMIT
from cdtool.results.traces.decimation import kept_samples
from cdtool.truth.force.limits import ForceProfile
from cdtool.truth.force.verdict import StepVerdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Panels beside each other in a drawing.
_IN_ROW = 4
# Sizes [inch]: of a drawing, its margins, and the distance of two panels. Given, not found by trial, which takes a
# second.
_WIDTH, _HEIGHT, _LEFT, _TOP, _BELOW, _APART = 6.9, 1.75, 0.5, 0.27, 0.34, 0.16
_FONT = 7.0  # legible on paper [points]
# The axis of the time ends at a multiple of this [s].
_ROUNDED = 0.1
_EXCEEDED, _EXPANDED = "#b3261e", "0.93"
# Below twice a limit, forces have a part of the axis to themselves if they had less than this share of the next part.
_LOW = 0.35


class _PartedAxis(NamedTuple):
    """An axis that is linear between its nodes; `places` are those of the nodes along the axis, from 0 to 1."""

    nodes: FloatArray
    places: FloatArray

    @classmethod
    def of(cls, nodes: Sequence[float], weights: Sequence[float]) -> _PartedAxis:
        """Return a scale whose parts are as long as their weights."""
        return cls(np.asarray(nodes), np.cumsum([0.0, *weights]) / sum(weights))

    def set(self, axes: Axes, name: str, ticks: Sequence[float], words: Words) -> None:
        """Set it on the axis "x" or "y" of a panel, with labels at the ticks."""
        from matplotlib.ticker import FixedLocator, MaxNLocator

        ends = (self.nodes, self.places), (self.places, self.nodes)
        functions = [partial(np.interp, xp=given, fp=wanted) for given, wanted in ends]
        getattr(axes, f"set_{name}scale")("function", functions=functions)
        getattr(axes, f"set_{name}lim")(self.nodes[0], self.nodes[-1])
        axis = getattr(axes, f"{name}axis")
        parts = [MaxNLocator(5).tick_values(*part)[1:-1] for part in pairwise(self.nodes.tolist())]
        axis.set_minor_locator(FixedLocator(np.concatenate(parts).tolist()))
        axis.set_major_locator(FixedLocator(ticks))
        axis.set_major_formatter(lambda value, _: words.limit(round(value, 3)))
        axis.set_tick_params(labelsize=_FONT)


def curve_drawings(point: PointAssessment, words: Words, quantity: str = "curve") -> Iterator[CurveDrawing]:
    """Yield drawings of the repetitions of a point, at most four in one; `quantity`: curve or pressure_curve."""
    numbered = list(enumerate(point.repetitions, 1))
    assert point.profile is not None, "curves are drawn with their limits"
    scales = _time_scale(point.profile, point.repetitions), _force_scale(point.profile, point.repetitions)
    for begin in range(0, len(numbered), _IN_ROW):
        some = numbered[begin : begin + _IN_ROW]
        width = (_WIDTH - _LEFT) / len(some) - _APART
        alt = []
        with drawing():
            figure = new_figure(_WIDTH, _HEIGHT)
            figure.set_layout_engine("none")
            sides = {"left": _LEFT / _WIDTH, "right": 1.0 - _APART / _WIDTH, "wspace": _APART / width}
            sides |= {"bottom": _BELOW / _HEIGHT, "top": 1.0 - _TOP / _HEIGHT}
            panels = figure.subplots(1, len(some), squeeze=False, gridspec_kw=sides)[0]
            for axes, (number, item) in zip(panels, some, strict=True):
                _draw(axes, item, scales, words)
                axes.tick_params(axis="y", labelleft=axes is panels[0])
                title = words("curve.repetition", number=number)
                write(axes, title, (1.0, 1.0), (-2, -2), ha="right", va="top", fontsize=_FONT, fontweight="bold")
                compared = _compared(item, quantity, words)
                _write_compared(axes, item, compared, scales[0].places, width)
                alt.append(f"{title}: {', '.join(map(' '.join, compared))}")
            figure.axes[0].set_ylabel(words(f"{quantity}.axis"), fontsize=_FONT)
            key = "curve.time" if len(scales[0].nodes) == 2 else "curve.compressed"
            figure.text(0.5, 0.0, words(key, begin=float(scales[0].nodes[1])), ha="center", va="bottom", fontsize=_FONT)
        text = words(f"{quantity}.alt", point=plain(point.point.name), values="; ".join(alt))
        yield CurveDrawing(svg_text(figure), text)


def _time_scale(profile: ForceProfile, repetitions: Sequence[Repetition]) -> _PartedAxis:
    """Return the axis of the time over all steps, at least as long as the record must be."""
    begins = [step.from_s for step in profile.steps]
    longest = max(item.curve.end for item in repetitions)
    end = max(longest, required_record(profile), begins[-1] + LAST_STEP_S)
    # The first of several steps has the peak.
    return _PartedAxis.of(
        [*begins, _ROUNDED * math.ceil(end / _ROUNDED)], [1.4 if len(begins) > 2 else 1.0, *(1.0 for _ in begins[1:])]
    )


def _force_scale(profile: ForceProfile, repetitions: Sequence[Repetition]) -> _PartedAxis:
    """Return the axis up to the highest force and limit; a limit near the bottom has a part of it to itself."""
    limits = sorted(step.at_most_n for step in profile.steps)
    nodes = [1.12 * max(limits[-1], *(item.curve.peak for item in repetitions))]
    for limit in reversed(limits[:-1]):
        if 2.0 * limit < _LOW * nodes[0]:
            nodes.insert(0, 2.0 * limit)
    lowest = min(0.0, *(1.1 * float(item.curve.force.min()) for item in repetitions))
    return _PartedAxis.of([lowest, *nodes], [*(1.0 for _ in nodes[1:]), 2.0])


def _draw(axes: Axes, item: Repetition, scales: tuple[_PartedAxis, _PartedAxis], words: Words) -> None:
    """Draw a curve with the limits, the times from which they apply, and the largest value of each step."""
    time, force = scales
    steps, end = [step.step for step in item.verdict.steps], float(time.nodes[-1])
    limits = [step.at_most_n for step in steps]
    time.set(
        axes, "x", time.nodes.tolist() if len(steps) > 1 else np.arange(0.0, end, math.ceil(end / 6.0)).tolist(), words
    )
    force.set(axes, "y", [0.0, *limits], words)
    if len(force.nodes) > 2:
        axes.axhspan(force.nodes[0], force.nodes[-2], color=_EXPANDED, linewidth=0)
    for node in force.nodes[1:-1]:
        axes.axhline(node, color="white", linewidth=1.5)
    for begin in time.nodes[1:-1]:
        axes.axvline(begin, color="0.6", linewidth=0.7)
    if item.curve.end < end - 2.0 * _ROUNDED:
        axes.axvspan(item.curve.end, end, fill=False, edgecolor="0.6", hatch="////", linewidth=0)
    kept = kept_samples(axes.xaxis.get_transform().transform(item.curve.time), item.curve.force, 900)
    axes.plot(item.curve.time[kept], item.curve.force[kept], color=FORCE, linewidth=0.9)
    times = [*(step.from_s for step in steps), end]
    axes.step(times, [*limits, limits[-1]], where="post", color=LIMIT, linestyle=(0, (4, 2)), linewidth=1.0)
    for step in item.verdict.steps:
        axes.plot(step.peak_at, step.peak, "o", markersize=3.5, color=_colour(step), clip_on=False, zorder=5)


def _colour(step: StepVerdict) -> str:
    return _EXCEEDED if step.outcome == "fail" else FORCE


def _compared(item: Repetition, quantity: str, words: Words) -> list[tuple[str, str]]:
    """Return the largest value of each step with its symbol, and the limit with how the value compares."""
    steps = item.verdict.steps
    symbols = [words.symbol(step.step.name) for step in steps]
    if quantity == "pressure_curve":
        symbols = [words.symbol(name) for name in ("pressure", "late_pressure")]
    signs = [
        "?" if step.outcome == "not_assessable" else ">" if step.peak > step.step.at_most_n else "≤" for step in steps
    ]
    return [
        (f"{symbol} {words.beside(step.peak, step.step.at_most_n)}", f"{sign} {words.limit(step.step.at_most_n)}")
        for symbol, sign, step in zip(symbols, signs, steps, strict=False)
    ]


def _write_compared(
    axes: Axes, item: Repetition, compared: Sequence[tuple[str, str]], places: FloatArray, width: float
) -> None:
    """Write above each step what was compared, where it is wide enough."""
    for step, lines, begin, end in zip(item.verdict.steps, compared, places[:-1], places[1:], strict=True):
        if text_width(lines, _FONT) <= (end - begin) * width + 0.5 * _APART:
            write(axes, "\n".join(lines), (float(begin), 1.0), (1, 2), va="bottom", fontsize=_FONT, color=_colour(step))
