"""The figures of docs/impact.md: they show what was simulated."""

from __future__ import annotations

import numpy as np
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


def test_the_curves_of_figure_3_4_fall_and_level_out_where_the_first_order_reaches_0():
    for curve in FIGURES.restitution_over_speed():
        slopes = np.diff(curve.exact)
        assert curve.exact[0] == 1.0 and np.all(slopes < 0.0) and np.all(np.diff(slopes) > 0.0)
        assert np.all(curve.exact[1:] > np.nan_to_num(curve.hunt_crossley[1:]))
    damping = FIGURES.restitution_over_damping()
    told = np.isfinite(damping.lankarani_nikravesh) & (damping.variable > 0.0)
    assert np.all(damping.exact[told] > damping.hunt_crossley[told])
    assert np.all(damping.hunt_crossley[told] > damping.lankarani_nikravesh[told])


def test_the_figures_name_impulses_speeds_and_works():
    course = FIGURES.plot_force_and_speed(FIGURES.two_bodies())
    titles = [axes.get_title(loc="left") for axes in course.axes]
    assert all(title.endswith(value) for title, value in zip(titles, ("0.71", "0.71", "0.50"), strict=True))
    panels = FIGURES.plot_loops(FIGURES.loops())
    assert [axes.get_title(loc="left") for axes in panels.axes] == ["Hertz", "Linear spring", "Hunt-Crossley"]
    assert "64 mJ lost" in panels.axes[2].get_legend().get_texts()[0].get_text()
    assert len(FIGURES.plot_restitution(FIGURES.restitution_over_speed()).axes[0].texts) == 3


def test_every_picture_is_on_a_page(tmp_path):
    FIGURES.draw(tmp_path)
    text = (DOCS / "impact.md").read_text(encoding="utf-8") + (DOCS / "study.md").read_text(encoding="utf-8")
    drawn = sorted(tmp_path.iterdir())
    assert len(drawn) == 8 and all(f"images/{path.name})" in text for path in drawn)
