"""Robots with known parameters: recovered without noise, covered with noise, refused where the motion says nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.commands.identify.estimate import Estimate, IdentificationError, Missing
from cdtool.commands.identify.robot.friction_choice import FrictionForm, JointFriction, choose_friction
from cdtool.commands.identify.robot.robot_dynamics import FRICTION, RobotFit, identify_robot
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, regressor_of
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.planar_arm import PlanarArm
from tests.commands.identify.robot_motion import (
    Motion,
    coloured,
    fourier,
    panda,
    planar_arm,
    predicted_torque,
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


def test_other_machines_other_joints_and_no_motion_are_refused() -> None:
    with pytest.raises(UsageError, match="is no robot"):
        identify_robot([fourier(1, 2).run(PLANAR)], machine_of(GATE))  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="3 joints"):
        identify_robot([RobotRun("three", 0.0, 0.01, *np.zeros((3, 100, 3)))], PLANAR)
    with pytest.raises(IdentificationError, match="no joint moves"):
        identify_robot([RobotRun("rest", 0.0, 0.01, *np.zeros((3, 100, 2)))], PLANAR)


def test_friction_is_not_negative() -> None:
    frictionless = unknown(PLANAR)
    run = fourier(11, 2).run(frictionless, 0.2 * coloured(11, (4000, 2), 10.0))
    fit = identify_robot([run], PLANAR)
    estimates = [item for item in fit.identified.estimates if item.key != "constant_force"]
    assert estimates
    assert all(item.value >= 0.0 for item in estimates)
    assert any(item.value == 0.0 and item.standard_error > 0.0 for item in estimates)


ARM = planar_arm(coulomb_slope=50.0)
NOISE = 0.05


def runs_of(machine: PlanarArm, amplitude: float = 0.5, noise: float = NOISE) -> list[RobotRun]:
    motions = [fourier(seed, 2, 15.0, 0.01, amplitude) for seed in (1, 2, 3)]
    return [motion.run(machine, noise * coloured(seed, (1500, 2), 5.0)) for seed, motion in enumerate(motions)]


def frictionless(machine: PlanarArm) -> PlanarArm:
    return replace(machine, viscous_friction=(0.0, 0.0), coulomb_friction=(0.0, 0.0), constant_force=(0.0, 0.0))


def values_of(friction: JointFriction) -> dict[str, float]:
    return {item.key: item.value for item in friction.identified.estimates}


def test_a_missing_motor_inertia_is_found_and_one_from_a_data_sheet_is_kept() -> None:
    without = replace(ARM, motor_inertia=(0.0, 0.0))
    (first, _), _ = choose_friction(runs_of(ARM), without)
    assert first.form is FrictionForm.DRIVE_INERTIA
    assert values_of(first)["drive_inertia"] == pytest.approx(1.5e-5 * 3600.0, rel=0.1)
    wrong = replace(ARM, motor_inertia=(1e-5, 1e-5))
    assert {item.form for item in choose_friction(runs_of(ARM), wrong)[0]} <= {
        FrictionForm.FRICTION,
        FrictionForm.FRICTION_ALONE,
        FrictionForm.PREVIOUS,
    }


def test_viscous_friction_of_slow_motion_is_known_only_together_with_the_rest() -> None:
    slow = replace(ARM, viscous_friction=(1e-6, 1e-6))
    friction = choose_friction(runs_of(slow, 0.02, 0.3), frictionless(ARM))[0][0]
    assert "viscous_friction" not in values_of(friction)
    assert values_of(friction)["coulomb_friction"] == pytest.approx(2.4, rel=0.1)
    assert [item.key for item in friction.together] == ["viscous_friction"]
    (missing,) = friction.identified.not_identifiable
    assert missing.missing == (Missing.SECOND_SPEED,)
    assert missing.numbers["standard_error"] > 0.5 * missing.numbers["value"]
