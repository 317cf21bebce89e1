"""Force curves and their limits: texts of the figure, plain, with the same bytes each time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cdtool.report.plots.figures import save
from cdtool.report.plots.force_plot import force_figure
from cdtool.results.traced_force import TracedForce
from cdtool.truth.force.limits import ForceProfile
from tests.report.plots.force_panels import GAP, curve
from tests.report.plots.svg import joined

STIFF = {"stiff": (curve("stiff/1", 900.0), curve("stiff/2", 3521.0), curve("stiff/3", 300.0))}
SOFT = {"soft": (curve("soft/1", 200.0, until=1.2), curve("soft/2", 390.0))}


def drawn(tmp_path: Path, *groups: dict[str, tuple[TracedForce, ...]], profile: ForceProfile = GAP) -> str:
    every = {name: curves for group in groups for name, curves in group.items()}
    save(force_figure(every, profile), tmp_path / "a.svg")
    return joined(tmp_path / "a.svg")


def test_a_contact_that_cannot_be_assessed_is_worse_than_one_that_passes(tmp_path):
    shown = drawn(tmp_path, SOFT)
    assert "2 contacts:\n1 not assessable, 1 pass" in shown
    assert "worst: soft/1" in shown
    assert "residual: not assessable" in shown
    assert "exceeded" not in shown


def test_the_footer_names_the_source_and_states_that_this_is_not_a_certificate(tmp_path):
    shown = drawn(tmp_path, SOFT)
    assert "EN 12453:2017+A1:2021" in shown
    assert "evidence, not a certificate; values to be checked against the standard" in shown
    shown = drawn(tmp_path, SOFT, profile=replace(GAP, checked=True, source="checked by hand"))
    assert "checked by hand\nevidence, not a certificate" in shown
    assert "to be checked" not in shown
