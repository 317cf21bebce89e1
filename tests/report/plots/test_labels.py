"""Labels of curves: near their own curve, clear of all others, none without room."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.report.plots.figures import Margins, drawing, stacked_panels
from cdtool.report.plots.labels import Labelled, write_labels

X = np.linspace(0.0, 10.0, 21)


def labelled(text: str, y: np.ndarray) -> Labelled:
    return Labelled(text, "black", X, y, np.arange(len(X)))


@pytest.fixture
def panel():
    with drawing():
        figure, (axes,) = stacked_panels(5.0, [3.0], Margins(0.5, 0.2, 0.2, 0.5))
        axes.set_xlim(0.0, 10.0)
        axes.set_ylim(0.0, 10.0)
        yield figure, axes


def boxes(figure, axes) -> dict[str, np.ndarray]:
    figure.draw_without_rendering()
    to_data = axes.transData.inverted()
    return {text.get_text(): to_data.transform(text.get_window_extent().get_points()) for text in axes.texts}


def test_a_label_is_next_to_its_curve_and_inside_the_panel(panel):
    figure, axes = panel
    assert write_labels(axes, [labelled("one", np.full(21, 3.0)), labelled("two", np.full(21, 7.0))]) == ["one", "two"]
    for text, level in (("one", 3.0), ("two", 7.0)):
        (left, low), (right, high) = boxes(figure, axes)[text]
        assert 0.0 < left < right < 10.0
        assert min(abs(low - level), abs(high - level)) < 0.5


def test_labels_cover_neither_curves_nor_each_other(panel):
    figure, axes = panel
    levels = {f"curve {i}": np.full(21, 1.0 + 1.2 * i) for i in range(7)}
    written = write_labels(axes, [labelled(text, y) for text, y in levels.items()])
    assert len(written) == 7
    found = boxes(figure, axes)
    for (_, low), (_, high) in found.values():
        assert not any(low < y[0] < high for y in levels.values())
    items = list(found.values())
    for i, first in enumerate(items):
        for second in items[i + 1 :]:
            assert np.any(first[1] < second[0]) or np.any(second[1] < first[0])


def test_without_room_no_label_is_written(panel):
    _, axes = panel
    crowded = [labelled(f"curve {i}", np.full(21, 5.0 + 0.05 * i)) for i in range(9)]
    assert set(write_labels(axes, crowded)) <= {"curve 0", "curve 8"}
    assert write_labels(axes, [labelled("n" * 300, np.full(21, 5.0))]) == []


def test_a_curve_without_a_position_for_its_label_and_a_panel_without_curves_are_valid(panel):
    _, axes = panel
    nowhere = Labelled("one", "black", X, X, np.array([], dtype=int))
    assert write_labels(axes, [nowhere]) == []
    assert write_labels(axes, []) == []
