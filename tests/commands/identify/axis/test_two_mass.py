"""Load, drive stiffness and friction of a two-mass axis from the simulated gate's impact-free runs."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.commands.identify.axis.two_mass import TwoMassFit, TwoMassSettings, identify_two_mass
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction, Sensors
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis
from tests.synthetic.gate_runs import GATE, free_runs, on_any_track
from tests.synthetic.plain_gate import drawn_gate, strokes

SENSORS = Sensors(accelerometer_hz=GATE.accelerometer_frequency, accelerometer_damping=GATE.accelerometer_damping)
SETTINGS = TwoMassSettings(motor_mass=GATE.motor_mass, sensors=SENSORS)
# What the model can see: the motor's friction adds to that of the leaf.
COULOMB = GATE.coulomb_friction + GATE.motor_friction


@pytest.fixture(scope="module", params=[True, False], ids=["with references", "without references"])
def fit(request: pytest.FixtureRequest) -> TwoMassFit:
    return identify_two_mass(free_runs(GATE, 404, 8, references=request.param), SETTINGS)


def test_the_gate_is_identified(fit: TwoMassFit) -> None:
    assert fit.identified["load_mass"].value == pytest.approx(GATE.leaf_mass, rel=0.15)
    assert fit.identified["stiffness"].value == pytest.approx(GATE.take_up_stiffness, rel=0.05)
    assert fit.model.friction.coulomb_forward == pytest.approx(COULOMB, rel=0.15)
    assert fit.model.drive.load_mass == fit.identified["load_mass"].value


def test_standard_errors_cover_on_other_tracks() -> None:
    inside = []
    for seed in range(3):
        track = on_any_track(GATE, seed)
        found = identify_two_mass(free_runs(track, seed, 5, references=seed % 2 == 0), SETTINGS).identified
        for key, value in (
            ("load_mass", GATE.leaf_mass),
            ("stiffness", GATE.take_up_stiffness),
            ("coulomb_forward", COULOMB),
        ):
            if key != "coulomb_forward" or key in found:
                inside.append(abs(found[key].value - value) < 2.0 * found[key].standard_error)
    assert np.mean(inside) >= 0.8


def cut(run: AxisRun, seconds: float) -> AxisRun:
    first = round(seconds / run.period)
    names = ("torque", "speed", "position", "acceleration", "reference_speed", "reference_torque")
    values = {name: getattr(run, name)[first:] for name in names if getattr(run, name) is not None}
    return AxisRun(run.name, run.start + seconds, run.period, **values)


def test_runs_that_never_start_from_rest_are_refused() -> None:
    with pytest.raises(IdentificationError, match="none of 3 runs starts from rest"):
        identify_two_mass([cut(run, 1.0) for run in free_runs(GATE, 5, 3)], SETTINGS)


def test_the_motor_inertia_is_needed() -> None:
    with pytest.raises(IdentificationError, match="motor's inertia"):
        identify_two_mass(free_runs(GATE, 5, 2), TwoMassSettings(motor_mass=0.0))


def test_a_rigid_drive_is_not_given_a_stiffness() -> None:
    """The starts of one mass with the motor's part of it stated: an elastic drive would fit noise and friction."""
    model = AxisModel(
        drive=ElasticDrive(load_mass=160.0),
        friction=Friction(coulomb_forward=40.0, coulomb_backward=40.0, static=50.0),
        controller=Controller(period=1e-3, speed_gain=4000.0, integral_gain=20_000.0),
    )
    runs = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        time = np.arange(3000) * 1e-3
        reference = 0.2 * np.clip((time - 0.5) / 0.5, 0.0, 1.0)
        motion = simulate_axis(model, AxisInputs(reference))
        torque = motion["drive_force"] + rng.normal(0.0, 2.0, len(time))
        speed = motion["motor_speed"] + rng.normal(0.0, 2e-4, len(time))
        runs.append(AxisRun(f"{seed}", 0.0, 1e-3, torque, speed=speed, position=motion["motor_position"]))
    with pytest.raises(IdentificationError, match="a rigid drive describes the starts as well"):
        identify_two_mass(runs, TwoMassSettings(motor_mass=60.0))
    with pytest.raises(IdentificationError, match="the motor alone is stated"):
        identify_two_mass(runs, TwoMassSettings(motor_mass=600.0))


@pytest.mark.parametrize("number", [0, 2, 6])
def test_a_damped_drive_keeps_its_one_stiffness(number: int) -> None:
    """Gates of another simulator, with the damping and the friction near rest that starts do not show alone.

    The waves of the friction of number 2 are near the resonance, and its rough mass is wrong.
    """
    gate = drawn_gate(number)
    sensors = Sensors(torque_filter_time=gate.torque_filter, accelerometer_hz=gate.accelerometer_hz)
    runs = [axis_run(recording) for recording in strokes(gate, number, range(14)).recordings]
    found = identify_two_mass(runs, TwoMassSettings(motor_mass=gate.motor_mass, sensors=sensors)).identified
    for key, value in (("stiffness", gate.stiffness), ("load_mass", gate.leaf_mass)):
        assert abs(found[key].value - value) < 1.96 * found[key].standard_error


def test_a_stated_low_pass_of_the_torque_is_undone() -> None:
    model = AxisModel(
        drive=ElasticDrive(motor_mass=150.0, load_mass=300.0, stiffness=9e4, damping=150.0),
        friction=Friction(coulomb_forward=60.0, coulomb_backward=60.0, static=60.0),
        controller=Controller(period=1e-3, speed_gain=4000.0, integral_gain=20_000.0),
    )
    motion = simulate_axis(model, AxisInputs(0.2 * np.clip((np.arange(3000) * 1e-3 - 0.5) / 0.5, 0.0, 1.0)))
    torque = first_order_low_pass(motion["drive_force"], 0.03, 1e-3)
    run = AxisRun("", 0.0, 1e-3, torque, speed=motion["motor_speed"], position=motion["motor_position"])
    settings = TwoMassSettings(motor_mass=150.0, sensors=Sensors(torque_filter_time=0.03))
    found = identify_two_mass([run], settings).model.drive
    assert (found.load_mass, found.stiffness) == pytest.approx((300.0, 9e4), rel=0.05)
