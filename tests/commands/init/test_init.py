"""`cdtool init`: guesses from simulated and real logs; the command is registered here to keep the test independent."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.commands.init.drafting import init
from cdtool.commands.judging.information import info
from cdtool.formats.machine_file import read_machine_file
from tests.command import cdtool
from tests.commands.init.drafts import drafted_columns, stroke
from tests.data_folder import UR10E_LOGS, data, needs_data

LOGS = Path(__file__).parents[3] / "sample_logs"


def drafted(log: Path, folder: Path) -> dict:
    path = folder / "machine.toml"
    done = init(log, path)
    assert done.text == path.read_text() and not done.left_out
    read_machine_file(path)
    info(log, machine=path)
    return tomllib.loads(done.text)


def places(section: dict) -> dict[str, object]:
    return {
        name: part.get("column", part.get("columns", part.get("field")))
        for name, part in section.items()
        if name != "time"
    }


def test_the_gates_table_is_guessed_with_its_signs_and_units(tmp_path):
    values = drafted(LOGS / "gate/stiff/03.csv", tmp_path)
    right = tomllib.loads((LOGS / "gate/machine.toml").read_text())["channels"]
    right.pop("mcap")
    channels = values["channels"]
    assert places(channels) == places(right) and channels["time"] == right["time"]
    for name in ("torque", "speed", "position", "reference_speed", "reference_torque"):
        assert channels[name]["unit"] == right[name]["unit"]
    assert channels["acceleration"]["scale"] == right["acceleration"]["scale"] == -1
    assert values["machine"]["type"] == "linear_axis" and values["machine"]["coordinates"] == "motor"


def test_values_not_in_the_log_are_marked_placeholders(tmp_path):
    path = tmp_path / "machine.toml"
    text = init(LOGS / "gate/stiff/03.csv", path).text.splitlines()
    for key in ("load_mass = 0.0", "motor_inertia = 0.0", "transmission_ratio = 1.0"):
        at = next(i for i, line in enumerate(text) if line.startswith(key))
        assert "CHECK" in text[at] or (text[at - 1].startswith("#") and "CHECK" in "".join(text[at - 2 : at]))
    mapped = [i for i, line in enumerate(text) if " = {" in line and not line.startswith("#")]
    assert all("guessed" in text[i] or text[i - 1].startswith("#") for i in mapped)
    done = cdtool("detect", LOGS / "gate/stiff/03.csv", "-m", path, "-d", "gm", "--set=threshold.limits=400")
    assert done.status == 2 and "needs the inertia" in done.err


def test_the_gates_topics_are_guessed(tmp_path):
    values = drafted(LOGS / "gate/stiff/01.mcap", tmp_path)["channels"]["mcap"]
    right = tomllib.loads((LOGS / "gate/machine.toml").read_text())["channels"]["mcap"]
    assert {n: (p["topic"], p["field"]) for n, p in values.items()} == {
        n: (p["topic"], p["field"]) for n, p in right.items()
    }
    assert values["acceleration"]["scale"] == -1


def test_an_arms_columns_are_grouped_by_joint_and_its_counts_are_scaled_by_its_speed(tmp_path):
    values = drafted(LOGS / "arm/trial_1/stiff/01.csv", tmp_path)
    right = tomllib.loads((LOGS / "arm/trial_1/machine.toml").read_text())["channels"]
    right.pop("mcap")
    assert places(values["channels"]) == places(right)
    assert values["channels"]["position"]["unit"] == "count"
    assert values["channels"]["position"]["scale"] == pytest.approx(right["position"]["scale"], rel=0.02)


def test_columns_without_names_are_recognised_by_their_values(tmp_path):
    channels = drafted(UR10E_LOGS / "link4.csv.gz", tmp_path)["channels"]
    assert channels["position"]["columns"] == [1, 2, 3, 4, 5, 6] and channels["speed"]["columns"] == [
        7,
        8,
        9,
        10,
        11,
        12,
    ]
    assert channels["torque"]["columns"] == [13, 14, 15, 16, 17, 18] and channels["time"]["column"] == 0


@needs_data("emps/DATA_EMPS.mat")
def test_a_drive_and_a_set_value_are_recognised_by_their_values(tmp_path):
    channels = drafted(data("emps/DATA_EMPS.mat"), tmp_path)["channels"]
    assert places(channels) == {"position": "qm", "torque": "vir", "reference_position": "qg"}


@needs_data("ur3e/L0L1.csv")
def test_of_175_columns_the_robots_are_found(tmp_path):
    channels = drafted(data("ur3e/L0L1.csv"), tmp_path)["channels"]
    named = {name: columns[0] for name, columns in places(channels).items()}
    assert named == {
        "position": "actual_q_0", "speed": "actual_qd_0", "torque": "actual_current_0",
        "reference_position": "target_q_0", "reference_speed": "target_qd_0", "reference_torque": "target_current_0",
    }  # fmt: skip


def test_a_log_without_recognised_channels_gets_its_clock_and_columns_as_comments(tmp_path):
    log, path = tmp_path / "scope.csv", tmp_path / "machine.toml"
    log.write_text("TIME,CH1,CH2\n" + "".join(f"{k * 1e-3:.3f},{k % 3},{k % 7}\n" for k in range(300)))
    done = cdtool("init", log, "-o", path)
    assert done.status == 0 and "torque, speed or position" in done.err
    values = tomllib.loads(path.read_text())
    assert list(values["channels"]) == ["time"] and values["channels"]["time"]["column"] == "TIME"
    assert values["machine"]["load_mass"] == 0.0
    assert '#   column = "CH1": 0 to 2' in path.read_text() and '#   column = "CH2": 0 to 6' in path.read_text()
    filled = path.read_text() + 'speed = { column = "CH1", unit = "m/s" }\n'
    path.write_text(filled)
    assert info(log, machine=path).channels


def test_a_log_with_only_a_clock_is_one_line(tmp_path):
    log = tmp_path / "clock.csv"
    log.write_text("t\n" + "".join(f"{k}\n" for k in range(30)))
    with pytest.raises(RecordingError, match="no column of numbers apart from a clock"):
        init(log, tmp_path / "machine.toml")
    assert not (tmp_path / "machine.toml").exists()


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 1e300])
def test_impossible_values_neither_warn_nor_disturb_the_guess(tmp_path, value):
    run = stroke(5e-3)
    broken = np.where((run.time > 1.0) & (run.time < 1.2), value, run.travel)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        columns = {"t [s]": run.time, "pos [m]": broken, "vel [m/s]": run.speed}
        (tmp_path / "log.csv").write_text(
            ",".join(columns)
            + "\n"
            + "\n".join(",".join(map(repr, row)) for row in zip(*(c.tolist() for c in columns.values()), strict=True))
        )
        drafted = init(tmp_path / "log.csv", tmp_path / "machine.toml")
    assert {"position", "speed"} <= set(drafted.channels)


def test_joints_have_the_names_in_the_columns(tmp_path):
    run = stroke()
    columns = {"t [s]": run.time}
    for k, name in enumerate(("pan", "tilt", "roll_axis")):
        columns |= {f"{name}/position": (k + 1.0) * run.travel, f"{name}/velocity": (k + 1.0) * run.speed}
    draft = drafted_columns(tmp_path, columns)
    assert draft.machine["joints"] == ["pan", "tilt", "roll_axis"]
    assert draft.channels["position"]["columns"] == [f"{name}/position" for name in draft.machine["joints"]]
