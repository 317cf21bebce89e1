"""Glitches and the first departures before an alarm, on sample logs with known changes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge_alone, run_detector
from cdtool.commands.judging.runs import RunReading, load_runs
from cdtool.commands.learning.normal_runs import normal_motions
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording
from cdtool.report.explanation_words import words
from cdtool.results.explanation.departure import departures
from cdtool.results.explanation.explanation import Explainer, Explanation
from cdtool.results.explanation.glitch import glitches
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.normal_motion import NormalMotion, NormalMotions
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
) -> Explanation:
    """Return the first alarm of a detector with a constant limit."""
    file = machine(folder)
    (operation,) = operations_of(recording)
    instance = file.detector(detector)
    limits = [limit] * len(recording.joints)
    signal = run_detector(operation, file.machine, instance)
    detection = judge_alone(operation, instance.name, signal, [Limit.given(limits)], activation)
    return Explainer(detection, activation, instance.needs, normals).alarm(detection.verdict.alarms[0], None, "alarm")


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


def test_a_joint_that_is_stopped_has_left_its_normal_band(arm):
    item = explained("arm/trial_1", log("arm/trial_1", "stiff/01.csv"), arm, 6.0)
    assert item.runs > 5 and item.absent is None and item.glitches == ()
    by_channel = {found.channel: found for found in item.departed if found.joint == "arm"}
    speed, torque = by_channel["speed"], by_channel["torque"]
    assert (speed.direction, torque.direction) == ("down", "up")
    assert speed.mean == pytest.approx(0.28, abs=0.01) and speed.value < 0.1
    assert torque.value > 1.5 * torque.mean
    stayed = [line for line in words(item) if line.startswith("No departure")]
    assert not any("speed of arm" in line or "torque" in line.split("forearm")[0] for line in stayed)


def test_a_glitch_of_sixty_revolutions_a_minute_that_alone_raised_the_alarm_is_named(gate):
    clean = log("gate", "holdout/03.csv")
    height = -60.0 * 2.0 * np.pi / 60.0 * 1.333e-3  # 60 rpm of the motor, on the load side
    item = explained("gate", glitch(clean, height), gate, 255.0, activation=Activation(2))
    assert item.alarm is not None and item.alarm.time == pytest.approx(4.0, abs=0.02)
    (found,) = item.glitches
    assert (found.kind, found.channel, found.joint, found.samples) == ("spike", "speed", "gate", 6)
    assert found.start == pytest.approx(4.0, abs=3e-3) and found.size == pytest.approx(height, rel=0.15)
    assert "Spike of speed of gate: -0.008" in " ".join(words(item))


def test_a_pulse_that_other_channels_answer_is_not_called_a_glitch(gate):
    """A knock: the speed dips for 20 ms, and the torque responds."""
    knocked = glitch(log("gate", "holdout/03.csv"), -0.05, 4.0, 0.02)

    def answered(time: np.ndarray, values: np.ndarray) -> np.ndarray:
        values[(time >= 4.01) & (time < 4.2), 0] += 200.0
        return values

    item = explained("gate", changed(knocked, "torque", answered), gate, 255.0, activation=Activation(2))
    assert item.glitches == ()
    assert {"speed", "torque"} <= {found.channel for found in item.departed if not math.isnan(found.time)}


def test_a_value_that_stands_still_is_named_frozen():
    def frozen(time: np.ndarray, values: np.ndarray) -> np.ndarray:
        held = (time >= 3.95) & (time < 4.0)
        values[held, 0] = values[np.flatnonzero(held)[0], 0]
        return values

    stuck = changed(log("gate", "holdout/03.csv"), "torque", frozen)
    (found,) = glitches(stuck, ("torque", "speed"), (), 3.7, 4.0)
    assert (found.kind, found.channel, found.samples) == ("frozen", "torque", 50)
    assert found.start == pytest.approx(3.95, abs=1e-6) and found.size == stuck["torque"].values[3950, 0]


def test_the_load_cell_is_not_an_input(gate):
    whole = log("gate", "stiff/03.csv")
    bare = whole.without_ground_truth()
    wild = changed(whole, "force", lambda time, _: 1e4 * np.sin(40.0 * time)[:, np.newaxis])
    found = [explained("gate", item, gate, 300.0) for item in (whole, bare, wild)]
    assert len({every_value((item.departed, item.glitches)) for item in found}) == 1


def test_rows_that_are_missing_right_before_an_alarm_are_named_with_their_number(gate):
    clean = log("gate", "holdout/03.csv")
    parts = {}
    for name, series in clean.channels.items():
        gone = (series.time > 4.0) & (series.time < 4.021)
        parts[name] = replace(series, time=series.time[~gone], values=series.values[~gone])
    lost = replace(clean, channels=parts)
    # An alarm 10 ms after the gap, independent of the signal: every later sample is outside.
    after = int(np.searchsorted(lost["torque"].time, 4.031))
    file = machine("gate")
    (operation,) = operations_of(lost)
    signal = run_detector(operation, file.machine, file.detector("pure_torque"))
    values = np.zeros_like(signal.values)
    values[after:] = 9.0
    detection = judge_alone(
        operation, "pure_torque", replace(signal, values=values), [Limit.given([5.0])], Activation(1)
    )
    item = Explainer(detection, Activation(1), ("torque",), gate).alarm(detection.verdict.alarms[0], None, "alarm")
    (found,) = item.glitches
    assert (found.kind, found.channel) == ("dropout", "torque") and found.samples == pytest.approx(20, abs=1)
    assert "Dropout of torque: about 20 samples missing, 31 ms before the alarm." in words(item)
    assert all(math.isnan(each.time) or each.time > 4.031 for each in item.departed)


def test_in_impact_free_runs_glitches_and_departures_are_hardly_ever_named(gate):
    looks = departed = named = 0
    for path in sorted((LOGS / "gate" / "holdout").iterdir()):
        recording = log("gate", f"holdout/{path.name}").without_ground_truth()
        (operation,) = operations_of(recording)
        normal = gate.of(recording, operation.motion)
        assert isinstance(normal, NormalMotion)
        for at in np.arange(recording.start + 1.2, recording.end - 0.3, 0.4):
            found = departures(recording, normal, "gate", "gate", float(at) - 0.9, float(at) + 0.5)
            looks, departed = looks + len(found), departed + sum(not math.isnan(each.time) for each in found)
            named += len(glitches(recording, tuple(recording.channels), (), float(at) - 0.3, float(at)))
    assert looks > 250 and departed == 0 and named <= 2
