"""The measured force-time curves of a point as vector drawings: a row per repetition, with the limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cdtool.commands.protocol.assessment.assessment import PointAssessment, Repetition
from cdtool.commands.protocol.document.words import Words
from cdtool.report.plots.figures import drawing, new_figure, svg_text
from cdtool.report.plots.force_plot import WHOLE
from cdtool.report.plots.style import FORCE, LIMIT
from cdtool.results.traces.decimation import kept_samples
from cdtool.truth.force.limits import ForceProfile

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Repetitions that fit on a page with their table.
_IN_ONE = 4
# Sizes [inch]: the drawing's width, the height of a panel and the distance to the next, the margins beside and below
# the panels, the left panels' width. Given, not found by trial, which takes a second.
_WIDTH, _PANEL, _APART, _BESIDE, _BELOW, _LEFT = 6.9, 1.2, 0.42, 0.62, 0.45, 3.3
NOT_RECORDED = "0.88"
# The first part is so many times as long as the first peak is late, at least and at most [s].
_PARTS, _SHORTEST, _LONGEST = 4.0, 0.2, 1.0


def curve_drawings(point: PointAssessment, words: Words, quantity: str = "curve.force") -> Iterator[tuple[str, int]]:
    """Yield the repetitions of a point as SVG, at most four in one drawing, with their number."""
    profile = point.profile
    assert profile is not None, "curves are drawn with their limits"
    numbered = list(enumerate(point.repetitions, 1))
    first = _first_part(point.repetitions)
    longest = max(item.curve.end for item in point.repetitions)
    for begin in range(0, len(numbered), _IN_ONE):
        some = numbered[begin : begin + _IN_ONE]
        with drawing():
            figure, rows = _panels(len(some))
            for (left, right), (number, item) in zip(rows, some, strict=True):
                for axes, end in ((left, first), (right, longest)):
                    _draw(axes, item, profile, end, words)
                left.set_title(words("curve.repetition", number=number), loc="left")
                left.set_ylabel(words(quantity))
            for axes in rows[-1]:
                axes.set_xlabel(words("curve.time"))
        yield svg_text(figure), len(some)


def _panels(count: int) -> tuple[Figure, list[tuple[Axes, Axes]]]:
    """Return a figure with rows of two panels."""
    height = _BELOW + count * (_PANEL + _APART)
    figure = new_figure(_WIDTH, height)
    figure.set_layout_engine("none")
    right = _BESIDE + _LEFT + _BESIDE
    rows = []
    for row in range(count):
        bottom = height - (row + 1) * (_PANEL + _APART) + 0.05
        spans = ((_BESIDE, _LEFT), (right, _WIDTH - right - 0.1))
        left_axes, right_axes = (
            figure.add_axes((begin / _WIDTH, bottom / height, width / _WIDTH, _PANEL / height))
            for begin, width in spans
        )
        rows.append((left_axes, right_axes))
    return figure, rows


def _first_part(repetitions: Sequence[Repetition]) -> float:
    """Return how much of the curves the left panels show [s]."""
    latest = max(float(item.curve.time[int(np.argmax(item.curve.force))]) for item in repetitions)
    return min(max(_PARTS * latest, _SHORTEST), _LONGEST)


def _draw(axes: Axes, item: Repetition, profile: ForceProfile, end: float, words: Words) -> None:
    time, force = item.curve.time, item.curve.force
    inside = time <= end
    time, force = time[inside], force[inside]
    kept = kept_samples(time, force, 900)  # more than the panel has pixels
    axes.plot(time[kept], force[kept], color=FORCE, linewidth=0.9)
    begins = [step.from_s for step in profile.steps if step.from_s < end]
    forces = [step.at_most_n for step in profile.steps[: len(begins)]]
    axes.step([*begins, end], [*forces, forces[-1]], where="post", color=LIMIT, linestyle=(0, (4, 2)), linewidth=1.0)
    if item.curve.end < WHOLE * end:
        axes.axvspan(item.curve.end, end, color=NOT_RECORDED, linewidth=0)
    axes.set_xlim(0.0, end)
    axes.set_ylim(min(0.0, 1.1 * float(force.min())), 1.15 * max(float(force.max()), *forces))
    axes.yaxis.set_major_formatter(lambda value, _: words.number(value))
    axes.xaxis.set_major_formatter(lambda value, _: words.number(value))
