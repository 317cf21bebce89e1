"""Division into strokes and their classes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import RecordingError, UsageError
from cdtool.recordings.motion import motion_class
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording, Series

TIME = np.arange(12_000) * 1e-3


def recording(speed: np.ndarray, **more: np.ndarray) -> Recording:
    channels = {"speed": Series(TIME, speed, "m/s")}
    channels |= {name: Series(TIME, values, "1") for name, values in more.items()}
    return Recording("log", "log", ("axis",), channels)


def speed_of(*strokes: tuple[float, float, float]) -> np.ndarray:
    """(start, end, speed) strokes with noise."""
    speed = 1e-3 * np.random.default_rng(0).normal(size=len(TIME))
    for start, end, v in strokes:
        speed[(start <= TIME) & (end > TIME)] += v
    return speed


def test_strokes_separated_by_rests_become_operations_with_direction_and_speed():
    parts = operations_of(recording(speed_of((1, 3, 0.2), (4, 6, -0.2), (7, 11, 0.1))), "motion")
    assert [part.name for part in parts] == ["log#1", "log#2", "log#3"]
    assert [part.motion.direction for part in parts] == [1, -1, 1]
    assert [part.motion.nominal_speed for part in parts] == pytest.approx([0.2, 0.2, 0.1], rel=0.02)
    assert parts[1].recording.start == pytest.approx(3.5, abs=0.02)
    assert parts[1].recording.end == pytest.approx(6.5, abs=0.02)


def test_a_reversal_without_rest_ends_a_stroke():
    parts = operations_of(recording(speed_of((1, 3, 0.2), (3, 5, -0.2))), "motion")
    assert [part.motion.direction for part in parts] == [1, -1]


def test_a_short_pause_does_not_end_a_stroke_and_a_short_motion_is_not_one():
    parts = operations_of(recording(speed_of((1, 3, 0.2), (3.1, 5, 0.2), (8, 8.1, 0.2))), "motion")
    assert len(parts) == 1


def test_a_trigger_channel_cuts_where_it_is_high():
    trigger = ((TIME >= 2) & (TIME < 5)) | ((TIME >= 6) & (TIME < 7))
    parts = operations_of(recording(speed_of((0, 12, 0.2)), trigger=trigger.astype(float)), "trigger")
    assert [(part.recording.start, round(part.recording.end, 3)) for part in parts] == [(2.0, 4.999), (6.0, 6.999)]


def test_a_trigger_without_a_sample_cuts_nothing():
    log = recording(speed_of((0, 12, 0.2)), trigger=np.zeros(len(TIME)))
    log = replace(log, channels={**log.channels, "trigger": log["trigger"].between(20.0, 30.0)})
    with pytest.raises(RecordingError, match="no operation found by trigger"):
        operations_of(log, "trigger")


def test_the_reference_speed_decides_the_class_where_it_is_logged():
    stopped = speed_of((1, 2, 0.05))
    log = recording(stopped, reference_speed=np.where(TIME > 1, 0.2, 0.0))
    assert motion_class(log).nominal_speed == pytest.approx(0.2)


def test_a_resting_recording_has_no_direction_and_no_stroke():
    log = recording(np.zeros(len(TIME)))
    assert motion_class(log).direction == 0
    with pytest.raises(RecordingError, match="no operation found"):
        operations_of(log, "motion")


def test_the_leading_joint_is_the_one_that_moves_most():
    values = np.column_stack((0.01 * np.sin(TIME), np.sin(TIME)))
    log = Recording("r", "r", ("a", "b"), {"speed": Series(TIME, values, "rad/s")})
    assert motion_class(log).joint == 1
    values[::2, 1] = np.nan  # every other message has no value of it
    values[1::2, 1] = 0.007
    assert motion_class(replace(log, channels={"speed": Series(TIME, values, "rad/s")})).joint == 1


def test_an_unknown_way_to_cut_names_the_known_ones():
    with pytest.raises(UsageError, match="motion"):
        operations_of(recording(np.zeros(len(TIME))), "motions")


@pytest.mark.parametrize(
    ("origin", "first", "began"),
    [(1.7e9, 0.5, 1.7e9 + 0.5), (0.0, 0.5, None), (0.0, 1.7e9, 1.7e9), (5.0e9, 0.0, None), (3.2e8, 0.0, None)],
)
def test_the_first_sample_of_any_channel_counts(origin, first, began):
    channels = {
        "speed": Series(np.array([first + 1.0, first + 2.0]), np.zeros((2, 1)), "m/s"),
        "torque": Series(np.array([first, first + 2.0]), np.zeros((2, 1)), "N"),
    }
    assert Recording("a.csv", "a.csv", ("gate",), channels, origin).began == began
