"""Intervals without an upper end: written with the number of contacts, not drawn across a plot."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdtool.report.few_contacts import open_end
from cdtool.report.plots.figures import save
from cdtool.report.plots.latency_plot import latency_figure
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.results import ExposureResult, Results
from tests.report.bench import contacts_of


def evaluated(latencies: list[float | None]) -> Evaluated:
    exposure = (ExposureResult("stiff", "momentum", len(latencies), len(latencies), 0.5),)
    rows = tuple(contacts_of("momentum", "stiff", latencies))
    return evaluate(Results({"onset": "x"}, ("momentum",), ("stiff",), rows, (), exposure))


@pytest.mark.parametrize(
    ("latencies", "words"),
    [
        ([25.0, None, None, None], "≥ 25.0 (n = 4)"),
        ([25.0 + i for i in range(7)] + [None] * 5, "≥ 26.0 (n = 12)"),
        ([25.0, 26.0, 27.0, None], ""),
        ([25.0 + i for i in range(12)], ""),
        ([None] * 4, ""),
    ],
)
def test_an_open_interval_begins_at_its_lower_end_and_names_its_contacts(tmp_path: Path, latencies, words):
    made = evaluated(latencies)
    found = open_end(made.summaries[0])
    assert (found[1] if found else "") == words
    save(latency_figure(made), tmp_path / "latency.svg")
    text = (tmp_path / "latency.svg").read_text(encoding="utf-8")
    assert words in text
    assert ("≥" in text) == bool(words)
    assert ("without an upper end" in text) == bool(words)


def test_the_median_is_drawn_within_its_interval(tmp_path: Path):
    made = evaluated([25.0 + i for i in range(7)] + [None] * 5)
    least, _ = open_end(made.summaries[0]) or (0.0, "")
    assert least == made.summaries[0].median.low < made.summaries[0].median.value
