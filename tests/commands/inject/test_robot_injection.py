"""[inject] of a robot: from URDF and logs to results, both brackets, the map, bad input, and without pinocchio."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.formats.csv import write_csv
from tests.command import cdtool as command
from tests.synthetic.robot_motion import robot_recording
from tests.synthetic.robots import JOINTS, six_joint_robot, six_joint_urdf

TRAVEL = np.array([0.8, 0.5, -0.4, 0.2, 0.6, -0.5])
COLUMNS = {"torque": "tau", "speed": "v", "position": "q"}


def columns(prefix: str) -> str:
    return ", ".join(f'"{prefix}_{joint}"' for joint in JOINTS)


MACHINE = f"""[machine]
type = "urdf_robot"
name = "six"
urdf = "six.urdf"
joints = [{", ".join(f'"{joint}"' for joint in JOINTS)}]
drive_inertia = 0.3
viscous_friction = 2.0
coulomb_friction = 1.0
coulomb_slope = 50.0

[channels]
time = {{ column = "t", unit = "s" }}
torque = {{ columns = [{columns("tau")}], unit = "SI" }}
speed = {{ columns = [{columns("v")}], unit = "SI" }}
position = {{ columns = [{columns("q")}], unit = "SI" }}

[model.drive]
rigid = true
"""
BENCHMARK = """machine = "machine.toml"
detectors = ["gm", "pt"]
[learn]
logs = ["free/*.csv"]
[signature]
force = true
"""
INJECT = """[inject]
logs = ["holdout/*.csv"]
positions = ["lift = 0.25rad"]
link = "link6"
point = [0.0, 0.0, 0.1]
duration_s = 0.4
[inject.obstacles.stiff]
stiffness_n_per_mm = 75
"""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Small logs of the six-joint robot."""
    folder = tmp_path_factory.mktemp("six")
    robot = six_joint_robot(folder)
    for group, count in (("free", 4), ("holdout", 1)):
        (folder / group).mkdir()
        for number in range(count):
            recording = robot_recording(robot, TRAVEL, period=4e-3, noise=0.3, seed=10 * number + len(group))
            table = {"t": recording["position"].time}
            for channel, name in COLUMNS.items():
                table |= {f"{name}_{joint}": recording[channel].values[:, i] for i, joint in enumerate(JOINTS)}
            write_csv(folder / group / f"{number}.csv", table, dict.fromkeys(table, "%.6f"))
    return folder


@pytest.fixture
def six(tmp_path: Path, logs: Path) -> Path:
    for group in ("free", "holdout"):
        (tmp_path / group).symlink_to(logs / group)
    (tmp_path / "six.urdf").write_text(six_joint_urdf(), encoding="utf-8")
    (tmp_path / "machine.toml").write_text(MACHINE, encoding="utf-8")
    return tmp_path


def write(folder: Path, text: str = INJECT) -> Path:
    path = folder / "case.toml"
    path.write_text(BENCHMARK + text, encoding="utf-8")
    return path


def test_both_brackets_are_scored_and_pure_torque_is_refused(six: Path) -> None:
    done = command("benchmark", write(six), "--json")
    assert done.status in (0, 3)
    results = cdtool.benchmark(six / "case.toml").results
    outcomes = {(row.group, row.detector): row.outcome for row in results.contacts}
    assert outcomes == {
        ("injected_stiff_frozen", "momentum"): "detected",
        ("injected_stiff_stiff", "momentum"): "detected",
    }
    assert any(item.recording == "pure_torque" and "controller" in item.reason for item in results.skipped)


def test_the_folder_is_a_benchmark_of_its_own_with_all_joints_changed(six: Path) -> None:
    done = command("inject", write(six), "-o", six / "out")
    assert done.status == 0
    cases = json.loads((six / "out" / "injected.json").read_text(encoding="utf-8"))["cases"]
    assert [case["assumption"] for case in cases] == ["frozen", "stiff"]
    assert all(case["position"] == "lift = 0.25 rad" for case in cases)
    assert all({"rigid_drive", "controller_unknown"} <= set(case["doubts"]) for case in cases)
    recording = cdtool.read(six / "out" / cases[1]["file"], six / "out" / "machine.toml")
    free = cdtool.read(six / "holdout" / "0.csv", six / "machine.toml")
    count = len(recording["torque"])
    added = recording["torque"].values - free["torque"].values[:count]
    before = recording["torque"].time <= cases[1]["start"]
    np.testing.assert_allclose(added[before], 0.0, atol=1e-9)
    assert np.all(np.max(np.abs(added[~before]), axis=0) > 0.5)
    lift = np.interp(cases[1]["start"], free["position"].time, free["position"].values[:, 1])
    assert lift == pytest.approx(0.25, abs=0.003)
    assert command("benchmark", six / "out" / "benchmark.toml").status in (0, 3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('link = "link6"\n', "", "inject.link: is missing"),
        ('link = "link6"', "link = -1", "whole number of at least 0"),
        ("point = [0.0, 0.0, 0.1]\n", "", "inject.point"),
        ("duration_s", "direction = [0, 0, 0]\nduration_s", "has the length 0"),
        ("duration_s", 'direction = "up"\nduration_s', "motion"),
        ("duration_s", 'joint = "lift"\nduration_s', "applies to axes only"),
        ("lift = 0.25rad", "lifd = 0.25rad", "did you mean lift"),
        ("lift = 0.25rad", "lift = rad", "give a joint and its position"),
        ('"lift = 0.25rad"', '"lift = 0.25rad", "pan = 0.25rad"', "different joints"),
    ],
)
def test_a_wrong_section_names_its_key(six: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(ConfigurationError) as fault:
        read_benchmark_file(write(six, INJECT.replace(old, new)))
    assert message in str(fault.value)


def test_without_pinocchio_one_line_names_the_extra(six: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    with pytest.raises(ConfigurationError, match=r"\.\[urdf\]") as fault:
        cdtool.inject(write(six), six / "out")
    assert "\n" not in str(fault.value)
