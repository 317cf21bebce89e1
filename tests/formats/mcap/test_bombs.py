"""False sizes and decompression bombs are refused quickly and with little memory."""

from __future__ import annotations

import functools
import struct
import zlib

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.mcap import Mcap, chunks
from cdtool.formats.mcap.records import MAGIC
from tests.formats.mcap.small_files import read_or_refused

MEBIBYTE = 1 << 20


def record(opcode, body):
    return struct.pack("<BQ", opcode, len(body)) + body


def chunk(packed, size, compression, crc=0, times=(0, 0)):
    name = compression.encode()
    head = struct.pack("<QQQI", *times, size, crc) + struct.pack("<I", len(name)) + name
    return record(6, head + struct.pack("<Q", len(packed)) + packed)


def one_message():
    channel = record(4, struct.pack("<HHI", 1, 0, 2) + b"/a" + struct.pack("<I", 4) + b"json" + struct.pack("<I", 0))
    return channel + record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + b"{}")


def file_of(path, *records):
    header = record(1, struct.pack("<II", 0, 0))
    path.write_bytes(MAGIC + header + b"".join(records) + record(15, bytes(4)) + record(2, bytes(20)) + MAGIC)
    return path


def packed(compression, content):
    return zstandard.ZstdCompressor().compress(content) if compression == "zstd" else lz4.frame.compress(content)


@functools.cache
def zeros(compression):
    """Return 300 MiB of zeros in some kilobytes (zstd) or a megabyte (lz4)."""
    if compression == "zstd":
        maker = zstandard.ZstdCompressor().compressobj()
        parts = [maker.compress(bytes(MEBIBYTE)) for _ in range(300)]
    else:
        maker = lz4.frame.LZ4FrameCompressor()
        parts = [maker.begin(), *(maker.compress(bytes(MEBIBYTE)) for _ in range(300))]
    return b"".join([*parts, maker.flush()])


@pytest.mark.parametrize("opcode", [4, 5, 9, 12, 0x90])
@pytest.mark.parametrize("length", [2**20, 2**40, 2**63, 2**64 - 1])
def test_a_record_that_declares_more_than_the_file_contains_is_not_read(tmp_path, opcode, length):
    content = one_message()
    good = chunk(content, len(content), "", zlib.crc32(content))
    path = file_of(tmp_path / "false.mcap", good, struct.pack("<BQ", opcode, length) + bytes(40), good)
    found, findings = read_or_refused(path)
    assert found == [("/a", 0, b"{}")] * 2
    assert f"declares {length} bytes" in findings[0]


@pytest.mark.parametrize("output_size", [1, 1 << 7, 1 << 17, 1 << 20])
def test_lz4_gives_the_same_result_in_pieces_of_any_size(monkeypatch, output_size):
    rng = np.random.default_rng(0)
    content = np.frombuffer(bytes(9_000) + rng.bytes(3_000) + bytes(70_000 if output_size > 1 else 9), np.uint8)
    frames = b"".join(lz4.frame.compress(part.tobytes()) for part in (content[:10_000], content[10_000:]))
    monkeypatch.setattr(chunks, "_LZ4_OUT", output_size)
    header = chunks.ChunkHeader(0, 0, 0, 0, len(content), 0, "lz4", 0, len(frames))
    target = np.empty(len(content), np.uint8)
    chunks.unpack(header, np.frombuffer(frames, np.uint8), target)
    assert target.tobytes() == content.tobytes()


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
