"""Wrong robot descriptions: one clear line, status 2, no traceback, and never a silent permutation of joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdtool.formats.mcap.write import Stream, write_mcap
from tests.command import cdtool
from tests.synthetic.robots import JOINTS, six_joint_urdf

pytest.importorskip("pinocchio")

TIME = np.arange(200) * 1e-2
VALUES = np.sin(TIME[:, np.newaxis] * np.arange(1.0, 7.0))
CHANNELS = """
[channels]
time = { column = "t", unit = "s" }
torque = { columns = [TAU], unit = "SI" }
speed = { columns = ["v0", "v1", "v2", "v3", "v4", "v5"], unit = "SI" }
position = { columns = ["q0", "q1", "q2", "q3", "q4", "q5"], unit = "SI" }
[channels.mcap]
torque = { topic = "/joint_states", field = "effort[:]" }
speed = { topic = "/joint_states", field = "velocity[:]" }
position = { topic = "/joint_states", field = "position[:]" }
"""
ALL = ", ".join(f'"f{i}"' for i in range(6))


@pytest.fixture
def log(tmp_path: Path) -> Path:
    names = [f"{letter}{i}" for letter in "fvq" for i in range(6)]
    table = np.column_stack((TIME, VALUES, np.gradient(VALUES, 1e-2, axis=0), VALUES))
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=",".join(["t", *names]), comments="")
    return tmp_path / "log.csv"


def described(folder: Path, urdf: str = "", joints=JOINTS, more: str = "", torque: str = ALL) -> Path:
    (folder / "six.urdf").write_text(urdf or six_joint_urdf())
    listed = ", ".join(f'"{name}"' for name in joints)
    head = f'[machine]\ntype = "urdf_robot"\nurdf = "six.urdf"\njoints = [{listed}]\n{more}'
    path = folder / "machine.toml"
    path.write_text(head + CHANNELS.replace("TAU", torque))
    return path


def refused(log: Path, machine: Path) -> str:
    done = cdtool("detect", log, "-m", machine, "-d", "gm", "--set=threshold.limits=10")
    assert done.status == 2 and "Traceback" not in done.err
    assert len(done.err.strip().splitlines()) == 1, done.err
    return done.err


def test_the_unchanged_robot_runs_without_its_meshes(log, tmp_path):
    done = cdtool("detect", log, "-m", described(tmp_path), "-d", "gm", "--set=threshold.limits=1e6")
    assert done.status == 0 and "no alarm" in done.out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"joints": ("pan", "lift", "elbo", "reach", "wrist", "tool")},
            ("'elbo'", "did you mean elbow", "joint_map"),
        ),
        ({"torque": '"f0", "f1", "f2"'}, ("channels.torque.columns: names 3 columns (give 6: one per joint)",)),
        ({"urdf": six_joint_urdf().replace('<mass value="4.0"/>', '<mass value="-4.0"/>')}, ("link3", "mass")),
        ({"urdf": "<robot name='x'><link"}, ("six.urdf",)),
        ({"more": "drive_inertias = 1.0\n"}, ("did you mean drive_inertia",)),
        ({"more": 'joint_map = { shoulder = "pan" }\n'}, ("machine.joint_map.shoulder: is not a joint of the log",)),
    ],
    ids=["joint", "columns", "mass", "broken XML", "key", "joint_map"],
)
def test_what_is_wrong_is_named_with_its_place(log, tmp_path, change, words):
    told = refused(log, described(tmp_path, **change))
    assert all(word in told for word in words), told


def test_an_absent_urdf_is_named(log, tmp_path):
    machine = described(tmp_path)
    (tmp_path / "six.urdf").unlink()
    assert "six.urdf" in refused(log, machine)


def test_joints_of_the_urdf_that_are_not_logged_must_be_locked(log, tmp_path):
    path = described(tmp_path, joints=JOINTS[:5])
    text = path.read_text()
    for column in (', "f5"', ', "v5"', ', "q5"'):
        text = text.replace(column, "")
    path.write_text(text)
    told = refused(log, path)
    assert "tool" in told and "locked" in told


def states(folder: Path, names: tuple[str, ...], order: list[int]) -> Path:
    speeds = np.gradient(VALUES, 1e-2, axis=0)
    columns = {"position": VALUES[:, order], "velocity": speeds[:, order], "effort": VALUES[:, order]}
    write_mcap(folder / "log.mcap", [Stream("/joint_states", "sensor_msgs/msg/JointState", TIME, columns, names)])
    return folder / "log.mcap"


def test_joints_in_another_order_in_the_messages_are_mapped_by_name(tmp_path):
    machine = described(tmp_path)
    straight = cdtool("info", states(tmp_path, JOINTS, [0, 1, 2, 3, 4, 5]), "-m", machine).out.splitlines()[1:]
    order = [5, 3, 1, 0, 2, 4]
    mixed = cdtool("info", states(tmp_path, tuple(JOINTS[i] for i in order), order), "-m", machine)
    assert mixed.status == 0 and mixed.out.splitlines()[1:] == straight


def test_joints_with_other_names_in_the_messages_are_an_error(tmp_path):
    told = refused(states(tmp_path, tuple(f"j{i}" for i in range(6)), list(range(6))), described(tmp_path))
    assert "name j0, j1" in told and "not 'pan' of machine.joints" in told and "joint_map" in told
