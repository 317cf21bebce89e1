"""Robots with known parameters: recovered without noise, covered with noise, refused where the motion says nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.commands.identify.estimate import Estimate, IdentificationError, Missing
from cdtool.commands.identify.robot.robot_dynamics import FRICTION, RobotFit, identify_robot
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, regressor_of
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine
from tests.commands.identify.robot_motion import (
    Motion,
    coloured,
    fourier,
    panda,
    planar_arm,
    predicted_torque,
    ur10e,
    ur10e_run,
)
from tests.synthetic.machines import GATE, machine_of

EVERYTHING = FRICTION | {ColumnGroup.INERTIAL}
PLANAR = planar_arm(coulomb_slope=50.0)


def true_base(fit: RobotFit, machine: CoupledMachine) -> FloatArray:
    return fit.grouping.combination @ regressor_of(machine).values[list(fit.grouping.columns)]


def by_joint(fit: RobotFit, key: str) -> dict[int, Estimate]:
    return {item.joint: item for item in fit.identified.estimates if item.key == key}


def refused(fit: RobotFit, key: str) -> dict[int, tuple[Missing, ...]]:
    return {item.joint: item.missing for item in fit.identified.not_identifiable if item.key == key}


def unknown(machine: CoupledMachine) -> CoupledMachine:
    """The machine without knowledge of its friction."""
    zeros = (0.0,) * len(machine.joints)
    return replace(machine, viscous_friction=zeros, coulomb_friction=zeros, constant_force=zeros)


def test_the_base_parameters_of_seven_joints_are_recovered_to_a_millionth(tmp_path: Path) -> None:
    pytest.importorskip("pinocchio")
    machine = panda(tmp_path)
    run = fourier(1, 7, 12.0, 0.002).run(machine)
    fit = identify_robot([run], unknown(machine), EVERYTHING, half_width=0.2)
    wanted = true_base(fit, machine)
    assert len(fit.base.names) == 43 + 3 * 7
    assert np.linalg.norm(fit.base.values - wanted) < 1e-6 * np.linalg.norm(wanted)
    np.testing.assert_allclose(fit.base.values, wanted, rtol=1e-5, atol=2e-6)
    assert refused(fit, "base_parameters") == {}
    other = fourier(2, 7, 4.0, 0.002).run(machine)
    error = predicted_torque(fit, other) - other.torque
    assert np.isfinite(error).mean() > 0.9
    assert np.nanmax(np.abs(error)) < 1e-3


@pytest.mark.parametrize("samples", [0.0, 20.0])
def test_standard_errors_of_base_parameters_cover_white_and_coloured_noise(tmp_path: Path, samples: float) -> None:
    pytest.importorskip("pinocchio")
    machine, inside = panda(tmp_path), []
    for seed in range(3):
        motion = fourier(100 + seed, 7, 16.0, 0.01)
        fit = identify_robot([motion.run(machine, 0.5 * coloured(seed, (1600, 7), samples))], machine, EVERYTHING)
        inside.append(np.abs(fit.base.values - true_base(fit, machine)) < 2.0 * fit.base.standard_errors)
    assert np.mean(inside) > 0.85


@pytest.mark.parametrize("samples", [0.0, 10.0, 50.0])
def test_standard_errors_of_a_planar_arm_cover(samples: float) -> None:
    distance = []
    for seed in range(25):
        run = fourier(seed, 2, 20.0, 0.01).run(PLANAR, 0.1 * coloured(seed, (2000, 2), samples))
        fit = identify_robot([run], PLANAR, EVERYTHING)
        distance.append((fit.base.values - true_base(fit, PLANAR)) / fit.base.standard_errors)
    assert np.mean(np.abs(distance) < 2.0) >= 0.85
    # Not by standard errors that are far too large.
    assert np.median(np.abs(distance)) > 0.4


def test_keys_units_and_values_of_a_planar_arm_are_those_of_the_load_side() -> None:
    fit = identify_robot(
        [fourier(3, 2, 20.0, 0.002).run(PLANAR)], unknown(PLANAR), FRICTION | {ColumnGroup.DRIVE_INERTIA}
    )
    assert by_joint(fit, "viscous_friction")[0].value == pytest.approx(1.1e-4 * 3600.0, rel=1e-4)
    assert by_joint(fit, "coulomb_friction")[1].value == pytest.approx(0.03 * 60.0, rel=1e-4)
    assert by_joint(fit, "constant_force")[1].value == pytest.approx(-0.002 * 60.0, rel=1e-3)
    assert by_joint(fit, "drive_inertia")[0].value == pytest.approx(1.5e-5 * 3600.0, rel=1e-4)
    units = {item.key: item.unit for item in fit.identified.estimates}
    assert units == {
        "drive_inertia": "kg m2",
        "viscous_friction": "N m s/rad",
        "coulomb_friction": "N m",
        "constant_force": "N m",
    }
    assert {item.section for item in fit.identified.estimates} == {"machine"}


def test_noise_of_the_speed_and_quantised_positions_hardly_matter(tmp_path: Path) -> None:
    motion = fourier(4, 2, 20.0, 0.005)
    rng = np.random.default_rng(4)
    noisy = RobotRun(
        "noisy",
        0.0,
        motion.period,
        motion.run(PLANAR).torque + 0.05 * rng.normal(size=motion.speed.shape),
        np.round(motion.position / 1e-4) * 1e-4,
        motion.speed + 5e-3 * rng.normal(size=motion.speed.shape),
    )
    fit = identify_robot([noisy], PLANAR, EVERYTHING)
    other = fourier(5, 2, 10.0, 0.005).run(PLANAR)
    error = predicted_torque(fit, other) - other.torque
    assert np.sqrt(np.nanmean(error**2, axis=0)) == pytest.approx([0.0, 0.0], abs=0.05)
    assert [fit.left_out.error(joint) for joint in (0, 1)] == pytest.approx([0.03, 0.03], abs=0.03)


def one_joint_moves(motion: Motion, joint: int) -> Motion:
    still = np.arange(motion.position.shape[1]) != joint
    speed, acceleration = motion.speed.copy(), motion.acceleration.copy()
    position = motion.position.copy()
    position[:, still] = position[0, still]
    speed[:, still] = acceleration[:, still] = 0.0
    return Motion(motion.period, position, speed, acceleration)


def test_a_joint_at_rest_has_no_friction_and_its_machine_keeps_the_old_one() -> None:
    motion = one_joint_moves(fourier(7, 2, 20.0, 0.005), 0)
    fit = identify_robot([motion.run(PLANAR, 0.01 * coloured(1, (4000, 2), 0.0))], PLANAR)
    for key in ("viscous_friction", "coulomb_friction", "constant_force"):
        assert set(by_joint(fit, key)) == {0}
        assert refused(fit, key) == {1: (Missing.OTHER_MOTION,)}
    own = [i for i, column in enumerate(fit.columns) if column.joint == 1]
    np.testing.assert_allclose(fit.parameters[own], regressor_of(PLANAR).values[own], rtol=1e-12)
    assert np.isnan(fit.left_out.error(1))
    assert np.isnan(predicted_torque(fit, motion.run(PLANAR))[:, 1]).all()


def ramp(speeds: tuple[float, ...], seconds: float = 6.0, period: float = 0.005) -> list[Motion]:
    """Both joints at constant speeds."""
    time = period * np.arange(round(seconds / period))[:, np.newaxis] * np.ones(2)
    return [Motion(period, -1.0 + v * time, v * np.ones_like(time), np.zeros_like(time)) for v in speeds]


def runs_of(motions: list[Motion]) -> list[RobotRun]:
    return [
        motion.run(PLANAR, 0.05 * coloured(i, motion.position.shape, 5.0), f"run {i}")
        for i, motion in enumerate(motions)
    ]


def test_one_direction_leaves_coulomb_friction_and_offset_open() -> None:
    fit = identify_robot(runs_of(ramp((0.2, 0.5))), PLANAR)
    assert refused(fit, "coulomb_friction") == dict.fromkeys((0, 1), (Missing.REVERSALS,))
    assert refused(fit, "constant_force") == dict.fromkeys((0, 1), (Missing.REVERSALS,))
    assert set(by_joint(fit, "viscous_friction")) == {0, 1}


def test_other_machines_other_joints_and_no_motion_are_refused() -> None:
    with pytest.raises(UsageError, match="is no robot"):
        identify_robot([fourier(1, 2).run(PLANAR)], machine_of(GATE))  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="3 joints"):
        identify_robot([RobotRun("three", 0.0, 0.01, *np.zeros((3, 100, 3)))], PLANAR)
    with pytest.raises(IdentificationError, match="no joint moves"):
        identify_robot([RobotRun("rest", 0.0, 0.01, *np.zeros((3, 100, 2)))], PLANAR)


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> tuple[CoupledMachine, RobotRun, RobotRun, RobotRun]:
    pytest.importorskip("pinocchio")
    file = ur10e(tmp_path_factory.mktemp("ur10e"))
    names = ("no_torque.csv.gz", "link4.csv.gz", "ur-static.csv.gz")
    first, second, third = (ur10e_run(file, name) for name in names)
    machine = file.machine
    assert isinstance(machine, CoupledMachine)
    return machine, first, second, third


def test_five_seconds_of_the_ur10e_do_not_determine_its_base_parameters(arm) -> None:
    machine, learned, _, _ = arm
    fit = identify_robot([learned], machine, FRICTION | {ColumnGroup.INERTIAL})
    (found,) = [item for item in fit.identified.not_identifiable if item.key == "base_parameters"]
    assert Missing.OTHER_MOTION in found.missing
    assert found.numbers["not_determined"] > 0
    assert found.numbers["uncertain_torque_share"] > 0.3
    assert found.numbers["condition_number"] > 50.0


def test_friction_is_not_negative() -> None:
    frictionless = unknown(PLANAR)
    run = fourier(11, 2).run(frictionless, 0.2 * coloured(11, (4000, 2), 10.0))
    fit = identify_robot([run], PLANAR)
    estimates = [item for item in fit.identified.estimates if item.key != "constant_force"]
    assert estimates
    assert all(item.value >= 0.0 for item in estimates)
    assert any(item.value == 0.0 and item.standard_error > 0.0 for item in estimates)


def test_one_speed_leaves_viscous_and_coulomb_friction_open() -> None:
    fit = identify_robot(runs_of(ramp((0.4, -0.4))), PLANAR)
    assert refused(fit, "viscous_friction") == dict.fromkeys((0, 1), (Missing.SECOND_SPEED,))
    assert refused(fit, "coulomb_friction") == dict.fromkeys((0, 1), (Missing.SECOND_SPEED,))
    assert set(by_joint(fit, "constant_force")) == {0, 1}


def test_a_torque_of_the_wrong_sign_is_not_explained_by_negative_friction() -> None:
    run = fourier(12, 2).run(PLANAR, 0.02 * coloured(12, (4000, 2), 5.0))
    turned = replace(
        run, torque=2.0 * PLANAR.inverse_dynamics(run.position, run.speed, run.acceleration()) - run.torque
    )
    fit = identify_robot([turned], PLANAR)
    assert by_joint(fit, "coulomb_friction") == {}
    numbers = [item.numbers for item in fit.identified.not_identifiable if item.key == "coulomb_friction"]
    assert all(item["least_squares"] < 0.0 for item in numbers)
