"""Every number of the real recordings, bit by bit as readers that share nothing with cdtool's find it.

Text tables by the `csv` module and `float`, MATLAB files by scipy, MCAP by mcap and mcap-ros2-support, bags by rosbags.
"""

from __future__ import annotations

import csv
from collections import defaultdict

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from scipy.io import loadmat

from cdtool.formats.channels.reading import survey
from tests.data_folder import DATA, needs_data


def recordings(suffix):
    """Parametrise a test with all recordings of this suffix; none where the recordings are absent."""
    found = sorted(path for path in DATA.rglob(f"*{suffix}") if "mcap_conformance" not in path.parts) if DATA else []
    return pytest.mark.parametrize("path", found, ids=[path.relative_to(DATA).as_posix() for path in found])


def number(cell):
    try:
        return float(cell)
    except ValueError:
        return np.nan


def assert_same(column, expected, name):
    values, expected = column.values, np.array(expected, dtype=np.float64)
    assert values.shape == expected.shape, name
    assert np.array_equal(np.where(np.isnan(values), np.nan, values).view(np.uint64), expected.view(np.uint64)), name


def member(message, field):
    for name in field.removesuffix("[:]").split("."):
        message = getattr(message, name)
    return list(message) if isinstance(message, bytes) else message


def check_messages(path, messages):
    columns = survey(path).columns
    assert columns or not any(topic.endswith("joint_states") for topic in messages)
    for name, column in columns.items():
        topic, field = name.split(" ")
        assert_same(column, [member(message, field) for message in messages[topic]], name)


@needs_data("baxter")
@recordings(".csv")
def test_a_table_has_the_cells_as_float_reads_them(path):
    text = path.read_text(encoding="utf-8-sig")
    rows = [[number(cell) for cell in line] for line in csv.reader(text.splitlines())]
    source = survey(path)
    rows = [row for row in rows if len(row) == len(source.names)]
    first = next(n for n, row in enumerate(rows) if (np.isfinite(row) >= np.isfinite(rows[-1])).all())
    assert source.columns and len(rows) > first
    for name, column in source.columns.items():
        assert_same(column, [row[source.names.index(name)] for row in rows[first:]], name)


@needs_data("emps")
@recordings(".mat")
def test_a_matlab_file_has_the_arrays_of_scipy(path):
    arrays = loadmat(path, squeeze_me=True)
    columns = survey(path).columns
    assert columns
    for name, column in columns.items():
        array, _, index = name.removesuffix("]").partition("[")
        assert_same(column, arrays[array][:, int(index)] if index else arrays[array], name)


@needs_data("mcap_samples")
@recordings(".mcap")
def test_a_ros_2_log_has_the_numbers_of_the_reference_reader(path):
    messages = defaultdict(list)
    for name in {column.split(" ")[0] for column in survey(path).columns}:
        with path.open("rb") as file:
            decoded = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages([name])
            messages[name] = [item.decoded_message for item in decoded]
    check_messages(path, messages)


@needs_data("ur3")
@recordings(".bag")
def test_a_ros_1_bag_has_the_numbers_of_rosbags(path):
    messages = defaultdict(list)
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            messages[connection.topic].append(reader.deserialize(raw, connection.msgtype))
    check_messages(path, messages)
