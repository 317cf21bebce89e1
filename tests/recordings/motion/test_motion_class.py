"""The nominal speed of a run, and grouping runs by how they move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.learning.grouping import by_class
from cdtool.recordings.motion import measured_class, motion_class
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.common_class import common_class
from tests.recordings.motion.speed_logs import log


def jittered(speed: float, rate: float, seed: int) -> Recording:
    """A stroke of which the position is logged at jittering stamps and the speed derived from it."""
    rng = np.random.default_rng(seed)
    true_time = np.cumsum(rng.uniform(0.6, 1.4, round(8.0 * rate)) / rate)
    stamps = true_time + rng.uniform(-0.25, 0.25, len(true_time)) / rate
    stamps = np.maximum.accumulate(stamps) + 1e-6 * np.arange(len(stamps))
    moving = np.clip(true_time - 1.0, 0.0, 5.0)
    position = speed * np.maximum(moving - 0.25, 0.5 * np.minimum(moving, 0.5) ** 2 / 0.5)
    rates = np.diff(position, prepend=position[0]) / np.diff(stamps, prepend=stamps[0] - 1.0 / rate)
    channels = {"speed": Series(stamps, rates, "rad/s"), "position": Series(stamps, position, "rad")}
    return Recording(f"jittered{seed}", "made up", ("axis",), channels)


@pytest.mark.parametrize("rate", [25.0, 50.0, 125.0])
def test_a_speed_derived_from_jittering_stamps_is_not_overestimated(rate):
    for seed in range(5):
        assert measured_class(jittered(0.0698, rate, seed)).nominal_speed == pytest.approx(0.0698, rel=0.05)


def test_the_reference_names_a_run_and_the_measured_speed_is_what_is_learned():
    recording = log((0.05, 2.0))
    time = recording["speed"].time
    known = replace(
        recording, channels={**recording.channels, "reference_speed": Series(time, np.full(len(time), 0.2), "m/s")}
    )
    assert motion_class(known).nominal_speed == pytest.approx(0.2)
    assert measured_class(known).nominal_speed == pytest.approx(0.05, rel=0.05)


def operation(recording: Recording, name: str) -> Operation:
    return operations_of(replace(recording, name=name))[0]


def test_one_stray_run_does_not_reject_the_others():
    many = [operation(log((0.2 * (1 + 0.004 * (i % 5)), 4.0), seed=i), f"run{i}") for i in range(22)]
    stray = operation(log((0.22, 4.0), seed=50), "stray")
    classes, odd = by_class([*many[:10], stray, *many[10:]])
    assert [item.name for item in max(classes, key=len)] == [item.name for item in many]
    assert [[item.name for item in group] for group in classes if len(group) == 1] == [["stray"]] and not odd
    common = common_class([item.recording for item in many])
    assert common.nominal_speed == pytest.approx(0.2, rel=0.03) and common.course is not None


def test_a_run_that_stops_on_its_way_is_left_out_by_name():
    alike = [operation(log((0.2, 4.0), seed=i), f"run{i}") for i in range(12)]
    halting = operation(log((0.2, 1.5), (0.05, 1.5), (0.2, 3.0), seed=60), "halting")
    classes, odd = by_class([halting, *alike])
    assert [len(group) for group in classes] == [12]
    assert [item.recording for item in odd] == ["halting"]
    assert "its speed differs from that of 12 other runs" in odd[0].reason


def test_directions_and_speeds_are_classes_of_their_own_in_the_order_of_their_first_run():
    runs = [(0.2, 4.0), (-0.2, 4.0), (0.3, 3.0)] * 4
    classes, odd = by_class([operation(log(part, seed=i), f"run{i}") for i, part in enumerate(runs)])
    assert [len(group) for group in classes] == [4, 4, 4] and not odd
    assert [group[0].name for group in classes] == ["run0", "run1", "run2"]


def test_classes_that_lie_close_are_learned_and_no_class_is_refused_whole():
    rng = np.random.default_rng(3)
    runs = []
    for number in range(32):
        speed = (0.1, 0.115)[number % 2] * (1.0 + 0.03 * rng.standard_normal())
        runs.append(operation(log((speed, 6.0), noise=0.001, seed=number), f"run{number}"))
    classes, odd = by_class(runs)
    for group in classes:
        common_class([item.recording for item in group])
    assert sum(map(len, classes)) + len(odd) == len(runs)


def test_the_class_of_a_speed_is_found_once():
    recording = log((0.2, 2.0))
    first = motion_class(recording)
    assert motion_class(replace(recording, name="renamed")) is first
    assert motion_class(log((0.2, 2.0), seed=1)) is not first
