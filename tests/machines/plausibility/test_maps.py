"""Wrong maps of real and simulated machines: none agrees where it is wrong, and right maps contradict nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.findings import Finding
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.plausibility import check_channels
from cdtool.recordings.recording import Recording, Series
from tests.data_folder import DATA

ROOT = Path(__file__).parents[3]
JOINTS = ("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3")
ARM = f"""
[machine]
type = "rotary_axis"
name = "arm"
joints = {list(JOINTS)}
coordinates = "load"
load_inertia = {[0.0] * 6}
"""
MAPS = {
    "ur3": """
[channels.mcap]
position = { topic = "/arm", field = "position[:]" }
speed = { topic = "/arm", field = "velocity[:]" }
torque = { topic = "/arm", field = "effort[:]", scale = -1.0 }
""",
    "ur10e_motions": """
[channels]
time = { column = 0, unit = "s" }
position = { columns = [1, 2, 3, 4, 5, 6], unit = "rad" }
speed = { columns = [7, 8, 9, 10, 11, 12], unit = "rad/s" }
torque = { columns = [13, 14, 15, 16, 17, 18], unit = "A", scale = 1.0 }
""",
}
LOGS = {"ur3": "ur3/*.bag", "ur10e_motions": "ur10e_motions/*sec*.csv", "emps": "emps/DATA_EMPS.mat"}
SENSORS = {"torque", "speed", "position"}
# What each machine has.
MACHINES = {
    "gate": {*SENSORS, "acceleration", "force"},
    "arm/trial_1": {*SENSORS, "acceleration", "force", "joints"},
    "arm/trial_2": {*SENSORS, "acceleration", "force", "joints"},
    "ur3": {*SENSORS, "joints"},
    "ur10e_motions": {*SENSORS, "joints"},
    "emps": SENSORS - {"speed"},
}


@pytest.fixture(scope="module")
def machine(tmp_path_factory) -> Callable[[str], tuple[MachineFile, list[Recording]]]:
    """Return a function: machine file and impact-free logs on the load side, of a machine with the right map."""

    @cache
    def read(name: str) -> tuple[MachineFile, list[Recording]]:
        if name in LOGS:
            logs = sorted(DATA.glob(LOGS[name])) if DATA is not None else []
            if not logs:
                pytest.skip(f"{LOGS[name]} is not in CDTOOL_DATA")
            file = ROOT / "docs" / "examples" / "emps.toml"
            if name in MAPS:
                file = tmp_path_factory.mktemp(name) / "machine.toml"
                file.write_text(ARM + MAPS[name], encoding="utf-8")
        else:
            file = ROOT / "sample_logs" / name / "machine.toml"
            logs = sorted((file.parent / "free").iterdir())
        known = read_machine_file(file)
        return known, [cdtool.read(log, known) for log in logs]

    return read


def channel(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recording], Recording]:
    """Return a map with a channel whose values (n, J) are changed."""

    def changed(recording: Recording) -> Recording:
        series = recording[name]
        values = Series(series.time, change(series.values), series.unit)
        return replace(recording, channels={**recording.channels, name: values})

    return changed


def instead(name: str, source: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recording], Recording]:
    """Return a map with values of another channel in the place of one."""

    def changed(recording: Recording) -> Recording:
        series, joints = recording[source], len(recording.joints)
        values = np.repeat(change(series.values), joints // series.joint_count, axis=1)
        return replace(recording, channels={**recording.channels, name: Series(series.time, values, "N")})

    return changed


def slower(recording: Recording) -> Recording:
    """Return a map whose clock is a row number, ten rows per second, read as ms."""
    channels = {name: Series(10.0 * item.time, item.values, item.unit) for name, item in recording.channels.items()}
    return replace(recording, channels=channels)


def tool(position: np.ndarray) -> np.ndarray:
    return 0.6 * np.cos(2.0 * position + 0.3)


def ahead(speed: np.ndarray) -> np.ndarray:
    return np.roll(speed, -5, axis=0)


# Each wrong map: the channel that is wrong, how, and what it needs.
WRONG = {
    "torque with the wrong sign": ("torque", channel("torque", np.negative), "torque"),
    "speed with the wrong sign": ("speed", channel("speed", np.negative), "position"),
    "acceleration with the wrong sign": ("acceleration", channel("acceleration", np.negative), "acceleration"),
    "deg for rad": ("speed", channel("speed", np.rad2deg), "position"),
    "mm for m": ("speed", channel("position", lambda values: 1e3 * values), "position"),
    "position for torque": ("torque", instead("torque", "position", np.positive), "position"),
    "tool for torque": ("torque", instead("torque", "position", tool), "position"),
    "speed for torque": ("torque", instead("torque", "speed", np.positive), "speed"),
    "set speed for torque": ("torque", instead("torque", "speed", ahead), "speed"),
    "load cell for drive": ("torque", instead("torque", "force", np.positive), "force"),
    "tool for position": ("speed", channel("position", tool), "position"),
    "current of another joint": ("torque", channel("torque", lambda values: np.roll(values, 1, axis=1)), "joints"),
    "swapped joints": ("speed", channel("speed", lambda values: np.roll(values, 1, axis=1)), "joints"),
    "row number for time": ("speed", slower, "position"),
}
# Those that are certain to be found, where the machine's motion shows what is wrong.
FOUND = {
    "gate": {*WRONG} - {"set speed for torque", "load cell for drive", "current of another joint", "swapped joints",
                        "tool for position"},
    "arm": {"speed with the wrong sign", "acceleration with the wrong sign", "deg for rad", "mm for m",
            "position for torque", "tool for torque", "speed for torque", "row number for time"},
    "emps": {"torque with the wrong sign", "position for torque", "tool for torque", "speed for torque"},
    "ur3": {"torque with the wrong sign", "speed with the wrong sign", "deg for rad", "mm for m", "position for torque",
            "speed for torque", "tool for position", "current of another joint", "swapped joints",
            "row number for time"},
}  # fmt: skip
FOUND["ur10e_motions"] = FOUND["ur3"]


def checks(recordings: list[Recording], machine_file: MachineFile) -> list[Finding]:
    return list(check_channels(recordings, machine_file.machine))


@pytest.mark.parametrize("name", MACHINES)
def test_the_right_map_contradicts_nothing_and_shows_the_friction_of_what_moves_both_ways(machine, name):
    machine_file, recordings = machine(name)
    found = checks(recordings, machine_file)
    assert not [item for item in found if item.numbers["answer"] == "contradicts"]
    shown = [item for item in found if item.numbers["check"] == "friction" and item.numbers["answer"] == "agrees"]
    assert len(shown) == (0 if "arm" in name else len(machine_file.machine.joints))


@pytest.mark.parametrize(
    ("name", "wrong"), [(name, wrong) for name, has in MACHINES.items() for wrong in WRONG if WRONG[wrong][2] in has]
)
def test_a_wrong_map_is_found_or_not_checked_and_never_agrees(machine, name, wrong):
    machine_file, recordings = machine(name)
    of, change, _ = WRONG[wrong]
    found = checks([change(item) for item in recordings], machine_file)
    agreed = [item for item in found if item.channel == of and item.numbers["answer"] == "agrees"]
    contradicted = {item.channel for item in found if item.numbers["answer"] == "contradicts"}
    assert not agreed
    if wrong in FOUND[name.split("/")[0]]:
        assert contradicted == {of}


@pytest.mark.parametrize("factor", [0.1, 10.0])
@pytest.mark.parametrize("name", ["gate", "emps"])
def test_a_mass_or_scale_that_is_wrong_by_ten_is_found_by_the_starts(machine, name, factor):
    machine_file, recordings = machine(name)
    change = channel("torque", lambda values: factor * values)
    found = checks([change(item) for item in recordings], machine_file)
    (wrong,) = [item for item in found if item.numbers["answer"] == "contradicts"]
    assert (wrong.channel, wrong.numbers["found"]) == ("torque", "inertia")
    assert wrong.numbers["value"] / wrong.numbers["expected"] == pytest.approx(factor, rel=0.3)


@pytest.mark.parametrize("log", ["link4", "no_torque", "ur-static"])
def test_a_real_robot_that_is_pushed_hardly_moves_or_holds_a_pose_contradicts_nothing(log):
    machine_file = read_machine_file(ROOT / "sample_logs" / "ur10e" / "machine.toml")
    found = checks([cdtool.read(ROOT / "sample_logs" / "ur10e" / f"{log}.csv.gz", machine_file)], machine_file)
    assert not [item for item in found if item.numbers["answer"] == "contradicts"]


@pytest.mark.parametrize("name", ["ur3", "ur10e_motions"])
@pytest.mark.parametrize("joint", ["Base", "Wrist 1", "Wrist 2", "Wrist 3"])
def test_the_wrong_sign_of_one_joint_is_found_by_what_grows_with_its_speed(machine, name, joint):
    machine_file, recordings = machine(name)
    signs = [-1.0 if other == joint else 1.0 for other in JOINTS]
    found = checks([channel("torque", lambda values: values * signs)(item) for item in recordings], machine_file)
    assert [item.numbers["joint"] for item in found if item.numbers["answer"] == "contradicts"] == [joint]
