"""The table [model] of a machine file."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.axis_model.model_table import axis_model, finite_values

GATE = """
[machine]
type = "linear_axis"
name = "gate"
motor_inertia = 0.00095
load_mass = 620
transmission_ratio = 0.001333
viscous_friction = 0.00026653
coulomb_friction = 0.2
constant_force = 0.01
"""


def read(folder: Path, text: str) -> MachineFile:
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return read_machine_file(path)


def test_masses_and_friction_come_from_the_machine(tmp_path: Path) -> None:
    file = read(tmp_path, GATE)
    model = axis_model(file.machine, file.model)  # type: ignore[arg-type]
    assert file.model is None
    assert model.drive.motor_mass == pytest.approx(0.00095 / 0.001333**2)
    assert model.drive.load_mass == pytest.approx(620.0)
    assert model.drive.is_rigid
    assert model.friction.viscous == pytest.approx(150.0, rel=1e-4)
    assert model.friction.coulomb_backward == pytest.approx(0.2 / 0.001333)
    assert model.friction.offset == pytest.approx(0.01 / 0.001333)
    assert model.controller is None


def test_the_model_adds_drive_controller_and_sensors(tmp_path: Path) -> None:
    text = (
        GATE
        + """
[model.drive]
stiffness = 80000.0
[model.friction]
coulomb_forward = 170
static = 210
[model.controller]
period = 0.001
speed_gain = 4300
speed_filter_order = 1
speed_filter_hz = 60
[model.sensors]
accelerometer_hz = 25
"""
    )
    file = read(tmp_path, text)
    model = axis_model(file.machine, file.model)  # type: ignore[arg-type]
    assert model.drive.stiffness == 8e4
    assert math.isinf(model.drive.take_up_travel)
    assert (model.friction.coulomb_forward, model.friction.static) == (170.0, 210.0)
    assert model.friction.viscous == pytest.approx(150.0, rel=1e-4)
    assert model.controller is not None
    assert model.controller.speed_filter_order == 1
    assert math.isinf(model.controller.slew_limit)
    assert model.sensors.accelerometer_hz == 25.0
    assert finite_values(model.drive)["stiffness"] == 8e4
    assert "take_up_travel" not in finite_values(model.drive)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("[model.drive]\nstifness = 1", "model.drive.stifness: unknown key"),
        ("[model.drive]\nload_mass = 1", "model.drive.load_mass: unknown key"),
        ("[model.motor]\nx = 1", "model.motor: unknown key"),
        ('[model.controller]\nperiod = "a"', "model.controller.period: is 'a'"),
        ("[model.drive]\nstiffness = -1", r"model\.drive\.stiffness: is -1"),
        ("[model.friction]\ncoulomb_forward = -1", r"model\.friction\.coulomb_forward: is -1"),
    ],
)
def test_a_wrong_key_is_named(tmp_path: Path, more: str, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        read(tmp_path, f"{GATE}\n{more}\n")


def test_load_coordinates_may_give_the_motors_share(tmp_path: Path) -> None:
    text = """
[machine]
type = "linear_axis"
coordinates = "load"
load_mass = 1154
[model.drive]
motor_mass = 534
stiffness = 8e4
"""
    file = read(tmp_path, text)
    drive = axis_model(file.machine, file.model).drive  # type: ignore[arg-type]
    assert (drive.motor_mass, drive.load_mass) == (534.0, 620.0)
