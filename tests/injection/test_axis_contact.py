"""A contact as the difference of two simulations, against the simulated gate's own contacts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cdtool.axis_model.obstacle import Obstacle
from cdtool.axis_model.parameters import AxisModel, Drive, Sensors
from cdtool.errors import RecordingError
from cdtool.identification.axis_run import axis_run
from cdtool.injection.axis_contact import ControllerReaction, Doubt, InjectedContact, axis_contact
from cdtool.injection.injected_recording import injected_recording
from cdtool.injection.refusal import Refusal, refusal
from cdtool.recording import Recording, Series
from cdtool.simulation.gate_model import GateRun, simulate_gate_run
from cdtool.simulation.gate_recordings import as_recording
from tests.axis_model.gate_as_model import gate_as_model, soft_obstacle, stiff_obstacle
from tests.synthetic.gate_runs import GATE, ON_LOAD_SIDE, without, without_references

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
    reaction: ControllerReaction = ControllerReaction.KNOWN,
) -> InjectedContact:
    return axis_contact(axis_run(ON_LOAD_SIDE.referred_to_load(recording)), model, OBSTACLES[kind], at, 1.0, reaction)


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


def test_samples_before_the_contact_are_not_touched() -> None:
    free, _, _ = twins("stiff", 6)
    injected = put(free, contact_in(free, 4.0005))
    for name, series in injected.channels.items():
        before = series.time <= 4.0005
        np.testing.assert_array_equal(series.values[before], free[name].values[: len(series)][before], err_msg=name)
    assert injected.end == pytest.approx(5.0, abs=0.01)
    assert "injected" in str(injected.findings[-1])


def test_the_contact_is_where_the_log_reaches_it_to_a_fraction_of_a_sample() -> None:
    free, _, _ = twins("stiff", 7)
    for at in (4.0, 4.00031, 4.00077):
        contact = contact_in(free, at)
        assert contact.start == at
        later = contact.force.values[:, 0] > 0.0
        first = float(contact.force.time[np.argmax(later)])
        assert 0.0 <= first - at <= 1.1e-3


def test_a_channel_on_a_clock_of_its_own_changes_on_that_clock() -> None:
    free, _, _ = twins("stiff", 8)
    rng = np.random.default_rng(0)
    slow = 2.5e-3 * (np.arange(3200) + rng.uniform(-0.2, 0.2, 3200))
    torque = Series(slow, np.interp(slow, free["torque"].time, free["torque"].values[:, 0]), "N")
    mixed = replace(free, channels={**free.channels, "torque": torque})
    injected = put(mixed, contact_in(mixed, 4.0))
    added = injected["torque"].values[:, 0] - torque.values[: len(injected["torque"]), 0]
    assert not np.any(added[injected["torque"].time <= 4.0])
    assert np.max(np.abs(added)) > 20.0


def test_missing_samples_stay_missing() -> None:
    free, _, _ = twins("stiff", 9)
    values = free["speed"].values.copy()
    values[4100:4120] = np.nan
    holes = replace(free, channels={**free.channels, "speed": free["speed"].with_values(values, "m/s")})
    injected = put(holes, contact_in(holes, 4.0))
    assert np.isnan(injected["speed"].values[4100:4120]).all()
    assert np.isfinite(injected["speed"].values[4120:]).all()


def test_a_log_without_a_load_cell_gets_one_without_noise() -> None:
    free, _, _ = twins("stiff", 10)
    injected = put(without(free, "force"), contact_in(free, 4.0))
    force = injected["force"]
    assert not np.any(force.values[force.time <= 4.0])
    assert np.max(force.values) > 3000.0


def test_torque_and_speed_alone_are_enough() -> None:
    free, _, hit = twins("stiff", 11)
    assert hit.contact_start is not None
    bare = without(free, "position", "acceleration", "force", "reference_speed", "reference_torque")
    whole = contact_in(free, hit.contact_start)
    contact = contact_in(bare, hit.contact_start)
    assert contact.peak_force == pytest.approx(whole.peak_force, rel=0.02)
    assert set(put(bare, contact).channels) == {"torque", "speed", "force"}


def test_the_brackets_of_an_unknown_controller_contain_the_known_one() -> None:
    free, _, _ = twins("stiff", 12)
    unknown = replace(MODEL, controller=None)
    torques = []
    for model, reaction in (
        (unknown, ControllerReaction.FROZEN),
        (MODEL, ControllerReaction.KNOWN),
        (unknown, ControllerReaction.STIFF),
    ):
        contact = contact_in(free, 4.0, "stiff", model, reaction)
        assert (Doubt.CONTROLLER_UNKNOWN in contact.doubts) == (reaction is not ControllerReaction.KNOWN)
        time = contact.changes["torque"].time
        torques.append(float(np.interp(4.08, time, contact.changes["torque"].values[:, 0])))
    assert torques[0] == pytest.approx(0.0, abs=1e-9)
    assert torques[0] < torques[1] < torques[2]


def test_a_rigid_drive_in_the_place_of_an_elastic_one_is_flagged_and_shows_the_contact_too_early() -> None:
    free, _, _ = twins("stiff", 13)
    rigid = replace(MODEL, drive=Drive(motor_mass=MODEL.drive.motor_mass, load_mass=MODEL.drive.load_mass))
    true, wrong = (contact_in(free, 4.0, "stiff", model) for model in (MODEL, rigid))
    assert Doubt.RIGID_DRIVE in wrong.doubts
    assert Doubt.RIGID_DRIVE not in true.doubts
    slowed = []
    for contact in (wrong, true):
        speed = contact.changes["speed"]
        slowed.append(float(speed.time[np.argmax(speed.values[:, 0] < -0.02)]))
    assert slowed[1] - slowed[0] > 0.010


def test_separation_and_wind_up_beyond_the_free_run_are_flagged() -> None:
    free, _, _ = twins("stiff", 14)
    contact = contact_in(free, 4.0)
    assert {Doubt.SEPARATION, Doubt.WIND_UP_BEYOND_FREE_RUNS} <= set(contact.doubts)
    assert contact.reliable_until == contact.separation < 4.2
    assert contact.wind_up > contact.free_wind_up


@pytest.mark.parametrize(("at", "message"), [(99.0, "outside the log"), (0.1, "at rest")])
def test_a_contact_that_cannot_be_is_refused(at: float, message: str) -> None:
    free, _, _ = twins("stiff", 15)
    with pytest.raises(RecordingError, match=message):
        contact_in(free, at)


def test_without_a_controller_there_is_no_known_reaction() -> None:
    free, _, _ = twins("stiff", 16)
    with pytest.raises(RecordingError, match="no controller"):
        contact_in(free, 4.0, "stiff", replace(MODEL, controller=None))


def test_an_obstacle_that_never_acts_is_an_error() -> None:
    free, _, _ = twins("stiff", 17)
    soft = Obstacle((0.0, 10.0, 11.0), (0.0, 1e-300, 1.0))
    with pytest.raises(RecordingError, match="changes nothing"):
        axis_contact(axis_run(ON_LOAD_SIDE.referred_to_load(free)), MODEL, soft, 4.0, 0.0)


UNKNOWN_DRIVE = replace(MODEL, drive=Drive(load_mass=1154.0))
KNOWN_RIGID = replace(MODEL, drive=Drive(load_mass=1154.0, stated_rigid=True))


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
