"""Cut files and flipped bytes: only true values, never a traceback, and every loss is reported."""

from __future__ import annotations

import pytest

from cdtool.base.findings import Finding
from cdtool.formats.mcap.log import Log
from tests.formats.mcap.small_files import COMPRESSIONS, read, read_or_refused, small_file


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_file_cut_at_any_byte_yields_true_messages_and_reports_the_cut(tmp_path, compression):
    path = tmp_path / "log.mcap"
    sent = small_file(path, compression, messages=14)
    whole = path.read_bytes()
    before = 0
    for cut in range(len(whole)):
        path.write_bytes(whole[:cut])
        messages, findings = read_or_refused(path)
        assert messages == sent[: len(messages)], cut
        assert any("damaged" in text for text in findings), cut
        assert len(messages) >= before, cut  # a longer part never has fewer messages
        before = len(messages)
    assert before == len(sent)


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_after_a_damaged_chunk_reading_continues_with_the_next(tmp_path, compression):
    path = tmp_path / "log.mcap"
    sent = small_file(path, compression)
    whole = bytearray(path.read_bytes())
    chunks = sorted(Log(path).summary.chunks.values(), key=lambda index: index.chunk_start_offset)
    hit = chunks[2]
    whole[hit.chunk_start_offset + hit.chunk_length - 12] ^= 0x5A
    path.write_bytes(whole)
    messages, findings, log = read(path)
    lost = len(sent) - len(messages)
    assert 0 < lost < 12
    assert set(messages) < set(sent)
    assert [loss.chunks for loss in log.section.losses.entries] == [1]
    span = tuple((stamp - 10**9) / 1e9 for stamp in (hit.message_start_time, hit.message_end_time))
    assert findings[0].numbers["lost"] == {"size": hit.chunk_length, "is_chunk": True, "messages": lost, "time": span}
    assert Finding("message_count_differs", "", {"stated": len(sent), "read": len(messages)}) in findings


def test_messages_that_no_checksum_covers_are_counted(tmp_path):
    path = tmp_path / "log.mcap"
    sent = small_file(path, enable_crcs=False)
    messages, findings, log = read(path)
    assert messages == sent
    assert log.unverified == len(sent)
    assert findings == [Finding("unverified", "", {"count": len(sent), "messages": len(sent)})]


def test_a_wrong_checksum_of_an_attachment_is_a_loss(tmp_path):
    from mcap.writer import Writer

    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_attachment(1, 2, "note.txt", "text/plain", b"calibrated on Monday")
        channel = writer.register_channel("/a", "json", 0)
        writer.add_message(channel, 5, b"{}", 5)
        writer.finish()
    assert not read(path)[1]
    path.write_bytes(path.read_bytes().replace(b"Monday", b"Friday"))
    messages, findings, _ = read(path)
    assert len(messages) == 1
    assert findings[0].severity == "loss"
    assert findings[0].numbers["reason"] == "the checksum of an attachment does not match"
