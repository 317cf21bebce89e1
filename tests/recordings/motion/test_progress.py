"""Progress and fitting samples: the kernels compared with the same rules written for whole arrays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.recordings.clock import previous_value
from cdtool.recordings.motion.progress import RUNNING_SHARE, START_SHARE, Progress, progress
from cdtool.recordings.motion.speed_course import TOLERANCE, SpeedCourse, SpeedCurve, fitting_samples, stroke_progress
from cdtool.recordings.recording import Recording, Series
from tests.bits import COUNTS, VALUES, assert_same_bits, clocks, samples


def confirmed(there: BoolArray) -> BoolArray:
    sure = there.copy()
    for lag in (1, 2):
        sure[lag:] &= there[:-lag]
    sure[:2] = False
    return sure


def progress_of_arrays(
    recording: Recording, clock: FloatArray, direction: int, start_speed: float, running_speed: float, joint: int
) -> Progress:
    speed = recording["speed"]
    with np.errstate(invalid="ignore"):
        forward = direction * speed.values[:, joint]
    elapsed, travel = np.full(len(clock), np.nan), np.full(len(clock), np.nan)
    running = np.zeros(len(clock), dtype=bool)
    starts = np.flatnonzero(confirmed(forward >= start_speed))
    if not len(starts):
        return Progress(elapsed, travel, running)
    start = float(speed.time[starts[0]])
    begun = clock >= start
    elapsed[begun] = clock[begun] - start
    fast = np.flatnonzero((forward >= running_speed) & (speed.time >= start))
    if len(fast):
        running = clock >= speed.time[fast[0]]
    along = np.where(begun, direction * previous_value(recording["position"], clock)[:, joint], np.nan)
    known = np.flatnonzero(np.isfinite(along))
    if len(known):
        reached = np.fmax.accumulate(np.where(np.isnan(along), -np.inf, along))
        travel = np.where(begun & np.isfinite(reached), reached - along[known[0]], np.nan)
    return Progress(elapsed, travel, running)


def fitting_of_arrays(
    recording: Recording, direction: int, nominal_speed: float, joint: int, course: SpeedCourse | None
) -> tuple[BoolArray, BoolArray]:
    forward = direction * recording["speed"].values[:, joint]
    where = stroke_progress(recording, direction, nominal_speed, joint)
    begun = np.isfinite(where.elapsed)
    least = TOLERANCE * nominal_speed
    if course is None:
        lowest = np.where(where.running, nominal_speed - least, -least)
        highest = np.full(len(forward), nominal_speed + least)
    else:
        by_time, by_travel = at(course.by_time, where.elapsed), at(course.by_travel, where.travel)
        mean, spread = (np.where(where.running, late, early) for early, late in zip(by_time, by_travel, strict=True))
        if course.alignment != "time_then_position":
            mean, spread = by_time if course.alignment == "time" else by_travel
        reach = np.maximum(5.5 * spread, least)
        lowest, highest = mean - reach, mean + reach
        ends = where.running & (np.nan_to_num(where.travel) >= course.by_travel.last) & (mean < 0.5 * nominal_speed)
        lowest = np.where(ends, np.minimum(lowest, -least), lowest)
    fits = (forward >= lowest) & (forward <= highest)
    return begun, np.where(begun, fits, ~confirmed(forward <= -START_SHARE * nominal_speed))


def at(curve: SpeedCurve, axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    grid, places = curve.step * np.arange(len(curve.mean)), np.nan_to_num(axis)
    return np.interp(places, grid, curve.mean), np.interp(places, grid, curve.spread)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    count, joints = draw(COUNTS), draw(st.sampled_from([1, 2]))
    time = draw(clocks(count))
    # A position that often grows, with steps back and gaps.
    steps = draw(samples(count, joints, st.one_of(st.just(0.25), st.integers(-1, 2).map(float), VALUES)))
    with np.errstate(invalid="ignore"):
        position = np.cumsum(steps, axis=0) if draw(st.booleans()) else steps
    own = draw(st.sampled_from([0.0, 0.7e-3]))
    speed = draw(samples(count, joints, st.one_of(st.just(1.0), VALUES)))
    channels = {"speed": Series(time, speed, "m/s"), "position": Series(time + own, position, "m")}
    return Recording("made up", "", tuple("ab"[:joints]), channels)


@settings(deadline=None, max_examples=30)
@given(recordings(), st.sampled_from([1, -1, 0]), st.sampled_from([0.0, 1e-4, -2.0, "position"]), st.data())
def test_it_has_the_bits_of_the_rule_written_for_arrays(recording, direction, shift, data):
    joint = data.draw(st.integers(0, len(recording.joints) - 1))
    clock = recording["position"].time if shift == "position" else recording["speed"].time + shift
    arguments = (recording, clock, direction, 0.5, 1.0, joint)
    for _ in range(2):  # the second time it may be a stored one
        ours, theirs = progress(*arguments), progress_of_arrays(*arguments)
        for name in ("elapsed", "travel", "running"):
            assert_same_bits(getattr(ours, name), getattr(theirs, name))


curves = st.builds(
    lambda step, pairs: SpeedCurve(step, *(np.array(column) for column in zip(*pairs, strict=True))),
    st.sampled_from([0.25, 0.3e-3, 1.0, 0.1]),
    st.lists(st.tuples(st.floats(-1.0, 2.0), st.floats(0.0, 0.2)), min_size=1, max_size=12),
)
courses = st.builds(SpeedCourse, st.sampled_from(["time_then_position", "time", "position"]), curves, curves)


@settings(deadline=None, max_examples=30)
@given(recordings(), st.sampled_from([1, -1]), st.one_of(st.none(), courses), st.booleans())
def test_the_speeds_that_fit_a_class_are_those_of_the_rule_written_for_arrays(recording, direction, course, positioned):
    if not positioned and len(recording["speed"]):
        recording = Recording("made up", "", recording.joints, {"speed": recording["speed"]})
    ours = fitting_samples(recording, direction, 1.0, 0, course)
    theirs = fitting_of_arrays(recording, direction, 1.0, 0, course)
    for one, other in zip(ours, theirs, strict=True):
        assert_same_bits(one, other)


def test_a_recording_that_runs_needs_a_position_and_one_at_rest_does_not():
    time = np.arange(100) * 1e-3
    for speed, needs in ((1.0, True), (0.0, False)):
        recording = Recording("run", "", ("x",), {"speed": Series(time, np.full(100, speed), "m/s")})
        if needs:
            with pytest.raises(RecordingError, match="no channel 'position'"):
                progress(recording, time, 1, START_SHARE, RUNNING_SHARE, 0)
        else:
            assert np.isnan(progress(recording, time, 1, START_SHARE, RUNNING_SHARE, 0).elapsed).all()


def test_it_is_computed_once_on_each_clock_of_the_recording():
    time = np.arange(100) * 1e-3
    channels = {"speed": Series(time, np.ones(100), "m/s"), "position": Series(time.copy(), time, "m")}
    recording = Recording("run", "", ("x",), channels)
    first = progress(recording, time.copy(), 1, 0.1, 0.9, 0)
    assert progress(recording, channels["position"].time, 1, 0.1, 0.9, 0) is first
    assert progress(recording, time, 1, 0.1, 0.8, 0) is not first
    assert progress(recording, time + 1e-4, 1, 0.1, 0.9, 0) is not first
    moved = {**channels, "position": Series(time, 2.0 * time, "m")}
    assert progress(Recording("run", "", ("x",), moved), time, 1, 0.1, 0.9, 0).travel[-1] == 2.0 * first.travel[-1]
