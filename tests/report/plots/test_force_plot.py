"""Force curves and their limits: texts of the figure, plain, with the same bytes each time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.text import Text

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.report.plots import force_plot
from cdtool.report.plots.figures import SUFFIXES, drawing, save
from cdtool.report.plots.force_plot import force_figure
from cdtool.results.traced_force import TracedForce
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import ForceProfile, ForceStep, profile_of, read_force_limits
from cdtool.truth.force.verdict import assess_force
from tests.report.hostile import HOSTILE

GAP = profile_of(read_force_limits(), "en_12453_reducing_gap")
TIME = np.arange(6500) * 1e-3
ALARMS = {"momentum": 0.066, "friction_ekf": 0.034}
SVG = "{http://www.w3.org/2000/svg}"


def half_sine(peak: float, rate: float = 28.4, until: float = 6.5) -> tuple[FloatArray, FloatArray]:
    time = TIME[until >= TIME]
    phase = rate * time
    return time, np.where(phase < np.pi, peak * np.sin(phase), 0.0)


def curve(
    name: str, peak: float, *, until: float = 6.5, alarms: Mapping[str, float] = ALARMS, profile: ForceProfile = GAP
) -> TracedForce:
    time, force = half_sine(peak, until=until)
    curve = ForceTimeCurve(time, force, np.zeros(len(time), dtype=bool), float(time[-1]))
    return TracedForce(name, "g", 1, time, force, assess_force(curve, profile), alarms)


STIFF = {"stiff": (curve("stiff/1", 900.0), curve("stiff/2", 3521.0), curve("stiff/3", 300.0))}
SOFT = {"soft": (curve("soft/1", 200.0, until=1.2), curve("soft/2", 390.0))}


def texts(path: Path) -> list[str]:
    return ["".join(item.itertext()) for item in ElementTree.parse(path).iter(f"{SVG}text")]


def drawn(tmp_path: Path, *groups: dict[str, tuple[TracedForce, ...]], profile: ForceProfile = GAP) -> str:
    every = {name: curves for group in groups for name, curves in group.items()}
    save(force_figure(every, profile), tmp_path / "a.svg")
    return "\n".join(texts(tmp_path / "a.svg"))


def test_a_panel_shows_the_worst_contact_with_peak_time_budget_and_alarms(tmp_path):
    shown = drawn(tmp_path, STIFF)
    for expected in (
        "stiff",
        "3 contacts:\n2 fail, 1 pass",
        "worst: stiff/2",
        "3521 N at 55 ms",
        "4.0 ms",
        "first exceeded after 4.0 ms",
        "dynamic: 3521 of 400 N",
        "alarm friction_ekf 34 ms",
        "alarm momentum 66 ms",
        "dynamic ≤ 400 N",
        "\n≤ 150 N",
        "\n≤ 25 N",
        "time from contact onset [ms]; compressed right of the first grey line",
    ):
        assert expected in shown, expected
    assert shown.index("friction_ekf 34 ms") < shown.index("momentum 66 ms")


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


def test_each_group_has_a_panel_and_an_empty_one_has_none(tmp_path):
    shown = drawn(tmp_path, STIFF, {"empty": ()}, SOFT)
    assert "stiff" in shown and "soft" in shown and "empty" not in shown
    assert "no contact with a load-cell force" in drawn(tmp_path, {"empty": ()})


def test_the_worst_is_coloured_five_more_are_emphasised_and_the_rest_is_pale():
    many = {"many": tuple(curve(f"c{i}", 500.0 + 10.0 * i, alarms={}) for i in range(9))}
    with drawing():
        (axes,) = force_figure(many, GAP).axes
    curves = [line for line in axes.lines if len(line.get_xdata()) > 100]
    colours = [line.get_color() for line in curves]
    assert len(curves) == 9
    assert [colours.count(colour) for colour in (force_plot._WORST, "0.45")] == [1, 5]
    worst = next(line for line in curves if line.get_color() == force_plot._WORST)
    assert np.max(worst.get_ydata()) == pytest.approx(580.0, abs=0.5)
    assert worst.get_zorder() == max(line.get_zorder() for line in curves)


def test_the_first_part_of_the_time_axis_is_linear_and_shows_peak_and_alarms():
    with drawing():
        (axes,) = force_figure(STIFF, GAP).axes
    scale = axes.get_xaxis().get_transform()
    assert axes.get_xlim() == (0.0, 6.5)
    places = scale.transform([0.0, 0.1, 0.2, 0.75, 5.0, 6.5])
    np.testing.assert_allclose(places, [0.0, 0.36, 0.72, 0.72 + 0.28 / 3, 0.72 + 0.56 / 3, 1.0])


def test_a_fast_impact_in_a_long_record_keeps_its_shape_on_the_wide_first_part():
    with drawing():
        (axes,) = force_figure(STIFF, GAP).axes
    worst = next(line for line in axes.lines if line.get_color() == force_plot._WORST and len(line.get_xdata()) > 9)
    early = np.asarray(worst.get_xdata())
    assert np.count_nonzero(early <= 0.2) == 201  # every sample of the first 200 ms


def test_a_short_record_with_its_limits_in_view_is_not_compressed(tmp_path):
    profile = ForceProfile("p", "p", "p", True, (ForceStep(0.0, 400.0, "a"), ForceStep(0.08, 100.0, "b")))
    brief = {"brief": (curve("x", 350.0, until=0.15, profile=profile),)}
    with drawing():
        (axes,) = force_figure(brief, profile).axes
    assert axes.get_xlim() == (0.0, pytest.approx(0.15))
    assert "compressed" not in drawn(tmp_path, brief, profile=profile)


@pytest.mark.parametrize("until", [0.3, 1.2, 6.5])
def test_all_steps_of_the_limit_are_drawn_and_the_time_after_the_record_is_hatched(tmp_path, until):
    cut = {"cut": (curve("x", 900.0, until=until, alarms={"momentum": 0.4}),)}
    with drawing():
        (axes,) = force_figure(cut, GAP).axes
    stairs = next(line for line in axes.lines if list(line.get_xdata())[:3] == [0.0, 0.75, 5.0])
    assert list(stairs.get_xdata()) == sorted(stairs.get_xdata())
    assert stairs.get_xdata()[-1] == axes.get_xlim()[1] == max(until, 6.0)
    assert ("record has ended" in drawn(tmp_path, cut)) == (until < 6.0)


def test_an_alarm_is_marked_on_the_curve_and_an_alarm_after_the_record_is_only_listed(tmp_path):
    late = {"late": (curve("x", 900.0, until=0.9, alarms={"momentum": 0.02, "direct": 1.5}),)}
    with drawing():
        (axes,) = force_figure(late, GAP).axes
    marks = {line.get_marker(): line for line in axes.lines if len(line.get_xdata()) == 1}
    assert set(marks) == {"o", "D"}  # the limit's crossing, and the momentum observer's alarm
    assert marks["D"].get_xdata()[0] == pytest.approx(0.02)
    assert marks["D"].get_ydata()[0] == pytest.approx(900.0 * np.sin(28.4 * 0.02), rel=1e-3)
    assert "alarm direct 1500 ms" in drawn(tmp_path, late)


def test_many_alarms_are_counted_after_the_first_four(tmp_path):
    alarms = {f"detector_{i}": 0.01 * (9 - i) for i in range(9)}
    shown = drawn(tmp_path, {"g": (curve("x", 900.0, alarms=alarms),)})
    assert "alarm detector_8 10 ms" in shown
    assert "alarm detector_5 40 ms" in shown
    assert "detector_4 50 ms" not in shown
    assert "and 5 later" in shown


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_same_input_gives_the_same_bytes(tmp_path, suffix):
    for name in ("a", "b"):
        save(force_figure({**STIFF, **SOFT}, GAP), tmp_path / f"{name}{suffix}")
    first = (tmp_path / f"a{suffix}").read_bytes()
    assert first == (tmp_path / f"b{suffix}").read_bytes()
    assert len(first) > 5000


def hostile(name: str) -> tuple[dict[str, tuple[TracedForce, ...]], ForceProfile]:
    profile = replace(
        GAP, title=name, source=name, steps=tuple(replace(step, name=f"{name}{i}") for i, step in enumerate(GAP.steps))
    )
    return {name: (curve(name, 900.0, alarms={name: 0.02}, profile=profile),)}, profile


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_are_drawn_as_plain_text(tmp_path, kind):
    panel, profile = hostile(HOSTILE[kind])
    shown = drawn(tmp_path, panel, profile=profile)
    assert not set(shown) & set("\u202e\u2067\x00\x1b\ufffe")
    assert all(len(text) < 140 for text in texts(tmp_path / "a.svg"))
    if kind == "math":
        assert "$x^2$" in shown
    if kind == "script":
        assert not list(ElementTree.parse(tmp_path / "a.svg").iter(f"{SVG}script"))


def test_nothing_is_clipped_at_the_edge_and_nothing_is_read_as_mathematics():
    long = hostile("n" * 300)
    with drawing():
        for panels, profile in (({**STIFF, **SOFT}, GAP), long):
            figure = force_figure(panels, profile)
            figure.draw_without_rendering()
            box = figure.get_tightbbox()
            width, height = figure.get_size_inches()
            assert box.x0 >= -0.02 and box.y0 >= -0.02
            assert box.x1 <= width + 0.02 and box.y1 <= height + 0.02
            assert not any(text.get_parse_math() for text in figure.findobj(Text))


def test_no_curve_crosses_the_name_of_a_limit():
    slow = replace(STIFF["stiff"][0], force=np.where(TIME > 0.3, 170.0, STIFF["stiff"][0].force))
    with drawing():
        figure = force_figure({**STIFF, "pressed": (slow,)}, GAP)
        figure.draw_without_rendering()
        for axes, curves in zip(figure.axes, (STIFF["stiff"], (slow,)), strict=True):
            boxes = [item.get_window_extent() for item in axes.texts if "≤" in item.get_text()]
            assert len(boxes) == 3
            for time, force in ((item.time, item.force) for item in curves):
                x, y = axes.transData.transform(np.column_stack((time, force))).T
                for box in boxes:
                    at = np.linspace(box.x0, box.x1, 50)
                    heights = np.interp(at, x, y)
                    assert not np.any((heights > box.y0) & (heights < box.y1))


def test_a_file_name_that_does_not_name_a_figure_is_refused(tmp_path):
    with pytest.raises(UsageError, match=r"a\.gif"):
        save(force_figure(STIFF, GAP), tmp_path / "a.gif")
