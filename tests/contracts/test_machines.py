"""What holds for every registered machine; those not built here are those of the examples in docs/machine-file.md."""

from __future__ import annotations

import json
from dataclasses import asdict, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

from cdtool.commands.simulate.arm_model import simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters
from cdtool.formats.machine_file import fingerprint, read_machine_file
from cdtool.machines import MACHINES
from cdtool.machines.dynamics import Machine
from cdtool.machines.rotary_axis import RotaryAxis
from cdtool.recordings.recording import Recording, Series
from tests.project.pages import machine_files
from tests.synthetic.arm_as_recording import as_recording
from tests.synthetic.machines import ARM, GATE, arm_of, machine_of
from tests.synthetic.motions import moving_recording
from tests.synthetic.robots import six_joint_robot


@pytest.fixture(scope="module", params=MACHINES.names())
def machine(request, tmp_path_factory) -> Any:
    if request.param == "linear_axis":
        return machine_of(GATE)
    if request.param == "rotary_axis":
        friction = {"coulomb_friction": 0.02, "coulomb_slope": 50.0}  # smooth: nothing sticks
        values = {"motor_inertia": 1e-3, "load_inertia": 2.0, "transmission_ratio": 0.01, **friction}
        return RotaryAxis.of(values)
    if request.param == "planar_arm":
        return arm_of(ARM)
    if request.param == "urdf_robot":
        pytest.importorskip("pinocchio")
        return six_joint_robot(tmp_path_factory.mktemp("robot"))
    path = tmp_path_factory.mktemp("machine") / "machine.toml"
    path.write_text(dict(machine_files())[request.param], encoding="utf-8")
    return read_machine_file(path).machine


def logged(machine: Any) -> Recording:
    """A recording as the machine logs it: in motor coordinates where it has some."""
    load = moving_recording(machine, seconds=2.0, noise=1e-3)
    if machine.coordinates == "load":
        return load
    ratio = np.array(machine.transmission_ratio)
    units = {"torque": "N m", "speed": "rad/s", "position": "rad"}
    channels = {}
    for name, series in load.channels.items():
        quantity = name.removeprefix("reference_")
        if quantity == "acceleration":
            channels[name] = series
            continue
        values = series.values * ratio if quantity == "torque" else series.values / ratio
        channels[name] = Series(series.time, values, units[quantity])
    return replace(load, channels=channels)


def test_it_is_a_frozen_dataclass_with_a_fingerprint_of_all_that_it_knows(machine):
    assert is_dataclass(machine) and type(machine).__dataclass_params__.frozen
    json.dumps(asdict(machine))
    assert fingerprint(machine) == fingerprint(replace(machine))
    other = replace(machine, viscous_friction=tuple(value + 1.0 for value in machine.viscous_friction))
    assert fingerprint(machine) != fingerprint(other)


def test_it_has_everything_that_a_detector_may_ask(machine):
    asked = [name for name in vars(Machine) if not name.startswith("_")]
    assert len(asked) > 12
    assert all(hasattr(machine, name) for name in asked)
    assert machine.nominal_inertia.shape == (len(machine.joints),) and (machine.nominal_inertia > 0.0).all()
    assert machine.default_sides in ("one", "two")


def test_referring_to_the_load_side_gives_the_load_side_back(machine):
    load, referred = moving_recording(machine, seconds=2.0, noise=1e-3), machine.referred_to_load(logged(machine))
    for name, series in load.channels.items():
        assert referred[name].unit == series.unit
        np.testing.assert_allclose(referred[name].values, series.values, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("missing", [(), ("speed",), ("position",), ("reference_position",)])
def test_referring_to_the_load_side_is_causal(machine, missing):
    raw = logged(machine)
    raw = replace(raw, channels={name: series for name, series in raw.channels.items() if name not in missing})
    whole = machine.referred_to_load(raw)
    for end in (0.0105, 0.61, 1.2345):
        part = machine.referred_to_load(raw.between(-np.inf, end))
        assert set(part.channels) == set(whole.channels)
        for name, series in part.channels.items():
            np.testing.assert_array_equal(series.values, whole[name].values[: len(series)])


def test_what_an_arms_sensors_feel_becomes_an_acceleration_causally(arm):
    run = simulate_arm_run(ArmParameters(), np.random.default_rng(3), 1, "stiff")
    raw = as_recording(run, "arm")
    whole = arm.referred_to_load(raw)
    assert whole["acceleration"].unit == "rad/s2"
    for end in (0.2, 1.55, 1.6):
        part = arm.referred_to_load(raw.between(-np.inf, end))["acceleration"]
        np.testing.assert_array_equal(part.values, whole["acceleration"].values[: len(part)])


@pytest.mark.parametrize("slope", [50.0, 0.0], ids=["smooth friction", "friction that sticks"])
def test_the_balance_with_an_acceleration_is_the_balance_without_m_a(machine, slope):
    joints = len(machine.joints)
    machine = replace(machine, coulomb_friction=(0.02,) * joints, coulomb_slope=(slope,) * joints)
    recording = moving_recording(machine, seconds=1.0)
    position, acceleration = recording["position"].values, recording["acceleration"].values
    # Slow samples stick where the torque is that of the motion.
    for speed in (recording["speed"].values, np.zeros_like(position)):
        torque = machine.required_torque(position, speed, acceleration)
        apart = machine.force_balance(torque, position, speed) - machine.inertia_times(position, acceleration)
        together = machine.force_balance(torque, position, speed, acceleration)
        np.testing.assert_allclose(together, apart, rtol=0.0, atol=1e-13 * np.abs(torque).max())


def test_momentum_force_energy_and_inertia_are_of_one_machine(machine):
    recording = moving_recording(machine, seconds=3.0)
    position, speed = recording["position"].values, recording["speed"].values
    acceleration, time = recording["acceleration"].values, recording["speed"].time
    inertia = machine.inertia_matrix(position)
    np.testing.assert_allclose(
        machine.inertia_times(position, speed), np.einsum("nij,nj->ni", inertia, speed), rtol=1e-9
    )
    torque = machine.required_torque(position, speed, acceleration)
    # Nothing is left over: the momentum changes as its balance says, and so does the energy.
    net, momentum = machine.momentum_balance(torque, position, speed, speed)
    gained = np.cumsum(0.5 * (net[1:] + net[:-1]) * np.diff(time)[:, np.newaxis], axis=0)
    np.testing.assert_allclose(momentum[1:] - momentum[0], gained, atol=2e-5 * np.abs(momentum).max())
    power, energy = machine.drive_power(torque, speed), machine.energy(position, speed)
    worked = np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(time)[:, np.newaxis], axis=0)
    np.testing.assert_allclose(energy[1:] - energy[0], worked, atol=2e-5 * np.ptp(energy))
    left = machine.force_balance(torque, position, speed) - machine.inertia_times(position, acceleration)
    moves = np.abs(speed) > 0.01
    assert np.abs(left[moves]).max() < 1e-9 * np.abs(torque).max()
    for j, equation in enumerate(machine.joint_equations(torque, position, speed, acceleration)):
        assert len(equation.inertia) in (1, len(time)) and equation.force.shape == (len(time),)
        np.testing.assert_allclose(equation.inertia * np.ones(len(time)), inertia[:, j, j], rtol=1e-12)
