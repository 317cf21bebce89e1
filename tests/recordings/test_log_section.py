"""A part of a log between two marks: times on its clock, or distances travelled."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError, UsageError
from cdtool.recordings.log_section import LogSection, Mark
from cdtool.recordings.recording import Recording, Series


def stroke(unit="m", position=True, n=1001):
    """Out by 2 and back by 1, at a speed of 0.5."""
    time = np.linspace(0.0, 6.0, n)
    place = 3.0 + np.minimum(0.5 * time, 4.0 - 0.5 * time)
    channels = {"speed": Series(time, np.where(time < 4.0, 0.5, -0.5), f"{unit}/s")}
    channels |= {"position": Series(time, place, unit)} if position else {}
    return Recording("stroke", "stroke.csv", ("axis",), channels)


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("3.2s", 3.2, "s"),
        ("250 ms", 0.25, "s"),
        ("2min", 120.0, "s"),
        (".5s", 0.5, "s"),
        ("1.m", 1.0, "m"),
        (" 80 cm ", 0.8, "m"),
        ("1.2rad", 1.2, "rad"),
        ("90deg", np.pi / 2, "rad"),
        ("90°", np.pi / 2, "rad"),
        ("-2.5s", -2.5, "s"),
        ("+1s", 1.0, "s"),
    ],
)
def test_a_mark_is_a_number_with_its_unit(text, value, unit):
    assert Mark.parse(text) == Mark(pytest.approx(value), unit)


@pytest.mark.parametrize(
    "text", ["", "3.2", "s", "-1m", "0m", "1,5s", "9" * 400 + "s", "3.2 N", "1 m/s", "nan s", "1e3s", "3.2s 4s", "٣s"]
)
def test_another_text_is_refused_with_what_to_give(text):
    with pytest.raises(UsageError, match="is '") as raised:
        Mark.parse(text)
    assert "3.2s" in raised.value.hint


@pytest.mark.parametrize("position", [True, False])
@pytest.mark.parametrize("unit", ["m", "rad"])
def test_a_distance_is_reached_where_the_axis_first_has_travelled_it(unit, position):
    recording = stroke(unit, position)
    assert Mark(1.0, unit).time_in(recording) == pytest.approx(2.0, abs=0.025)
    assert Mark(1.9, unit).time_in(recording) == pytest.approx(3.8, abs=0.025)
    assert Mark(2.5, unit).time_in(recording) == np.inf


def test_single_wrong_values_and_an_encoder_that_starts_again_are_no_distance():
    time = np.linspace(0.0, 6.0, 601)
    angle = 1.2 * time
    wrapped = (angle + np.pi) % (2.0 * np.pi) - np.pi
    spikes = np.where(np.isin(np.arange(601), (0, 50)), 5.0, wrapped)
    for values in (wrapped, spikes):
        recording = Recording("r", "", ("axis",), {"position": Series(time, values, "rad")})
        assert Mark(3.6, "rad").time_in(recording) == pytest.approx(3.0, abs=0.06)


def test_the_joint_that_travels_counts_and_not_the_one_at_the_largest_angle():
    time = np.linspace(0.0, 5.0, 501)
    angles = Series(time, np.column_stack((np.full(501, 3.0), 0.1 * time)), "rad")
    recording = Recording("r", "", ("a", "b"), {"position": angles})
    assert Mark(0.2, "rad").time_in(recording) == pytest.approx(2.0, abs=0.05)


def test_a_distance_in_the_unit_of_another_machine_is_refused():
    with pytest.raises(
        RecordingError, match="1 rad of travel is not a distance of this machine, whose position is in m"
    ):
        LogSection.parse(None, "1rad").of(stroke())
    with pytest.raises(RecordingError, match="speed"):
        LogSection.parse(None, "1m").of(Recording("empty", "", ("axis",), {}))


@given(st.floats(0.0, 5.0), st.floats(0.01, 5.0), st.sampled_from("sm"))
def test_a_section_has_exactly_the_samples_between_its_marks(begin, length, unit):
    recording = stroke()
    section = LogSection(Mark(begin, "s"), Mark(begin + length, "s") if unit == "s" else Mark(length, "m"))
    start, end = section.times(recording)
    wanted = (recording["speed"].time >= start) & (recording["speed"].time <= end)
    if not wanted.any():
        with pytest.raises(RecordingError, match="no sample from"):
            section.of(recording)
        return
    part = section.of(recording)
    np.testing.assert_array_equal(part["speed"].time, recording["speed"].time[wanted])
    np.testing.assert_array_equal(part["position"].values, recording["position"].values[wanted])


def test_the_whole_log_is_the_same_object_and_an_end_before_the_begin_is_refused():
    recording = stroke()
    assert LogSection().of(recording) is recording and not LogSection()
    with pytest.raises(UsageError, match="the end, 1 s, is not after the begin, 1 s"):
        LogSection.parse("1s", "1000ms")
    assert LogSection.parse("1m", "1s"), "a time and a distance are compared in a log only"
