"""A contact as the difference of two simulations, against the simulated gate's own contacts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.commands.inject.assumption import Assumption, ControllerReaction, assumptions_of
from cdtool.commands.inject.axis_contact import axis_contact
from cdtool.commands.inject.injected_contact import Doubt, InjectedContact
from cdtool.commands.inject.injected_logs import injected_recording
from cdtool.commands.inject.with_injected import Refusal, refusal
from cdtool.commands.simulate.gate_model import GateRun, simulate_gate_run
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.parameters import AxisModel, ElasticDrive, Sensors
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis
from cdtool.recordings.recording import Recording
from tests.machines.axis_model.gate_as_model import gate_as_model, soft_obstacle, stiff_obstacle
from tests.synthetic.gate_as_recording import as_recording
from tests.synthetic.gate_runs import GATE, ON_LOAD_SIDE, without_references

MODEL = gate_as_model(GATE)
OBSTACLES = {"stiff": stiff_obstacle(GATE), "soft": soft_obstacle(GATE)}


def twins(kind: str, seed: int) -> tuple[Recording, Recording, GateRun]:
    """Return the impact-free recording, the one with the contact, and the simulated run of the latter."""
    hit = simulate_gate_run(GATE, np.random.default_rng(seed), kind)  # type: ignore[arg-type]
    free = simulate_gate_run(GATE, np.random.default_rng(seed), "none")
    return as_recording(free, "free", GATE), as_recording(hit, "hit", GATE), hit


def contact_in(
    recording: Recording,
    at: float,
    kind: str = "stiff",
    model: AxisModel = MODEL,
    assumption: Assumption | None = None,
) -> InjectedContact:
    return axis_contact(axis_run(ON_LOAD_SIDE.referred_to_load(recording)), model, OBSTACLES[kind], at, 1.0, assumption)


def put(recording: Recording, contact: InjectedContact) -> Recording:
    return injected_recording(recording, ON_LOAD_SIDE, contact.changes, contact.force, (0,))


@pytest.mark.parametrize("kind", ["stiff", "soft"])
@pytest.mark.parametrize("references", [True, False])
def test_every_channel_changes_as_in_the_true_contact(kind: str, references: bool) -> None:
    free, true, hit = twins(kind, 5)
    assert hit.contact_start is not None
    free = free if references else without_references(free)
    injected = put(free, contact_in(free, hit.contact_start, kind))
    time = injected["speed"].time
    within = (time > hit.contact_start) & (time < hit.contact_start + 0.1)
    rows = slice(0, len(time))
    for channel, share in (("speed", 0.1), ("torque", 0.15), ("force", 0.05), ("position", 0.1)):
        found, expected = (item[channel].values[rows, 0] for item in (injected, true))
        before = free[channel].values[rows, 0] if channel in free else 0.0
        size = np.max(np.abs((expected - before)[within]))
        assert np.max(np.abs(found - expected)[within]) < share * size, channel


def test_the_brackets_of_an_unknown_controller_contain_the_known_one() -> None:
    free, _, _ = twins("stiff", 12)
    unknown = replace(MODEL, controller=None)
    torques = []
    for model, reaction in (
        (unknown, ControllerReaction.FROZEN),
        (MODEL, ControllerReaction.KNOWN),
        (unknown, ControllerReaction.STIFF),
    ):
        contact = contact_in(free, 4.0, "stiff", model, Assumption(reaction))
        assert (Doubt.CONTROLLER_UNKNOWN in contact.doubts) == (reaction is not ControllerReaction.KNOWN)
        time = contact.changes["torque"].time
        torques.append(float(np.interp(4.08, time, contact.changes["torque"].values[:, 0])))
    assert torques[0] == pytest.approx(0.0, abs=1e-9)
    assert torques[0] < torques[1] < torques[2]


def test_a_rigid_drive_in_the_place_of_an_elastic_one_is_flagged_and_shows_the_contact_too_early() -> None:
    free, _, _ = twins("stiff", 13)
    rigid = replace(MODEL, drive=ElasticDrive(motor_mass=MODEL.drive.motor_mass, load_mass=MODEL.drive.load_mass))
    true, wrong = (contact_in(free, 4.0, "stiff", model) for model in (MODEL, rigid))
    assert Doubt.RIGID_DRIVE in wrong.doubts
    assert Doubt.RIGID_DRIVE not in true.doubts
    slowed = []
    for contact in (wrong, true):
        speed = contact.changes["speed"]
        slowed.append(float(speed.time[np.argmax(speed.values[:, 0] < -0.02)]))
    assert slowed[1] - slowed[0] > 0.010


def value_at(contact: InjectedContact, channel: str, time: float) -> float:
    change = contact.changes[channel]
    return float(np.interp(time, change.time, change.values[:, 0]))


def known_up_to_the_free_run(free: Recording) -> AxisModel:
    """The model without what impact-free runs do not show of the drive."""
    drive = MODEL.drive
    wind_up = contact_in(free, 4.0).free_wind_up
    return replace(
        MODEL,
        drive=replace(
            drive, take_up_travel=math.inf, end_stiffness=math.inf, end_damping=0.0, observed_wind_up=wind_up
        ),
    )


def test_the_brackets_of_a_drive_beyond_its_known_wind_up_contain_the_true_torque() -> None:
    free, _, _ = twins("stiff", 18)
    model = known_up_to_the_free_run(free)
    soft, rigid = assumptions_of(model)
    assert (soft.suffix, rigid.suffix) == ("", "_rigid")
    true, least, most = contact_in(free, 4.0), *(contact_in(free, 4.0, "stiff", model, item) for item in (soft, rigid))
    assert Doubt.WIND_UP_BEYOND_FREE_RUNS in least.doubts
    # Up to the known wind-up all are the same; beyond it a stiffer drive slows the motor sooner.
    before = [value_at(item, "speed", 4.05) for item in (least, true, most)]
    assert before == pytest.approx([before[1]] * 3, rel=1e-5)
    assert before[1] < -1e-3
    for after in (0.06, 0.07, 0.08):
        slowed = [value_at(item, "speed", 4.0 + after) for item in (least, true, most)]
        assert slowed[0] > slowed[1] > slowed[2]


def test_the_brackets_of_an_unknown_slew_limit_contain_the_true_torque() -> None:
    free, _, _ = twins("stiff", 20)
    assert MODEL.controller is not None and math.isfinite(MODEL.controller.slew_limit)
    slow = 0.5 * MODEL.controller.slew_limit
    unknown = replace(MODEL, controller=replace(MODEL.controller, slew_limit=math.inf, observed_slope=slow))
    assumptions = assumptions_of(unknown)
    assert [item.suffix for item in assumptions] == ["", "_limited"]
    fast, limited = (contact_in(free, 4.0, "stiff", unknown, item) for item in assumptions)
    assert Doubt.SLOPE_BEYOND_FREE_RUNS in fast.doubts and Doubt.SLOPE_BEYOND_FREE_RUNS not in limited.doubts
    torques = [value_at(item, "torque", 4.06) for item in (limited, contact_in(free, 4.0), fast)]
    assert torques[0] < torques[1] < torques[2]


@pytest.mark.parametrize(("at", "message"), [(99.0, "outside the log"), (0.1, "at rest")])
def test_a_contact_that_cannot_be_is_refused(at: float, message: str) -> None:
    free, _, _ = twins("stiff", 15)
    with pytest.raises(RecordingError, match=message):
        contact_in(free, at)


def with_values(run: AxisRun, **changed: object) -> AxisRun:
    return replace(run, **changed)  # type: ignore[arg-type]


def test_a_model_that_does_not_follow_the_log_is_refused() -> None:
    free, _, _ = twins("stiff", 21)
    assert MODEL.controller is not None
    weak = replace(MODEL.controller, speed_gain=0.1 * MODEL.controller.speed_gain, integral_gain=0.0)
    with pytest.raises(RecordingError, match=r"the model moves at .*, the log at 0\.2"):
        contact_in(free, 4.0, "stiff", replace(MODEL, controller=weak))
    run = axis_run(ON_LOAD_SIDE.referred_to_load(free))
    with pytest.raises(RecordingError, match="the torque falls where the model's rises"):
        axis_contact(with_values(run, torque=-run.torque), MODEL, OBSTACLES["stiff"], 4.0)


UNKNOWN_DRIVE = replace(MODEL, drive=ElasticDrive(load_mass=1154.0))
KNOWN_RIGID = replace(MODEL, drive=ElasticDrive(load_mass=1154.0, stated_rigid=True))


@pytest.mark.parametrize(
    ("needs", "model", "reaction", "expected"),
    [
        (("torque",), MODEL, ControllerReaction.KNOWN, None),
        (("torque",), MODEL, ControllerReaction.FROZEN, Refusal.CONTROLLER),
        (("torque", "reference_torque"), MODEL, ControllerReaction.STIFF, Refusal.CONTROLLER),
        (("torque", "speed"), MODEL, ControllerReaction.FROZEN, None),
        (("torque", "speed"), UNKNOWN_DRIVE, ControllerReaction.KNOWN, Refusal.DRIVE),
        (("torque", "speed"), KNOWN_RIGID, ControllerReaction.KNOWN, None),
        (("acceleration",), UNKNOWN_DRIVE, ControllerReaction.KNOWN, None),
        (("acceleration",), replace(MODEL, sensors=Sensors()), ControllerReaction.KNOWN, Refusal.ACCELEROMETER),
    ],
)
def test_detectors_that_need_what_the_model_does_not_know_are_refused(
    needs: tuple[str, ...], model: AxisModel, reaction: ControllerReaction, expected: Refusal | None
) -> None:
    assert refusal(needs, model, reaction) is expected
    assert math.isfinite(model.drive.load_mass)


def test_an_axis_that_was_beyond_the_place_before_meets_the_obstacle_only_at_the_contact() -> None:
    """A reciprocating axis that never rests, whose second forward stroke is shorter than its first."""
    time = np.arange(6000) * 1e-3
    rate = 2.0 * math.pi / 3.0
    speed = np.where(time < 3.0, 0.3, 0.2) * np.sin(rate * time)
    assert MODEL.controller is not None
    motion = simulate_axis(MODEL, AxisInputs(speed))
    run = AxisRun("reciprocating", 0.0, 1e-3, motion["drive_force"], speed=motion["motor_speed"], reference_speed=speed)
    contact = axis_contact(run, MODEL, OBSTACLES["stiff"], 3.8, 0.3)
    before = contact.force.time < 3.8 - 1e-9
    assert not np.any(contact.force.values[before])
    assert not np.any(contact.changes["speed"].values[before])
    assert contact.peak_force > 100.0


def test_the_rigid_end_of_a_drive_is_where_the_contact_winds_it_up_in_either_direction() -> None:
    free, _, _ = twins("stiff", 19)
    run = axis_run(ON_LOAD_SIDE.referred_to_load(free))
    mirrored = replace(
        run,
        **{name: -getattr(run, name) for name in ("torque", "speed", "position", "reference_speed")},
        acceleration=None,
        reference_torque=None,
    )
    model = known_up_to_the_free_run(free)
    rigid = assumptions_of(model)[1]
    forward = axis_contact(run, model, OBSTACLES["stiff"], 4.0, 0.2, rigid)
    backward = axis_contact(mirrored, model, OBSTACLES["stiff"], 4.0, 0.2, rigid)
    assert backward.speed == pytest.approx(-forward.speed)
    for channel in ("speed", "torque", "position", "acceleration"):
        assert -backward.changes[channel].values == pytest.approx(forward.changes[channel].values, abs=1e-6)
    assert backward.force.values == pytest.approx(forward.force.values, abs=1e-6)
