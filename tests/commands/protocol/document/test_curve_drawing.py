"""The curves: each value is shown beside its limit, and a limit near the bottom of the axis can be read."""

from __future__ import annotations

import re

import numpy as np
import pytest

from cdtool.commands.protocol.assessment.assessment import Repetition, assess_point
from cdtool.commands.protocol.assessment.plan import MeasuringPoint
from cdtool.commands.protocol.document.curve_drawing import curve_drawings
from cdtool.commands.protocol.document.words import words_of
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import read_force_limits


@pytest.fixture(scope="module")
def drawing():
    """Return a drawing of three doors: 1400.4 N, a static force that exceeds its limit, and a record of one second."""
    profile = read_force_limits()["en_12453_wide_gap"]
    time = np.arange(6000) * 1e-3
    forces = (np.where(time < 0.3, 1400.4, 20.0), np.where(time < 3.0, 160.0, 20.0), np.full(1000, 100.0))
    curves = [ForceTimeCurve(time[: len(f)], f, np.zeros(len(f), dtype=bool), end=1e-3 * len(f)) for f in forces]
    runs = [Repetition.of((f"{number}.csv", str(number)), 1, curve, profile) for number, curve in enumerate(curves)]
    point = assess_point(MeasuringPoint(name="Kante", repetitions=3), profile, runs)
    return next(iter(curve_drawings(point, words_of("de"))))


def test_every_value_is_compared_with_its_limit_in_the_drawing_and_in_its_description(drawing):
    for text in ("Fdyn 1400,4 > 1400, Fs 20,0 ≤ 150, Fe 20,0 ≤ 25", "Fs 160 > 150", "Fs 100 ? 150, Fe – ? 25"):
        assert text in drawing.alt
    shown = re.findall(r"<text[^>]*>([^<]*)</text>", drawing.svg)
    assert {"Fdyn 1400,4", "&gt; 1400", "Fs 160", "&gt; 150", "Fe –", "? 25", "0,75", "5", "25", "1400"} <= set(shown)


def test_the_limit_of_25_newtons_is_as_far_from_the_axis_as_its_label_is_high(drawing):
    tick = r'<g id="ytick_.*?<use [^>]*y="([\d.]+)".*?<text[^>]*>([^<]*)</text>'
    ticks = re.findall(tick, drawing.svg, re.DOTALL)
    at = {label: float(height) for height, label in ticks}
    assert at["0"] - at["25"] >= 7.0 and at["25"] - at["150"] >= 7.0 and at["150"] - at["1400"] >= 7.0
