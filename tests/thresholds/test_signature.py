"""The signature: what it learns, where it has a limit, how it is updated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import SignatureError
from cdtool.detectors.detection import Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.recording import Series
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature import Signature
from cdtool.thresholds.signature_curve import Curve
from tests.thresholds.strokes import TIME, N, noise_runs, signal, stroke


def test_the_limit_is_the_mean_plus_the_factor_times_the_spread():
    fitted = Signature(safety_factor=5.0).fit(noise_runs(40))
    _, band = fitted.evaluate(stroke(), signal(np.zeros(N)))
    upper = band.upper[1500:3900, 0]
    assert np.median(upper) == pytest.approx(105.0, abs=0.2)
    assert np.ptp(upper) < 1.5
    assert (band.lower[1500:3900] == -np.inf).all()


def test_backward_motion_is_watched_below_for_a_signed_signal_and_above_otherwise():
    backward = noise_runs(12, direction=-1)
    signed = Signature().fit(backward)
    _, band = signed.evaluate(stroke(-1), signal(np.zeros(N)))
    assert (band.upper[2000:3900] == np.inf).all() and np.isfinite(band.lower[2000:3900]).all()
    unsigned = Signature().fit([(recording, replace(s, signed=False)) for recording, s in backward])
    _, band = unsigned.evaluate(stroke(-1), signal(np.zeros(N), signed=False))
    assert (band.lower[2000:3900] == -np.inf).all() and np.isfinite(band.upper[2000:3900]).all()


@pytest.mark.parametrize("rate", [10, 25, 50, 100])
def test_a_log_with_fewer_samples_than_grid_points_has_a_limit_all_along(rate):
    time, rng = np.arange(4 * rate) / rate, np.random.default_rng(3)
    moving = stroke(time=time)
    learned = [(moving, signal(100.0 + rng.normal(size=len(time)), time)) for _ in range(40)]
    statistic, band = Signature(safety_factor=5.0).fit(learned).evaluate(moving, learned[0][1])
    # The last sample is beyond the last point of the grid, by less than a step of it.
    assert statistic.valid[time > 0.4 + 3.0 / rate][:-1].all()
    assert np.median(band.upper[statistic.valid]) == pytest.approx(105.0, abs=0.5)


def test_beyond_the_learned_travel_no_limit_is_known():
    fitted = Signature(alignment="position").fit(noise_runs(12))
    longer = stroke(start=0.0)
    statistic, _ = fitted.evaluate(longer, signal(np.zeros(N)))
    learned = stroke()["position"].values[-1, 0]
    beyond = longer["position"].values[:, 0] > learned + 5e-3
    assert beyond.sum() > 100
    assert (statistic.status[beyond] == Status.NO_LIMIT).all()


def test_the_band_freezes_where_the_axis_stops_after_a_contact():
    fitted = Signature().fit([(stroke(), signal(100.0 + 50.0 * TIME + 0.1 * r)) for r in range(12)])
    stopped = stroke()
    v, x = stopped["speed"].values.copy(), stopped["position"].values.copy()
    v[2500:], x[2500:] = 0.0, x[2500] - 0.01  # it bounced back a little
    stopped = replace(stopped, channels={"speed": Series(TIME, v, "m/s"), "position": Series(TIME, x, "m")})
    _, band = fitted.evaluate(stopped, signal(np.zeros(N)))
    assert np.ptp(band.upper[2500:, 0]) == 0.0
    assert band.upper[2499, 0] == pytest.approx(band.upper[2600, 0], abs=0.2)


def test_a_run_of_another_speed_or_direction_is_refused_by_name():
    for other in (stroke(speed=0.15), stroke(-1)):
        odd = replace(other, name="other class")
        with pytest.raises(SignatureError, match="other class"):
            Signature().fit([*noise_runs(11), (odd, signal(np.zeros(N)))])


def test_the_thesis_rule_is_the_mean_plus_one_standard_deviation_point_by_point():
    pairs = noise_runs(15)
    fitted = Signature(rule="thesis", alignment="position").fit(pairs)
    _, upper = fitted.limits(fitted.by_travel)
    point = 150
    travel = pairs[0][0]["position"].values[:, 0] - pairs[0][0]["position"].values[402, 0]
    passed = np.flatnonzero(travel >= fitted.by_travel.grid[point])[0]
    values = [s.values[passed, 0] for _, s in pairs]
    assert upper[point, 0] == pytest.approx(np.mean(values) + np.std(values, ddof=1), rel=1e-6)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=4), min_size=3, max_size=12))
def test_adding_runs_one_by_one_gives_what_learning_from_all_of_them_gives(values):
    samples = np.array(values)[:, :, np.newaxis]
    curve = Curve.empty(1.0, 2.0, 3.0, 1)
    at_once = curve.learned(samples)
    one_by_one = curve.learned(samples[:2])
    for sample in samples[2:]:
        one_by_one = one_by_one.updated(sample, None)
    np.testing.assert_allclose(one_by_one.mean, at_once.mean, atol=1e-9)
    np.testing.assert_allclose(one_by_one.squares, at_once.squares, rtol=1e-9, atol=1e-6)


def test_forgetting_follows_a_drift_that_welford_averages_away():
    samples = np.random.default_rng(1).normal(size=(20, 4, 1))
    kept = forgotten = Curve.empty(1.0, 2.0, 3.0, 1).learned(samples)
    for _ in range(100):
        kept, forgotten = kept.updated(np.full((4, 1), 10.0), None), forgotten.updated(np.full((4, 1), 10.0), 20.0)
    assert (forgotten.mean > 9.9).all() and (kept.mean < 9.0).all()
    assert (forgotten.count == 20).all() and (forgotten.squares >= 0.0).all()


def test_the_spread_has_a_floor_where_a_quantised_signal_does_not_vary():
    samples = np.random.default_rng(1).normal(size=(20, 101, 1))
    samples[:, 40:45] = 3.0
    _, spread = Curve.empty(1.0, 1.0, 100.0, 1).learned(samples).band(pooled=False)
    assert spread[42, 0] == pytest.approx(0.1 * np.median(spread), rel=1e-9)


@pytest.mark.parametrize(
    ("force", "runs", "said"),
    [
        (False, 9, "9 impact-free runs of one class: 1 more is needed to have 10"),
        (False, 1, "1 impact-free run of one class: 9 more are needed to have 10"),
        (True, 1, "1 impact-free run of one class: 1 more is needed to have 2"),
    ],
)
def test_too_few_runs_are_reported_with_how_many_are_missing(force, runs, said):
    with pytest.raises(SignatureError, match=said) as fault:
        Signature(force=force).fit([(None, None)] * runs)
    assert ("signature.force = true" in fault.value.hint) is not force


def flat_signature() -> FittedSignature:
    """Limits that rise by 9 over 2 m of travel, 1 above and below the mean."""
    mean = np.linspace(0.0, 9.0, 21)[:, np.newaxis]
    curve = Curve(0.1, 0.1, np.full((21, 1), 10.0), mean, np.ones((21, 1)))
    return FittedSignature(MotionClass(1, 0.2), "position", "thesis", "two", 1.0, True, ("axis",), curve, curve)


def test_signatures_with_other_grids_on_the_same_motion_have_their_own_limits():
    first, motion = flat_signature(), stroke()
    coarse = replace(first, by_travel=replace(first.by_travel, step=0.2))
    for signature in (first, coarse, replace(first, alignment="time")):
        _, band = signature.evaluate(motion, signal(np.zeros(N)))
        _, alone = signature.evaluate(stroke(), signal(np.zeros(N)))
        np.testing.assert_array_equal(band.upper, alone.upper)
        np.testing.assert_array_equal(band.lower, alone.lower)
    travel = motion["position"].values[2000, 0]
    for signature, slope in ((first, 4.5), (coarse, 2.25)):
        upper = signature.evaluate(motion, signal(np.zeros(N)))[1].upper[2000, 0]
        spread = 0.5 * (upper - signature.evaluate(motion, signal(np.zeros(N)))[1].lower[2000, 0])
        assert upper - spread == pytest.approx(slope * travel, rel=0.02)
