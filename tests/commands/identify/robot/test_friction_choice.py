"""The friction of a joint is replaced only where the new one predicts better what it was not fitted to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.estimate import Missing
from cdtool.commands.identify.robot.friction_choice import FrictionForm, JointFriction, choose_friction
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.planar_arm import PlanarArm
from tests.commands.identify.robot_motion import Motion, coloured, fourier, planar_arm

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


def test_a_joint_that_rests_keeps_its_friction_and_has_no_errors() -> None:
    motion = fourier(1, 2, 15.0, 0.01)
    rests = np.zeros_like(motion.speed)
    rests[:, 0] = motion.speed[:, 0]
    position = motion.position.copy()
    position[:, 1] = 0.2
    acceleration = motion.acceleration * [1.0, 0.0]
    friction = choose_friction([Motion(0.01, position, rests, acceleration).run(ARM)], frictionless(ARM))[0][1]
    assert friction.form is FrictionForm.PREVIOUS
    assert np.isnan(friction.explained_share)
    assert set(friction.errors) == {FrictionForm.PREVIOUS}


def test_viscous_friction_of_slow_motion_is_known_only_together_with_the_rest() -> None:
    slow = replace(ARM, viscous_friction=(1e-6, 1e-6))
    friction = choose_friction(runs_of(slow, 0.02, 0.3), frictionless(ARM))[0][0]
    assert "viscous_friction" not in values_of(friction)
    assert values_of(friction)["coulomb_friction"] == pytest.approx(2.4, rel=0.1)
    assert [item.key for item in friction.together] == ["viscous_friction"]
    (missing,) = friction.identified.not_identifiable
    assert missing.missing == (Missing.SECOND_SPEED,)
    assert missing.numbers["standard_error"] > 0.5 * missing.numbers["value"]
