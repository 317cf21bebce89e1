"""URDF -> tree: pinocchio's result for the same file is the reference, and every error is reported in one line."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.machines import urdf_reader
from cdtool.machines.urdf_reader import read_urdf
from tests.data_folder import UR10E_LOGS

needs_pinocchio = pytest.mark.skipif(find_spec("pinocchio") is None, reason="pinocchio is not installed (cdtool[urdf])")

BODY = (
    '<inertial><origin xyz="0.1 -0.05 0.2" rpy="0.3 0.1 -0.2"/><mass value="1.5"/>'
    '<inertia ixx="0.03" ixy="0.002" ixz="-0.001" iyy="0.02" iyz="0.003" izz="0.04"/></inertial>'
)


def link(name, inside=BODY):
    return f'<link name="{name}">{inside}</link>'


def joint(name, kind, parent, child, axis="0 0 1", origin='xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"', more=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin {origin}/>'
        f'<axis xyz="{axis}"/><limit lower="-9" upper="9" effort="1" velocity="1"/>{more}</joint>'
    )


def write(folder: Path, *parts: str, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.write_text(f'<?xml version="1.0"?>\n<robot name="robot">\n{chr(10).join(parts)}\n</robot>\n', encoding="utf-8")
    return path


def random_robot(folder: Path, seed: int, count: int) -> Path:
    """Joints of all kinds on skew axes, branching, with a fixed link between some of them."""
    rng = np.random.default_rng(seed)
    parts, carriers = [link("base")], ["base"]

    def text(values):
        return " ".join(f"{x:.17g}" for x in values)

    def placement():
        return f'xyz="{text(rng.normal(size=3) * 0.3)}" rpy="{text(rng.uniform(-3.0, 3.0, size=3))}"'

    for index in range(count):
        parent = carriers[-1] if rng.random() < 0.6 else str(rng.choice(carriers))
        kind = str(rng.choice(["revolute", "continuous", "prismatic"]))
        axis = (
            text(rng.normal(size=3)) if rng.random() < 0.6 else str(rng.choice(["1 0 0", "0 -1 0", "0 0 1", "0 0 -2"]))
        )
        parts += [link(f"link{index}"), joint(f"j{index}", kind, parent, f"link{index}", axis, placement())]
        carriers.append(f"link{index}")
        if rng.random() < 0.4:
            parts += [link(f"flange{index}"), joint(f"f{index}", "fixed", f"link{index}", f"flange{index}")]
            carriers.append(f"flange{index}")
    return write(folder, *parts)


def assert_as_in_pinocchio(path: Path, joints, locked=None, seed=0):
    """Every result of the tree against pinocchio's own model of the file, at random states."""
    pin = pytest.importorskip("pinocchio")
    locked = locked or {}
    tree, model = read_urdf(path, joints, locked), pin.buildModelFromUrdf(str(path))
    data, rng = model.createData(), np.random.default_rng(seed)
    position, speed = rng.normal(size=(8, len(joints))) * 2.0, rng.normal(size=(8, len(joints)))
    acceleration = rng.normal(size=(8, len(joints)))
    columns = [model.idx_vs[model.getJointId(name)] for name in joints]
    results = *tree.momentum_terms(position, speed), tree.inverse_dynamics(position, speed, acceleration)
    kinetic, potential = tree.energies(position, speed)
    jacobians = {item.name: tree.contact_jacobian(position, item.name, (0.1, -0.2, 0.3)) for item in tree.links}
    lowest = None
    for k in range(8):
        q, v, a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        for name, value in (*zip(joints, position[k], strict=True), *locked.items()):
            index = model.getJointId(name)
            place = [value] if model.nqs[index] == 1 else [np.cos(value), np.sin(value)]
            q[model.idx_qs[index] : model.idx_qs[index] + len(place)] = place
        v[columns], a[columns] = speed[k], acceleration[k]
        expected = (
            pin.crba(model, data, q) @ v,
            pin.computeCoriolisMatrix(model, data, q, v).T @ v,
            pin.computeGeneralizedGravity(model, data, q),
            pin.rnea(model, data, q, v, a),
        )
        size = max(np.linalg.norm(item[columns]) for item in expected)
        for found, wanted in zip(results, expected, strict=True):
            assert np.max(np.abs(found[k] - wanted[columns])) < 1e-12 * size
        assert kinetic[k] == pytest.approx(pin.computeKineticEnergy(model, data, q, v), rel=1e-11, abs=1e-12)
        # Where the locked joints' mass is fixed to the base, the two count from different heights.
        lifted = pin.computePotentialEnergy(model, data, q) - potential[k]
        lowest = lifted if lowest is None else lowest
        assert lifted == pytest.approx(lowest, abs=1e-10 * max(1.0, abs(lowest)))
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for name, jacobian in jacobians.items():
            frame = model.getFrameId(name, pin.FrameType.BODY)
            wanted = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED).reshape(6, -1)[:, columns]
            lever = data.oMf[frame].rotation @ np.array((0.1, -0.2, 0.3))
            wanted[:3] -= np.cross(lever, wanted[3:], axis=0)
            assert jacobian[k] == pytest.approx(wanted, abs=1e-11)


@needs_pinocchio
@pytest.mark.parametrize("seed", range(10))
def test_trees_of_all_kinds_of_joints_are_as_in_pinocchio_in_any_order_of_columns(tmp_path, seed):
    count = 6 + seed % 2
    order = [f"j{k}" for k in np.random.default_rng(seed).permutation(count)]
    assert_as_in_pinocchio(random_robot(tmp_path, seed, count), order)


@needs_pinocchio
def test_an_arm_with_identified_and_slightly_unphysical_inertias_is_as_in_pinocchio():
    assert_as_in_pinocchio(UR10E_LOGS / "ur10e.urdf", [f"joint{k}" for k in (1, 2, 3, 4, 5, 6)])


def robots() -> Path:
    """Where the package example-robot-data keeps its URDFs."""
    places = [Path(site) / "cmeel.prefix/share/example-robot-data/robots" for site in sys.path]
    return next((place for place in places if place.is_dir()), Path("absent"))


@needs_pinocchio
@pytest.mark.skipif(not robots().is_dir(), reason="example-robot-data is not installed")
def test_a_panda_and_a_ur10_without_their_meshes_are_as_in_pinocchio(tmp_path):
    fingers = {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.01}
    for robot, joints, locked in (
        ("panda_description/urdf/panda.urdf", [f"panda_joint{k}" for k in range(1, 8)], fingers),
        (
            "ur_description/urdf/ur10_robot.urdf",
            [
                "elbow_joint",
                "shoulder_lift_joint",
                "shoulder_pan_joint",
                "wrist_1_joint",
                "wrist_2_joint",
                "wrist_3_joint",
            ],
            {},
        ),
    ):
        path = tmp_path / "alone.urdf"
        path.write_bytes((robots() / robot).read_bytes())
        assert_as_in_pinocchio(path, joints, locked)


@needs_pinocchio
def test_a_massless_last_link_is_taken_where_a_drive_gives_it_inertia(tmp_path):
    path = write(tmp_path, link("base"), link("arm"), link("tip", ""), joint("j", "revolute", "base", "arm"), TIP)
    assert read_urdf(path, ["j", "tip"], {}, drive_inertia=(0.0, 0.1)).inertia_matrix(np.zeros((1, 2)))[0, 1, 1] == 0.1
    fault = refused(path, ["j", "tip"])
    assert "joint 'tip' moves no inertia" in fault.message
    assert "drive_inertia" in fault.hint


TIP = joint("tip", "revolute", "arm", "tip")
ARM = (link("base"), link("arm"), joint("j", "revolute", "base", "arm"))


def refused(path: Path, joints=("j",), locked=None) -> ConfigurationError:
    with pytest.raises(ConfigurationError) as caught:
        read_urdf(path, joints, locked or {})
    assert str(path) in caught.value.message
    assert "\n" not in str(caught.value)
    assert caught.value.hint
    return caught.value


def test_an_installed_pinocchio_that_cannot_be_loaded_is_reported_with_the_missing_library(tmp_path, monkeypatch):
    def refusing(name):
        raise ImportError("libgomp.so.1: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(urdf_reader, "import_module", refusing)
    fault = refused(write(tmp_path, *ARM))
    assert "cannot be loaded: libgomp.so.1" in fault.message and "libgomp1" in fault.hint


def test_without_pinocchio_the_extra_to_install_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    fault = refused(write(tmp_path, *ARM))
    assert "pinocchio, which is not installed" in fault.message
    assert fault.hint == "pip install '.[urdf]'"


def test_broken_xml_is_reported_with_line_and_column(tmp_path):
    path = tmp_path / "broken.urdf"
    path.write_text('<robot name="r">\n<link name="a"></robot>\n', encoding="utf-8")
    assert "broken XML in line 2, column 18: mismatched tag" in refused(path).message


@needs_pinocchio
def test_what_the_urdf_parser_finds_is_in_the_message_and_not_on_the_terminal(tmp_path, capfd):
    fault = refused(write(tmp_path, *ARM, link("island")))
    assert "Two root links found" in fault.message
    assert capfd.readouterr() == ("", "")


@needs_pinocchio
def test_an_inertia_matrix_that_is_not_positive_definite_is_refused(tmp_path):
    round_body = '<inertial><mass value="1"/><inertia ixx="1" ixy="{}" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    path = write(
        tmp_path,
        link("base"),
        link("arm", round_body.format(0)),
        link("tip", round_body.format(3)),
        joint("j", "revolute", "base", "arm", "1 0 0", 'xyz="0 0 0"'),
        joint("tip", "revolute", "arm", "tip", "0 1 0", 'xyz="0 0 0"'),
    )
    fault = refused(path, ["j", "tip"])
    assert "not positive definite" in fault.message
    assert "drive_inertia" in fault.hint


def test_another_kind_of_xml_is_no_urdf(tmp_path):
    path = tmp_path / "model.sdf"
    path.write_text("<sdf/>", encoding="utf-8")
    assert "its root is <sdf>" in refused(path).message


LINKS = (link("base"), link("arm"))
SLIDE = (link("tip"), TIP, link("end"), joint("slide", "prismatic", "tip", "end"))


def heavy(old: str, new: str) -> tuple[str, ...]:
    """The arm, one of the values of its body another."""
    return (link("base"), link("arm", BODY.replace(old, new)), ARM[2])


@pytest.mark.parametrize(
    ("parts", "joints", "locked", "message", "hint"),
    [
        (ARM, ["jj"], {}, "no moving joint 'jj'", "did you mean j?"),
        (ARM, ["jj"], {}, "no moving joint 'jj'", "joint_map"),
        (ARM, ["j", "j"], {}, "joint 'j' is given twice", ""),
        (ARM, ["j"], {"j": 0.0}, "joint 'j' is both logged and locked", ""),
        (ARM, ["j"], {"k": 0.0}, "no moving joint 'k' to lock", ""),
        (ARM, [], {"j": float("nan")}, "joint 'j' is locked at nan", ""),
        (ARM, [], {"j": 0.0}, "no joint is logged", ""),
        ((*ARM, *SLIDE), ["j"], {}, "neither logged nor locked: tip, slide", "locked = { tip = 0.0, slide = 0.0 }"),
        ((*LINKS, joint("j", "planar", "base", "arm")), ["j"], {}, "joint 'j': type 'planar' is not supported", ""),
        ((*LINKS, joint("j", "revolute", "base", "arm", "0 0 0")), ["j"], {}, "'j': its axis has the length 0", ""),
        (heavy('value="1.5"', 'value="${mass}"'), ["j"], {}, "link 'arm': <mass> value is '${mass}'", "xacro"),
        (heavy('value="1.5"', 'value="-1.5"'), ["j"], {}, "link 'arm': mass -1.5 kg is negative", ""),
        (heavy('ixx="0.03"', 'ixx="nan"'), ["j"], {}, "link 'arm': <inertia> ixx is 'nan'", ""),
        (heavy("0.1 -0.05 0.2", "0.1 inf 0.2"), ["j"], {}, "link 'arm': <origin> xyz is '0.1 inf 0.2'", ""),
    ],
)
def test_a_robot_that_cannot_be_is_one_line_with_the_next_step(tmp_path, parts, joints, locked, message, hint):
    fault = refused(write(tmp_path, *parts), joints, locked)
    assert message in fault.message and hint in fault.hint


def test_drive_inertias_that_are_not_one_per_joint_are_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="2 values of drive_inertia, 1 joints"):
        read_urdf(write(tmp_path, *ARM), ["j"], {}, drive_inertia=(1.0, 2.0))
