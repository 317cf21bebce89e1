"""Ids that are redefined or undefined: their messages are lost and counted, and never read by another schema."""

from __future__ import annotations

import struct
import zlib

import pytest

from tests.formats.mcap.small_files import read, read_or_refused
from tests.formats.mcap.test_bombs import chunk, file_of, record


def text(value):
    return struct.pack("<I", len(value)) + value


def schema(number, content):
    return record(3, struct.pack("<H", number) + text(b"T") + text(b"ros2msg") + text(content))


def channel(number, topic, schema_id=1):
    return record(4, struct.pack("<HH", number, schema_id) + text(topic) + text(b"cdr") + struct.pack("<I", 0))


def message(number, time):
    return record(5, struct.pack("<HIQQ", number, 0, time, time) + b"payload")


def verified(*records):
    content = b"".join(records)
    times = [int.from_bytes(item[15:23], "little") for item in records if item[0] == 5]
    return chunk(content, len(content), "", zlib.crc32(content), (min(times), max(times)))


DEFINED = (schema(1, b"float64 data"), channel(1, b"/a"), channel(2, b"/b", 0))


@pytest.mark.parametrize("change", [schema(1, b"float32 data"), channel(1, b"/c"), channel(1, b"/a", 0)])
@pytest.mark.parametrize("apart", [False, True], ids=["in one chunk", "in two chunks"])
def test_after_a_redefinition_messages_are_lost_and_counted_and_other_channels_are_read(tmp_path, change, apart):
    before = (*DEFINED, message(1, 1), message(2, 2), message(1, 3))
    after = (change, message(1, 4), message(2, 5), message(1, 6))
    chunks = (verified(*before), verified(*after)) if apart else (verified(*before, *after),)
    messages, findings = read_or_refused(file_of(tmp_path / "redefined.mcap", *chunks))
    assert [time for _, time, _ in messages] == [1, 2, 3, 5]
    assert [topic for topic, _, _ in messages] == ["/a", "/b", "/a", "/b"]
    assert "is defined twice, differently: 2 messages lost" in findings[0]


def test_a_repeated_definition_is_not_a_redefinition(tmp_path):
    again = (*DEFINED, message(1, 1))
    messages, findings = read_or_refused(file_of(tmp_path / "again.mcap", verified(*again), verified(*again)))
    assert len(messages) == 2
    assert not findings


def test_only_the_messages_of_an_undefined_channel_are_lost(tmp_path):
    path = file_of(tmp_path / "missing.mcap", verified(*DEFINED, message(1, 1), message(7, 2), message(7, 3)))
    messages, findings = read_or_refused(path)
    assert [time for _, time, _ in messages] == [1]
    assert findings == ["a message names channel 7, which is not defined: 2 messages lost"]


def test_only_the_messages_of_an_undefined_schema_are_lost(tmp_path):
    path = file_of(tmp_path / "missing.mcap", verified(*DEFINED, channel(3, b"/c", 9), message(1, 1), message(3, 2)))
    messages, findings = read_or_refused(path)
    assert [time for _, time, _ in messages] == [1]
    assert findings == ["channel '/c' names schema 9, which is not defined: 1 message lost"]


def test_a_schema_with_the_id_0_is_ignored(tmp_path):
    messages, findings = read_or_refused(
        file_of(tmp_path / "zero.mcap", verified(schema(0, b""), *DEFINED, message(2, 1)))
    )
    assert len(messages) == 1
    assert not findings


def test_a_definition_outside_of_chunks_leaves_its_messages_unverified(tmp_path):
    path = file_of(tmp_path / "outside.mcap", *DEFINED, verified(message(1, 1), message(2, 2)))
    messages, _, log = read(path)
    assert len(messages) == log.unverified == 2
