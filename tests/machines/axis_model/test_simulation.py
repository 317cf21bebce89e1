"""The model of one axis: the gate's own simulator, closed forms, steady motion, step size."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis, wind_up_at
from tests.machines.axis_model.gate_as_model import gate_as_model, soft_obstacle, stiff_obstacle

# A gate without what the model does not contain.
PLAIN = GateParameters(
    friction_waviness=0.0,
    friction_scatter=0.0,
    cogging_force=0.0,
    disturbance_force=0.0,
    resolver_counts=0,
    torque_noise=0.0,
)


@pytest.mark.parametrize(("impact", "obstacle"), [("stiff", stiff_obstacle(PLAIN)), ("soft", soft_obstacle(PLAIN))])
def test_the_gate_runs_as_in_its_own_simulator(impact: str, obstacle: Obstacle) -> None:
    run = simulate_gate_run(PLAIN, np.random.default_rng(1), impact, substeps=4)  # type: ignore[arg-type]
    model = gate_as_model(PLAIN)
    inputs = AxisInputs(run.reference_speed * PLAIN.transmission_ratio)
    free = simulate_axis(model, inputs)
    assert run.contact_start is not None
    place = float(np.interp(run.contact_start, run.time, free["front_position"]))
    hit = simulate_axis(model, inputs, obstacle.at(place, 1))
    before = run.time < run.contact_start
    np.testing.assert_array_equal(free["drive_force"][before], hit["drive_force"][before])
    assert hit.first_contact == pytest.approx(run.contact_start, abs=2e-5)
    # Half a second after contact; the bumper's force law differs a little once it has bottomed out.
    near = (run.time > run.contact_start) & (run.time < run.contact_start + 0.3)
    scale = np.max(run.contact_force[near])
    assert np.max(np.abs(hit["contact_force"] - run.contact_force)[near]) < 0.01 * scale
    assert np.max(np.abs(hit["drive_force"] - run.motor_force)[near]) < 1.0
    assert np.max(np.abs(hit["measured_speed"] - run.motor_speed * PLAIN.transmission_ratio)[near]) < 1e-3


def rigid(mass: float, **friction: float) -> AxisModel:
    return AxisModel(drive=ElasticDrive(load_mass=mass), friction=Friction(**friction))


def test_a_rigid_axis_under_a_constant_force_accelerates_as_newton_says() -> None:
    period, force, mass, viscous = 1e-3, 40.0, 20.0, 8.0
    motion = simulate_axis(
        rigid(mass, viscous=viscous), AxisInputs(np.zeros(2000), command=np.full(2000, force)), period=period
    )
    time = period * np.arange(2000)
    expected = force / viscous * (1.0 - np.exp(-viscous / mass * time))
    np.testing.assert_allclose(motion["load_speed"], expected, atol=1e-9)
    np.testing.assert_array_equal(motion["motor_position"], motion["load_position"])


def test_a_mass_on_a_spring_rebounds_after_half_a_period_with_its_speed() -> None:
    mass, stiffness, speed = 5.0, 2e4, 0.3
    inputs = AxisInputs(np.zeros(400), command=np.zeros(400), initial_speed=speed)
    motion = simulate_axis(rigid(mass), inputs, Obstacle.spring(stiffness).at(0.01, 1), period=1e-3)
    assert motion.first_contact == pytest.approx(0.01 / speed, abs=1e-7)
    assert np.max(motion["contact_force"]) == pytest.approx(speed * math.sqrt(stiffness * mass), rel=1e-3)
    assert motion["load_speed"][-1] == pytest.approx(-speed, rel=1e-4)
    in_contact = np.count_nonzero(motion["contact_force"]) * 1e-3
    assert in_contact == pytest.approx(math.pi * math.sqrt(mass / stiffness), abs=2e-3)


def test_motor_and_load_swing_at_the_two_mass_resonance() -> None:
    motor, load, stiffness = 3.0, 6.0, 5e4
    model = AxisModel(drive=ElasticDrive(motor_mass=motor, load_mass=load, stiffness=stiffness, backlash=0.0))
    impulse = np.zeros(1000)
    impulse[:3] = 200.0
    motion = simulate_axis(model, AxisInputs(np.zeros(1000), command=impulse), period=2e-4)
    wind_up = motion["wind_up"][3:]
    crossings = np.flatnonzero((wind_up[1:] > 0.0) & (wind_up[:-1] <= 0.0))
    period = float(np.mean(np.diff(crossings))) * 2e-4
    expected = 2.0 * math.pi * math.sqrt(motor * load / (motor + load) / stiffness)
    assert period == pytest.approx(expected, rel=0.01)
    momentum = motor * motion["motor_speed"] + load * motion["load_speed"]
    np.testing.assert_allclose(momentum[3:], 200.0 * 3 * 2e-4, rtol=1e-6)


def test_a_log_that_begins_in_motion_begins_in_steady_motion() -> None:
    gate = gate_as_model(PLAIN)
    steady = simulate_axis(gate, AxisInputs(np.full(500, 0.2), initial_speed=0.2))
    assert np.ptp(steady["load_speed"]) < 1e-6
    assert np.ptp(steady["drive_force"]) < 1e-3
    assert steady["drive_force"][0] == pytest.approx(150.0 + 150.0 * 0.2 + 20.0, abs=1e-3)


def test_a_cascade_follows_its_position_reference() -> None:
    controller = Controller(
        period=1e-3, speed_gain=8557.0, position_gain=160.0, speed_filter_order=1, speed_filter_hz=175.0
    )
    model = AxisModel(
        drive=ElasticDrive(load_mass=95.0),
        friction=Friction(coulomb_forward=20.0, coulomb_backward=20.0, viscous=203.0),
        controller=controller,
    )
    reference = 0.1 * np.minimum(np.arange(3000) * 1e-3, 2.0)
    motion = simulate_axis(model, AxisInputs(np.zeros(3000), reference_position=reference))
    lag = (203.0 * 0.1 + 20.0) / (8557.0 * 160.0) + 0.1 / 160.0
    assert reference[1900] - motion["load_position"][1900] == pytest.approx(lag, rel=0.02)


def test_a_delayed_command_acts_later() -> None:
    controller = Controller(period=1e-3, speed_gain=100.0, speed_filter_order=0)
    model = AxisModel(drive=ElasticDrive(load_mass=10.0), controller=controller)
    late = replace(model, controller=replace(controller, delay=5e-3))
    reference = np.where(np.arange(100) < 20, 0.0, 0.1)
    at_once = simulate_axis(model, AxisInputs(reference))
    later = simulate_axis(late, AxisInputs(reference))
    first, second = (int(np.flatnonzero(item["load_speed"])[0]) for item in (at_once, later))
    assert second - first == 5


def test_the_command_is_limited_in_slope_and_size() -> None:
    controller = Controller(period=1e-3, speed_gain=1e4, slew_limit=500.0, force_limit=60.0, anti_windup_rate=10.0)
    model = AxisModel(drive=ElasticDrive(load_mass=100.0), controller=controller)
    motion = simulate_axis(model, AxisInputs(np.full(1000, 0.2)))
    assert np.max(np.abs(np.diff(motion["command"]))) <= 0.5 + 1e-9
    assert np.max(np.abs(motion["command"])) == 60.0


@pytest.mark.parametrize(("force", "wind_up"), [(-500.0, -0.012), (0.0, 0.0), (100.0, 0.001), (600.0, 0.0055)])
def test_a_drive_winds_up_along_its_force_curve(force: float, wind_up: float) -> None:
    drive = ElasticDrive(
        load_mass=500.0,
        motor_mass=300.0,
        stiffness=1e5,
        take_up_travel=0.005,
        end_stiffness=2e5,
        backlash=0.0095,
    )
    assert wind_up_at(drive, force) == pytest.approx(wind_up, abs=1e-12)
