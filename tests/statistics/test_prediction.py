"""The predicted probability of the next maximum: Student's closed form, and correct on average."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from cdtool.statistics.prediction import Prediction, prediction_of


@pytest.mark.parametrize("n", [3, 14, 60])
@pytest.mark.parametrize("t", [0.5, 2.0, 4.0])
def test_without_a_gumbel_part_it_is_students_prediction(n, t):
    expected = stats.t.sf(t / math.sqrt(1.0 + 1.0 / n), n - 1)
    assert Prediction(n, 0.0, 1.0, gumbel_share=0.0).chance_above(t) == pytest.approx(expected, rel=0.05)


def drawn(rng: np.random.Generator, share: float, shape: tuple[int, ...]) -> np.ndarray:
    scale = math.sqrt(6.0 * share) / math.pi
    return math.sqrt(1.0 - share) * rng.normal(size=shape) + scale * rng.gumbel(size=shape)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("n", [5, 14, 40])
def test_the_limit_for_a_chance_is_exceeded_with_that_chance_on_average(share, n):
    rng = np.random.default_rng(2)
    samples, fresh = 7.0 + 3.0 * drawn(rng, share, (4000, n)), 7.0 + 3.0 * drawn(rng, share, (4000, 50))
    unit = Prediction(n, 0.0, 1.0, share).limit_for(0.02)
    limits = samples.mean(axis=1) + unit * samples.std(axis=1, ddof=1)
    assert np.mean(fresh > limits[:, np.newaxis]) == pytest.approx(0.02, abs=0.004)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.1, 9.0), min_size=3, max_size=30), st.floats(1e-4, 0.2))
def test_the_limit_is_the_inverse_of_the_chance(values, chance):
    prediction = prediction_of(values)
    if prediction.std > 1e-6:
        assert prediction.chance_above(prediction.limit_for(chance)) == pytest.approx(chance, rel=1e-3)


def test_the_runs_required_are_the_fewest_that_meet_the_probability():
    needed = Prediction(14, 2.5, 0.7).runs_for(5.5, 1e-3)
    assert needed is not None and 20 < needed < 100
    assert Prediction(needed, 2.5, 0.7).chance_above(5.5) <= 1e-3 < Prediction(needed - 1, 2.5, 0.7).chance_above(5.5)
    assert Prediction(14, 2.5, 0.7).runs_for(4.0, 1e-3) is None


def test_equal_maxima_are_certain():
    prediction = prediction_of([2.0, 2.0, 2.0, 2.0])
    assert (prediction.chance_above(2.1), prediction.chance_above(1.9)) == (0.0, 1.0)
    assert prediction.limit_for(1e-3) == 2.0
    assert prediction.runs_for(5.5, 1e-3) == 3 and prediction.runs_for(1.5, 1e-3) is None
