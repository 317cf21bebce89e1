"""The low-pass against closed forms, gaps, least squares, instrumental variables, standard errors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.commands.identify.axis.filtered_regression import (
    LowPass,
    block_covariance,
    filter_run,
    fit_linear,
    white_noise,
)
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.machines.axis_model.axis_run import AxisRun

PERIOD = 1e-3
TIME = np.arange(4000) * PERIOD


def run_of(
    position: FloatArray | None = None, speed: FloatArray | None = None, torque: FloatArray | None = None
) -> AxisRun:
    length = len(position if position is not None else speed)  # type: ignore[arg-type]
    return AxisRun("log", 0.0, PERIOD, np.zeros(length) if torque is None else torque, speed, position)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.sampled_from([5.0, 20.0, 80.0]))
def test_the_derivatives_of_a_parabola_are_exact(offset, slope, curvature, corner):
    low_pass = LowPass(corner, PERIOD)
    time = TIME[:1500]
    signal = offset + slope * time + 0.5 * curvature * time**2
    inside = slice(low_pass.reach, -low_pass.reach)
    np.testing.assert_allclose(low_pass.slope(signal)[inside], (slope + curvature * time)[inside], atol=1e-8)
    np.testing.assert_allclose(low_pass.curvature(signal)[inside], curvature, atol=1e-5)


@pytest.mark.parametrize("corner", [5.0, 20.0, 60.0])
def test_the_corner_of_the_low_pass_is_where_it_is_stated(corner):
    low_pass = LowPass(corner, PERIOD)
    assert low_pass.corner_hz == pytest.approx(corner, rel=0.15)
    wave = np.sin(2.0 * math.pi * low_pass.corner_hz * TIME)
    assert np.nanmax(low_pass.value(wave)) == pytest.approx(math.sqrt(0.5), rel=0.04)


def test_the_low_passes_of_value_and_derivatives_cancel():
    """A wave above the corner: each derivative is damped exactly as the wave is."""
    low_pass, rate = LowPass(20.0, PERIOD), 2.0 * math.pi * 30.0
    wave = np.sin(rate * TIME)
    inside = slice(low_pass.reach, -low_pass.reach)
    ratio = np.std(low_pass.curvature(wave)[inside]) / np.std(low_pass.value(wave)[inside])
    assert ratio == pytest.approx(rate**2, rel=1e-3)


def test_a_missing_sample_is_unknown_within_reach_and_nowhere_else():
    low_pass = LowPass(20.0, PERIOD)
    signal = np.ones(1000)
    signal[500] = np.nan
    unknown = np.flatnonzero(np.isnan(low_pass.value(signal)))
    inside = unknown[(unknown > 100) & (unknown < 900)]
    assert inside.tolist() == list(range(500 - low_pass.reach, 501 + low_pass.reach))


def test_a_signal_shorter_than_the_low_pass_is_unknown():
    assert np.isnan(LowPass(1.0, PERIOD).value(np.ones(100))).all()


@pytest.mark.parametrize("corner", [0.0, -1.0, math.nan, math.inf])
def test_a_low_pass_without_a_frequency_is_refused(corner):
    with pytest.raises(UsageError, match="low-pass"):
        LowPass(corner, PERIOD)


def test_the_noise_of_a_moving_position_is_found():
    rng = np.random.default_rng(1)
    signal = 0.3 * np.sin(2.0 * math.pi * TIME) + 1e-5 * rng.standard_normal(len(TIME))
    assert white_noise(signal) == pytest.approx(1e-5, rel=0.1)
    assert white_noise(np.ones(5)) == 0.0
    assert white_noise(np.ones(500)) == 0.0


def test_the_noise_of_an_encoder_is_that_of_its_motion():
    moving = np.round(0.2 * TIME + 0.05 * np.sin(3.0 * TIME), 4)
    with_rest = np.concatenate((np.full(20_000, moving[0]), moving))
    assert white_noise(with_rest) == pytest.approx(1e-4 / math.sqrt(12.0), rel=0.25)


def test_speed_and_acceleration_come_from_the_position_and_agree_with_those_from_the_speed():
    position = 0.2 * np.sin(2.0 * math.pi * 0.7 * TIME)
    speed = 0.2 * 2.0 * math.pi * 0.7 * np.cos(2.0 * math.pi * 0.7 * TIME)
    by_position, by_speed = filter_run(run_of(position=position), 20.0), filter_run(run_of(speed=speed), 20.0)
    known = by_position.complete & by_speed.complete
    assert known.mean() > 0.95
    np.testing.assert_allclose(by_position.acceleration[known], by_speed.acceleration[known], atol=1e-3)
    np.testing.assert_allclose(by_position.speed[known], by_speed.speed[known], atol=1e-4)


def test_a_position_that_is_the_integral_of_the_speed_is_not_used():
    speed = np.full(1000, 0.2)
    run = AxisRun("log", 0.0, PERIOD, np.zeros(1000), speed, np.zeros(1000), derived=frozenset({"position"}))
    assert np.nanmean(filter_run(run, 20.0).speed) == pytest.approx(0.2)


def test_a_run_without_motion_channels_is_an_error():
    with pytest.raises(IdentificationError, match="no speed or position"):
        filter_run(AxisRun("log", 0.0, PERIOD, np.zeros(100)), 20.0)


def test_strokes_end_at_reversals_rests_and_gaps():
    speed = np.concatenate(
        (np.full(500, 0.2), np.full(500, -0.2), np.zeros(300), np.full(500, -0.2), np.full(500, -0.2))
    )
    speed[2000:2100] = np.nan
    run = filter_run(run_of(speed=speed), 20.0)
    assert run.stroke.max() == 3
    assert (run.stroke[1050:1250] == -1).all()
    assert not run.usable[1020:1280].any()


def test_the_start_from_rest_is_left_out_and_a_reversal_is_not():
    ramp = np.linspace(0.0, 0.2, 400)
    speed = np.concatenate((np.zeros(400), ramp, np.full(600, 0.2), np.linspace(0.2, -0.2, 800), np.full(600, -0.2)))
    run = filter_run(run_of(speed=speed), 20.0)
    assert not run.usable[400:455].any()
    assert run.usable[470:1400].all()
    near_reversal = run.usable[1600:1960]
    assert near_reversal.mean() > 0.85


def test_an_oscillation_at_rest_is_not_a_stroke():
    speed = np.concatenate((0.01 * np.sin(40.0 * TIME[:1000]), np.full(2000, 0.2)))
    assert filter_run(run_of(speed=speed), 20.0).stroke.max() == 0


def test_instruments_remove_the_bias_of_noise_in_the_regressors():
    """Errors in variables: least squares is low by the factor var(x) / (var(x) + var(noise)) = 0.8."""
    rng = np.random.default_rng(2)
    truth = rng.standard_normal(40_000)
    measured = truth + 0.5 * rng.standard_normal(40_000)
    force = 3.0 * truth
    plain = fit_linear(measured[:, None], force)
    cured = fit_linear(measured[:, None], force, truth[:, None])
    assert plain.coefficients[0] == pytest.approx(2.4, rel=0.02)
    assert cured.coefficients[0] == pytest.approx(3.0, rel=0.01)


def test_the_influence_reproduces_the_coefficients():
    rng = np.random.default_rng(4)
    regressors, force = rng.standard_normal((200, 3)) * [1.0, 1e-3, 1e3], rng.standard_normal(200)
    fit = fit_linear(regressors, force, regressors + 0.1 * rng.standard_normal((200, 3)))
    np.testing.assert_allclose(fit.influence @ force, fit.coefficients, rtol=1e-9)


def test_the_condition_number_does_not_depend_on_units():
    rng = np.random.default_rng(5)
    regressors = rng.standard_normal((300, 2)) + np.array([0.0, 3.0])
    force = rng.standard_normal(300)
    scaled = fit_linear(regressors * [1e4, 1e-3], force)
    assert scaled.condition_number == pytest.approx(fit_linear(regressors, force).condition_number)
    lengths = regressors / np.linalg.norm(regressors, axis=0)
    assert scaled.condition_number == pytest.approx(float(np.linalg.cond(lengths)))


def test_regressors_that_depend_on_each_other_are_an_error():
    column = np.arange(20.0)
    with pytest.raises(IdentificationError, match="depend on each other"):
        fit_linear(np.column_stack((column, 2.0 * column)), column)
    with pytest.raises(IdentificationError, match="1 equations for 2 parameters"):
        fit_linear(np.ones((1, 2)), np.ones(1))


def test_the_block_covariance_is_the_jackknife():
    rng = np.random.default_rng(6)
    regressors, force = rng.standard_normal((120, 2)) * [1.0, 50.0], rng.standard_normal(120)
    block = np.repeat(np.arange(6), 20)
    fit = fit_linear(regressors, force)
    changes = np.array(
        [fit.coefficients - fit_linear(regressors[block != g], force[block != g]).coefficients for g in range(6)]
    )
    np.testing.assert_allclose(block_covariance(fit, block), 5.0 / 6.0 * changes.T @ changes, rtol=1e-6)


def test_a_coefficient_from_a_single_block_has_an_infinite_variance_and_the_others_have_not():
    rng = np.random.default_rng(7)
    block = np.repeat(np.arange(5), 30)
    regressors = np.column_stack((np.ones(150), np.where(block == 2, rng.standard_normal(150), 0.0)))
    covariance = block_covariance(fit_linear(regressors, rng.standard_normal(150)), block)
    assert math.isinf(covariance[1, 1])
    assert 0.0 < covariance[0, 0] < 1.0


def test_one_block_has_no_standard_error():
    fit = fit_linear(np.ones((10, 1)), np.arange(10.0))
    assert np.isnan(block_covariance(fit, np.zeros(10, dtype=np.int64))).all()


def test_block_standard_errors_cover_a_level_per_block():
    rng = np.random.default_rng(8)
    block = np.repeat(np.arange(10), 50)
    inside = []
    for _ in range(200):
        force = 4.0 + rng.standard_normal(10)[block] + rng.standard_normal(500)
        fit = fit_linear(np.ones((500, 1)), force)
        error = math.sqrt(block_covariance(fit, block)[0, 0])
        inside.append(abs(fit.coefficients[0] - 4.0) / error)
    assert np.mean(np.array(inside) < 1.0) >= 0.55
    assert np.mean(np.array(inside) < 2.0) >= 0.85


def test_noise_that_grows_with_the_speed_counts_as_its_mean_power():
    rng = np.random.default_rng(5)
    level = np.repeat([1e-4, 1e-4, 1e-4, 8e-4], 1500)
    signal = np.cumsum(np.full(len(level), 1e-3)) + level * rng.standard_normal(len(level))
    assert white_noise(signal) == pytest.approx(math.sqrt(np.mean(level**2)), rel=0.1)


def test_samples_between_those_of_a_jittered_clock_do_not_hide_the_noise():
    rng = np.random.default_rng(6)
    clock = np.arange(8000) * 2e-3
    stamps = clock + rng.uniform(-1e-4, 1e-4, len(clock))
    signal = np.interp(clock[1:-1] + 1e-3, stamps, 1.0 * clock)
    # The mean of two neighbours, each with the error of its stamp times the speed of 1 m/s.
    assert white_noise(signal) == pytest.approx(1e-4 / math.sqrt(3.0) / math.sqrt(2.0), rel=0.2)
