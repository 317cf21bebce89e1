"""A torque that lags the motion is found and undone, and an axis whose torque does not lag keeps its mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.axis.filtered_regression import LagForm, TorqueLag
from cdtool.commands.identify.axis.rigid_axis import (
    RigidAxisSettings,
    identify_rigid_axis,
)
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass
from tests.commands.identify.axis.test_rigid_axis import TRUTH, emps, gate_runs, simulated
from tests.data_folder import needs_data

PERIOD = 5e-3
QUICK = RigidAxisSettings()


def low_passed(run: AxisRun, time_constant: float) -> AxisRun:
    return replace(run, torque=first_order_low_pass(run.torque, time_constant, PERIOD))


def delayed(run: AxisRun, time: float) -> AxisRun:
    samples = round(time / PERIOD)
    held = np.full(samples, run.torque[0])
    return replace(run, torque=np.concatenate((held, run.torque[:-samples])))


@pytest.fixture(scope="module")
def runs():
    return simulated(3, acceleration=2.0)


@pytest.mark.parametrize(("change", "time"), [(low_passed, 0.01), (low_passed, 0.05), (delayed, 0.02), (delayed, 0.05)])
def test_a_lag_is_found_and_the_mass_is_that_without_it(runs, change, time):
    fit = identify_rigid_axis([change(run, time) for run in runs], 0.0, QUICK)
    uncorrected = identify_rigid_axis([change(run, time) for run in runs], 0.0, replace(QUICK, torque_filter_time=0.0))
    assert (
        fit.torque_lag.time
        == fit.identified["torque_filter_time"].value
        == pytest.approx(time, abs=max(4e-3, 0.1 * time))
    )
    assert fit.torque_lag.form is (LagForm.DELAY if change is delayed else LagForm.LOW_PASS)
    assert fit.identified["load_mass"].value == pytest.approx(TRUTH["load_mass"], rel=0.03)
    assert abs(fit.total_mass - TRUTH["load_mass"]) < 2.0 * fit.total_mass_error
    assert abs(uncorrected.total_mass - TRUTH["load_mass"]) > 2.0 * abs(fit.total_mass - TRUTH["load_mass"])
    assert uncorrected.torque_lag.time == 0.0 and "torque_filter_time" not in uncorrected.identified


def test_a_stated_low_pass_is_undone_and_not_written_again(runs):
    lagging = [low_passed(run, 0.05) for run in runs]
    fit = identify_rigid_axis(lagging, 0.0, replace(QUICK, torque_filter_time=0.05))
    plain = identify_rigid_axis(runs, 0.0, QUICK)
    assert fit.torque_lag == TorqueLag(0.05) and "torque_filter_time" not in fit.identified
    assert fit.total_mass == pytest.approx(plain.total_mass, rel=5e-3)
    # The forces of the prediction are without the lag.
    assert fit.cross_validation is not None and plain.cross_validation is not None
    assert fit.cross_validation.error == pytest.approx(plain.cross_validation.error, rel=0.1)


def test_an_axis_whose_torque_does_not_lag_shows_no_lag(runs):
    for free in (runs, simulated(4, noise=20.0), simulated(5, speeds=(0.2, 0.2)), gate_runs(3)):
        fit = identify_rigid_axis(free, 0.0, QUICK)
        assert fit.torque_lag.time == 0.0 and "torque_filter_time" not in fit.identified


@needs_data("emps/DATA_EMPS.mat")
def test_a_real_axis_with_a_torque_from_its_command_has_no_lag():
    assert identify_rigid_axis([emps()], 0.0, QUICK).torque_lag.time == 0.0
