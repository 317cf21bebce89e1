"""Limits on a prediction: exact on polynomials, its gains and noise those of the closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.detectors.detection import Status
from cdtool.thresholds.predicted_limit import PredictedLimit
from tests.thresholds.strokes import TIME, N, jittering_clock, noise_runs, signal


def impulse_response(order: int, forgetting: float, ahead: float) -> np.ndarray:
    values = np.zeros(N)
    values[2000] = 1.0
    rule = PredictedLimit(order=order, forgetting=forgetting, ahead=ahead)
    return rule.statistic(signal(values), 1e-3).values[2000:, 0]


@pytest.mark.parametrize(
    ("order", "forgetting", "gains"),
    [(1, 0.95, (0.0975, 0.0025)), (2, 0.95, (0.142625, 0.0073125, 6.25e-5)), (2, 0.9, (0.271, 0.0285, 5e-4))],
)
def test_the_steady_gains_are_those_of_the_closed_form(order, forgetting, gains):
    at_first = [impulse_response(order, forgetting, ahead)[0] for ahead in (0.0, 1.0, 2.0)]
    square = (at_first[2] - 2.0 * at_first[1] + at_first[0]) / 2.0
    found = (at_first[0], at_first[1] - at_first[0] - square, square)
    assert found[: order + 1] == pytest.approx(gains, rel=1e-6)
    assert order == 2 or found[2] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("order", "forgetting", "ahead", "amplification"),
    [
        *((1, 0.95, ahead, sd) for ahead, sd in ((0, 0.25), (10, 0.30), (20, 0.36))),
        *((2, 0.95, ahead, sd) for ahead, sd in ((0, 0.32), (10, 0.47), (20, 0.65), (40, 1.10))),
        *((2, 0.9, ahead, sd) for ahead, sd in ((0, 0.45), (10, 0.93), (20, 1.60), (40, 3.39))),
    ],
)
def test_white_noise_is_passed_on_as_the_reference_says(order, forgetting, ahead, amplification):
    response = impulse_response(order, forgetting, ahead)
    assert np.sqrt(np.sum(response**2)) == pytest.approx(amplification, abs=0.0051)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.8])
def test_a_parabola_is_predicted_exactly_on_any_clock(share):
    time = jittering_clock(N, share)
    rule = PredictedLimit(order=2, ahead=15.0)
    statistic = rule.statistic(signal(3.0 - 40.0 * time + 25.0 * time**2, time), 1e-3)
    later = time + 15e-3
    np.testing.assert_allclose(
        statistic.values[500:, 0], (3.0 - 40.0 * later + 25.0 * later**2)[500:], atol=1e-4, rtol=0.0
    )


def test_a_gap_longer_than_the_memory_restarts_it():
    holed = signal(np.where(TIME < 2.0, 0.0, 50.0))
    status = holed.status.copy()
    start_up = int(np.ceil(np.log(0.01) / np.log(0.95)))
    status[2000 : 2000 + start_up] = Status.GAP
    statistic = PredictedLimit().statistic(replace(holed, status=status), 1e-3)
    back = 2000 + start_up
    assert (statistic.status[back : back + start_up] == Status.START_UP).all()
    assert statistic.valid[back + start_up :].all()
    np.testing.assert_allclose(statistic.values[back:, 0], 50.0, atol=1e-6)


def test_it_stays_exact_over_a_hundred_thousand_samples():
    time = np.arange(100_000) * 1e-3
    values = signal(np.sin(2.0 * time), time)
    late = PredictedLimit(order=2).statistic(values, 1e-3).values[-4000:, 0]
    fresh = PredictedLimit(order=2).statistic(signal(values.values[-6000:], time[-6000:]), 1e-3).values[-4000:, 0]
    np.testing.assert_allclose(late, fresh, atol=1e-9)


def test_limits_are_learned_on_the_prediction_and_not_on_the_signal():
    pairs = noise_runs(20)
    wide = PredictedLimit(order=2, forgetting=0.9, ahead=40.0).fit(pairs)
    narrow = PredictedLimit(order=1, forgetting=0.95, ahead=0.0).fit(pairs)
    ratio = (wide.limit.greatest[0] - 100.0) / (narrow.limit.greatest[0] - 100.0)
    assert ratio == pytest.approx(3.39 / 0.25, rel=0.3)
