"""Moments that no friction explains are left out, for all joints, and only they."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdtool.commands.identify.robot.robot_dynamics import identify_robot
from cdtool.commands.identify.robot.unexplained_torque import _outside, without_unexplained
from tests.commands.identify.robot_motion import coloured, fourier, planar_arm

ARM = planar_arm(coulomb_slope=50.0)


def test_a_push_is_left_out_and_the_rest_of_both_runs_is_kept() -> None:
    runs = [fourier(seed, 2, 15.0, 0.01).run(ARM, 0.1 * coloured(seed, (1500, 2), 5.0)) for seed in (1, 2)]
    torque = runs[1].torque.copy()
    torque[700:730, 0] += 20.0
    found = without_unexplained([runs[0], replace(runs[1], torque=torque)], ARM)
    gone = np.isnan(found.runs[1].torque)
    assert gone[705:725].all()
    assert not gone[:670].any()
    assert not gone[760:].any()
    assert not np.isnan(found.runs[0].torque).any()
    assert 0.0 < found.share < 0.03


def test_noise_is_no_reason() -> None:
    runs = [fourier(3, 2, 15.0, 0.01).run(ARM, 0.5 * coloured(3, (1500, 2), 5.0))]
    found = without_unexplained(runs, ARM)
    assert found.share == 0.0
    assert found.runs[0] is runs[0]


def test_rounding_errors_are_no_reason() -> None:
    run = fourier(3, 2, 15.0, 0.01).run(ARM, np.zeros((1500, 2)))
    fit = identify_robot([run], ARM)
    torques = fit.equations.rows @ fit.base.values
    random = np.random.default_rng(1).standard_t(2, len(torques))
    rounded = replace(fit, equations=replace(fit.equations, torques=torques * (1.0 + 1e-16 * random)))
    assert not _outside(rounded).any()
