"""False sizes and decompression bombs are refused quickly and with little memory."""

from __future__ import annotations

import struct

from mcap.writer import CompressionType, Writer

from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.mcap import Mcap, chunks


def camera_in_the_dark(path, compression):
    """Write a load cell at 100 Hz and black images of 300 kB: 200 MB of almost only zeros."""
    image = b"\0\1\0\0" + bytes(300_000)
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, chunk_size=1 << 20)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data")
        cell, camera = writer.register_channel("/cell", "cdr", schema), writer.register_channel("/camera", "raw", 0)
        for i in range(700):
            writer.add_message(cell, i * 10**7, b"\0\1\0\0" + struct.pack("<d", i), i * 10**7, i + 1)
            writer.add_message(camera, i * 10**7, image, i * 10**7, i + 1)
        writer.finish()
    return path


def test_the_findings_of_a_log_of_dark_images_state_how_to_read_it_completely(tmp_path):
    packed_log = camera_in_the_dark(tmp_path / "packed.mcap", CompressionType.ZSTD)
    for wanted in (
        None,
        ChannelMap(TimeSource(), (ChannelSource("force", topic="/cell", field="data"),), ("a",), True),
    ):
        source = Mcap().columns(packed_log, wanted)
        assert [finding.kind for finding in source.findings].count("chunks_refused") == 1
        assert any(finding.severity == "loss" for finding in source.findings)
    plain = camera_in_the_dark(tmp_path / "plain.mcap", CompressionType.NONE)
    source = Mcap().columns(plain)
    assert source.columns["/cell data"].values.tolist() == list(range(700))
    # The images have an unknown encoding; nothing else of the log is lost.
    others = [finding for finding in source.findings if finding.kind != "undecodable_messages"]
    assert not [finding for finding in others if finding.severity == "loss" or finding.kind == "chunks_refused"]


def test_numbers_that_never_change_are_read_in_logs_of_any_length(tmp_path, monkeypatch):
    """The values of a stuck joint are compressed to a tenth, but its times are not."""
    monkeypatch.setattr(chunks, "_LONG", 1 << 20)
    monkeypatch.setattr(chunks, "LARGEST", 1 << 20)
    path = tmp_path / "frozen.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD, chunk_size=1 << 19)
        writer.start()
        channel = writer.register_channel("/q", "json", 0)
        for i in range(60_000):
            writer.add_message(channel, i * 10**6, b'{"position": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}', i * 10**6)
        writer.finish()
    source = Mcap().columns(path)
    assert len(source.columns["/q position[:]"].values) == 60_000
    assert not [finding for finding in source.findings if finding.severity == "loss"]
