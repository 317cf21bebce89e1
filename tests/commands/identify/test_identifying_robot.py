"""`cdtool.identify` of robots and planar arms: from logs to the machine file and its URDF."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.base.files.strict_json import strict_json
from cdtool.commands.identify.estimate import IdentificationError, Missing
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.commands.identify.robot.consistent_inertia import is_consistent
from cdtool.commands.identify.robot.drive_gains import LoadedRuns
from cdtool.commands.identify.robot.friction_choice import FrictionForm
from cdtool.commands.identify.robot.robot_regressor import body_parameters, regressor_of, with_bodies
from cdtool.commands.identify.robot.robot_run import RobotRun, robot_run
from cdtool.commands.identify.robot.updated_urdf import updated_urdf
from cdtool.formats.machine_file import read_machine_file
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.urdf_reader import read_urdf
from cdtool.machines.urdf_robot import UrdfRobot
from tests.commands.identify.robot_motion import (
    ARM,
    PANDA_JOINTS,
    TRUE,
    Motion,
    coloured,
    files,
    fourier,
    panda,
    panda_urdf,
    ur10e,
    ur10e_run,
    write_log,
)
from tests.data_folder import UR10E_LOGS, data, needs_data

ROOT = Path(__file__).parents[3]


def test_missing_friction_of_a_planar_arm_is_found_and_its_drawing_stays(tmp_path: Path) -> None:
    path = files(tmp_path, TRUE, ARM, [fourier(seed, 2, 12.0, 0.01) for seed in (1, 2)])
    done = cdtool.identify([str(tmp_path / "run*.csv")], path, tmp_path / "identified.toml")
    values = tomllib.loads(Path(done.written).read_text(encoding="utf-8"))["machine"]
    assert values["viscous_friction"] == pytest.approx([0.4, 0.3], abs=0.05)
    assert values["coulomb_friction"] == pytest.approx([2.4, 1.8], abs=0.1)
    assert values["constant_force"] == pytest.approx([0.3, -0.1], abs=0.05)
    assert done.robot is not None
    assert done.robot.unexplained_share == 0.0
    for joint in done.joints:
        assert joint.robot is not None
        assert joint.robot.errors[joint.robot.form] < 0.1 * joint.robot.errors[FrictionForm.PREVIOUS]
    assert '"form": "' in strict_json(done.summary)


def test_wrong_links_of_a_planar_arm_show_in_its_base_parameters_and_stay(tmp_path: Path) -> None:
    wrong = ARM.replace("[0.14, 0.18]", "[0.10, 0.25]").replace("[0.012, 0.018]", "[0.05, 0.002]")
    path = files(tmp_path, TRUE, wrong, [fourier(seed, 2, 12.0, 0.01) for seed in (1, 2)])
    done = cdtool.identify([str(tmp_path / "run*.csv")], path, tmp_path / "identified.toml")
    assert done.robot is not None
    inertias = done.robot.inertias
    assert not inertias.is_new
    assert "only a URDF" in inertias.refused
    true = regressor_of(TRUE).values[:5]
    assert [name[:2] for name in inertias.base.names[:5]] == ["M1", "M2", "h", "g1", "g2"]
    assert (np.abs(inertias.base.values[:5] - true) < 4.0 * inertias.base.standard_errors[:5]).all()
    assert inertias.base.values[:5] == pytest.approx(true, rel=0.1)
    written = read_machine_file(done.written).machine
    assert isinstance(written, PlanarArm)
    assert written.centre_of_mass == (0.10, 0.25)


def test_one_direction_gives_friction_that_is_known_only_together(tmp_path: Path) -> None:
    time = 0.01 * np.arange(600)[:, np.newaxis] * np.ones(2)
    still = np.zeros_like(time)
    motions = [Motion(0.01, -1.0 + v * time, v * np.ones_like(time), still) for v in (0.2, 0.35, 0.5)]
    path = files(tmp_path, TRUE, ARM, motions)
    done = cdtool.identify([str(tmp_path / "run*.csv")], path)
    changes = {change.key: change for change in done.changes}
    assert set(changes) == {"viscous_friction", "coulomb_friction"}
    assert not any(change.is_known_alone for change in changes.values())
    # In this direction, Coulomb friction and constant force are one.
    assert changes["coulomb_friction"].values == pytest.approx((2.7, 1.7), abs=0.15)
    missing = {item.key: item.missing for item in done.joints[0].not_identifiable}
    assert missing["coulomb_friction"] == (Missing.REVERSALS,)


def test_friction_that_is_right_stays_and_nothing_is_written(tmp_path: Path) -> None:
    right = "viscous_friction = [0.4, 0.3]\ncoulomb_friction = [2.4, 1.8]\nconstant_force = [0.3, -0.1]\n"
    path = files(tmp_path, TRUE, ARM + right, [fourier(seed, 2, 12.0, 0.01) for seed in (1, 2)], noise=0.5)
    done = cdtool.identify([str(tmp_path / "run*.csv")], path, tmp_path / "identified.toml")
    assert [joint.robot.form for joint in done.joints if joint.robot] == [FrictionForm.PREVIOUS] * 2
    assert done.changes == ()
    assert done.written == ""
    assert not (tmp_path / "identified.toml").exists()


def test_contacts_that_no_channel_shows_are_left_out(tmp_path: Path) -> None:
    path = files(tmp_path, TRUE, ARM, [fourier(seed, 2, 12.0, 0.01) for seed in (1, 2)])
    run = fourier(3, 2, 12.0, 0.01).run(TRUE, 0.05 * coloured(3, (1200, 2), 5.0))
    torque = run.torque.copy()
    torque[500:530] += 30.0
    write_log(tmp_path / "run2.csv", replace(run, torque=torque))
    done = cdtool.identify([str(tmp_path / "run*.csv")], path)
    assert done.robot is not None
    assert 0.002 < done.robot.unexplained_share < 0.05
    changes = {change.key: change for change in done.changes}
    assert changes["coulomb_friction"].values == pytest.approx((2.4, 1.8), abs=0.1)


@pytest.mark.parametrize(
    ("wrong", "seen"), [("sign", "of arm: gives power"), ("order", "of arm: follows the motion of forearm")]
)
def test_channels_of_the_wrong_sign_or_order_give_one_line(tmp_path: Path, wrong: str, seen: str) -> None:
    path = files(tmp_path, TRUE, ARM, [fourier(1, 2, 12.0, 0.01)])
    run = fourier(1, 2, 12.0, 0.01).run(TRUE)
    torque = -run.torque if wrong == "sign" else run.torque[:, ::-1]
    write_log(tmp_path / "run0.csv", replace(run, torque=torque))
    with pytest.raises(IdentificationError, match=seen) as fault:
        cdtool.identify([tmp_path / "run0.csv"], path, tmp_path / "identified.toml")
    assert "\n" not in str(fault.value)
    assert not (tmp_path / "identified.toml").exists()


def test_a_log_at_rest_and_a_log_without_positions_give_one_line(tmp_path: Path) -> None:
    path = files(tmp_path, TRUE, ARM, [fourier(1, 2, 5.0, 0.01)])
    still = np.full((500, 2), 0.3)
    write_log(tmp_path / "rest.csv", RobotRun("rest", 0.0, 0.01, still, still, np.zeros((500, 2))))
    with pytest.raises(IdentificationError, match="no joint moves"):
        cdtool.identify([tmp_path / "rest.csv"], path)
    text = path.read_text(encoding="utf-8")
    path.write_text("".join(line for line in text.splitlines(True) if "position" not in line), encoding="utf-8")
    with pytest.raises(IdentificationError, match="no position"):
        cdtool.identify([tmp_path / "run0.csv"], path)


def test_a_payload_of_an_axis_or_of_an_unknown_link_is_refused(tmp_path: Path) -> None:
    gate = ROOT / "sample_logs" / "gate"
    with pytest.raises(UsageError, match="payload is given for an axis"):
        cdtool.identify([gate / "free" / "03.csv"], gate / "machine.toml", loaded=LoadedRuns(("x.csv",), 1.0))
    path = files(tmp_path, TRUE, ARM, [fourier(1, 2, 6.0, 0.01)])
    payload = LoadedRuns((tmp_path / "run0.csv",), 1.0, "hand")
    with pytest.raises(ConfigurationError, match="unknown link 'hand'"):
        cdtool.identify([tmp_path / "run0.csv"], path, loaded=payload)


PANDA = """[machine]
type = "urdf_robot"
urdf = "wrong.urdf"
joints = {joints}
locked = {{ panda_finger_joint1 = 0.0, panda_finger_joint2 = 0.0 }}
coulomb_slope = 50.0
"""


@pytest.fixture(scope="module")
def seven_joints(tmp_path_factory: pytest.TempPathFactory) -> tuple[IdentifiedMachine, Path, UrdfRobot]:
    """A robot of which the file has links that are 15 % too heavy, and no friction."""
    pytest.importorskip("pinocchio")
    pytest.importorskip("cvxpy")
    folder = tmp_path_factory.mktemp("seven")
    machine = panda(folder)
    heavy = with_bodies(machine.tree, 1.15 * np.array([body_parameters(joint) for joint in machine.tree.joints]))
    text = panda_urdf().read_text(encoding="utf-8")
    (folder / "wrong.urdf").write_text(updated_urdf(text, heavy), encoding="utf-8")
    joints = str(list(PANDA_JOINTS)).replace("'", '"')
    path = files(folder, machine, PANDA.format(joints=joints), [fourier(s, 7, 16.0, 0.01) for s in (1, 2)])
    (folder / "out").mkdir()
    done = cdtool.identify([str(folder / "run*.csv")], path, folder / "out" / "identified.toml")
    return done, folder, machine


def test_seven_joints_get_a_urdf_that_predicts_other_motion(seven_joints) -> None:
    done, folder, machine = seven_joints
    assert done.robot.inertias.is_new
    assert [joint.robot.form for joint in done.joints] == [FrictionForm.WITH_INERTIAS] * 7
    values = tomllib.loads((folder / "out" / "identified.toml").read_text(encoding="utf-8"))
    assert values["machine"]["urdf"] == "identified.urdf"
    new = read_machine_file(folder / "out" / "identified.toml").machine
    assert all(is_consistent(body_parameters(joint)) for joint in new.tree.joints)
    other = fourier(9, 7, 5.0, 0.01)
    motion = other.position, other.speed, other.acceleration
    wanted = machine.required_torque(*motion)
    old = read_machine_file(folder / "machine.toml").machine.required_torque(*motion)
    error = np.sqrt(np.mean((new.required_torque(*motion) - wanted) ** 2, axis=0))
    assert (error < 0.1 * np.sqrt(np.mean((old - wanted) ** 2, axis=0))).all()


def test_the_urdf_of_the_machine_is_kept_and_no_urdf_is_overwritten(seven_joints) -> None:
    done, folder, _ = seven_joints
    names = [path.name for path, _ in done.files_for(folder / "wrong.toml")]
    assert names == ["wrong.toml", "wrong_2.urdf"]
    assert "identified inertias; was wrong.urdf" in done.files_for(folder / "wrong.toml")[0][1]


def test_without_the_extra_the_friction_is_identified_and_one_line_names_the_extra(
    seven_joints, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, folder, _ = seven_joints

    def refuse(name: str) -> None:
        raise ImportError(name=name)

    monkeypatch.setattr("cdtool.commands.identify.robot.consistent_inertia.import_module", refuse)
    done = cdtool.identify([str(folder / "run*.csv")], folder / "machine.toml", tmp_path / "friction.toml")
    assert done.robot is not None
    assert done.robot.inertias is not None
    assert "pip install '.[identify]'" in done.robot.inertias.refused
    assert "\n" not in done.robot.inertias.refused
    assert any(joint.robot.form is FrictionForm.FRICTION for joint in done.joints if joint.robot)
    assert [path.name for path in tmp_path.iterdir()] == ["friction.toml"]
    # The URDF stays where it is, seen from the new file's folder.
    assert read_machine_file(tmp_path / "friction.toml").machine.joints == PANDA_JOINTS


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> tuple[IdentifiedMachine, Path]:
    pytest.importorskip("pinocchio")
    folder = tmp_path_factory.mktemp("ur10e")
    ur10e(folder)
    target = folder / "identified.toml"
    return cdtool.identify([UR10E_LOGS / "no_torque.csv.gz"], folder / "machine.toml", target), folder


def test_the_ur10e_is_predicted_at_least_as_well_as_by_the_published_friction(real) -> None:
    """Learned from no_torque.csv with its stop; chosen on it alone, checked on two other recordings."""
    _, folder = real
    old, new = (read_machine_file(folder / name) for name in ("machine.toml", "identified.toml"))
    # At rest the wrist's constant force is 0.012 N m further off, a fifth of its standard error.
    for name, worse in (("link4.csv.gz", 1e-3), ("ur-static.csv.gz", 0.08)):
        run = ur10e_run(old, name)
        motion = run.position, run.speed, run.acceleration()
        before, after = (
            np.sqrt(np.nanmean((run.torque - file.machine.required_torque(*motion)) ** 2, axis=0))
            for file in (old, new)
        )
        assert (after <= before * (1.0 + worse)).all()
        if name == "link4.csv.gz":
            assert after[0] < 0.9 * before[0]


def test_the_ur10e_keeps_its_inertias(real) -> None:
    done, _ = real
    (found,) = done.robot.inertias.not_identifiable
    assert found.key == "base_parameters"
    assert Missing.OTHER_MOTION in found.missing
    assert found.numbers["not_determined"] == 12.0
    assert done.joints[1].robot.form is FrictionForm.PREVIOUS


@needs_data("ur10e_motions/ur-20_02_05-20sec_12harm.csv", "ur10e_motions/ur-20_02_06-20sec_5harm.csv")
def test_the_ur10e_with_links_of_another_robot_gets_its_own_from_a_motion_of_all_joints(tmp_path: Path) -> None:
    """With links that are wrong by a factor of 0.5 to 2, those from one motion predict another one."""
    pytest.importorskip("cvxpy")
    ur10e(tmp_path)
    text = (UR10E_LOGS / "ur10e.urdf").read_text(encoding="utf-8")
    tree = read_urdf(UR10E_LOGS / "ur10e.urdf", tuple(f"joint{i}" for i in range(1, 7)), {})
    factors = np.array([1.0, 2.0, 0.5, 2.0, 0.5, 1.5])[:, np.newaxis]
    wrong = with_bodies(tree, factors * np.array([body_parameters(joint) for joint in tree.joints]))
    (tmp_path / "wrong.urdf").write_text(updated_urdf(text, wrong), encoding="utf-8")
    path = tmp_path / "machine.toml"
    path.write_text(re.sub('urdf = ".+"', 'urdf = "wrong.urdf"', path.read_text(encoding="utf-8")), encoding="utf-8")
    learned, other = (data(f"ur10e_motions/ur-20_02_0{name}harm.csv") for name in ("5-20sec_12", "6-20sec_5"))
    done = cdtool.identify([learned], path, tmp_path / "new.toml")
    assert done.robot is not None
    assert done.robot.inertias.is_new
    assert done.robot.inertias.residual_rise < 0.02
    run = robot_run(cdtool.read(other, path))
    motion = run.position, run.speed, run.acceleration()
    before, after = (
        np.sqrt(np.nanmean((run.torque - read_machine_file(file).machine.required_torque(*motion)) ** 2, axis=0))
        for file in (path, tmp_path / "new.toml")
    )
    assert (after < 1.1 * before).all()
    assert (after[1:4] < 0.75 * before[1:4]).all()
