"""The floor of a prediction error is the scatter between equal runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.robot.repeated_runs import repeated_runs
from cdtool.commands.identify.robot.robot_dynamics import Window
from tests.commands.identify.robot_motion import coloured, fourier, planar_arm

ARM = planar_arm(coulomb_slope=50.0)
MOTION = fourier(1, 2, 20.0, 0.01)


def test_the_floor_is_the_deviation_of_a_single_run_through_the_window() -> None:
    sizes = np.array([0.3, 0.1])
    runs = [MOTION.run(ARM, sizes * coloured(seed, (2000, 2), 0.0)) for seed in range(4)]
    found = repeated_runs(runs)
    assert found.pairs == 3
    passed = np.sqrt(np.sum(Window.of(0.1, 0.01).weights ** 2))
    assert found.floor == pytest.approx(sizes * passed, rel=0.15)


def test_runs_that_differ_in_motion_length_or_rate_are_no_pair() -> None:
    run = MOTION.run(ARM)
    others = [fourier(2, 2, 20.0, 0.01).run(ARM), fourier(1, 2, 10.0, 0.01).run(ARM), replace(run, period=0.02)]
    for other in others:
        found = repeated_runs([run, other])
        assert found.pairs == 0
        assert np.isnan(found.floor).all()


def test_gaps_do_not_count() -> None:
    one, other = (MOTION.run(ARM, 0.2 * coloured(seed, (2000, 2), 0.0)) for seed in (1, 2))
    torque = other.torque.copy()
    torque[300:900] = np.nan
    found = repeated_runs([one, replace(other, torque=torque)])
    assert np.isfinite(found.floor).all()
    assert found.pairs == 1
