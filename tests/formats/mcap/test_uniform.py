"""The fast path for uniform chunks gives the same values, times, order, findings and errors as single messages."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as Ros2Writer

from cdtool.formats.mcap import Mcap
from cdtool.formats.mcap.container.log import Log
from cdtool.messages.schemas import DEFINITIONS
from tests.formats.mcap.fast_path import same
from tests.formats.mcap_damage.assembly import Ending, assemble, blocks_of, with_false_header
from tests.formats.mcap_damage.messages import DEFINITIONS as TOPICS
from tests.formats.mcap_damage.messages import START as START_S
from tests.formats.mcap_damage.messages import payload
from tests.formats.mcap_damage.truth import Message
from tests.messages.ros_messages import definitions, numeric_texts

NAME, TOPIC = "test_msgs/msg/Thing", "/thing"
START = 1_700_000_000 * 10**9


@st.composite
def recordings(draw):
    """Return a definition, repeated and single messages, times [ns] in any order, and messages of another topic."""
    text, values = draw(definitions())
    runs = draw(st.lists(st.tuples(values, st.sampled_from([1, 2, 60])), min_size=1, max_size=5))
    messages = [message for message, count in runs for _ in range(count)]
    steps = draw(st.sampled_from([(0, 10**7), (-(10**6), 10**7), (-(2**61), 2**61)]))
    times = START + np.cumsum(draw(st.lists(st.integers(*steps), min_size=1, max_size=7)))
    return text, messages, [int(times[i % len(times)]) % 2**64 + i for i in range(len(messages))]


@settings(max_examples=120, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    recordings(),
    st.sampled_from(list(CompressionType)),
    st.sampled_from([100, 600, 5000]),
    st.sampled_from(["log", "publish"]),
    st.data(),
)
def test_the_fast_path_reads_any_messages_like_one_by_one(recording, compression, chunk_size, clock, data):
    text, messages, times = recording
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        with path.open("wb") as file:
            writer = Ros2Writer(file, chunk_size=chunk_size, compression=compression)
            schema = writer.register_msgdef(NAME, text)
            other = writer.register_msgdef("std_msgs/msg/Float64", "float64 data")
            for i, (time, message) in enumerate(zip(times, messages, strict=True)):
                writer.write_message(TOPIC, schema, message, log_time=time, publish_time=time // 2)
                if i % 3 == 0:
                    writer.write_message("/other", other, {"data": i}, log_time=time, publish_time=time)
            writer.finish()
        survey = Mcap().columns(path)
        texts = numeric_texts([name.removeprefix(f"{TOPIC} ") for name in survey.columns if name.startswith(TOPIC)])
        fields = data.draw(st.lists(st.sampled_from(texts), min_size=1, max_size=4, unique=True))
        if data.draw(st.booleans()):
            fields = [field for field in fields if f"{TOPIC} {field}" in survey.columns] or fields
        same(path, [(TOPIC, field) for field in fields], clock)


def joint_states(path, count=400, chunk_size=2000, change=None, stamp=None, repeated=1):
    """Write a log of /joint_states and /force; `change(i, message)` changes messages."""
    rng = np.random.default_rng(3)
    with path.open("wb") as file:
        writer = Ros2Writer(file, chunk_size=chunk_size)
        kinds = ("sensor_msgs/msg/JointState", "std_msgs/msg/Float64")
        schemas = [writer.register_msgdef(kind, DEFINITIONS[kind].text) for kind in kinds]
        for i in range(count):
            time = START + i * 10**6
            sec, nanosec = divmod(stamp(i) if stamp else time, 10**9)
            message = {
                "header": {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": "base"},
                "name": ["a", "b", "c"],
                **{name: rng.normal(size=3).tolist() for name in ("position", "velocity", "effort")},
            }
            for topic in ("/joint_states", "/joint_states_2")[:repeated]:
                writer.write_message(topic, schemas[0], change(i, message) if change else message, time, time + 5, i)
            writer.write_message("/force", schemas[1], {"data": float(i)}, time, time + 7, i)
        writer.finish()


FIELDS = [("/joint_states", field) for field in ("position[:]", "velocity[b]", "effort[2]", "header.stamp.nanosec")]


@pytest.mark.parametrize("clock", ["log", "publish", "header"])
def test_the_fast_path_reads_all_but_the_first_chunk_of_a_usual_log(tmp_path, fast_path_chunks, clock):
    path = tmp_path / "log.mcap"
    joint_states(path)
    before = dict(fast_path_chunks)
    columns, _, findings = same(path, FIELDS, clock)
    chunks = len(Log(path).summary.chunks)
    assert chunks > 30
    assert fast_path_chunks[True] - before[True] == chunks - 1
    assert fast_path_chunks[False] == before[False]
    assert not findings
    assert columns["/joint_states position[:]"][0] == (400, 3)


@pytest.mark.parametrize("every", [1, 2, 30, 399])
@pytest.mark.parametrize(
    "change",
    [
        lambda message: {**message, "name": ["b", "a", "c"]},
        lambda message: {**message, "name": ["a", "b", "d"]},
        lambda message: {**message, "effort": []},
        lambda message: {**message, "position": message["position"][:2]},
        lambda message: {**message, "name": [], "position": [], "velocity": [], "effort": []},
        lambda message: {**message, "header": {**message["header"], "frame_id": "longer than before"}},
    ],
    ids=["order", "names", "no efforts", "two positions", "empty", "frame"],
)
def test_the_fast_path_reads_messages_that_differ_sometimes_like_one_by_one(tmp_path, every, change):
    path = tmp_path / "log.mcap"
    joint_states(path, change=lambda i, message: change(message) if i % every == every - 1 else message)
    for clock in ("log", "header"):
        same(path, FIELDS, clock)
    same(path, [("/joint_states", "velocity[:]"), ("/force", "data")])


@pytest.mark.parametrize(
    "stamp",
    [
        lambda i: START - i * 10**6,
        lambda i: START + (i % 100) * 10**6,
        lambda i: START + i * 10**6 if i < 300 else (i - 300) * 10**6,
        lambda i: (i - 200) * 10**7,
        lambda _: 0,
    ],
    ids=["backwards", "again", "set", "before 1970", "standing"],
)
def test_stamps_in_any_order_have_the_same_findings(tmp_path, stamp):
    path = tmp_path / "log.mcap"
    joint_states(path, stamp=stamp)
    same(path, FIELDS, "header")


def test_two_topics_of_one_type_and_one_that_is_not_requested(tmp_path):
    path = tmp_path / "log.mcap"
    joint_states(path, repeated=2)
    same(path, [*FIELDS, ("/joint_states_2", "effort[a]")], "header")
    same(path, [("/force", "data")])


WANTED = [("/force", "data"), ("/axis", "value"), ("/raw", "data")]


def unchanged(_, message):
    return message


def blocks(everywhere=False, count=600, size=20, change=unchanged):
    """Return chunks with alternating messages of three topics: two in CDR, one of ROS 1."""
    messages = []
    for i in range(count):
        topic, time = WANTED[i % 3][0], START_S + i * 10**6
        messages.append(change(i, Message(topic, time, payload(topic, time, i / 7), i / 7)))
    return blocks_of(messages, size, "zstd", everywhere)


def written(path, parts, ending=None):
    path.write_bytes(assemble(parts, ending))
    return path


def test_definitions_that_are_repeated_in_every_chunk_are_skipped(tmp_path, fast_path_chunks):
    path = written(tmp_path / "log.mcap", blocks(everywhere=True))
    before = fast_path_chunks[True]
    columns, _, findings = same(path, WANTED)
    assert fast_path_chunks[True] - before == 29
    assert not findings
    assert sorted(shape for shape, _, _ in columns.values()) == [(200,)] * 3


@pytest.mark.parametrize("at", [0, 1, 7, 28])
@pytest.mark.parametrize("kind", ["another type", "another topic"])
def test_a_redefined_channel_is_lost_on_the_fast_path_too(tmp_path, at, kind):
    force = TOPICS["/force"]
    other = replace(force, topic="/elsewhere") if kind == "another topic" else replace(force, encoding="json")
    parts = blocks()
    parts[at] = replace(parts[at], after=other.records)
    _, _, findings = same(written(tmp_path / "log.mcap", parts), WANTED)
    assert any("defined twice" in finding for finding in findings)


def shorter(index):
    """Return an index with one message fewer of a channel and one more of the next."""
    return replace(index, offsets={channel: at - 16 * (channel == 3) for channel, at in index.offsets.items()})


@pytest.mark.parametrize(
    "falsify",
    [
        shorter,
        lambda index: replace(index, index_length=index.index_length + 160),
        lambda index: replace(index, index_length=max(0, index.index_length - 16)),
        lambda index: replace(index, offsets={}),
        lambda index: replace(index, offsets={1: index.start + index.length}),
        lambda index: replace(index, offsets=dict(zip(index.offsets, reversed(index.offsets.values()), strict=True))),
    ],
    ids=["shifted", "longer", "shorter", "none", "one", "exchanged"],
)
@pytest.mark.parametrize("which", [range(30), range(5, 6), range(20, 30)], ids=["all", "one", "last"])
def test_false_message_counts_of_a_chunk_change_nothing(tmp_path, falsify, which):
    ending = Ending(
        indexes=lambda all_indexes: [falsify(index) if i in which else index for i, index in enumerate(all_indexes)]
    )
    path = written(tmp_path / "log.mcap", blocks(), ending)
    columns = same(path, WANTED)[0]
    if not isinstance(columns, str):
        for k, (topic, field) in enumerate(WANTED):
            assert columns[f"{topic} {field}"][1] == (np.arange(k, 600, 3) / 7).tobytes()


@pytest.mark.parametrize("off", [lambda n: n - 20, lambda n: n + 10**6, lambda _: 0, lambda _: 1])
def test_false_message_counts_of_the_file_change_nothing(tmp_path, off):
    ending = Ending(counts=lambda counts: {channel: off(count) for channel, count in counts.items()})
    same(written(tmp_path / "log.mcap", blocks(), ending), WANTED)


@pytest.mark.parametrize("lost", [(0,), (1,), (11, 12, 20), tuple(range(2, 30, 2))])
def test_rows_after_lost_chunks_are_consecutive(tmp_path, lost):
    parts = [with_false_header(part, crc=1) if i in lost else part for i, part in enumerate(blocks())]
    columns, _, findings = same(written(tmp_path / "log.mcap", parts), WANTED)
    assert any("checksum" in finding for finding in findings)
    kept = [i for i in range(600) if i // 20 not in lost]
    for k, (topic, field) in enumerate(WANTED):
        expected = np.array([i / 7 for i in kept if i % 3 == k])
        assert columns[f"{topic} {field}"][1] == expected.tobytes()


def test_truncated_messages_are_lost_on_the_fast_path_too(tmp_path):
    def cut(i, message):
        return replace(message, payload=message.payload[:-3]) if i % 50 == 49 else message

    _, _, findings = same(written(tmp_path / "log.mcap", blocks(change=cut)), WANTED)
    assert any("cannot be decoded" in finding for finding in findings)


@pytest.mark.parametrize("time", [2**63, 2**64 - 1, 0])
def test_invalid_times_are_the_same_on_the_fast_path(tmp_path, time):
    def without(i, message):
        return replace(message, time=time) if i % 100 == 70 or i < 3 else message

    same(written(tmp_path / "log.mcap", blocks(change=without)), WANTED)
