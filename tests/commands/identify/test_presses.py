"""`cdtool identify` with presses on a load cell: the scale of the torque, and what depends on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import UsageError
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.commands.identify.presses import PressLogs
from cdtool.formats.machine_file import read_machine_file
from cdtool.machines.axis_model.model_table import axis_model
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis
from tests.command import cdtool as command
from tests.commands.identify.axis.test_torque_constant import SCALE, pressed

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"
MASS = 80.0
AXIS = """[machine]
type = "linear_axis"
name = "axis"
coordinates = "load"
load_mass = 50.0
[channels]
time = { column = "t", unit = "s" }
torque = { column = "f", unit = "N" } # from a data sheet
speed = { column = "v", unit = "m/s" }
force = { column = "cell", unit = "N" }
"""


def write_press(path: Path, seed: int) -> None:
    recording, _ = pressed(seed=seed)
    time = recording["torque"].time
    cell = np.interp(time, recording["force"].time, recording["force"].values[:, 0])
    write(path, time, recording["torque"].values[:, 0], recording["speed"].values[:, 0], cell)


def write_free(path: Path, seed: int) -> None:
    """Strokes in both directions at three speeds; the logged torque is too large by 1 / SCALE."""
    time = np.arange(12_000) * 1e-3
    speed = (0.2 + 0.1 * np.floor(time / 4.0)) * np.sin(2.0 * np.pi * time / 2.0)
    controller = Controller(period=1e-3, speed_gain=8000.0, integral_gain=40_000.0)
    friction = Friction(coulomb_forward=30.0, coulomb_backward=30.0, viscous=40.0)
    motion = simulate_axis(
        AxisModel(drive=ElasticDrive(load_mass=MASS), friction=friction, controller=controller), AxisInputs(speed)
    )
    noise = np.random.default_rng(seed).standard_normal(len(time))
    write(path, time, (motion["drive_force"] + noise) / SCALE, motion["motor_speed"], np.zeros(len(time)))


def write(path: Path, *columns: np.ndarray) -> None:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header="t,f,v,cell", comments="", fmt="%.7g")


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("axis")
    for seed in range(3):
        write_free(folder / f"free{seed}.csv", seed)
        write_press(folder / f"press{seed}.csv", seed)
    (folder / "machine.toml").write_text(AXIS, encoding="utf-8")
    return folder


def test_presses_correct_the_scale_of_the_torque_and_everything_that_depends_on_it(axis: Path) -> None:
    free, machine = [axis / "free*.csv"], axis / "machine.toml"
    wrong = {change.key: change.values[0] for change in cdtool.identify(free, machine).changes}
    assert wrong["load_mass"] == pytest.approx(MASS / SCALE, rel=0.03)
    presses = PressLogs((str(axis / "press*.csv"), str(axis / "free0.csv")))
    target = axis / "identified.toml"
    done = cdtool.identify(free, machine, target, other_logs=presses)
    (left_out,) = done.skipped
    assert "the load cell shows no contact" in left_out.reason
    right = {change.key: change.values[0] for change in done.changes}
    assert right["scale"] == pytest.approx(SCALE, rel=0.02)
    errors = {change.key: change.standard_errors[0] for change in done.changes}
    assert abs(right["load_mass"] - MASS) < 3.0 * errors["load_mass"]
    assert 0.0005 * MASS < errors["load_mass"] < 0.02 * MASS  # that of the scale included
    assert right["coulomb_friction"] == pytest.approx(30.0, rel=0.1)
    # The new file reads the same logs with the corrected torque, and finds nothing to correct.
    again = cdtool.identify(free, target, other_logs=presses)
    assert {change.key: change.values[0] for change in again.changes}["scale"] == pytest.approx(
        right["scale"], rel=1e-3
    )
    assert "# from a data sheet" in target.read_text(encoding="utf-8")


def test_a_torque_of_the_opposite_sign_is_named_and_nothing_is_written(axis: Path) -> None:
    machine = axis / "wrong.toml"
    machine.write_text(AXIS.replace('unit = "N" } # from', 'unit = "N", scale = -1 } # from'), encoding="utf-8")
    with pytest.raises(IdentificationError, match="gives power to the machine"):
        cdtool.identify([axis / "free*.csv"], machine, axis / "never.toml")
    assert not (axis / "never.toml").exists()


def test_an_old_friction_of_the_model_does_not_apply_with_new_values(axis: Path) -> None:
    machine, target = axis / "old.toml", axis / "new.toml"
    machine.write_text(f"{AXIS}[model.friction]\nviscous = 3.0\n", encoding="utf-8")
    cdtool.identify([axis / "free*.csv"], machine, target)
    file = read_machine_file(target)
    friction = axis_model(file.machine, file.model).friction  # type: ignore[arg-type]
    assert friction.viscous == pytest.approx(40.0 / SCALE, rel=0.1)


def test_hits_do_not_show_the_torque_constant_and_the_reason_is_stated() -> None:
    logs = PressLogs((str(GATE / "stiff" / "*.csv"),))
    done = cdtool.identify([GATE / "free" / "0[34].csv"], GATE / "machine.toml", other_logs=logs)
    assert "torque constant cannot be identified" in done.joints[0].refused["torque_scale"]
    assert all(change.key != "scale" for change in done.changes)


def test_a_rotary_axis_needs_the_lever_arm_of_its_load_cell(tmp_path: Path) -> None:
    text = AXIS.replace("linear_axis", "rotary_axis").replace("load_mass", "load_inertia").replace('"m/s"', '"rad/s"')
    (tmp_path / "machine.toml").write_text(text.replace('"f", unit = "N"', '"f", unit = "N m"'), encoding="utf-8")
    write_free(tmp_path / "free.csv", 1)
    with pytest.raises(UsageError, match="lever arm"):
        cdtool.identify([tmp_path / "free.csv"], tmp_path / "machine.toml", other_logs=PressLogs(("x.csv",)))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--lever-arm", "0.5"), "--lever-arm without --presses"),
        (("--presses", "x.csv", "--lever-arm", "-1"), "--lever-arm is -1"),
        (("--presses", "x.csv", "--loaded-logs", "y.csv", "--payload", "1kg"), "these are for robots, those for axes"),
    ],
)
def test_options_that_do_not_belong_together_are_one_line(axis: Path, options: tuple[str, ...], message: str) -> None:
    done = command("identify", axis / "free0.csv", "-m", axis / "machine.toml", *options)
    assert done.status == 2
    assert message in done.err and done.err.count("\n") == 1


def test_the_command_writes_what_presses_show(axis: Path) -> None:
    target, page = axis / "pressed.toml", axis / "pressed.html"
    words = ("-m", axis / "machine.toml", "--presses", axis / "press*.csv", "-o", target, "-o", page)
    done = command("identify", axis / "free*.csv", *words)
    assert done.status == 0, done.err
    assert "channels.torque.scale" in done.out
    assert read_machine_file(target).machine.name == "axis"
    assert "channels.torque.scale" in page.read_text(encoding="utf-8")
