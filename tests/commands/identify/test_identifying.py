"""`cdtool identify` from logs to the updated machine file."""

from __future__ import annotations

import math
import shutil
import tomllib
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import UsageError
from cdtool.commands.identify.estimate import Estimate, Method
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.commands.identify.machine_update import MachineChange, changes_of, updated_text
from cdtool.formats.machine_file import read_machine_file
from cdtool.machines.axis_model.model_table import axis_model
from tests.command import cdtool as command
from tests.data_folder import DATA, needs_data

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate"


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> tuple[IdentifiedMachine, Path]:
    target = tmp_path_factory.mktemp("identified") / "machine.toml"
    return cdtool.identify([str(GATE / "free" / "*")], GATE / "machine.toml", target), target


def test_the_gates_file_gets_drive_friction_and_controller(identified: tuple[IdentifiedMachine, Path]) -> None:
    done, target = identified
    file = read_machine_file(target)
    model = axis_model(file.machine, file.model)  # type: ignore[arg-type]
    assert len(done.runs) == 10
    assert model.drive.load_mass == pytest.approx(620.0, rel=0.15)
    assert model.drive.stiffness == pytest.approx(8e4, rel=0.05)
    friction = model.friction
    assert friction.coulomb_forward + 0.2 * friction.viscous == pytest.approx(200.0, rel=0.1)
    assert model.controller is not None
    assert model.controller.speed_gain == pytest.approx(4300.0, rel=0.005)
    assert model.controller.integral_gain == pytest.approx(8000.0, rel=0.005)
    assert model.controller.slew_limit == pytest.approx(800.0, rel=0.005)
    assert model.controller.period == pytest.approx(1e-3)


def test_old_values_comments_and_channels_are_kept(identified: tuple[IdentifiedMachine, Path]) -> None:
    text = identified[1].read_text(encoding="utf-8")
    before = (GATE / "machine.toml").read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith("load_mass")]
    assert "+-" in line
    assert "10 runs" in line
    assert line.endswith("was 620 (kg)")
    for kept in ("# mounted backward", 'name = "gate"', "[channels.mcap]"):
        assert kept in text
    assert tomllib.loads(text)["channels"] == tomllib.loads(before)["channels"]


def test_what_one_speed_in_one_direction_does_not_show_is_said(identified: tuple[IdentifiedMachine, Path]) -> None:
    (joint,) = identified[0].joints
    keys = {(item.section, item.key) for item in joint.not_identifiable}
    assert {("machine", "viscous_friction"), ("machine", "coulomb_friction"), ("machine", "constant_force")} <= keys
    assert tomllib.loads(identified[0].text)["machine"]["viscous_friction"] == 0.00026653


def test_an_existing_file_is_kept_unless_it_is_the_machine_file_itself(tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    other.write_text("mine", encoding="utf-8")
    logs = [GATE / "free" / "03.csv", GATE / "free" / "04.csv", GATE / "free" / "05.csv"]
    with pytest.raises(UsageError, match="already exists"):
        cdtool.identify(logs, GATE / "machine.toml", other)
    assert other.read_text(encoding="utf-8") == "mine"
    own = tmp_path / "machine.toml"
    shutil.copy(GATE / "machine.toml", own)
    again = cdtool.identify(logs, own, own)
    assert again.text == own.read_text(encoding="utf-8")


CRASHES = """machine = "{gate}/machine.toml"
detectors = ["momentum"]
threshold = "limit"

[onset]
labels = "labels.csv"

[learn]
until = "onset"
logs = ["{gate}/stiff/*.csv"]

[impacts.stiff]
logs = ["{gate}/stiff/*.csv"]
"""


@pytest.mark.parametrize("is_labelled", [False, True])
def test_crash_logs_are_used_up_to_their_contacts(tmp_path: Path, is_labelled: bool) -> None:
    logs = sorted((GATE / "stiff").glob("*.csv"))
    given: list[Path] = logs
    if is_labelled:
        rows = "\n".join(f"{path},3.0,3.1" for path in logs)
        (tmp_path / "labels.csv").write_text(f"recording,start_s,end_s\n{rows}\n", encoding="utf-8")
        given = [tmp_path / "benchmark.toml"]
        given[0].write_text(CRASHES.format(gate=GATE), encoding="utf-8")
    done = cdtool.identify(given, GATE / "machine.toml")
    assert len(done.runs) == len(logs) and not done.skipped
    (joint,) = done.joints
    assert joint.rigid is not None
    assert joint.rigid.levels[0].force == pytest.approx(200.0, rel=0.1)
    assert joint.rigid.excitation.moving_time / len(logs) == pytest.approx(2.3 if is_labelled else 5.3, abs=0.6)


def test_a_log_at_rest_gives_one_line_and_nothing_is_written(tmp_path: Path) -> None:
    rows = "\n".join(f"{i},0.1,0.0,0.0" for i in range(3000))
    (tmp_path / "rest.csv").write_text(f"t,i,n,phi\n{rows}\n", encoding="utf-8")
    machine = '[machine]\ntype = "linear_axis"\ntransmission_ratio = 1e-3\nmotor_inertia = 1e-3\n[channels]\n'
    machine += 'time = {column = "t", unit = "ms"}\ntorque = {column = "i", unit = "A", scale = 0.5}\n'
    machine += 'speed = {column = "n", unit = "rpm"}\nposition = {column = "phi", unit = "rad"}\n'
    (tmp_path / "m.toml").write_text(machine, encoding="utf-8")
    done = command("identify", tmp_path / "rest.csv", "-m", tmp_path / "m.toml", "-o", tmp_path / "out.toml")
    assert done.status == 2
    assert len(done.err.strip().splitlines()) == 1
    assert "nothing can be identified from 1 log: " in done.err
    assert "rest.csv: hardly" in done.err.split("from 1 log: ")[1].split(";")[0]
    assert "reference" not in done.err
    assert not (tmp_path / "out.toml").exists()


@needs_data("emps")
def test_the_real_axis_is_identified_as_published() -> None:
    done = cdtool.identify([DATA / "emps" / "DATA_EMPS.mat"], ROOT / "docs" / "examples" / "emps.toml")
    values = {change.key: change.values[0] for change in done.changes}
    assert values["load_mass"] == pytest.approx(95.1089, rel=0.01)
    assert values["viscous_friction"] == pytest.approx(203.5034, rel=0.01)
    assert values["coulomb_friction"] == pytest.approx(20.3935, rel=0.01)
    assert values["constant_force"] == pytest.approx(-3.1648, rel=0.01)
    assert values["position_gain"] == pytest.approx(160.18, rel=0.01)
    assert values["speed_gain"] == pytest.approx(243.45 * 35.15, rel=0.03)
    # The difference of the directions holds the constant force, which must not count twice.
    assert values["offset"] == 0.0


MACHINE = """[machine]
type = "linear_axis"
joints = ["x", "y"]
transmission_ratio = [0.01, 0.02] # two screws
load_mass = 10.0   # guessed
coulomb_friction = 0.5
"""


def estimate(key: str, value: float, joint: int, section: str = "machine") -> Estimate:
    return Estimate(section, key, value, 0.01 * value, "kg", Method.LEAST_SQUARES, joint)


def test_values_of_the_file_are_at_the_motor_and_other_joints_keep_theirs(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE, encoding="utf-8")
    machine = read_machine_file(path).machine
    estimates = [estimate("load_mass", 12.345678, 1), estimate("coulomb_friction", 30.0, 1)]
    estimates.append(estimate("stiffness", 5e4, 0, "model.drive"))
    changes = changes_of(machine, tomllib.loads(MACHINE), estimates)
    text = updated_text(MACHINE, changes, "3 runs, 2026-01-02")
    values = tomllib.loads(text)
    assert values["machine"]["load_mass"] == [10.0, 12.3457]
    assert values["machine"]["coulomb_friction"] == [0.5, 0.6]
    assert "# two screws" in text
    assert "was 10.0 (guessed)" in text
    assert changes[0].old == (10.0, 10.0)


def test_a_joint_whose_value_is_known_only_together_does_not_undo_that_of_another(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE, encoding="utf-8")
    known, vague = estimate("viscous_friction", 30.0, 0), estimate("viscous_friction", 50.0, 1)
    (change,) = changes_of(read_machine_file(path).machine, tomllib.loads(MACHINE), [known], [vague])
    assert change.values == pytest.approx((30.0 * 0.01**2, 50.0 * 0.02**2))
    assert not change.is_known_alone


CHANGES = [
    MachineChange("machine", "load_mass", (620.0,), (657.9,), (33.0,), "kg", Method.OUTPUT_ERROR),
    MachineChange("model.drive", "stiffness", (None,), (8.1e4,), (math.nan,), "N/m", Method.OUTPUT_ERROR),
]
LAYOUTS = {
    "tables": '[machine]\nname = "gate"\nload_mass = 620 # kg\n[model.drive]\nfront_stiffness = 1e6\n'
    "[channels]\nx = 1\n",
    "inline": 'machine = { name = "gate", load_mass = 620 }\nmodel = { drive = { front_stiffness = 1e6 } }\n'
    "channels = { x = 1 }\n",
    "inline within": '[machine]\nname = "gate"\nload_mass = 620\n[model]\ndrive = { front_stiffness = 1e6 }\n'
    "[channels]\nx = 1\n",
    "dotted": 'machine.name = "gate"\nmachine.load_mass = 620\nmodel.drive.front_stiffness = 1e6\nchannels.x = 1\n',
    "without a model": '[machine]\nname = "gate"\nload_mass = 620\n[channels]\nx = 1',
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_only_the_changed_keys_of_a_machine_file_change(layout: str) -> None:
    before = tomllib.loads(LAYOUTS[layout])
    after = tomllib.loads(updated_text(LAYOUTS[layout], CHANGES, "3 runs"))
    assert after["machine"].pop("load_mass") == 657.9
    assert after["model"]["drive"].pop("stiffness") == 8.1e4
    del before["machine"]["load_mass"]
    if layout == "without a model":
        before["model"] = {"drive": {}}
    assert after == before


def test_a_line_that_ends_without_a_line_break_keeps_its_comment() -> None:
    text = updated_text("[machine]\nload_mass = 620 # from the drawing", CHANGES, "3 runs")
    assert "was 620 (from the drawing)" in text
    assert tomllib.loads(text)["machine"]["load_mass"] == 657.9
