"""Take-up travel, end stiffness and load from contacts of the simulated gate with a load cell."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.commands.identify.contact.contact_fit import ContactFit, ContactSettings, identify_contacts, with_contacts
from cdtool.commands.identify.contact.load_cell_contact import LoadCellContact, load_cell_contact
from cdtool.commands.identify.estimate import IdentificationError, Method, Missing
from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.commands.simulate.gate_recordings import as_recording
from cdtool.machines.axis_model.parameters import AxisModel, ElasticDrive
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis
from cdtool.recordings.recording import Contact, Recording, Series
from tests.machines.axis_model.gate_as_model import gate_as_model, stiff_obstacle
from tests.synthetic.gate_runs import GATE, ON_LOAD_SIDE, without

# What impact-free runs show: the first stiffness, all friction on the load, a load that is 3 % off.
IDENTIFIED = gate_as_model(GATE)
MODEL = replace(
    IDENTIFIED,
    friction=replace(
        IDENTIFIED.friction,
        coulomb_forward=GATE.coulomb_friction + GATE.motor_friction,
        coulomb_backward=GATE.coulomb_friction + GATE.motor_friction,
        static=GATE.static_friction + GATE.motor_friction,
    ),
    drive=ElasticDrive(
        motor_mass=GATE.motor_mass,
        load_mass=600.0,
        stiffness=GATE.take_up_stiffness,
        front_stiffness=GATE.post_stiffness,
    ),
)
SETTINGS = ContactSettings(largest_wind_up=5e-3)


@cache
def struck(gate: GateParameters, number: int) -> tuple[Recording, Contact]:
    run = simulate_gate_run(gate, np.random.default_rng([77, number]), "stiff")
    assert run.contact_start is not None
    recording = ON_LOAD_SIDE.referred_to_load(as_recording(run, f"hit {number}", gate))
    return recording, Contact(run.contact_start, run.contact_start + 1.0, 1e-3)


def contacts(gate: GateParameters = GATE, count: int = 3) -> list[tuple[Recording, Contact]]:
    return [struck(gate, number) for number in range(count)]


def prepared(pairs: Sequence[tuple[Recording, Contact]], model: AxisModel = MODEL) -> list[LoadCellContact]:
    return [load_cell_contact(recording, contact, model) for recording, contact in pairs]


@pytest.fixture(scope="module")
def fit() -> ContactFit:
    return identify_contacts(prepared(contacts()), MODEL, SETTINGS)


@pytest.fixture(scope="module")
def one() -> ContactFit:
    return identify_contacts(prepared(contacts(count=1)), MODEL, SETTINGS)


def test_the_gate_is_identified(fit: ContactFit) -> None:
    identified = fit.identified
    assert identified["load_mass"].value == pytest.approx(GATE.leaf_mass, rel=0.02)
    assert identified["take_up_travel"].value == pytest.approx(GATE.take_up_travel, rel=0.06)
    assert identified["end_stiffness"].value == pytest.approx(GATE.drive_stiffness, rel=0.02)
    assert identified["end_damping"].value == pytest.approx(GATE.drive_damping, rel=0.15)
    assert identified["front_mass"].value == pytest.approx(GATE.post_mass, rel=0.1)
    assert {item.method for item in identified.estimates} == {Method.CONTACTS}


def test_the_standard_errors_are_of_the_size_of_the_errors(fit: ContactFit) -> None:
    truth = {"load_mass": 620.0, "take_up_travel": 5e-3, "end_stiffness": 1.2e6, "stiffness": 8e4, "front_mass": 60.0}
    for key, value in truth.items():
        estimate = fit.identified[key]
        assert abs(estimate.value - value) < 3.0 * estimate.standard_error
        assert 0.001 < estimate.relative_error < 0.06


def test_friction_on_the_motor_is_no_longer_that_of_the_load(fit: ContactFit) -> None:
    model = with_contacts(MODEL, fit)
    assert model.drive.motor_friction == pytest.approx(GATE.motor_friction, rel=0.5)
    total = model.drive.motor_friction + model.friction.coulomb_forward
    assert total == pytest.approx(MODEL.friction.coulomb_forward)
    moved = {item.key: item.value for item in fit.together if item.section == "model.friction"}
    assert moved == {key: getattr(model.friction, key) for key in ("coulomb_forward", "coulomb_backward", "static")}


def test_the_model_gets_every_value_that_is_reported(fit: ContactFit) -> None:
    drive = with_contacts(MODEL, fit).drive
    reported = [item for item in (*fit.identified.estimates, *fit.together) if item.section != "model.friction"]
    assert {item.key for item in reported} >= {"load_mass", "take_up_travel", "end_stiffness", "damping", "front_mass"}
    for item in reported:
        assert getattr(drive, item.key) == item.value
    assert drive.observed_wind_up == fit.wind_up > fit.identified["take_up_travel"].value


def test_the_model_follows_the_contacts(fit: ContactFit) -> None:
    assert fit.relative_error["torque"] < 0.08
    assert fit.relative_error["acceleration"] < 0.1
    assert fit.drive_force > 1000.0


def test_a_noise_free_contact_of_the_same_model_is_recovered() -> None:
    true = replace(IDENTIFIED, sensors=replace(IDENTIFIED.sensors, torque_filter_time=0.0, accelerometer_hz=0.0))
    time = np.arange(0.0, 3.0, 1e-3)
    inputs = AxisInputs(np.clip(0.2 * (time - 0.2), 0.0, 0.2))
    free = simulate_axis(true, inputs)
    motion = simulate_axis(true, inputs, stiff_obstacle(GATE).at(float(free["load_position"][2000]), 1))
    channels = {
        "torque": Series(time, motion["drive_force"], "N"),
        "position": Series(time, motion["motor_position"], "m"),
        "speed": Series(time, motion["motor_speed"], "m/s"),
        "force": Series(time, motion["contact_force"], "N"),
    }
    recording = Recording("noise-free", "noise-free", ("axis",), channels)
    start = motion.first_contact
    known = replace(true, drive=replace(MODEL.drive, motor_friction=GATE.motor_friction))
    found = identify_contacts([load_cell_contact(recording, Contact(start, start + 0.5, 1e-3), known)], known)
    assert found.identified["load_mass"].value == pytest.approx(620.0, rel=0.005)
    assert found.identified["take_up_travel"].value == pytest.approx(5e-3, rel=0.02)
    assert found.identified["end_stiffness"].value == pytest.approx(1.2e6, rel=0.02)


def test_the_delay_of_the_load_cell_is_found(one: ContactFit) -> None:
    late = []
    for recording, contact in contacts(count=1):
        force = recording["force"]
        delayed = Series(force.time + 4e-3, force.values, force.unit)
        late.append((replace(recording, channels={**recording.channels, "force": delayed}), contact))
    found = identify_contacts(prepared(late), MODEL, SETTINGS)
    assert found.delays[0] - one.delays[0] == pytest.approx(4e-3, abs=1e-3)
    assert found.identified["take_up_travel"].value == pytest.approx(GATE.take_up_travel, rel=0.06)


def test_contacts_in_the_other_direction_give_the_same(one: ContactFit) -> None:
    turned = []
    for recording, contact in contacts(count=1):
        channels = {
            name: series if name == "force" else series.with_values(-series.values, series.unit)
            for name, series in recording.channels.items()
        }
        turned.append((replace(recording, channels=channels), contact))
    found = identify_contacts(prepared(turned), MODEL, SETTINGS)
    assert found.identified["end_stiffness"].value == pytest.approx(one.identified["end_stiffness"].value, rel=1e-3)


def test_the_speed_with_its_known_low_pass_replaces_the_position(one: ContactFit) -> None:
    pairs = [(without(recording, "position"), contact) for recording, contact in contacts(count=1)]
    found = identify_contacts(prepared(pairs), MODEL, SETTINGS)
    assert found.identified["end_damping"].value == pytest.approx(one.identified["end_damping"].value, rel=0.02)


def test_the_damping_is_not_identifiable_from_a_speed_with_an_unknown_low_pass() -> None:
    model = replace(MODEL, controller=None)
    pairs = [(without(recording, "position"), contact) for recording, contact in contacts(count=1)]
    found = identify_contacts(prepared(pairs, model), model, SETTINGS)
    missing = {item.key: item.missing for item in found.identified.not_identifiable}
    assert missing["end_damping"] == (Missing.POSITION,)
    assert "end_damping" not in found.identified


def test_a_front_of_unknown_stiffness_makes_the_load_less_certain() -> None:
    model = replace(MODEL, drive=replace(MODEL.drive, front_stiffness=math.inf))
    found = identify_contacts(prepared(contacts(count=1), model), model, SETTINGS).identified
    assert "front_mass" not in found
    assert found["load_mass"].relative_error >= 0.02
    assert found["load_mass"].value == pytest.approx(GATE.leaf_mass, abs=2.0 * found["load_mass"].standard_error)


def test_contacts_that_wind_the_drive_up_no_further_show_no_second_stage() -> None:
    soft = replace(GATE, take_up_travel=1.0)
    found = identify_contacts(prepared(contacts(soft, 1)), MODEL, ContactSettings(largest_wind_up=60e-3))
    for key in ("take_up_travel", "end_stiffness"):
        item = next(item for item in found.identified.not_identifiable if item.key == key)
        assert item.missing == (Missing.CONTACTS,)
        assert item.numbers["drive_force"] < item.numbers["drive_force_of_impact_free_runs"]
    assert math.isinf(found.drive.take_up_travel)


def test_a_drive_with_one_stiffness_has_no_second_one() -> None:
    gate = replace(GATE, take_up_stiffness=1.2e6, take_up_damping=1500.0)
    model = replace(MODEL, drive=replace(MODEL.drive, stiffness=1.2e6))
    found = identify_contacts(prepared(contacts(gate, 1), model), model)
    assert {"take_up_travel", "end_stiffness"} <= {item.key for item in found.identified.not_identifiable}
    assert found.identified["load_mass"].value == pytest.approx(GATE.leaf_mass, rel=0.04)
    assert with_contacts(model, found).drive.stiffness == 1.2e6


def test_a_slow_log_does_not_show_the_end_stiffness() -> None:
    slow = []
    for recording, contact in contacts(count=1):
        channels = {
            name: Series(series.time[::10], series.values[::10], series.unit)
            for name, series in recording.channels.items()
        }
        slow.append((replace(recording, channels=channels), contact))
    found = identify_contacts(prepared(slow), MODEL, SETTINGS).identified
    assert next(item for item in found.not_identifiable if item.key == "end_stiffness").missing == (
        Missing.HIGHER_RATE,
    )
    assert found["load_mass"].value == pytest.approx(GATE.leaf_mass, rel=0.04)


def test_a_torque_that_does_not_belong_to_the_contact_is_refused() -> None:
    recording, contact = struck(GATE, 0)
    noise = recording["torque"].with_values(-2.0 * recording["torque"].values, "N")
    pairs = [(replace(recording, channels={**recording.channels, "torque": noise}), contact)]
    with pytest.raises(IdentificationError, match=r"the model's torque is \d+ % off"):
        identify_contacts(prepared(pairs), MODEL, SETTINGS)


def test_without_contacts_or_stiffness_nothing_is_identified() -> None:
    with pytest.raises(IdentificationError, match="no contact with a load cell"):
        identify_contacts([], MODEL)
    rigid = replace(MODEL, drive=ElasticDrive(load_mass=1000.0))
    with pytest.raises(IdentificationError, match="first stiffness"):
        identify_contacts(prepared(contacts(count=1)), rigid)


def cut(recording: Recording, first: float, last: float) -> Recording:
    channels = {name: series.between(first, last) for name, series in recording.channels.items()}
    return replace(recording, channels=channels)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [(0.03, 1.0, "does not cover the contact"), (0.5, 0.1, "does not cover the contact")],
)
def test_a_log_that_does_not_cover_the_contact_is_refused(before: float, after: float, message: str) -> None:
    recording, contact = struck(GATE, 0)
    part = cut(recording, contact.start - before, contact.start + after)
    with pytest.raises(RecordingError, match=message):
        load_cell_contact(part, contact, MODEL)


def test_missing_samples_and_a_missing_load_cell_are_refused() -> None:
    recording, contact = struck(GATE, 0)
    torque = recording["torque"].values.copy()
    near = np.abs(recording["torque"].time - contact.start - 0.05) < 0.01
    torque[near] = np.nan
    gap = {**recording.channels, "torque": recording["torque"].with_values(torque, "N")}
    with pytest.raises(RecordingError, match="samples are missing"):
        load_cell_contact(replace(recording, channels=gap), contact, MODEL)
    with pytest.raises(RecordingError, match="no load cell"):
        load_cell_contact(without(recording, "force"), contact, MODEL)


def test_an_axis_at_rest_does_not_approach() -> None:
    recording, contact = struck(GATE, 0)
    with pytest.raises(RecordingError, match="does not move"):
        load_cell_contact(recording, replace(contact, start=0.25), MODEL)


def test_a_lever_arm_makes_a_torque_of_the_force() -> None:
    recording, contact = struck(GATE, 0)
    whole = load_cell_contact(recording, contact, MODEL)
    half = load_cell_contact(recording, contact, MODEL, lever_arm=0.5)
    assert np.allclose(half.force, 0.5 * whole.force)
