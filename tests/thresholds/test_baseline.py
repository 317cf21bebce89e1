"""Limits from the run's own first seconds in motion: closed forms, restarts, and what is not assessable."""

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.detectors.detection import WHOLE_MACHINE, Signal, Status
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.baseline import FittedBaseline

RATE = 100.0


def run_of(speed, values, time=None, status=None, joints=("axis",), names=()):
    speed, values = (np.asarray(item, dtype=float).reshape(len(item), -1) for item in (speed, values))
    time = np.arange(len(values)) / RATE if time is None else time
    status = np.zeros(values.shape, dtype=np.uint8) if status is None else status
    recording = Recording("run", "run.csv", joints, {"speed": Series(time, speed, "m/s")})
    return recording, Signal(time, values, status, "N", joints=names)


def evaluated(speed, values, warm_up=1.0, factor=8.0, **more):
    statistic, band = FittedBaseline(warm_up, factor).evaluate(*run_of(speed, values, **more))
    return statistic.status[:, 0], band.lower[:, 0], band.upper[:, 0]


def first_valid(status):
    return int(np.flatnonzero(status == Status.VALID)[0])


def test_limits_are_median_and_quantile_distance_of_the_first_seconds():
    rng = np.random.default_rng(3)
    values = 5.0 + rng.standard_normal(400)
    status, lower, upper = evaluated(np.full(400, 0.4), values)
    first = first_valid(status)
    used = values[first - 100 : first]  # 100 steps of 10 ms; each belongs to the sample at its end
    low, middle, high = np.quantile(used, [0.158655, 0.5, 0.841345])
    assert upper[first] == pytest.approx(middle + 4.0 * (high - low), rel=1e-12)
    assert lower[first] == pytest.approx(middle - 4.0 * (high - low), rel=1e-12)
    assert np.all(upper[first:] == upper[first]), "frozen"
    assert np.all(status[:first] == Status.START_UP)


def test_rest_before_the_motion_is_not_part_of_it():
    rng = np.random.default_rng(5)
    speed = np.repeat([0.0, 0.5], [300, 300]) + 1e-4 * rng.standard_normal(600)
    values = np.repeat([0.0, 20.0], [300, 300]) + np.repeat([0.01, 1.0], [300, 300]) * rng.standard_normal(600)
    status, lower, upper = evaluated(speed, values)
    first = first_valid(status)
    assert 395 <= first <= 415
    assert lower[-1] == pytest.approx(12.0, abs=3.0) and upper[-1] == pytest.approx(28.0, abs=3.0)


def test_a_joint_that_moves_ten_times_as_fast_as_in_its_first_seconds_starts_again():
    speed = np.repeat([0.02, 0.5], [300, 300])
    values = np.repeat([1.0, 9.0], [300, 300]) + np.tile([-0.1, 0.1], 300)
    status, _, upper = evaluated(speed, values)
    assert status[250] == Status.VALID and status[320] == Status.START_UP and status[-1] == Status.VALID
    assert upper[250] == pytest.approx(1.8) and upper[-1] == pytest.approx(9.8)


def test_after_a_contact_has_stopped_the_joint_it_is_still_judged():
    speed = np.repeat([0.5, 0.0], [200, 100])
    status, _, upper = evaluated(speed, np.repeat([1.0, 50.0], [200, 100]) + np.tile([-0.1, 0.1], 150))
    assert np.all(status[105:] == Status.VALID) and np.all(upper[105:] < 2.0)


def test_a_signal_without_spread_has_no_limit_and_one_that_never_moves_never_starts():
    status, _, upper = evaluated(np.full(300, 0.5), np.full(300, 2.0))
    assert np.all(status[110:] == Status.NO_LIMIT) and np.isnan(upper).all()
    status, _, _ = evaluated(np.zeros(300), np.arange(300.0))
    assert np.all(status == Status.START_UP)


def test_joints_have_their_own_motion_and_a_signal_of_the_whole_machine_that_of_the_fastest():
    speed = np.zeros((400, 2))
    speed[:, 0], speed[200:, 1] = 0.5, 0.5
    values = np.tile([[-1.0, -2.0], [1.0, 2.0]], (200, 1))
    run = run_of(speed, values, joints=("one", "two"))
    statistic, band = FittedBaseline(1.0, 8.0).evaluate(*run)
    assert first_valid(statistic.status[:, 0]) < 110 < 300 < first_valid(statistic.status[:, 1]) < 320
    assert band.upper[-1].tolist() == [8.0, 16.0]
    _, only_two = run_of(speed, values[:, 1], joints=("one", "two"), names=("two",))
    statistic, _ = FittedBaseline(1.0, 8.0).evaluate(run[0], only_two)
    assert first_valid(statistic.status[:, 0]) > 300
    _, whole = run_of(speed, values[:, 0], joints=("one", "two"), names=WHOLE_MACHINE)
    statistic, _ = FittedBaseline(1.0, 8.0).evaluate(run[0], whole)
    assert first_valid(statistic.status[:, 0]) < 110


def test_one_side_is_that_on_which_an_obstacle_opposes_the_present_motion():
    speed = np.repeat([0.5, 0.0, -0.5], 150)
    recording, signal = run_of(speed, np.tile([-1.0, 1.0], 225))
    _, band = FittedBaseline(1.0, 8.0, "one").evaluate(recording, signal)
    assert np.isneginf(band.lower[120:300]).all() and np.all(band.upper[120:300] == 8.0)
    assert np.isposinf(band.upper[320:]).all() and np.all(band.lower[320:] == -8.0)
    _, unsigned = FittedBaseline(1.0, 8.0, "one").evaluate(recording, signal.changed(signed=False))
    assert np.isneginf(unsigned.lower[120:]).all() and np.all(unsigned.upper[120:] == 8.0)


def test_widening_limits_follow_the_square_root_of_the_time_since_the_warm_up():
    recording, signal = run_of(np.full(600, 0.5), np.tile([-1.0, 1.0], 300))
    _, plain = FittedBaseline(1.0, 8.0).evaluate(recording, signal)
    _, band = FittedBaseline(1.0, 8.0, widen=True).evaluate(recording, signal)
    first = int(np.flatnonzero(np.isfinite(plain.upper[:, 0]))[0])
    elapsed = signal.time[first:] - signal.time[first - 1]
    np.testing.assert_allclose(band.upper[first:, 0], 8.0 * np.sqrt(1.0 + elapsed), rtol=1e-12)
    np.testing.assert_allclose(band.lower[first:, 0], -8.0 * np.sqrt(1.0 + elapsed), rtol=1e-12)


def test_without_a_speed_it_is_an_error_that_names_the_channel():
    _, signal = run_of(np.full(10, 0.5), np.zeros(10))
    with pytest.raises(RecordingError, match="speed"):
        FittedBaseline(1.0, 8.0).evaluate(Recording("run", "", ("axis",), {}), signal)
