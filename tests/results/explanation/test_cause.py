"""The likely cause of an alarm, and the first departures, on sample logs with known changes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge, run_detector
from cdtool.commands.judging.runs import RunReading, load_runs
from cdtool.commands.learning.normal_runs import normal_motions
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording
from cdtool.report.explanation_words import words
from cdtool.results.explanation.cause import CauseKind
from cdtool.results.explanation.departure import _began
from cdtool.results.explanation.explanation import AlarmExplanation, explain_alarm
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.normal_choice import Absence, NormalMotions
from tests.bits import every_value

LOGS = Path(__file__).parents[3] / "sample_logs"
NINE = Activation(9)


def machine(folder: str) -> MachineFile:
    return read_machine_file(LOGS / folder / "machine.toml")


def free_runs(folder: str) -> list[Operation]:
    return load_runs(sorted((LOGS / folder / "free").iterdir()), machine(folder), RunReading("whole")).operations


@pytest.fixture(scope="module")
def gate() -> NormalMotions:
    return NormalMotions(normal_motions(free_runs("gate")))


@pytest.fixture(scope="module")
def arm() -> NormalMotions:
    return NormalMotions(normal_motions(free_runs("arm/trial_1")))


def log(folder: str, name: str) -> Recording:
    return cdtool.read(LOGS / folder / name, LOGS / folder / "machine.toml")


def explained(
    folder: str,
    recording: Recording,
    normals: NormalMotions,
    limit: float,
    detector: str = "momentum",
    activation: Activation = NINE,
) -> AlarmExplanation:
    """Return the first alarm of a detector with a constant limit."""
    file = machine(folder)
    (operation,) = operations_of(recording)
    instance = file.detector(detector)
    limits = [limit] * len(recording.joints)
    signal = run_detector(operation, file.machine, instance)
    detection = judge(operation, instance.name, signal, [Limit.given(limits)], activation)
    alarm = detection.verdict.alarms[0]
    return explain_alarm(detection, alarm, activation, inputs=instance.needs, normals=normals)


def changed(recording: Recording, channel: str, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Recording:
    series = recording[channel]
    values = change(series.time, series.values.copy())
    return replace(recording, channels={**recording.channels, channel: replace(series, values=values)})


def glitch(recording: Recording, height: float, start: float = 4.0, length: float = 0.006) -> Recording:
    """Change the speed by `height` for `length` from `start` [s]; downward, an observer sees a contact."""

    def added(time: np.ndarray, values: np.ndarray) -> np.ndarray:
        values[(time >= start) & (time < start + length), 0] += height
        return values

    return changed(recording, "speed", added)


def test_a_joint_that_is_stopped_is_not_within_its_usual_range(arm):
    item = explained("arm/trial_1", log("arm/trial_1", "stiff/01.csv"), arm, 6.0)
    assert item.cause.kind is CauseKind.CONTACT and item.runs > 5 and item.absent is None
    by_channel = {found.channel: found for found in item.moved if found.joint == "arm"}
    assert by_channel["speed"].direction == "down" and by_channel["torque"].direction == "up"
    speed, torque = item.cause.shifts
    assert speed.normal == pytest.approx(0.28, abs=0.01) and speed.value < 0.1
    assert torque.value > 1.5 * torque.normal
    usual = [line for line in words(item) if line.startswith("Within their usual range")]
    assert not any("speed of arm" in line or "torque" in line.split("forearm")[0] for line in usual)


def test_every_channel_outside_its_band_is_listed_with_value_mean_spread_and_unit(gate):
    item = explained("gate", log("gate", "stiff/03.csv"), gate, 300.0)
    first = next(found for found in item.moved if found.channel == "acceleration")
    assert first.unit == "m/s2" and abs(first.value - first.mean) > 5.0 * first.spread > 0.0
    line = next(line for line in words(item) if line.startswith("Moved first"))
    assert f"against {first.mean:.4g} +- {first.spread:.4g} m/s2" in line


def test_a_glitch_of_sixty_revolutions_a_minute_that_alone_raised_the_alarm_is_named(gate):
    clean = log("gate", "holdout/03.csv")
    height = -60.0 * 2.0 * np.pi / 60.0 * 1.333e-3  # 60 rpm of the motor, on the load side
    item = explained("gate", glitch(clean, height), gate, 255.0, activation=Activation(2))
    assert item.cause.kind is CauseKind.SPEED_GLITCH and item.alarm.time == pytest.approx(4.0, abs=0.02)
    assert item.cause.transient is not None
    assert item.cause.transient.start == pytest.approx(4.0, abs=3e-3)
    assert item.cause.transient.height == pytest.approx(height, rel=0.15)
    first = item.moved[0]
    assert (first.channel, first.brief) == ("speed", True)
    assert any(line.startswith("Likely cause: a glitch of the speed sensor") for line in words(item))


def test_a_speed_that_the_position_confirms_is_no_glitch(gate):
    clean = log("gate", "holdout/03.csv")
    height, start, length = -0.03, 4.0, 0.006
    moved = glitch(clean, height, start, length)

    def follow(time: np.ndarray, values: np.ndarray) -> np.ndarray:
        values[:, 0] += height * np.clip(time - start, 0.0, length)
        return values

    item = explained("gate", changed(moved, "position", follow), gate, 255.0, activation=Activation(2))
    assert item.cause.kind is not CauseKind.SPEED_GLITCH


def test_the_load_cell_is_not_an_input_of_the_cause(gate):
    whole = log("gate", "stiff/03.csv")
    bare = whole.without_ground_truth()
    wild = changed(whole, "force", lambda time, _: 1e4 * np.sin(40.0 * time)[:, np.newaxis])
    found = [explained("gate", item, gate, 300.0) for item in (whole, bare, wild)]
    assert found[0].cause == found[1].cause == found[2].cause
    assert len({every_value(item.moved) for item in found}) == 1


def test_rows_that_are_missing_right_before_an_alarm_are_named_with_their_number(gate):
    clean = log("gate", "holdout/03.csv")
    parts = {}
    for name, series in clean.channels.items():
        gone = (series.time > 4.0) & (series.time < 4.021)
        parts[name] = replace(series, time=series.time[~gone], values=series.values[~gone])
    lost = replace(clean, channels=parts)
    # An alarm 10 ms after the gap, independent of the signal: every later sample is outside.
    after = int(np.searchsorted(lost["torque"].time, 4.031))
    low = changed(lost, "torque", lambda _, values: values)
    file = machine("gate")
    (operation,) = operations_of(low)
    instance = file.detector("pure_torque")
    signal = run_detector(operation, file.machine, instance)
    values = np.zeros_like(signal.values)
    values[after:] = 9.0
    detection = judge(operation, "pure_torque", replace(signal, values=values), [Limit.given([5.0])], Activation(1))
    item = explain_alarm(detection, detection.verdict.alarms[0], Activation(1), inputs=("torque",), normals=gate)
    assert item.cause.kind is CauseKind.LOST and item.cause.loss is not None
    assert item.cause.loss.samples == pytest.approx(20, abs=1) and item.cause.loss.channel == "torque"
    assert all(math.isnan(found.time) or found.time > item.alarm.time for found in item.moved)


def test_a_channel_within_its_usual_range_is_listed_with_its_numbers(gate):
    clean = log("gate", "holdout/03.csv")
    item = explained("gate", glitch(clean, -0.02), gate, 255.0, activation=Activation(2))
    torque = next(found for found in item.moved if found.channel == "torque")
    assert torque.reason == "within its usual range" and math.isnan(torque.time)
    assert abs(torque.value - torque.mean) < 5.0 * torque.spread


def test_a_torque_that_is_off_from_the_start_is_never_called_usual(gate):
    clean = changed(log("gate", "holdout/03.csv"), "torque", lambda _, values: values + 150.0)
    item = explained("gate", glitch(clean, -0.05), gate, 500.0, activation=Activation(2))
    torque = next(found for found in item.moved if found.channel == "torque")
    assert torque.reason != "within its usual range"


@pytest.mark.parametrize(
    ("absent", "told"),
    [
        (Absence.BY_HAND, "limits set by hand are not learned"),
        (Absence.OLDER_FILE, "relearn it with cdtool learn-signature"),
        (Absence.FEW_RUNS, "too few impact-free runs"),
    ],
)
def test_without_impact_free_runs_the_comparison_and_its_reason_are_stated(absent, told):
    item = explained("gate", log("gate", "stiff/03.csv"), NormalMotions((), absent), 300.0)
    assert item.absent is absent and item.runs == 0
    text = " ".join(words(item))
    assert "No impact-free runs to compare with: " in text and "this log's own past" in text and told in text
    # Nothing was learned, so nothing is called normal, and the next step is given.
    assert "usual range" not in text and "normal" not in text.replace("has no normal motion", "")
    assert item.cause.kind is CauseKind.CONTACT and "Likely cause: a contact: speed of gate" in text
    assert "learn" in text.partition("No impact-free runs to compare with")[2]


def test_a_drifting_speed_within_its_band_departs_at_the_bend(gate):
    # The speed deviates by up to half of its limit for 60 ms before this contact, and falls 35 ms after it.
    item = explained("gate", log("gate", "stiff/04.csv"), gate, 300.0)
    speed = next(each for each in item.moved if each.channel == "speed")
    assert 0.03 <= speed.time - 5.939 <= 0.05
    assert "(farthest -0.1992 against" in " ".join(words(item))


@pytest.mark.parametrize("wandering", [0.3, 0.45, 0.5, 0.6])
def test_a_departure_after_a_slow_drift_begins_at_the_bend(wandering):
    time = np.arange(0.0, 1.0, 1e-3)
    noise = 0.02 * np.random.default_rng(1).normal(size=len(time))
    shares = noise + np.clip(wandering * (time - 0.2) / 0.4, 0.0, wandering) + np.maximum(time - 0.8, 0.0) * 20.0
    last = int(np.argmax(shares > 1.0)) + 2
    began = _began(time[: last + 1], shares[: last + 1])
    assert time[began] == pytest.approx(0.8, abs=0.012)


def test_a_stroke_at_another_speed_is_not_compared_with_a_learned_class(gate):
    (normal,) = gate.motions
    faster = NormalMotions((replace(normal, motion=replace(normal.motion, nominal_speed=0.5)),))
    item = explained("gate", log("gate", "stiff/03.csv"), faster, 300.0)
    assert item.absent is Absence.NO_CLASS
    both = NormalMotions((*faster.motions, *gate.motions))
    assert explained("gate", log("gate", "stiff/03.csv"), both, 300.0).absent is None


def test_an_alarm_without_any_departure_is_not_clear(gate):
    item = explained("gate", log("gate", "holdout/03.csv"), gate, 215.0, activation=Activation(1))
    assert item.cause.kind in (CauseKind.UNCLEAR, CauseKind.FRICTION)
    if item.cause.kind is CauseKind.UNCLEAR:
        assert "Likely cause: not clear." in words(item)
