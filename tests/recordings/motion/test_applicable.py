"""Which class of motion judges: decided from the speed so far."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.alarms.judgement import judgement_of
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.applicable import GRACE, applicable_classes
from cdtool.recordings.motion.speed_course import stroke_progress
from cdtool.recordings.motion.strokes import strokes_so_far
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.common_class import common_class
from cdtool.thresholds.signature import Signature
from tests.recordings.motion.speed_logs import PERIOD, RAMP, log


def learned(*parts: tuple[float, float]) -> MotionClass:
    return common_class([log(*parts, seed=100 + i) for i in range(12)])


SLOW, FAST = learned((0.2, 8.0), (0.0, 1.0)), learned((0.3, 3.0), (0.0, 1.5))
BACK = learned((-0.3, 3.0), (0.0, 1.5))


def judges(recording: Recording, *classes: MotionClass, how: str = "whole") -> np.ndarray:
    """(n, classes) where each judges, in whichever stroke."""
    time = recording["speed"].time
    found = np.zeros((len(time), len(classes)), dtype=bool)
    for item in applicable_classes(recording, classes, strokes_so_far(recording, how, classes), time):
        found[:, item.motion] |= item.where
    return found


def at(recording: Recording, seconds: float) -> int:
    return int(np.searchsorted(recording["speed"].time, seconds))


def test_while_two_classes_fit_both_judge_and_then_the_one_that_still_fits():
    recording = log((0.3, 3.0), (0.0, 1.5), seed=1)
    found = judges(recording, SLOW, FAST)
    # Both accelerate alike up to 0.2 m/s, 0.5 s after the start at 0.5 s.
    both = slice(at(recording, 0.6), at(recording, 0.95))
    assert found[both].all()
    assert found[:, 1].all()
    assert not found[at(recording, 1.1 + GRACE) :, 0].any()


def test_a_contact_that_slows_the_axis_is_judged_by_the_class_before_it_and_by_no_slower_one():
    recording = log((0.3, 2.0), (0.2, 2.0), seed=2)
    found = judges(recording, SLOW, FAST)
    departs = at(recording, 2.5)
    within = slice(departs + 100, at(recording, 2.5 + 0.9 * GRACE))
    assert found[within, 1].all() and not found[within, 0].any()
    # After the grace period the slower class fits: judging goes on.
    assert found[at(recording, 4.0) :, 0].all() and not found[at(recording, 4.0) :, 1].any()


def test_an_axis_that_a_contact_stops_is_judged_for_the_matching_window_and_no_longer():
    recording = log((0.3, 2.0), (0.0, 4.0), seed=3)
    found = judges(recording, FAST)[:, 0]
    assert found[: at(recording, 2.5 + GRACE)].all()
    assert not found[at(recording, 2.7 + GRACE) :].any()


def test_without_a_speed_for_the_matching_window_nothing_judges():
    recording = log((0.3, 3.0), (0.0, 1.5), seed=7)
    speed = recording["speed"].values.copy()
    speed[1500:3800] = np.nan
    holed = Recording(
        "holed", "made up", ("axis",), {**recording.channels, "speed": Series(recording["speed"].time, speed, "m/s")}
    )
    found = judges(holed, FAST)[:, 0]
    assert found[: 1500 + 900].all() and not found[2600:3800].any()


@pytest.mark.parametrize("how", ["whole", "motion"])
def test_a_log_without_a_single_sample_of_speed_is_judged_by_no_class(how):
    recording = log((0.3, 3.0), (0.0, 1.5))
    nothing = Series(np.empty(0), np.empty((0, 1)), "m/s")
    silent = Recording("silent", "made up", ("axis",), {**recording.channels, "speed": nothing})
    clock = recording["position"].time
    assert applicable_classes(silent, (FAST, BACK), strokes_so_far(silent, how, (FAST, BACK)), clock) == []


@pytest.mark.parametrize("place", [0.05, 0.1, 0.2, 0.3])
def test_a_contact_during_acceleration_or_just_behind_it_is_judged(place):
    recording = log((0.3, 2.0), seed=10)
    travel = recording["position"].values[:, 0]
    hit = int(np.searchsorted(travel, place))
    speed = recording["speed"].values.copy()
    speed[hit:, 0] *= np.exp(-np.arange(len(speed) - hit) / 20.0)
    position = np.concatenate((travel[:hit], np.full(len(travel) - hit, travel[hit])))
    time = recording["speed"].time
    stopped = Recording(
        "stopped", "made up", ("axis",), {"speed": Series(time, speed, "m/s"), "position": Series(time, position, "m")}
    )
    assert judges(stopped, FAST)[: hit + 900].all()


def test_a_contact_that_throws_the_axis_back_is_still_judged_by_the_class_that_it_hit():
    recording = log((0.3, 2.0), (-0.3, 1.6), seed=13, noise=0.002)
    found = judges(recording, FAST, BACK, how="motion")
    departs = at(recording, 2.5)
    assert found[departs : departs + 950, 0].all()
    assert not found[departs + 200 : departs + 900, 1].any()


@pytest.mark.parametrize("noise", [0.01, 0.02, 0.03])
def test_noise_of_the_speed_neither_hides_a_rest_nor_chops_a_stroke(noise):
    recording = log((0.3, 2.0), (0.0, 2.2), (0.3, 2.0), (0.0, 1.5), noise=noise, seed=14)
    assert len(strokes_so_far(recording, "motion", [SLOW, FAST])) == 3


def test_a_stroke_behind_a_sudden_stop_begins_with_its_own_motion():
    stopped, again = log((0.3, 2.5), seed=11), log((0.3, 3.0), (0.0, 1.5), seed=12)
    time = np.concatenate((stopped["speed"].time, stopped["speed"].time[-1] + PERIOD + again["speed"].time))
    travel = float(stopped["position"].values[-1, 0])
    channels = {
        "speed": Series(time, np.concatenate((stopped["speed"].values, again["speed"].values)), "m/s"),
        "position": Series(time, np.concatenate((stopped["position"].values, travel + again["position"].values)), "m"),
    }
    both, stop = Recording("both", "made up", ("axis",), channels), float(stopped["speed"].time[-1])
    behind = time > stop + 0.3
    assert judges(both, FAST, how="motion")[behind].all()
    second = strokes_so_far(both, "motion", (FAST,))[1]
    assert stop < second.start <= second.applies < stop + 0.4
    part = both.section(second.start, np.inf)
    at = stroke_progress(part, FAST.direction, FAST.nominal_speed, FAST.joint)
    begins = float(part["speed"].time[np.flatnonzero(np.isfinite(at.elapsed))[0]])
    assert begins == pytest.approx(stop + 0.5 + 0.1 * 0.3 / RAMP, abs=0.05)


def test_where_no_speed_came_samples_are_missing_and_not_of_another_speed():
    recordings = [log((0.3, 3.0), (0.0, 1.5), seed=200 + i) for i in range(12)]
    rng = np.random.default_rng(1)

    def signal_of(recording: Recording) -> Signal:
        values = rng.standard_normal((len(recording["speed"].time), 1))
        status = np.zeros(values.shape, dtype=np.uint8)
        return Signal(recording["speed"].time, values, status, "N", joints=("axis",))

    fitted = Signature(safety_factor=8.0).fit([(item, signal_of(item)) for item in recordings])
    recording = log((0.3, 3.0), (0.0, 1.5), seed=7)
    speed = recording["speed"].values.copy()
    speed[1500:3800] = np.nan
    series = Series(recording["speed"].time, speed, "m/s")
    holed = Recording("holed", "made up", ("axis",), {**recording.channels, "speed": series})
    statistic, _ = judgement_of(holed, signal_of(holed), [fitted]).evaluated
    assert (statistic.status[2600:3800] == Status.GAP).all()
    assert not (statistic.status == Status.OTHER_SPEED).any()
