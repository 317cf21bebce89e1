"""Reading in pieces: bounded memory, reading one piece ahead, many messages, files that shrink."""

from __future__ import annotations

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType, Writer

from cdtool.base.errors import RecordingError
from cdtool.formats.mcap import data_section
from cdtool.formats.mcap.file_bytes import FileBytes
from cdtool.formats.mcap.log import Log
from tests.formats.mcap.small_files import COMPRESSIONS, read, small_file


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("joined", [1, 900, 10**6])
@pytest.mark.parametrize("index_types", [IndexType.ALL, IndexType.NONE])
def test_pieces_of_any_size_have_the_same_messages(tmp_path, monkeypatch, compression, joined, index_types):
    path = tmp_path / "log.mcap"
    sent = small_file(path, compression, index_types=index_types)
    monkeypatch.setattr(data_section, "JOINED", joined)
    found, findings, _ = read(path)
    assert found == sent
    assert not findings


def test_messages_outside_of_chunks_are_read_window_by_window(tmp_path):
    path = tmp_path / "log.mcap"
    sent = small_file(path, messages=3000, use_chunking=False)
    assert path.stat().st_size > 65536  # more than one window
    assert read(path)[0] == sent


def test_a_message_larger_than_a_window_is_read_completely(tmp_path):
    path = tmp_path / "log.mcap"
    large = np.random.default_rng(0).bytes(200_000)
    for chunking in (False, True):
        with path.open("wb") as file:
            writer = Writer(file, use_chunking=chunking, compression=CompressionType.ZSTD)
            writer.start()
            channel = writer.register_channel("/a", "raw", 0)
            for i, content in enumerate((b"small", large, b"", large[:100_000], b"small")):
                writer.add_message(channel, i, content, i)
            writer.finish()
        assert [len(payload) for _, _, payload in read(path)[0]] == [5, 200_000, 0, 100_000, 5]


@pytest.mark.parametrize("use_chunking", [True, False])
def test_a_file_that_shrinks_while_it_is_read_is_one_clear_error(tmp_path, monkeypatch, use_chunking):
    path = tmp_path / "log.mcap"
    small_file(path, use_chunking=use_chunking)
    log = Log(path)
    whole = FileBytes.read_into

    def shrink(self, at, content):
        path.write_bytes(b"")
        whole(self, at, content)

    monkeypatch.setattr(FileBytes, "read_into", shrink)
    with pytest.raises(RecordingError, match="became shorter while it was read"):
        list(log.blocks())
