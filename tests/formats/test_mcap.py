from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.mcap import Mcap
from cdtool.formats.messages.fields import FieldMissingError, parse_field
from cdtool.formats.source import TopicDetails
from tests.base.findings.facts import fact_of
from tests.data_folder import DATA, data, needs_data
from tests.formats.mcap_files import JOINTS, START, TIME, N, by_hand, wanted, written

__all__ = ["by_hand", "written"]


@pytest.mark.parametrize("encoding", ["cdr", "json"])
@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_written_values_are_read_back_exactly(written, encoding, compression):
    source = Mcap().columns(written(encoding=encoding, compression=compression))
    for name, expected in {
        "/joint_states position[:]": JOINTS,
        "/joint_states effort[:]": JOINTS[:, 2:],
        "/imu linear_acceleration.x": JOINTS[:, 0],
        "/load_cell wrench.force.z": JOINTS[:, 1],
        "/force data": JOINTS[:, 2],
        "/reference data[:]": JOINTS[:, :2],
    }.items():
        assert np.array_equal(source.columns[name].values, expected), name
    assert np.array_equal(source.columns["/force data"].time, TIME)
    assert np.allclose(source.columns["/imu linear_acceleration.x"].time, TIME + 0.0005, rtol=0, atol=1e-12)
    assert source.origin == START / 1e9
    assert not source.findings
    assert source.topics["/force"] == TopicDetails("std_msgs/msg/Float64", N, encoding)


@pytest.mark.parametrize("encoding", ["cdr", "json"])
def test_a_field_is_a_number_an_element_an_array_or_a_joint(written, encoding):
    fields = ["position[1]", "position[:]", "position[shoulder_joint]", "position[elbow.joint]", "effort[0]"]
    path = written(encoding=encoding)
    requested = wanted(
        *(("/joint_states", field) for field in fields), joints=("base", "shoulder_joint", "elbow.joint")
    )
    columns = Mcap().columns(path, requested).columns
    found = [columns[f"/joint_states {field}"].values for field in fields]
    for values, expected in zip(found, [JOINTS[:, 1], JOINTS, JOINTS[:, 1], JOINTS[:, 2], JOINTS[:, 2]], strict=True):
        assert np.array_equal(values, expected)
    assert set(columns) == {f"/joint_states {field}" for field in fields}


@pytest.mark.parametrize("encoding", ["cdr", "json"])
def test_a_whole_array_is_ordered_by_the_machines_joints_with_the_messages_names(written, encoding):
    path = written(encoding=encoding)
    order = ("elbow.joint", "base", "shoulder_joint")
    column = Mcap().columns(path, wanted(("/joint_states", "position[:]"), joints=order)).columns
    assert np.array_equal(column["/joint_states position[:]"].values, JOINTS[:, [2, 0, 1]])
    two = Mcap().columns(path, wanted(("/joint_states", "position[:]"), joints=order[:2])).columns
    assert np.array_equal(two["/joint_states position[:]"].values, JOINTS[:, [2, 0]])


def test_joint_names_missing_from_the_messages_are_an_error_and_never_a_silent_permutation(written):
    requested = wanted(("/joint_states", "position[:]"), joints=("base", "shoulder", "elbow.joint"))
    with pytest.raises(RecordingError, match=r"name base, shoulder_joint, elbow.joint, not 'shoulder'.*joint_map"):
        Mcap().columns(written(), requested)


@pytest.mark.parametrize("clock", ["log", "publish", "header"])
def test_the_clock_is_chosen_and_messages_are_sorted_by_it(by_hand, clock):
    stamps = {"log": [10, 20, 30], "publish": [9, 7, 8], "header": [3, 1, 2]}
    messages = [
        (log, publish, {"header": {"stamp": {"sec": header, "nanosec": 500}}, "x": i})
        for i, (log, publish, header) in enumerate(zip(*stamps.values(), strict=True))
    ]
    column = Mcap().columns(by_hand(messages), wanted(("/a", "x"), clock=clock)).columns["/a x"]
    order = np.argsort(stamps[clock])
    assert column.values.tolist() == order.tolist()
    unit = 1.0 if clock == "header" else 1e-9
    assert np.allclose(np.diff(column.time), np.diff(np.sort(stamps[clock])) * unit, rtol=1e-12)


def test_a_header_clock_without_a_header_is_a_clear_error(by_hand):
    with pytest.raises(RecordingError, match=r"/a: a message has no header\.stamp"):
        Mcap().columns(by_hand([(1, 1, {"x": 1})]), wanted(("/a", "x"), clock="header"))


def test_a_survey_reports_the_delay_of_logged_messages(by_hand):
    messages = [
        (10**9 + i * 10**6 + 3 * 10**6, 0, {"header": {"stamp": {"sec": 1, "nanosec": i * 10**6}}}) for i in range(5)
    ]
    (finding,) = Mcap().columns(by_hand(messages)).findings
    assert finding.kind == "header_delay" and finding.numbers["median"] == pytest.approx(3.0)


def test_a_missing_topic_is_named_with_its_channel_and_the_nearest(written):
    with pytest.raises(
        RecordingError, match=r"no message of topic '/joint_state' \(channel 'speed'\).*did you mean /joint_states"
    ):
        Mcap().columns(written(), wanted(("/joint_state", "position[0]")))


@pytest.mark.parametrize(
    ("topic", "field", "message"),
    [
        ("/imu", "linear_acceleration.w", "there is no 'w'.*known: x, y, z"),
        ("/imu", "acceleration.x", "there is no 'acceleration'.*did you mean linear_acceleration"),
        ("/joint_states", "position", r"'position' is an array.*position\[0\]"),
        ("/joint_states", "position[3]", r"'position' has 3 elements"),
        ("/joint_states", "position[wrist]", "no message names this joint.*known: base, elbow.joint, shoulder_joint"),
        ("/joint_states", "position[]", "cannot be understood"),
        ("/joint_states", "position[0", "cannot be understood"),
        ("/joint_states", "name[0]", "not a number"),
        ("/force", "data[0]", "'data' is not an array"),
        ("/force", "data.x", "there is no 'x'"),
    ],
)
def test_a_wrong_field_is_an_error_that_names_the_existing_fields(written, topic, field, message):
    with pytest.raises(RecordingError, match=message) as fault:
        Mcap().columns(written(), wanted((topic, field)))
    assert topic in str(fault.value)


def test_an_empty_array_is_nan_and_counted(by_hand):
    path = by_hand([(i, i, {"q": [] if i == 1 else [i, 2 * i]}) for i in range(4)])
    for field, values in {"q[:]": [[0, 0], [np.nan] * 2, [2, 4], [3, 6]], "q[1]": [0, np.nan, 4, 6]}.items():
        source = Mcap().columns(path, wanted(("/a", field)))
        assert np.array_equal(source.columns[f"/a {field}"].values, np.array(values), equal_nan=True)
    assert fact_of(Mcap().columns(path, wanted(("/a", "q[:]"))).findings[-1]) == ("empty_arrays", {"count": 1})


def test_an_array_of_varying_length_is_a_clear_error(by_hand):
    path = by_hand([(i, i, {"q": [1.0] * (2 + i // 3)}) for i in range(4)])
    with pytest.raises(RecordingError, match="length of field 'q\\[:\\]' varies: 2 in 3, 3 in 1"):
        Mcap().columns(path, wanted(("/a", "q[:]")))
    assert fact_of(Mcap().columns(path).findings[0]) == ("array_lengths_differ", {"lengths": (2, 3)})


def test_json_null_is_nan_and_a_text_is_refused(by_hand):
    path = by_hand([(0, 0, {"x": 1, "s": "up"}), (1, 1, {"x": None, "s": "up"})])
    assert np.isnan(Mcap().columns(path, wanted(("/a", "x"))).columns["/a x"].values[1])
    with pytest.raises(RecordingError, match="contains 'up', not a number"):
        Mcap().columns(path, wanted(("/a", "s")))


@pytest.mark.parametrize("text", ["a b.c", "x[0].y", "a[b.c].d"])
def test_a_field_may_select_elements_of_arrays_of_objects(text):
    assert parse_field(text, "here").text == text
    message = {"a b": {"c": 1}, "x": [{"y": 2}], "a": [{"d": 3}], "name": ["b.c"]}
    assert parse_field(text, "here").of(message) in (1.0, 2.0, 3.0)
    with pytest.raises(FieldMissingError):
        parse_field(text, "here").of({})


@needs_data("mcap_samples")
@pytest.mark.parametrize("name", sorted(path.name for path in DATA.glob("mcap_samples/*.mcap")) if DATA else ["none"])
def test_real_files_of_other_writers_survey_without_an_error(name):
    source = Mcap().columns(data("mcap_samples") / name)
    assert source.topics
    if "wrong_rmw" in name:
        reasons = {finding.numbers["reason"] for finding in source.findings if finding.kind == "undecodable_messages"}
        assert any("'wrong_format'" in reason for reason in reasons)
        with pytest.raises(RecordingError, match="wrong_format"):
            Mcap().columns(data("mcap_samples") / name, wanted(("/test_topic", "int32_value")))
