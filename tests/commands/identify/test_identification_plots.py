"""The figures of an identification: what they say, and that a misfit is visible in them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cdtool.commands.identify.axis.rigid_axis import identify_rigid_axis
from cdtool.commands.identify.evidence import CrossValidation, UnseenRun
from cdtool.commands.identify.plots import draw_friction, draw_unseen_run
from cdtool.report.plots.figures import encoded
from tests.synthetic.gate_runs import GATE, free_runs

UNITS = ("N", "m/s", "m")


def lines(axes: Any) -> dict[str, Any]:
    return {line.get_label(): line for line in axes.get_lines()}


def validation(wrong_by: float) -> CrossValidation:
    time = 1e-3 * np.concatenate((np.arange(1000), np.arange(2000, 3000)))
    measured = 200.0 + 10.0 * np.sin(time)
    unseen = UnseenRun("03.csv", time, measured, measured - wrong_by, 10)
    return CrossValidation(wrong_by, 8, 5.0, 4, unseen)


def test_friction_has_bars_of_two_standard_errors_and_the_model_over_the_same_speeds() -> None:
    fit = identify_rigid_axis(free_runs(GATE, 404, 3), GATE.motor_mass).evidence
    left, right = draw_friction(fit, UNITS).axes
    model = lines(left)["model"]
    # One speed: the model is flat, the measured friction is not.
    assert np.ptp(model.get_ydata()) < 0.5 * np.ptp(fit.friction_curve.mean)
    (bars,) = [item for item in left.containers if item.get_label().startswith("measured")]
    segment = bars.lines[2][0].get_segments()[0]
    assert segment[1][1] - segment[0][1] == pytest.approx(4.0 * fit.friction_curve.standard_error[0])
    assert right.get_xlabel() == "position [m]"


def test_the_same_content_has_the_same_bytes() -> None:
    first, second = (encoded(draw_unseen_run(validation(25.0), "N"), ".png") for _ in range(2))
    assert first == second
    assert first.startswith(b"\x89PNG")
    assert first != encoded(draw_unseen_run(validation(20.0), "N"), ".png")
