"""Missing messages are detected by their sequence numbers."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from cdtool.base.findings import Finding
from cdtool.formats.mcap import Mcap
from tests.formats.mcap.small_files import small_file

MS = 10**6


def write(path, messages, chunk_size=400):
    """Write messages (topic, time [ms], sequence number)."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk_size)
        writer.start()
        channels = {topic: writer.register_channel(topic, "json", 0) for topic in {item[0]: 0 for item in messages}}
        for topic, time, number in messages:
            payload = json.dumps({"x": float(time)}).encode()
            writer.add_message(channels[topic], 1000 * MS + time * MS, payload, 1000 * MS + time * MS, number)
        writer.finish()
    return path


def missing_messages(path):
    return [finding for finding in Mcap().columns(path).findings if finding.kind == "missing_messages"]


@pytest.mark.parametrize(
    "numbers",
    [
        [0] * 200,
        list(range(1, 201)),
        list(range(7, 2007, 10)),
        [*range(1, 101), *range(1, 101)],
        [*range(2**32 - 100, 2**32), *range(100)],
        np.random.default_rng(1).integers(0, 2**32, 200).tolist(),
    ],
    ids=["no numbers", "complete", "every tenth", "restarted", "32-bit overflow", "random"],
)
def test_numbers_other_than_a_count_with_jumps_are_not_reported(tmp_path, numbers):
    assert not missing_messages(write(tmp_path / "log.mcap", [("/a", i, number) for i, number in enumerate(numbers)]))


def test_each_topic_is_counted_separately(tmp_path):
    messages = [("/a", i, i + 1) for i in range(300) if i != 200]
    messages += [("/b", 10 * i, i + 1) for i in range(30)]
    messages.sort(key=lambda item: item[1])
    (only,) = missing_messages(write(tmp_path / "log.mcap", messages))
    assert only == Finding("missing_messages", "/a", {"jumps": 1, "missing": 1, "after": 0.199, "of_topic": True})


def test_a_log_whose_topics_are_counted_together_has_only_common_jumps(tmp_path):
    small_file(tmp_path / "whole.mcap", messages=200)  # two topics, one count
    assert not missing_messages(tmp_path / "whole.mcap")
    messages = [("/b" if i % 3 == 2 else "/a", i, i + 1) for i in range(300) if not 100 <= i < 110]
    (only,) = missing_messages(write(tmp_path / "log.mcap", messages))
    assert only == Finding("missing_messages", "", {"jumps": 1, "missing": 10, "after": 0.099, "of_topic": False})


@settings(max_examples=40, deadline=None)
@given(lost=st.sets(st.integers(1, 298), max_size=60), chunk=st.sampled_from([100, 1000, 10**6]))
def test_any_loss_between_the_first_and_the_last_message_is_counted(tmp_path_factory, lost, chunk):
    messages = [("/a", i, i + 1) for i in range(300) if i not in lost]
    findings = missing_messages(write(tmp_path_factory.mktemp("jumps") / "log.mcap", messages, chunk))
    assert len(findings) == bool(lost)
    if lost:
        assert findings[0].numbers["missing"] == len(lost)


def test_a_channel_is_read_if_another_one_of_its_topic_cannot_be_decoded(tmp_path):
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=300)
        writer.start()
        unknown, known = (writer.register_channel("/a", encoding, 0) for encoding in ("morse", "json"))
        for i in range(50):
            writer.add_message(unknown, i * MS, b"...---...", i * MS)
            writer.add_message(known, i * MS, json.dumps({"name": ["x"], "v": i}).encode(), i * MS)
        writer.finish()
    source = Mcap().columns(path)
    assert source.columns["/a v"].values.tolist() == list(range(50))
    assert any(finding.kind == "undecodable_messages" and finding.numbers["count"] == 50 for finding in source.findings)
    assert Mcap().element_names(path, "/a") == ("x",)


def test_channels_counted_separately_miss_nothing_if_their_numbers_do_not_meet(tmp_path):
    """As of a part of a log: no number repeats, but each channel counts by itself."""
    messages = [("/a", i, 201 + i) for i in range(100)] + [("/b", 2 * i, 101 + i) for i in range(50)]
    path = write(tmp_path / "log.mcap", sorted(messages, key=lambda item: item[1]), chunk_size=1 << 20)
    assert missing_messages(path) == []
