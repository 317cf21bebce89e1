"""The figures of docs/impact.md: they show what was simulated."""

from __future__ import annotations

import pytest

from tests.project.pages import DOCS, docs_script

FIGURES = docs_script("make_impact_figures")


def test_the_example_of_figure_3_2_loses_half_its_relative_energy():
    hit = FIGURES.two_bodies()
    assert hit.energy_loss == pytest.approx(0.5, abs=1e-6)
    assert hit.speeds[0] == pytest.approx([0.6, 0.1])
    assert hit.speeds[-1] == pytest.approx([0.3 - 0.6 * 0.5**1.5, 0.3 + 0.4 * 0.5**1.5], abs=1e-6)


def test_the_loops_of_figure_3_5_lose_what_their_restitution_says():
    for group in FIGURES.loops().values():
        for name, hit in group.items():
            e = {"none (3.13)": 1.0, "e = 0.3 (3.19)": 0.3}.get(name, 0.7)
            assert hit.restitution.newton == pytest.approx(e, abs=1e-6), name


def test_every_picture_is_on_a_page(tmp_path):
    FIGURES.draw(tmp_path)
    text = (DOCS / "impact.md").read_text(encoding="utf-8") + (DOCS / "study.md").read_text(encoding="utf-8")
    drawn = sorted(tmp_path.iterdir())
    assert len(drawn) == 8 and all(f"images/{path.name})" in text for path in drawn)
