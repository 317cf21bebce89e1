"""Unseen torque, friction and decisions of robots: the same numbers as in the identification; and the command."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdtool
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer
from cdtool.machines.planar_arm import PlanarArm
from tests.command import cdtool as command
from tests.commands.identify.robot_motion import ARM, TRUE, channels_of, coloured, files, fourier, ur10e, write_log
from tests.data_folder import UR10E_LOGS

ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> IdentifiedMachine:
    folder = tmp_path_factory.mktemp("arm")
    path = files(folder, TRUE, ARM, [fourier(seed, 2, 12.0, 0.01) for seed in (1, 2)])
    return cdtool.identify([str(folder / "run*.csv")], path)


def test_new_friction_is_decided_and_drawn_as_it_is(arm) -> None:
    for joint, item in enumerate(arm.joints):
        assert item.robot.answer is FrictionAnswer.NEW
        assert item.robot.after < 0.1 * item.robot.before
        assert item.units == ("kg m2", "N m", "rad", "N m s/rad")
        shown = item.evidence
        curve, model = shown.friction_curve, shown.friction - shown.residual
        truth = TRUE.viscous_friction[joint] * curve.abscissa
        truth = truth + TRUE.coulomb_friction[joint] * np.sign(curve.abscissa) + TRUE.constant_force[joint]
        fast = np.abs(curve.abscissa) > 0.2
        assert curve.mean[fast] == pytest.approx(truth[fast], abs=0.15)
        near = np.abs(shown.speed - 0.5) < 0.05
        assert np.mean(model[near]) == pytest.approx(
            0.5 * TRUE.viscous_friction[joint] + TRUE.coulomb_friction[joint] + TRUE.constant_force[joint], abs=0.1
        )
        # What the model leaves over is noise, along the travel in both directions.
        assert set(shown.position_curves) == {1, -1}
        assert np.sqrt(np.mean(shown.residual**2)) < 1.1 * item.robot.after


def test_a_joint_that_rests_has_nothing_but_its_need() -> None:
    folder = ROOT / "sample_logs" / "arm" / "trial_1"
    _, forearm = cdtool.identify([str(folder / "free" / "0[1-3].*")], folder / "machine.toml").joints
    assert forearm.robot is not None
    assert forearm.robot.answer is FrictionAnswer.NOT_MOVED
    assert math.isnan(forearm.robot.before)
    assert forearm.evidence is None
    # No speed is made up from the noise at rest.
    assert forearm.excitation is not None
    assert forearm.excitation.moving_time == 0.0
    assert not forearm.excitation.speeds


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, Any]]:
    """What the command prints and writes as JSON of the UR10e."""
    pytest.importorskip("pinocchio")
    folder = tmp_path_factory.mktemp("ur10e")
    ur10e(folder)
    done = command(
        "identify", UR10E_LOGS / "no_torque.csv.gz", "-m", folder / "machine.toml", "-o", folder / "ur10e.json"
    )
    assert done.status == 0, done.err
    return done.out, json.loads((folder / "ur10e.json").read_text(encoding="utf-8"))


def test_the_residuals_of_the_ur10e_are_those_that_chose_its_friction(
    real: tuple[str, dict[str, Any]],
) -> None:
    joints = real[1]["joints"]
    assert [joint["friction_decision"]["answer"] for joint in joints] == ["new", *["not_better"] * 3, "new", "new"]
    for joint in joints:
        # One run: what is shown is all of it.
        decision, unseen = joint["friction_decision"], joint["force_error_on_unseen_runs"]
        used = decision["after" if decision["answer"] == "new" else "before"]
        assert unseen["error"] == pytest.approx(used, rel=1e-6)
        assert unseen["error_of_worst_run"] == pytest.approx(used, rel=1e-6)
        assert decision["form"] in ("friction", "friction_alone")


def test_the_command_states_what_the_ur10e_does_not_show(real: tuple[str, dict[str, Any]]) -> None:
    out, values = real
    (line,) = [line for line in out.splitlines() if "full set of base parameters" in line]
    assert "is not identifiable from this motion: condition number 91" in line
    assert "of 36 not determined" in line
    assert out.count("old: not better by more than one standard error") == 3
    assert "errors do not contain how friction differs from day to day" in out
    assert values["joints"][2]["excitation"]["moving_time"] > 1.0


def loaded_arm(mass: float, along: float) -> PlanarArm:
    """The arm whose forearm and a point mass are one body."""
    total = 1.6 + mass
    centre = (1.6 * 0.18 + mass * along) / total
    inertia = 0.018 + 1.6 * (0.18 - centre) ** 2 + mass * (along - centre) ** 2
    return replace(TRUE, link_mass=(1.3, total), centre_of_mass=(0.14, centre), link_inertia=(0.012, inertia))


def currents(folder: Path) -> list[object]:
    """Logs of the arm with currents in A, without and with a payload; returns the command's arguments."""
    for name, machine, seed in (("free", TRUE, 1), ("loaded", loaded_arm(0.7, 0.25), 2)):
        run = fourier(seed, 2, 12.0, 0.01).run(machine, 0.02 * coloured(seed, (1200, 2), 5.0))
        write_log(folder / f"{name}.csv", replace(run, torque=run.torque / np.array([12.0, 8.0])))
    (folder / "machine.toml").write_text(ARM + channels_of(2, "[10.0, 10.0]"), encoding="utf-8")
    return ["identify", folder / "free.csv", "-m", folder / "machine.toml", "--loaded-logs", folder / "loaded.csv"]


def test_the_command_identifies_torque_constants(tmp_path: Path) -> None:
    arguments = [*currents(tmp_path), "--payload", "0.7kg@forearm:0.25,0,0"]
    outputs = ["-o", tmp_path / "new.toml", "-o", tmp_path / "new.html", "-o", tmp_path / "new.json"]
    done = command(*arguments, *outputs)
    assert done.status == 0, done.err
    assert "channels.torque.scale" in done.out
    values = tomllib.loads((tmp_path / "new.toml").read_text(encoding="utf-8"))
    assert values["channels"]["torque"]["scale"] == pytest.approx([12.0, 8.0], rel=0.03)
    shown = json.loads((tmp_path / "new.json").read_text(encoding="utf-8"))["joints"]
    # By the new constants the friction is that of the arm.
    assert values["machine"]["coulomb_friction"] == pytest.approx([2.4, 1.8], rel=0.05)
    assert all(joint["friction_decision"]["after"] < 0.2 for joint in shown)
