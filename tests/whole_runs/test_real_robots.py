"""Real robots with their models: the UR10e recordings with three and four contacts, and joint states of two arms."""

from __future__ import annotations

import json
import math
import re
import runpy
import shutil
import tomllib
from importlib.metadata import PackageNotFoundError, files
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.alarms.pipeline import run_detector
from cdtool.formats.machine_file import read_machine_file
from cdtool.recordings.operations import operations_of
from tests.data_folder import UR10E_LOGS, data, needs_data

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "ur10e_collisions.py"
DETECTORS = ("momentum", "kalman_momentum", "velocity", "direct", "energy")
UR10 = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
PANDA = tuple(f"panda_joint{k}" for k in range(1, 8))
# Length before the abrupt stop and the last contact [s].
CONTACT_FREE_END = {"no_torque": 5.0, "link4": 16.4, "ur-static": math.inf}

pytestmark = pytest.mark.skipif(find_spec("pinocchio") is None, reason="pinocchio is not installed (cdtool[urdf])")


def robot_urdf(name: str) -> Path | None:
    """Return a URDF of the package example-robot-data; None if it is not installed."""
    try:
        found = files("example-robot-data") or []
    except PackageNotFoundError:
        return None
    return next((Path(str(item.locate())) for item in found if item.as_posix().endswith(f"/robots/{name}")), None)


needs_robots = pytest.mark.skipif(
    robot_urdf("panda_description/urdf/panda.urdf") is None, reason="example-robot-data is not installed"
)


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(EXAMPLE))


@pytest.fixture(scope="module")
def arm():
    return UR10E_LOGS / "machine.toml"


def test_the_machine_file_has_the_published_parameters(arm):
    values = json.loads((UR10E_LOGS / "parameters.json").read_text(encoding="utf-8"))
    file, friction = tomllib.loads(arm.read_text(encoding="utf-8")), values["friction"]
    machine = file["machine"]
    assert (machine["joints"], machine["urdf"]) == (values["joints"], values["urdf"])
    assert machine["drive_inertia"] == values["drive_inertia"]["value"]
    assert machine["viscous_friction"] == friction["viscous"]["value"]
    assert machine["coulomb_friction"] == friction["coulomb"]["value"]
    assert machine["coulomb_slope"] == friction["tanh_slope"]["value"]
    assert machine["constant_force"] == friction["offset"]["value"]
    assert file["channels"]["torque"]["scale"] == values["torque_gain"]["value"]


def read(name, machine):
    return cdtool.read(UR10E_LOGS / f"{name}.csv.gz", machine)


def motion_of(recording):
    return recording["position"].values, recording["speed"].values, recording["torque"].values


def forward_euler_observer(time, net_force, momentum, gain):
    """The recursion on the data's web page: its residual is positive if a contact pushes the joint forward."""
    residual, total = np.zeros_like(momentum), momentum[0].copy()
    for k in range(1, len(time)):
        total = total + (time[k] - time[k - 1]) * (net_force[k] + residual[k - 1])
        residual[k] = gain * (momentum[k] - total)
    return residual


@pytest.mark.parametrize("name", ["no_torque", "link4", "ur-static"])
def test_the_reference_observer_of_the_data_follows_from_the_machines_terms(arm, name):
    import pinocchio as pin

    recording = read(name, arm)
    machine = read_machine_file(arm).machine
    position, speed, torque = motion_of(recording)
    values = json.loads((UR10E_LOGS / "parameters.json").read_text(encoding="utf-8"))
    part = {key: np.array(item["value"]) for key, item in values["friction"].items() if key not in ("formula", "sign")}
    model = pin.buildModelFromUrdf(str(UR10E_LOGS / "ur10e.urdf"))
    model.armature = np.array(values["drive_inertia"]["value"])
    model_data = model.createData()
    momentum, net_force = np.empty_like(speed), np.empty_like(speed)
    for k, (q, v, tau) in enumerate(zip(position, speed, torque, strict=True)):
        momentum[k] = pin.crba(model, model_data, q) @ v
        coriolis = pin.computeCoriolisMatrix(model, model_data, q, v)
        friction = part["viscous"] * v + part["coulomb"] * np.tanh(part["tanh_slope"] * v) + part["offset"]
        net_force[k] = tau + coriolis.T @ v - pin.computeGeneralizedGravity(model, model_data, q) - friction

    ours, velocity_force, gravity = machine.momentum_terms(position, speed)
    assert momentum == pytest.approx(ours, abs=1e-9)
    ours_net = torque + velocity_force - gravity - machine.friction(speed)
    gain = 0.3 * np.array([90, 50, 50, 90, 90, 40])
    time = recording["speed"].time
    reference = forward_euler_observer(time, net_force, momentum, gain)
    assert np.abs(reference).max() > 15.0
    assert forward_euler_observer(time, ours_net, ours, gain) == pytest.approx(reference, abs=1e-9)


@pytest.mark.parametrize("name", ["no_torque", "link4", "ur-static"])
@pytest.mark.parametrize(("gain", "share"), [(20.0, 0.1), (2.0, 0.04), ((27.0, 15.0, 15.0, 27.0, 27.0, 12.0), 0.12)])
def test_the_momentum_residual_is_the_reference_observers_with_the_sign_turned(arm, name, gain, share):
    """They differ only by the sampling, forward Euler versus the exact step; the difference decreases with K T."""
    recording = read(name, arm)
    machine_file = read_machine_file(arm)
    machine = machine_file.machine
    position, speed, torque = motion_of(recording)
    momentum, velocity_force, gravity = machine.momentum_terms(position, speed)
    net_force = torque + velocity_force - gravity - machine.friction(speed)
    time = recording["speed"].time
    reference = forward_euler_observer(time, net_force, momentum, np.array(gain))
    residual = type(machine_file.detector("momentum"))(bandwidth=gain).signal(recording, machine).values
    before_the_stop = time - time[0] < CONTACT_FREE_END[name]
    difference = (residual + reference)[before_the_stop]
    assert np.sqrt(np.mean(difference**2)) < share * np.sqrt(np.mean(reference[before_the_stop] ** 2))


def test_at_rest_model_and_currents_agree_for_the_shoulder(arm):
    position, _, torque = motion_of(read("ur-static", arm))
    gravity = read_machine_file(arm).machine.gravity(position).mean(axis=0)
    assert gravity[1] == pytest.approx(-44.5, abs=0.05)
    assert torque.mean(axis=0)[1] == pytest.approx(-44.1, abs=0.05)


def test_joints_named_in_another_order_with_their_columns_give_the_same_residual(arm, tmp_path):
    order = [3, 0, 5, 1, 4, 2]

    def reordered(listed: re.Match[str]) -> str:
        items = listed[1].split(", ")
        return f"[{', '.join(items[k] for k in order)}]"

    shutil.copy(UR10E_LOGS / "ur10e.urdf", tmp_path)
    text = re.sub(r"\[([^\[\]]+(?:, [^\[\]]+){5})\]", reordered, arm.read_text(encoding="utf-8"))
    (tmp_path / "turned.toml").write_text(text, encoding="utf-8")
    plain, turned = read_machine_file(arm), read_machine_file(tmp_path / "turned.toml")
    assert turned.machine.joints == tuple(plain.machine.joints[k] for k in order)
    for name in ("momentum", "direct"):
        signals = [f.detector(name).signal(read("link4", f), f.machine).values for f in (plain, turned)]
        assert signals[1] == pytest.approx(signals[0][:, order], abs=1e-9)


@pytest.fixture(scope="module")
def judged(example):
    """The results of the example: each detector on no_torque, link4 and ur-static."""
    return example["run"](UR10E_LOGS, example["DETECTORS"], factor=5.5, block=0.5)


@pytest.mark.parametrize("name", ["momentum", "kalman_momentum", "velocity", "direct"])
def test_every_contact_of_the_arm_is_found_with_limits_from_five_seconds_without_one(judged, example, name):
    _, moving, resting = judged[name]
    assert (len(moving.matching.matches), len(resting.matching.matches)) == (3, 4)
    for item, log in ((moving, "link4.csv.gz"), (resting, "ur-static.csv.gz")):
        for match, (start, end) in zip(item.matching.matches, example["WINDOWS"][log], strict=True):
            assert match.outcome == "detected"
            assert start - 0.11 <= match.alarm.time - item.recording.start <= end
            assert match.alarm.joint == "joint3"


@pytest.mark.parametrize(
    ("name", "count"), [("momentum", 1), ("kalman_momentum", 1), ("velocity", 3), ("direct", 0), ("energy", 0)]
)
def test_false_alarms_come_only_from_a_wrist_that_stands_still(judged, name, count):
    """At rest, dry friction takes any value up to Coulomb's, and the learned runs contain no rest."""
    quiet, moving, resting = judged[name]
    assert not quiet.detection.verdict.alarms and not resting.matching.false_alarms
    false = moving.matching.false_alarms
    assert len(false) == count
    speed = moving.recording["speed"]
    for alarm in false:
        assert alarm.joint == "joint6"
        assert abs(speed.values[np.searchsorted(speed.time, alarm.time), alarm.column]) < 1e-3


def test_the_energy_observer_misses_slow_contacts_and_is_not_assessable_at_rest(judged):
    _, moving, resting = judged["energy"]
    assert [match.outcome for match in moving.matching.matches] == ["missed"] * 3
    assert [match.outcome for match in resting.matching.matches] == ["not_assessable"] * 4
    assert resting.detection.statistic.valid.mean() < 0.01


def test_the_table_of_the_page_matches_the_example(judged):
    text = (EXAMPLE.parents[1] / "real-recordings.md").read_text(encoding="utf-8")
    for name, (_, moving, resting) in judged.items():
        row_of = rf"^\| `{name}` \| (.*) (?:N m|W) \| (.*) \| (.*) \| (\d) \| (\d+) % \|$"
        (row,) = re.findall(row_of, text, re.MULTILINE)
        limits, late, pushes, false, not_assessable = row
        assert [float(value) for value in limits.split(", ")] == moving.detection.band.upper[0].tolist()
        alarms = [match.alarm for match in moving.matching.matches if match.alarm]
        starts = [match.contact.start for match in moving.matching.matches]
        found = ", ".join(f"{alarm.time - start:.2f}" for alarm, start in zip(alarms, starts, strict=False))
        assert late == (found or "missed, all three")
        detected = sum(match.outcome == "detected" for match in resting.matching.matches)
        assert pushes == (f"{detected} of 4" if detected else "none")
        assert int(false) == len(moving.matching.false_alarms)
        assert int(not_assessable) == round(100.0 * (1.0 - resting.detection.statistic.valid.mean()))


def test_smaller_limits_bring_false_alarms_and_larger_ones_miss_contacts(example, arm):
    machine = read_machine_file(arm)
    detector = machine.detector("momentum")
    recordings = {name: example["load"](UR10E_LOGS, name, machine) for name in example["RECORDINGS"]}
    counts = []
    for factor in (3.0, 4.0, 5.5, 8.0):
        limit = example["learn_limit"](recordings["no_torque.csv.gz"], machine, detector, factor, 0.5)
        found = [example["judge"](item, name, machine, detector, limit) for name, item in recordings.items()]
        missed = sum(match.outcome == "missed" for item in found for match in item.matching.matches)
        counts.append((missed, sum(len(item.matching.false_alarms) for item in found)))
    assert counts == [(0, 5), (0, 3), (0, 1), (3, 0)]


def machine_text(urdf: Path, joints: dict[str, str], extra: str = "") -> str:
    """A machine file for joint states: the log's names, each mapped to its name in the URDF."""
    names = "\n".join(f'{mine} = "{theirs}"' for mine, theirs in joints.items())
    fields = {"position": "position[:]", "speed": "velocity[:]", "torque": "effort[:]"}
    channels = "\n".join(f'{key} = {{ topic = "/joint_states", field = "{field}" }}' for key, field in fields.items())
    return (
        f'[machine]\ntype = "urdf_robot"\nurdf = "{urdf.as_posix()}"\njoints = {json.dumps(list(joints))}\n'
        f"coulomb_slope = 50.0\n{extra}\n[machine.joint_map]\n{names}\n[channels.mcap]\n{channels}\n"
    )


def joint_states(name: str, folder: Path):
    """The machine file and the recording of an arm's log, in which a Panda's joints are fer_joint1 to 7."""
    if name == "ur10":
        text = machine_text(robot_urdf("ur_description/urdf/ur10_robot.urdf"), {joint: joint for joint in UR10})
    else:
        locked = "locked = { panda_finger_joint1 = 0.0, panda_finger_joint2 = 0.0 }"
        renamed = {joint.replace("panda", "fer"): joint for joint in PANDA}
        text = machine_text(robot_urdf("panda_description/urdf/panda.urdf"), renamed, locked)
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path, cdtool.read(data("mcap_samples") / f"{name}_joint_states.mcap", path)


def friction_of(rest, speed):
    """Return the viscous, Coulomb (slope 50 s/rad) and constant friction of each joint that best explain a torque."""
    found = []
    for j in range(speed.shape[1]):
        terms = np.column_stack((speed[:, j], np.tanh(50.0 * speed[:, j]), np.ones(len(speed))))
        found.append(np.linalg.lstsq(terms, rest[:, j], rcond=None)[0])
    return np.array(found).T


@needs_robots
@needs_data("mcap_samples/ur10_joint_states.mcap")
@pytest.mark.parametrize(
    ("name", "explained", "least"), [("ur10", [0, 1, 2], [0.97, 0.98, 0.98]), ("panda", [1, 2, 3], [0.99, 0.97, 0.91])]
)
def test_inverse_dynamics_and_fitted_friction_explain_nearly_all_of_the_effort(name, explained, least, tmp_path):
    path, recording = joint_states(name, tmp_path)
    position, speed, effort = motion_of(recording)
    acceleration = np.gradient(speed, recording["speed"].time, axis=0)
    rest = effort - read_machine_file(path).machine.inverse_dynamics(position, speed, acceleration)
    viscous, coulomb, offset = friction_of(rest, speed)
    left = rest - viscous * speed - coulomb * np.tanh(50.0 * speed) - offset
    share = 1.0 - left.var(axis=0) / effort.var(axis=0)
    assert np.all(share[explained] > least), share


@needs_robots
@needs_data("mcap_samples/ur10_joint_states.mcap")
@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_every_detector_runs_on_joint_states_of_a_real_arm(name, detector, tmp_path):
    path, recording = joint_states(name, tmp_path)
    machine_file = read_machine_file(path)
    signal = run_detector(operations_of(recording)[0], machine_file.machine, machine_file.detector(detector))
    assert signal.valid.mean() > 0.5
    assert np.all(np.isfinite(signal.values[signal.valid]))
    assert signal.joints == (("whole machine",) if detector == "energy" else recording.joints)
    if detector != "energy":
        effort = recording["torque"].values
        weighty = int(np.argmax(np.mean(effort**2, axis=0)))
        left = signal.values[signal.valid[:, weighty], weighty]
        assert np.sqrt(np.mean(left**2)) < 0.4 * np.sqrt(np.mean(effort[:, weighty] ** 2))
