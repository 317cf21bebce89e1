"""What a motion excites: held speeds, directions, acceleration; and that what is missing shows the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.excitation import Excitation, measure_excitation
from cdtool.commands.identify.axis.filtered_regression import filter_run
from cdtool.commands.identify.axis.rigid_axis import RigidAxisFit, identify_rigid_axis
from cdtool.commands.identify.estimate import Missing
from cdtool.commands.identify.evidence import friction_curve, speed_edges
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis

PERIOD = 2e-3


def stroke(speed: float, seconds: float = 4.0, acceleration: float = 1.0) -> FloatArray:
    ramp = np.linspace(0.0, speed, max(round(abs(speed) / acceleration / PERIOD), 2))
    hold, rest = np.full(round(seconds / PERIOD), speed), np.zeros(round(0.3 / PERIOD))
    return np.concatenate((rest, ramp, hold, ramp[::-1], rest))


# An axis with a screw, as the simulated axis has it; its friction depends on the position, too.
AXIS = AxisModel(
    drive=ElasticDrive(load_mass=95.0),
    friction=Friction(
        coulomb_forward=20.0, coulomb_backward=24.0, static=24.0, stribeck_speed=1e-3, viscous=200.0, offset=-3.0
    ),
    controller=Controller(period=PERIOD, speed_gain=4000.0, integral_gain=20000.0, force_limit=500.0),
)


def driven(speed: float, direction: int, number: int, acceleration: float = 1.0, travel: float = 0.3) -> AxisRun:
    """Return a log of the simulated axis: rest, one stroke at a speed over the travel, rest; noise on all channels."""
    rng = np.random.default_rng([number, round(1e4 * speed), direction + 1])
    reference = direction * stroke(speed, travel / speed, acceleration)
    waves = 0.8 * np.sin(2.0 * np.pi * np.cumsum(np.abs(reference)) * PERIOD / 0.07)
    motion = simulate_axis(AXIS, AxisInputs(reference, disturbance=-direction * waves * (reference != 0.0)))
    count = len(reference)
    return AxisRun(
        f"{direction * speed:g} m/s, {number}",
        0.0,
        PERIOD,
        motion["drive_force"] + 0.5 * rng.standard_normal(count),
        speed=motion["load_speed"] + 1e-4 * rng.standard_normal(count),
        position=motion["load_position"],
        reference_speed=reference,
    )


def of_needed_motion(fit: RigidAxisFit, directions: set[int]) -> list[AxisRun]:
    """Return four runs for each motion that the fit states as missing."""
    missing = {need for item in fit.identified.not_identifiable for need in item.missing}
    assert missing <= {Missing.SECOND_SPEED, Missing.REVERSALS}
    both = {1, -1} if Missing.REVERSALS in missing else directions
    wanted = [(speed, way) for speed in (0.075, 0.14) for way in both if Missing.SECOND_SPEED in missing]
    wanted += [(speed, way) for speed in fit.excitation.speeds for way in both - directions]
    return [driven(speed, way, 100 + number) for speed, way in wanted for number in range(4)]


@pytest.mark.parametrize(
    ("logged", "unknown"),
    [
        ([(0.25, 1), (0.25, -1)], {"viscous_friction", "coulomb_friction", "coulomb_forward", "coulomb_backward"}),
        (
            [(0.25, 1), (0.15, 1), (0.08, 1)],
            {"coulomb_friction", "coulomb_backward", "coulomb_forward", "constant_force"},
        ),
        (
            [(0.25, -1)],
            {"viscous_friction", "coulomb_friction", "coulomb_forward", "coulomb_backward", "constant_force"},
        ),
    ],
)
def test_the_motion_that_is_stated_as_missing_makes_the_parameters_identifiable(logged, unknown):
    before = [driven(speed, direction, number) for speed, direction in logged for number in range(3)]
    fit = identify_rigid_axis(before, 0.0)
    assert {item.key for item in fit.identified.not_identifiable} == unknown
    added = of_needed_motion(fit, {direction for _, direction in logged})
    again = identify_rigid_axis([*before, *added], 0.0).identified
    assert not again.not_identifiable
    assert again["viscous_friction"].value == pytest.approx(200.0, rel=0.1)
    assert again["coulomb_friction"].value == pytest.approx(22.0, rel=0.1)
    # The offset, and half of what the directions differ.
    assert again["constant_force"].value == pytest.approx(-5.0, rel=0.15)


def test_weak_acceleration_is_answered_with_one_that_shows_the_mass():
    slow = [noisy(driven(0.06, direction, 1, acceleration=0.005, travel=0.05)) for direction in (1, -1)]
    fit = identify_rigid_axis(slow, 0.0)
    missing = [item for item in fit.identified.not_identifiable if item.key == "load_mass"]
    assert missing[0].missing == (Missing.ACCELERATION, Missing.FINER_MOTION)
    wanted = 5.0 * fit.excitation.acceleration_noise
    more = [noisy(driven(0.06, way, number, wanted, travel=0.05)) for way in (1, -1) for number in range(4)]
    again = identify_rigid_axis([*slow, *more], 0.0)
    assert again.identified["load_mass"].value == pytest.approx(95.0, rel=0.3)


def noisy(run: AxisRun) -> AxisRun:
    """Return a run whose only motion is a position with noise."""
    assert run.position is not None
    position = run.position + 2e-5 * np.random.default_rng(len(run)).standard_normal(len(run))
    return replace(run, position=position, speed=None, reference_speed=None)


def test_the_curve_of_a_line_is_the_line():
    speed = np.linspace(-0.3, 0.3, 6001)
    edges = speed_edges(speed)
    curve = friction_curve(speed, 200.0 * speed, np.arange(6001) % 5, edges)
    assert len(curve.mean) == len(edges) - 1
    np.testing.assert_allclose(curve.mean, 200.0 * curve.abscissa, atol=0.05)
    assert curve.count.sum() == 6001


def test_the_standard_error_is_that_between_strokes_not_between_samples():
    rng = np.random.default_rng(1)
    stroke = np.repeat(np.arange(16), 200)
    force = rng.standard_normal(16)[stroke] + 0.1 * rng.standard_normal(3200)
    curve = friction_curve(np.full(3200, 0.5), force, stroke, np.array([0.0, 1.0]))
    assert curve.standard_error[0] == pytest.approx(0.25, rel=0.4)


def excitation_of(*speeds: FloatArray, noise: float) -> Excitation:
    rng = np.random.default_rng(1)
    runs = [
        AxisRun("log", 0.0, PERIOD, np.zeros(len(speed)), speed=speed + noise * rng.standard_normal(len(speed)))
        for speed in speeds
    ]
    return measure_excitation([filter_run(run, 20.0) for run in runs])


def test_acceleration_counts_only_above_its_noise():
    both = excitation_of(stroke(0.2), stroke(-0.2), noise=1e-4)
    assert both.is_accelerated and not both.is_one_way
    assert both.moving_time == pytest.approx(8.8, rel=0.05)
    steady = excitation_of(np.full(5000, -0.2), noise=1e-3)
    assert steady.is_one_way and not steady.is_accelerated
