"""The slope that a command had at least: exact for a logged command, a lower bound for a noisy torque."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdtool.commands.identify.axis.speed_controller import observed_slope
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass

SLOPE, LAG = 800.0, 0.01


def run(seed: int = 1, noise: float = 0.0, slope: float = SLOPE, gap: bool = False) -> AxisRun:
    """A command that rises for 0.4 s, is steady, and falls at half the slope; the torque follows with a lag."""
    time = np.arange(8000) * 1e-3
    command = slope * (np.clip(time - 1.0, 0.0, 0.4) - 0.5 * np.clip(time - 6.0, 0.0, 0.8))
    torque = command + noise * np.random.default_rng(seed).standard_normal(len(time))
    torque = first_order_low_pass(torque, LAG, 1e-3)
    if gap:
        torque[1200:1210] = np.nan
    return AxisRun("run", 0.0, 1e-3, torque, reference_torque=command)


def test_of_a_logged_command_it_is_the_largest_step() -> None:
    assert observed_slope([run(), run(slope=0.5 * SLOPE)], True) == pytest.approx(SLOPE)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("gap", [False, True])
def test_of_a_noisy_torque_it_is_a_bound_from_below(seed: int, gap: bool) -> None:
    found = observed_slope([run(seed, 60.0, gap=gap)], False, LAG)
    assert (0.4 if gap else 0.5) * SLOPE < found < SLOPE


def test_noise_alone_has_no_slope() -> None:
    assert observed_slope([run(seed, 60.0, 0.0) for seed in range(5)], False, LAG) < 0.1 * SLOPE


def test_without_a_command_it_is_not_known() -> None:
    bare = AxisRun("bare", 0.0, 1e-3, np.full(200, np.nan))
    assert math.isnan(observed_slope([bare], True))
    assert math.isnan(observed_slope([bare], False, LAG))
