"""Chunks that are read ahead have the same messages, losses and findings as chunks read one by one."""

from __future__ import annotations

import pytest

from cdtool.formats.mcap.container import chunk_read_ahead
from cdtool.formats.mcap.container.chunks import Decompressor
from cdtool.formats.mcap.container.log import Log
from tests.formats.mcap.small_files import COMPRESSIONS, read, small_file

ONE_CORE, MANY = 1, 4


@pytest.fixture
def cores(monkeypatch):
    """Return a function that sets the number of usable cores."""

    def to(count):
        monkeypatch.setattr(chunk_read_ahead, "usable_cores", lambda: count)

    return to


@pytest.fixture
def read_in_turn(monkeypatch):
    """Yield the offsets of the chunks that were read one by one (False) and read ahead (True)."""
    offsets = {True: [], False: []}
    reading, filling = Decompressor.read, chunk_read_ahead.ChunkReadAhead._fill

    def fill(self, reader, index, content):
        checked = filling(self, reader, index, content)
        if checked is not None:
            offsets[True].append(index.chunk_start_offset)
        return checked

    def read_chunk(self, file, header, target):
        offsets[False].append(header.at)
        return reading(self, file, header, target)

    monkeypatch.setattr(chunk_read_ahead.ChunkReadAhead, "_fill", fill)
    monkeypatch.setattr(Decompressor, "read", read_chunk)
    return offsets


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("joined", [1, 2000, 10**6])
def test_every_chunk_is_read_once_and_read_ahead(tmp_path, monkeypatch, cores, read_in_turn, compression, joined):
    path = tmp_path / "log.mcap"
    sent = small_file(path, compression)
    monkeypatch.setattr(chunk_read_ahead, "JOINED", joined)
    cores(MANY)
    messages, findings, log = read(path)
    assert messages == sent
    assert not findings
    assert sorted(read_in_turn[True]) == sorted(log.summary.chunks)
    assert not read_in_turn[False]


def test_on_one_core_or_without_a_verified_summary_nothing_is_read_ahead(tmp_path, cores, read_in_turn):
    path = tmp_path / "log.mcap"
    sent = small_file(path)
    cores(ONE_CORE)
    assert read(path)[0] == sent
    whole = bytearray(path.read_bytes())
    whole[-12:-8] = bytes(4)  # the summary's CRC: 0, no checksum
    path.write_bytes(whole)
    cores(MANY)
    assert read(path)[0] == sent
    assert not read_in_turn[True]


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("damage", ["content", "crc", "no crc", "size", "opcode", "time"])
@pytest.mark.parametrize("joined", [1, 2000, 10**6])
def test_a_damaged_chunk_is_lost_with_and_without_reading_ahead(
    tmp_path, monkeypatch, cores, compression, damage, joined
):
    path = tmp_path / "log.mcap"
    small_file(path, compression)
    offsets = sorted(Log(path).summary.chunks)
    monkeypatch.setattr(chunk_read_ahead, "JOINED", joined)
    whole = path.read_bytes()
    # Offsets in the record: opcode 1 and length 8 bytes, two times, size, CRC.
    offset, count = {"content": (70, 1), "crc": (33, 1), "no crc": (33, 4), "size": (25, 1), "opcode": (0, 1)}.get(
        damage, (9, 1)
    )
    for start in (offsets[0], offsets[len(offsets) // 2], offsets[-1]):
        changed = bytearray(whole)
        at = start + offset
        changed[at : at + count] = bytes(count) if damage == "no crc" else bytes([changed[at] ^ 0x41])
        path.write_bytes(changed)
        cores(ONE_CORE)
        messages, findings, log = read(path)
        cores(MANY)
        again = read(path)
        assert again[0] == messages
        assert again[1] == findings
        assert again[2].unverified == log.unverified
        assert findings
