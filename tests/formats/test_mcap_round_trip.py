"""Random messages in files written by the `mcap` packages and by rosbags are read back exactly."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as Ros2Writer

from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.mcap import Mcap
from tests.formats.messages.ros_messages import definitions

NAME = "test_msgs/msg/Thing"
TOPIC = "/thing"
START = 1_700_000_000 * 10**9
RARELY = settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def numbers(message, prefix=""):
    """Return every numeric field of a message: a float, or a list of floats."""
    fields = {}
    for name, value in message.items():
        if isinstance(value, dict):
            fields |= numbers(value, f"{prefix}{name}.")
        elif isinstance(value, list) and all(isinstance(item, int | float) for item in value):
            fields[f"{prefix}{name}[:]"] = [float(item) for item in value]
        elif isinstance(value, int | float):
            fields[f"{prefix}{name}"] = float(value)
    return fields


def expected_columns(messages):
    """Return the values per field as in a survey: only arrays of one length, and NaN for empty arrays."""
    rows = [numbers(message) for message in messages]
    columns = {}
    for name in rows[0]:
        values = [row.get(name, []) for row in rows]
        widths = {len(value) for value in values if isinstance(value, list) and value}
        if not name.endswith("[:]"):
            columns[name] = np.array(values)
        elif len(widths) == 1:
            columns[name] = np.array([value or [math.nan] * max(widths) for value in values])
    return columns


def check(path, messages, times):
    """Check that all numbers and times are those that were written, in a survey and by name."""
    expected = expected_columns(messages)
    survey = Mcap().columns(path)
    assert set(survey.columns) == {f"{TOPIC} {name}" for name in expected}
    assert not [finding for finding in survey.findings if finding.severity == "loss"]
    sources = tuple(ChannelSource("speed", topic=TOPIC, field=name) for name in expected)
    requested = Mcap().columns(path, ChannelMap(TimeSource(), sources, (), topics=True)) if expected else survey
    for source in (survey, requested):
        for name, values in expected.items():
            column = source.columns[f"{TOPIC} {name}"]
            assert np.array_equal(bits(column.values), bits(values)), name
            assert column.time.tolist() == [(time - times[0]) / 1e9 for time in times]


def bits(values):
    """Return float64 numbers as bytes; all NaN are equal."""
    return np.where(np.isnan(values), np.nan, np.ascontiguousarray(values, dtype=np.float64)).view(np.int64)


@st.composite
def recordings(draw):
    """Return a definition, messages of it, and their times [ns], which do not decrease."""
    text, values = draw(definitions())
    messages = draw(st.lists(values, min_size=1, max_size=5)) * draw(st.sampled_from([1, 1, 40]))
    steps = draw(st.lists(st.integers(0, 10**7), min_size=len(messages), max_size=len(messages)))
    return text, messages, (START + np.cumsum(steps)).tolist()


@RARELY
@given(recordings(), st.sampled_from(list(CompressionType)), st.sampled_from([100, 5000]))
def test_files_of_mcap_ros2_support_are_read_exactly(recording, compression, chunk_size):
    text, messages, times = recording
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        with path.open("wb") as file:
            writer = Ros2Writer(file, chunk_size=chunk_size, compression=compression)
            schema = writer.register_msgdef(NAME, text)
            for time, message in zip(times, messages, strict=True):
                writer.write_message(TOPIC, schema, message, log_time=time, publish_time=time)
            writer.finish()
        check(path, messages, times)


@RARELY
@given(recordings(), st.booleans())
def test_files_of_rosbags_are_read_exactly(recording, compressed):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    text, messages, times = recording
    store = typestore(text)
    with tempfile.TemporaryDirectory() as folder:
        bag = rosbag2.Writer(Path(folder) / "bag", version=9, storage_plugin=rosbag2.StoragePlugin.MCAP)
        if compressed:
            bag.set_compression(rosbag2.CompressionMode.STORAGE, rosbag2.CompressionFormat.ZSTD)
        with bag:
            connection = bag.add_connection(TOPIC, NAME, typestore=store)
            for time, message in zip(times, messages, strict=True):
                bag.write(connection, time, store.serialize_cdr(as_class(store, NAME, message), NAME))
        (path,) = (Path(folder) / "bag").glob("*.mcap")
        check(path, messages, times)


def typestore(text):
    """Return rosbags' types of a definition."""
    from rosbags import typesys

    store = typesys.get_typestore(typesys.Stores.EMPTY)
    store.register(typesys.get_types_from_msg(text, NAME))
    return store


def as_class(store, name, message):
    """Return a dict as an object of rosbags' class."""
    kinds = dict(store.fielddefs[name][1])
    return store.types[name](**{field: as_value(store, kinds[field], value) for field, value in message.items()})


def as_value(store, kind, value):
    """Return one field; `kind` is rosbags' (node, detail): 1 for a base type, 2 for a message, 3 and 4 for arrays."""
    node, detail = kind
    if node == 2:
        return as_class(store, detail, value)
    if node in (3, 4):
        inner = detail[0]
        if inner[0] == 1 and inner[1][0] != "string":
            return np.array(value, dtype=inner[1][0])
        return [as_value(store, inner, item) for item in value]
    return value
