"""A log in parts, as rosbag2 splits one: surveyed as one log, with findings on missing parts."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool import convert
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.reading import log_parts, read_recording, survey
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.formats.source import TopicDetails
from tests.base.findings.facts import fact_of

START = 1_700_000_000
MACHINE = """[machine]
type = "linear_axis"
coordinates = "load"

[channels.mcap]
speed = { topic = "/speed", field = "data" }
"""


def write_part(path: Path, time: np.ndarray, values: np.ndarray, topics: tuple[str, ...] = ("/speed",)) -> Path:
    streams = [Stream(topic, "std_msgs/msg/Float64", time, {"data": values}) for topic in topics]
    write_mcap(path, streams, start_ns=START * 10**9)
    return path


def bag(folder: Path, count: int = 3, rows: int = 100) -> Path:
    """Write `count` parts of one second each, numbered as by rosbag2: the tenth sorts before the second."""
    folder.mkdir(exist_ok=True)
    for number in range(count):
        time = number + np.arange(rows) / rows
        write_part(folder / f"bag_{number}.mcap", time, time)
    return folder


def metadata(folder: Path, text: str) -> None:
    (folder / "metadata.yaml").write_text(f"rosbag2_bagfile_information:\n  version: 5\n{text}  message_count: 3\n")


def machine(folder: Path):
    (folder / "machine.toml").write_text(MACHINE)
    return read_machine_file(folder / "machine.toml")


def losses(findings) -> list[tuple]:
    return [fact_of(finding) for finding in findings if finding.severity == "loss"]


@settings(max_examples=15, deadline=None)
@given(cuts=st.lists(st.integers(0, 200), max_size=4), order=st.permutations(range(5)), seed=st.integers(0, 2**32 - 1))
def test_a_log_cut_anywhere_is_surveyed_as_the_whole_log(tmp_path_factory, cuts, order, seed):
    folder = tmp_path_factory.mktemp("cut")
    values = np.random.default_rng(seed).normal(size=200)
    time = np.arange(200) / 128.0
    edges = [0, *sorted(cuts), 200]
    (folder / "bag").mkdir()
    for i, (first, last) in enumerate(pairwise(edges)):
        write_part(folder / "bag" / f"{order[i]}.mcap", time[first:last], values[first:last])
    whole = survey(write_part(folder / "whole.mcap", time, values))
    parts = survey(folder / "bag")
    assert parts.path == folder / "bag" and parts.format == "mcap" and parts.names == whole.names
    assert parts.origin == whole.origin == START
    column, expected = parts.columns["/speed data"], whole.columns["/speed data"]
    np.testing.assert_array_equal(column.values, expected.values)
    # The origin of a part is an epoch in float64, with a resolution of 0.24 us.
    np.testing.assert_allclose(column.time, expected.time, rtol=0.0, atol=5e-7)
    assert parts.topics["/speed"] == whole.topics["/speed"]
    assert {item.kind for item in parts.findings} <= {"no_message"}


def test_overlapping_parts_are_sorted_and_reported(tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    for number in (0, 1):
        time = 0.5 * number + np.arange(100) / 100 + 0.001 * number
        write_part(folder / f"bag_{number}.mcap", time, time)
    source = survey(folder)
    column = source.columns["/speed data"]
    assert np.all(np.diff(column.time) > 0.0)
    np.testing.assert_allclose(column.values, column.time, rtol=0.0, atol=5e-7)
    assert source.findings == (Finding("parts_overlap", "", {"part": "bag_1.mcap", "column": "/speed data"}),)


def test_an_array_whose_length_differs_between_parts_is_left_out_and_reported(tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    for number in (0, 1):
        time = number + np.arange(10) / 10
        fields = {"position": np.ones((10, 2 + number))}
        stream = Stream("/joints", "sensor_msgs/msg/JointState", time, fields)
        write_mcap(folder / f"bag_{number}.mcap", [stream], start_ns=START * 10**9)
    source = survey(folder)
    assert "/joints position[:]" not in source.columns
    assert Finding("array_lengths_differ", "/joints position[:]", {"lengths": (2, 3)}) in source.findings


def test_findings_on_a_part_have_the_name_of_its_file(tmp_path):
    folder = bag(tmp_path / "bag")
    whole = (folder / "bag_2.mcap").read_bytes()
    (folder / "bag_2.mcap").write_bytes(whole[:-40])
    source = survey(folder)
    assert source.details["parts"] == "3, bag_0.mcap to bag_2.mcap"
    findings = [item for item in source.findings if item.severity == "loss"]
    assert findings and all(item.file == "bag_2.mcap" and "bag_2.mcap: " in str(item) for item in findings)


@pytest.mark.parametrize(
    "listed",
    [
        "  relative_file_paths:\n    - bag_0.mcap\n    - bag_1.mcap\n    - bag_2.mcap\n    - bag_3.mcap\n",
        "  relative_file_paths:\n  - bag_0.mcap\n\n  # one more\n  - bag_1.mcap\n  - bag_2.mcap # it\n  - bag_3.mcap\n",
        "  relative_file_paths: [bag_0.mcap, bag_1.mcap,\n    'bag_2.mcap', \"bag_3.mcap\"]\n",
        "  relative_file_paths:\n  - 'b/bag_0.mcap'\n  - \"b/bag_1.mcap\"\n  - b/bag_2.mcap\n  - b/bag_3.mcap\n",
    ],
    ids=["block", "block with comments", "flow", "with the folder, as the first versions"],
)
def test_a_missing_part_that_metadata_names_is_a_loss(tmp_path, listed):
    folder = bag(tmp_path / "bag")
    metadata(folder, listed)
    lost = [("part_missing", {"part": "bag_3.mcap", "metadata": "metadata.yaml"})]
    assert losses(survey(folder).findings) == lost
    assert losses(read_recording(folder, machine(tmp_path)).findings) == lost


def test_a_part_of_another_format_than_the_others_is_a_loss(tmp_path):
    folder = bag(tmp_path / "bag", count=1)
    (folder / "bag_1.db3").write_bytes(b"SQLite format 3\0")
    metadata(folder, "  relative_file_paths:\n  - bag_0.mcap\n  - bag_1.db3\n")
    assert losses(survey(folder).findings) == [
        ("part_of_other_kind", {"part": "bag_1.db3", "metadata": "metadata.yaml"})
    ]


def test_a_folder_without_any_of_its_parts_is_refused_with_the_name_of_the_first(tmp_path):
    metadata(tmp_path, "  relative_file_paths:\n  - bag_0.db3\n")
    for read in (survey, log_parts):
        with pytest.raises(RecordingError, match=r"part bag_0\.db3 of metadata\.yaml is not in the folder") as fault:
            read(tmp_path)
        assert "\n" not in str(fault.value)


def test_the_parts_of_a_ros_2_bag_in_sqlite_are_surveyed_as_one(tmp_path):
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    number = store.types["std_msgs/msg/Float64"]
    folder = tmp_path / "bag"
    folder.mkdir()
    for part in (0, 1):
        with Writer(tmp_path / f"bag_{part}", version=8) as writer:
            connection = writer.add_connection("/speed", number.__msgtype__, typestore=store)
            for k in range(50):
                stamp = START * 10**9 + (50 * part + k) * 10**7
                writer.write(connection, stamp, store.serialize_cdr(number(50.0 * part + k), number.__msgtype__))
        (tmp_path / f"bag_{part}" / f"bag_{part}.db3").rename(folder / f"bag_{part}.db3")
    metadata(folder, "  relative_file_paths:\n  - bag_0.db3\n  - bag_1.db3\n  - bag_2.db3\n")
    source = survey(folder)
    assert source.topics["/speed"] == TopicDetails("std_msgs/msg/Float64", 100)
    np.testing.assert_array_equal(source.columns["/speed data"].values, np.arange(100.0))
    assert losses(source.findings) == [("part_missing", {"part": "bag_2.db3", "metadata": "metadata.yaml"})]


@settings(max_examples=15, deadline=None)
@given(cuts=st.lists(st.integers(1, 199), max_size=4, unique=True), pause=st.sampled_from([0.0, 0.01, 5.0]))
def test_a_log_cut_anywhere_is_read_as_the_whole_log(tmp_path_factory, cuts, pause):
    folder = tmp_path_factory.mktemp("cut")
    time = np.arange(200) / 128.0 + pause * (np.arange(200) >= 100)
    (folder / "bag").mkdir()
    for i, (first, last) in enumerate(pairwise([0, *sorted(cuts), 200])):
        write_part(folder / "bag" / f"{9 - i}.mcap", time[first:last], time[first:last])
    whole = read_recording(write_part(folder / "whole.mcap", time, time), machine(folder))
    parts = read_recording(folder / "bag", machine(folder))
    assert parts.origin == whole.origin == START and parts.name == "bag"
    np.testing.assert_array_equal(parts["speed"].values, whole["speed"].values)
    np.testing.assert_allclose(parts["speed"].time, whole["speed"].time, rtol=0.0, atol=5e-7)
    assert [item.kind for item in parts.findings] == [item.kind for item in whole.findings]
    assert ("sample_gaps" in {item.kind for item in parts.findings}) == (pause == 5.0)


def test_parts_that_overlap_are_refused(tmp_path):
    folder = bag(tmp_path / "bag", count=1)
    write_part(folder / "bag_1.mcap", 0.5 + np.arange(100) / 100, np.zeros(100))
    with pytest.raises(RecordingError, match=r"bag_1\.mcap: overlaps the previous part"):
        read_recording(folder, machine(tmp_path))


def test_a_table_with_the_suffix_of_a_part_is_one_line(tmp_path):
    folder = tmp_path / "log"
    folder.mkdir()
    (folder / "bag_0.mcap").write_text("t,x\n0,1\n1,2\n2,3\n", encoding="utf-8")
    columns = MACHINE.replace("[channels.mcap]", "[channels]\ntime = { column = 't', unit = 's' }")
    (tmp_path / "machine.toml").write_text(columns.partition("speed")[0] + "speed = { column = 'x', unit = 'm/s' }\n")
    with pytest.raises(RecordingError, match=r"bag_0\.mcap: is not a log of topics"):
        convert(folder, tmp_path / "out.csv")
    with pytest.raises(RecordingError, match=r"bag_0\.mcap: is not a log of topics"):
        read_recording(folder, read_machine_file(tmp_path / "machine.toml"))
    assert not (tmp_path / "out.csv").exists()


def test_the_missing_last_of_two_parts_is_a_loss(tmp_path):
    folder = bag(tmp_path / "bag", count=1)
    metadata(folder, "  relative_file_paths:\n    - bag_0.mcap\n    - bag_1.mcap\n")
    assert losses(survey(folder).findings) == [("part_missing", {"part": "bag_1.mcap", "metadata": "metadata.yaml"})]
