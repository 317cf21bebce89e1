"""The summary is compared with the data: differences are reported, and no chunk is skipped without verification."""

from __future__ import annotations

from mcap.writer import CompressionType, Writer

from cdtool.formats.mcap import chunks, data_section
from tests.formats.mcap.small_files import read


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
