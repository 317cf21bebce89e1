"""A contact on a rotary axis acts on a lever: forces at the load cell are in N, whatever the radius."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis

# A swing door: 40 kg m2, its edge 0.8 m from the hinge.
LEVER, INERTIA, PERIOD = 0.8, 40.0, 1e-3
CONTROLLER = Controller(period=PERIOD, speed_gain=400.0, integral_gain=800.0)
MODEL = AxisModel(drive=ElasticDrive(load_mass=INERTIA), friction=Friction(coulomb_forward=8.0), controller=CONTROLLER)
MACHINE = f"""[machine]
type = "rotary_axis"
name = "door"
coordinates = "load"
load_inertia = {INERTIA}
coulomb_friction = 8.0
[channels]
time = {{ column = "t", unit = "s" }}
torque = {{ column = "torque", unit = "N m" }}
speed = {{ column = "speed", unit = "rad/s" }}
position = {{ column = "position", unit = "rad" }}
[model.drive]
rigid = true
[model.controller]
period = {PERIOD}
speed_gain = 400.0
integral_gain = 800.0
"""
SETUP = """machine = "machine.toml"
detectors = ["gm"]
[signature]
force = true
[learn]
logs = ["free/*.csv"]
[inject]
logs = ["free/1.csv"]
positions = ["45deg"]
{lever}
[inject.obstacles.spring]
stiffness_n_per_mm = 50
"""


def write_run(path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.arange(5000) * PERIOD
    speed = 0.5 * np.clip((time - 0.5) / 0.4, 0.0, 1.0)
    motion = simulate_axis(MODEL, AxisInputs(speed))
    torque = motion["drive_force"] + rng.normal(0.0, 0.5, len(time))
    rows = np.column_stack((time, torque, motion["motor_speed"], motion["motor_position"]))
    np.savetxt(path, rows, delimiter=",", header="t,torque,speed,position", comments="", fmt="%.9g")


@pytest.fixture(scope="module")
def door(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("door")
    (folder / "free").mkdir()
    for seed in range(3):
        write_run(folder / "free" / f"{seed}.csv", seed)
    (folder / "machine.toml").write_text(MACHINE, encoding="utf-8")
    return folder


def test_the_force_at_the_edge_is_that_of_the_spring(door: Path) -> None:
    """Half k x^2 = half J w^2: F = w sqrt(k J), while the controller goes on pushing."""
    path = door / "benchmark.toml"
    path.write_text(SETUP.format(lever=f"lever_arm_m = {LEVER}"), encoding="utf-8")
    done = cdtool.benchmark(path)
    (contact,) = done.results.contacts
    assert contact.outcome == "detected"
    assert contact.peak_force_n is not None
    rebound = 0.5 * np.sqrt(50e3 * INERTIA)
    assert contact.peak_force_n == pytest.approx(rebound, rel=0.2)
    twice = SETUP.format(lever=f"lever_arm_m = {2 * LEVER}").replace("= 50", "= 12.5")
    path.write_text(twice, encoding="utf-8")
    (longer,) = cdtool.benchmark(path).results.contacts
    # The same stiffness about the axis: the same motion, half of the force.
    assert longer.peak_force_n == pytest.approx(0.5 * contact.peak_force_n, rel=1e-3)
    assert longer.alarm_s == contact.alarm_s


def test_a_rotary_axis_needs_the_lever(door: Path) -> None:
    path = door / "without.toml"
    path.write_text(SETUP.format(lever=""), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="lever_arm_m: is missing"):
        read_benchmark_file(path)
