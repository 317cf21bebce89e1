"""The summary is compared with the data: differences are reported, and no chunk is skipped without verification."""

from __future__ import annotations

import struct
import zlib

import pytest
from mcap.writer import CompressionType, Writer

from cdtool.formats.mcap import chunks, data_section
from cdtool.formats.mcap.log import Log
from tests.base.findings.facts import fact_of
from tests.formats.mcap.small_files import read, small_file


def with_summary(path, change):
    """Write the file again with a changed summary section and its valid CRC."""
    whole = path.read_bytes()
    start = Log(path).summary.footer.summary_start
    section, footer = change(bytearray(whole[start:-37])), whole[-37:-12]
    crc = zlib.crc32(bytes(section) + footer)
    path.write_bytes(whole[:start] + bytes(section) + footer + struct.pack("<I", crc) + whole[-8:])


def alternating_chunks(path):
    """Write chunks of one topic each: alternately 10 messages of /a and of /b."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=600, compression=CompressionType.NONE)
        writer.start()
        channels = [writer.register_channel(topic, "json", 0) for topic in ("/a", "/b")]
        for i in range(20):
            for k in range(10):
                writer.add_message(channels[i % 2], 100 * i + k, b"x" * 40, 0)
        writer.finish()


def find(section, value):
    at = section.find(value)
    assert at >= 0
    return at


def test_chunks_without_a_wanted_topic_are_not_read(tmp_path, monkeypatch):
    path = tmp_path / "log.mcap"
    alternating_chunks(path)
    checked = []
    unpack = chunks.unpack

    def counting(header, packed, target):
        checked.append(header.at)
        unpack(header, packed, target)

    monkeypatch.setattr(data_section, "unpack", counting)
    for topic in ("/a", "/b"):
        checked.clear()
        messages, findings, log = read(path, wanted=topic.__eq__)
        assert len(messages) == 100
        assert {name for name, _, _ in messages} == {topic}
        assert not findings
        assert log.count == 200
        assert {name: topic.messages for name, topic in log.topic_details.items()} == {"/a": 100, "/b": 100}
        assert len(checked) < len(log.summary.chunks)
        assert log.origin == 0


@pytest.mark.parametrize(
    "what", ["a chunk is left out", "a count", "a channel of a chunk", "message indexes are longer", "no CRC"]
)
def test_a_false_summary_loses_nothing_and_is_reported(tmp_path, what):
    path = tmp_path / "log.mcap"
    alternating_chunks(path)
    log = Log(path)
    indexes = list(log.summary.chunks.values())

    def change(section):
        at = find(section, struct.pack("<QQ", indexes[5].chunk_start_offset, indexes[5].chunk_length)) + 16
        if what == "a chunk is left out":
            begin = at - 41
            length = 9 + int.from_bytes(section[begin + 1 : begin + 9], "little")
            assert section[begin] == 8
            del section[begin : begin + length]
            section[begin:begin] = struct.pack("<BQ", 0x90, length - 9) + bytes(length - 9)  # all offsets stay the same
        elif what == "a count":
            at = find(section, struct.pack("<HQHQ", 1, 100, 2, 100))
            section[at : at + 20] = struct.pack("<HQHQ", 1, 110, 2, 90)
        elif what == "a channel of a chunk":
            section[at + 4] = 1 if section[at + 4] == 2 else 2
        elif what == "message indexes are longer":
            size = struct.unpack_from("<I", section, at)[0]
            length = struct.unpack_from("<Q", section, at + 4 + size)[0]
            more = indexes[6].chunk_length + indexes[6].message_index_length
            struct.pack_into("<Q", section, at + 4 + size, length + more)
        return section

    with_summary(path, change)
    if what == "no CRC":
        whole = path.read_bytes()
        path.write_bytes(whole[:-12] + bytes(4) + whole[-8:])
    for topic in ("/a", "/b"):
        messages, findings, _ = read(path, wanted=topic.__eq__)
        assert len(messages) == 100, topic
        if what in ("a chunk is left out", "a count"):
            assert any(finding.kind in ("index_disagrees", "channel_counts_differ") for finding in findings)


def test_a_file_with_more_messages_than_in_its_summary_is_read_completely(tmp_path):
    path = tmp_path / "log.mcap"
    sent = small_file(path)
    statistics = Log(path).summary.statistics

    def change(section):
        at = find(section, struct.pack("<QH", statistics.message_count, statistics.schema_count))
        struct.pack_into("<Q", section, at, 20)
        return section

    with_summary(path, change)
    messages, findings, _ = read(path)
    assert messages == sent
    assert fact_of(findings[0]) == ("message_count_differs", {"stated": 20, "read": len(sent)})


@pytest.mark.parametrize("field", ["start", "end"])
def test_a_chunk_whose_times_differ_from_the_summary_is_reported(tmp_path, field):
    path = tmp_path / "log.mcap"
    sent = small_file(path)
    whole = bytearray(path.read_bytes())
    at = sorted(Log(path).summary.chunks)[1] + (9 if field == "start" else 17)
    whole[at] ^= 0x01
    path.write_bytes(whole)
    messages, findings, _ = read(path)
    assert messages == sent
    assert ("index_disagrees", {"count": 1, "how": "other values"}) in [fact_of(finding) for finding in findings]


def test_a_damaged_summary_is_reported_and_the_data_are_read_without_it(tmp_path):
    path = tmp_path / "log.mcap"
    sent = small_file(path)
    whole = bytearray(path.read_bytes())
    whole[Log(path).summary.footer.summary_start + 30] ^= 0x01
    path.write_bytes(whole)
    messages, findings, _ = read(path)
    assert messages == sent
    assert fact_of(findings[0]) == (
        "summary_damaged",
        {"reason": "the checksum of the summary does not match", "messages": len(sent)},
    )
