"""The nominal speed of a run, grouping runs by how they move, and what is motion at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.commands.learning.grouping import by_class
from cdtool.recordings.motion import measured_class, motion_class
from cdtool.recordings.motion.evident_motion import evident_speed
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.common_class import common_class
from tests.recordings.motion.speed_logs import log


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


def speed_of(values, rate=100.0, time=None):
    values = np.asarray(values, dtype=float)
    return Series(np.arange(len(values)) / rate if time is None else time, values, "m/s")


@pytest.mark.parametrize("noise", [1e-6, 1e-3, 1.0])
@pytest.mark.parametrize("rate", [30.0, 100.0, 1000.0])
def test_white_noise_at_rest_is_almost_never_motion_whatever_its_size(noise, rate):
    values = noise * np.random.default_rng(1).standard_normal(20_000)
    assert np.count_nonzero(evident_speed(speed_of(values, rate))) < 0.02 * len(values)


@pytest.mark.parametrize("rate", [30.0, 100.0, 1000.0])
def test_a_motion_ten_times_its_noise_is_seen_after_the_averaging_time(rate):
    rng, n = np.random.default_rng(2), int(2 * rate)
    found = evident_speed(speed_of(np.repeat([0.0, -0.5], n) + 0.05 * rng.standard_normal(2 * n), rate))[:, 0]
    after = n + max(6, int(0.1 * rate))
    assert np.all(np.abs(found[after:] + 0.5) < 0.1)
    assert np.mean(found[:n] != 0.0) < 0.02


@given(st.integers(1, 60), st.integers(0, 2**32 - 1))
def test_a_later_sample_never_changes_it(cut, seed):
    rng = np.random.default_rng(seed)
    values = np.where(rng.random(60) < 0.1, np.nan, rng.standard_normal(60) + np.linspace(0.0, 3.0, 60))
    time = np.cumsum(rng.uniform(0.001, 0.1, 60))
    whole = evident_speed(speed_of(values, time=time))
    np.testing.assert_array_equal(evident_speed(speed_of(values[:cut], time=time[:cut])), whole[:cut])
