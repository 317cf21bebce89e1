"""The survival figure: a step curve per detector, bands of a few curves, missed contacts as open marks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import pytest

from cdtool.report.plots import survival_plot
from cdtool.report.plots.figures import drawing, save
from cdtool.report.plots.survival_plot import survival_figure
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.results import Results
from tests.report.bench import contacts_of
from tests.report.plots.svg import joined, texts


def of(latencies: Mapping[str, Sequence[float | str | None]], group: str = "stiff") -> Evaluated:
    """Detectors with their latencies in one group."""
    rows = [row for name, late in latencies.items() for row in contacts_of(name, group, late)]
    return evaluate(Results({}, tuple(latencies), (group,), tuple(rows), (), ()))


def drawn(evaluated: Evaluated):
    with drawing():
        return survival_plot.survival_figure(evaluated)


def steps(figure, panel: int = 0) -> list:
    return [line for line in figure.axes[panel].lines if line.get_drawstyle() == "steps-post"]


def opened(figure, panel: int = 0) -> list[tuple[float, float]]:
    """Where open marks stand."""
    lines = [line for line in figure.axes[panel].lines if line.get_markerfacecolor() == "white"]
    return [point for line in lines for point in zip(line.get_xdata(), line.get_ydata(), strict=True)]


def test_a_curve_falls_to_zero_by_one_step_per_contact():
    (curve,) = steps(drawn(of({"momentum": [20.0, 40.0, 60.0, 80.0]})))
    assert curve.get_xdata().tolist() == [0.0, 20.0, 40.0, 60.0, 80.0, 80.0]
    assert curve.get_ydata() == pytest.approx([1.0, 0.75, 0.5, 0.25, 0.0, 0.0])


def test_a_missed_contact_is_an_open_mark_at_the_end_of_its_monitoring():
    figure = drawn(of({"momentum": [20.0, 40.0, None, "blind"]}))
    assert opened(figure) == [(1000.0, pytest.approx(1 / 3))]
    assert steps(figure)[0].get_xdata()[-1] == 1000.0
    assert figure.axes[0].get_xlim()[1] >= 1000.0


def test_everything_missed_nothing_assessable_one_contact_and_none_are_drawn_too(evaluated, tmp_path):
    figure = drawn(of({"momentum": [None] * 20}))
    assert set(steps(figure)[0].get_ydata()) == {1.0}
    assert opened(figure) == [(1000.0, 1.0)]
    save(survival_figure(of({"momentum": ["blind"] * 3})), tmp_path / "blind.svg")
    assert "not assessable" in texts(tmp_path / "blind.svg")
    assert steps(drawn(of({"momentum": ["blind"] * 3}))) == []
    assert steps(drawn(of({"momentum": [25.0]})))[0].get_ydata().tolist() == [1.0, 0.0, 0.0]
    save(survival_figure(evaluate(replace(evaluated.results, contacts=()))), tmp_path / "none.svg")
    assert "no contact in any group" in joined(tmp_path / "none.svg")
