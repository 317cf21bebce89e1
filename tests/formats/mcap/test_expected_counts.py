"""The expected message counts from chunk indexes are those of the chunks."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

from cdtool.formats.mcap.container.chunk_read_ahead import expected_rows
from cdtool.formats.mcap.container.log import Log
from tests.formats.mcap.small_files import COMPRESSIONS, small_file


def indexes(path):
    return [index for _, index in sorted(Log(path).summary.chunks.items())]


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("chunk_size", [100, 500, 10**6])
def test_expected_rows_are_numbered_per_channel_through_all_chunks(tmp_path, compression, chunk_size):
    path = tmp_path / "log.mcap"
    sent = small_file(path, compression, messages=50, chunk_size=chunk_size)
    chunks = indexes(path)
    expected = expected_rows(chunks)
    assert list(expected) == [index.chunk_start_offset for index in chunks]
    counts = Counter()
    for index in chunks:
        for channel, numbers in expected[index.chunk_start_offset].items():
            assert numbers.start == counts[channel]
            counts[channel] = numbers.stop
    topics = {channel.id: channel.topic for channel in Log(path).summary.channels.values()}
    assert {topics[channel]: count for channel, count in counts.items()} == Counter(topic for topic, _, _ in sent)


def test_expected_rows_end_at_message_indexes_of_impossible_length(tmp_path):
    path = tmp_path / "log.mcap"
    small_file(path, chunk_size=200)
    chunks = indexes(path)
    assert len(chunks) > 3
    chunks[2] = replace(chunks[2], message_index_length=chunks[2].message_index_length + 1)
    assert list(expected_rows(chunks)) == [index.chunk_start_offset for index in chunks[:2]]
    chunks[1] = replace(chunks[1], message_index_length=3)
    assert list(expected_rows(chunks)) == [chunks[0].chunk_start_offset]


def test_without_message_indexes_no_rows_are_expected(tmp_path):
    path = tmp_path / "log.mcap"
    small_file(path)
    bare = [replace(index, message_index_offsets={}, message_index_length=0) for index in indexes(path)]
    assert all(not rows for rows in expected_rows(bare).values())
