"""All figures: the same bytes each time, hostile names as plain text, nothing beyond the edge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.text import Text

from cdtool.commands.detect import plot as detection_plot
from cdtool.commands.detect.plot import plot_detected
from cdtool.report.plots.amoc_plot import amoc_figure
from cdtool.report.plots.figures import SUFFIXES, drawing, save
from cdtool.report.plots.force_plot import force_figure
from cdtool.report.plots.latency_plot import latency_figure
from cdtool.report.plots.survival_plot import survival_figure
from cdtool.report.plots.trigger_plot import trigger_figure
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.results import ExposureResult, Results
from cdtool.results.traces.trace import ContactOutcome
from tests.report.bench import contacts_of
from tests.report.hostile import HOSTILE
from tests.report.plots.force_panels import GAP, group_of
from tests.report.plots.svg import assert_harmless, assert_within
from tests.results.sweeps import swept

FIGURES = ("latency", "survival", "amoc", "forces", "detected", "triggers")


@dataclass(frozen=True)
class Drawing:
    """A figure with one name at every place of one: written to a file, and as matplotlib has it."""

    write: Callable[[Path], None]
    figure: Callable[[], Any]

    @classmethod
    def of(cls, figure: Callable[..., Any], *content: Any) -> Drawing:
        return cls(lambda path: save(figure(*content), path), lambda: figure(*content))


def evaluated(name: str) -> Evaluated:
    """One detector and two groups, with contacts missed and not assessable, false alarms and a sweep."""
    contacts = [row for group in (name, f"{name} ") for row in contacts_of(name, group, [20.0, 30.0, None, name])]
    rows = swept(name, name, lambda m: 60.0 * m, lambda m: int(5 / m))
    exposure = (ExposureResult(name, name, 4, 4, 0.1),)
    return evaluate(Results({}, (name,), (name, f"{name} "), tuple(contacts), (), exposure, sweep=tuple(rows)))


@pytest.fixture
def drawing_of(bench, simulated) -> Callable[[str, str], Drawing]:
    def make(kind: str, name: str) -> Drawing:
        if kind == "forces":
            steps = tuple(replace(step, name=f"{name}{i}") for i, step in enumerate(GAP.steps))
            profile = replace(GAP, title=name, source=name, steps=steps)
            return Drawing.of(force_figure, group_of(name, profile), profile)
        if kind in ("detected", "triggers"):
            recording = replace(simulated("stiff", 1), name=name, joints=(name,))
            if kind == "detected":
                found = bench.detected(recording, "momentum")
                return Drawing(lambda path: plot_detected(found, path), lambda: detection_plot._figure(found))
            trace = bench.trace(recording, name, ("momentum", "pure_torque"))
            blind = (ContactOutcome("not_assessable", float("nan"), float("nan"), name),)
            panel = replace(trace.panels[0], detector=name, joint=name, unit=name, reason=name, seen=blind)
            named = replace(trace, recording=name, joints=2, panels=(panel, *trace.panels[1:]))
            return Drawing.of(trigger_figure, named, evaluated(name).results)
        figures = {"latency": latency_figure, "survival": survival_figure, "amoc": amoc_figure}
        return Drawing.of(figures[kind], evaluated(name))

    return make


@pytest.mark.parametrize("kind", FIGURES)
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_same_input_gives_the_same_bytes(drawing_of, tmp_path, kind, suffix):
    for name in ("a", "b"):
        drawing_of(kind, "stiff").write(tmp_path / f"{name}{suffix}")
    content = (tmp_path / f"a{suffix}").read_bytes()
    assert content == (tmp_path / f"b{suffix}").read_bytes() and len(content) > 1000


@pytest.mark.parametrize("kind", FIGURES)
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_are_drawn_as_plain_text(drawing_of, tmp_path, kind, name):
    drawing_of(kind, HOSTILE[name]).write(tmp_path / "a.svg")
    assert [path.name for path in tmp_path.iterdir()] == ["a.svg"]
    assert_harmless(tmp_path / "a.svg", name)


@pytest.mark.parametrize("kind", FIGURES)
@pytest.mark.parametrize("name", ["momentum", "n" * 300])
def test_nothing_is_clipped_and_no_text_is_read_as_mathematics(drawing_of, kind, name):
    with drawing():
        figure = drawing_of(kind, name).figure()
        assert_within(figure)
        assert not any(text.get_parse_math() for text in figure.findobj(Text))
