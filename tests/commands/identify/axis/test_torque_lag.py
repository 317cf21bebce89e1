"""A mass from a torque that lags the motion is refused until the lag is stated; without a lag it is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.axis.rigid_axis import RigidAxisSettings, identify_rigid_axis
from cdtool.commands.identify.estimate import Missing
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass
from tests.commands.identify.axis.test_rigid_axis import TRUTH, emps, gate_runs, simulated
from tests.data_folder import needs_data

PERIOD = 5e-3


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
def test_a_mass_from_a_torque_that_lags_is_refused_with_the_lag(runs, change, time):
    lagging = [change(run, time) for run in runs]
    (mass,) = [
        item for item in identify_rigid_axis(lagging, 0.0).identified.not_identifiable if item.key == "load_mass"
    ]
    assert mass.missing == (Missing.TORQUE_FILTER,)
    assert 0.3 * time < mass.numbers["lag_s"] < 2.0 * time
    # Friction at a speed that is held is known all the same, and so is the mass where 0 is stated: too small.
    stated = identify_rigid_axis(lagging, 0.0, RigidAxisSettings(torque_filter_time=0.0)).identified
    assert stated["load_mass"].value < TRUTH["load_mass"]


def test_a_stated_low_pass_is_undone(runs):
    lagging = [low_passed(run, 0.05) for run in runs]
    fit = identify_rigid_axis(lagging, 0.0, RigidAxisSettings(torque_filter_time=0.05))
    plain = identify_rigid_axis(runs, 0.0)
    assert fit.total_mass == pytest.approx(plain.total_mass, rel=5e-3)
    assert fit.identified["load_mass"].value == pytest.approx(TRUTH["load_mass"], rel=0.03)
    # The forces of the prediction are without the lag.
    assert fit.evidence.cross_validation is not None and plain.evidence.cross_validation is not None
    assert fit.evidence.cross_validation.error == pytest.approx(plain.evidence.cross_validation.error, rel=0.1)


def test_an_axis_whose_torque_does_not_lag_keeps_its_mass(runs):
    for free in (runs, simulated(4, noise=20.0), simulated(5, speeds=(0.2, 0.2)), gate_runs(3)):
        missing = [item.missing for item in identify_rigid_axis(free, 0.0).identified.not_identifiable]
        assert (Missing.TORQUE_FILTER,) not in missing


@needs_data("emps/DATA_EMPS.mat")
def test_a_real_axis_with_a_torque_from_its_command_keeps_its_mass():
    assert "load_mass" in identify_rigid_axis([emps()], 0.0).identified
