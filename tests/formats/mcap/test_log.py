"""Reading in pieces: bounded memory, reading one piece ahead, many messages, files that shrink."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType, Writer

from cdtool.base.errors import RecordingError
from cdtool.formats.mcap import Mcap, chunks, data_section
from cdtool.formats.mcap.file_bytes import FileBytes
from cdtool.formats.mcap.log import Log
from cdtool.formats.messages.topic import sort_times
from tests.formats.mcap.small_files import COMPRESSIONS, read, small_file
from tests.formats.mcap_files import STREAMS, by_hand, wanted, written  # noqa: F401  # noqa: F401


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


_LATEST = 2**64 - 1


@given(st.lists(st.integers(0, _LATEST), max_size=6), st.integers(0, _LATEST))
def test_times_are_differences_of_any_integers(stamps, origin):
    time, _ = sort_times(np.array(stamps, dtype=np.uint64), origin)
    assert time.tolist() == sorted((stamp - origin) / 1e9 for stamp in stamps)


@given(st.lists(st.integers(-(2**63) + 1, 2**63 - 1), min_size=1, max_size=6))
def test_times_of_headers_may_be_before_1970(stamps):
    time, _ = sort_times(np.array(stamps, dtype=np.int64), stamps[0])
    assert time.tolist() == sorted((stamp - stamps[0]) / 1e9 for stamp in stamps)


@pytest.mark.parametrize("channels", [None, wanted(("/a", "v"))])
def test_the_log_starts_with_its_first_message_with_a_valid_time(by_hand, channels):  # noqa: F811
    path = by_hand([(at, at, {"v": float(i)}) for i, at in enumerate([_LATEST, 10**9 + 1, 10**9 + 3])])
    source = Mcap().columns(path, channels)
    column = source.columns["/a v"]
    assert source.origin == 1.000000001
    assert column.time[:2].tolist() == [0.0, 2e-9]
    assert column.values.tolist() == [1.0, 2.0, 0.0]


def test_a_header_before_1970_is_earlier_than_one_after_it(by_hand):  # noqa: F811
    stamps = [(-1, 0), (0, 0), (1, 0)]
    path = by_hand([(1, 1, {"header": {"stamp": {"sec": sec, "nanosec": ns}}, "v": float(sec)}) for sec, ns in stamps])
    column = Mcap().columns(path, wanted(("/a", "v"), clock="header")).columns["/a v"]
    assert column.time.tolist() == [0.0, 1.0, 2.0]
    assert column.values.tolist() == [-1.0, 0.0, 1.0]


def test_element_names_are_in_the_order_of_the_first_message(written):  # noqa: F811
    assert Mcap().element_names(written(), "/joint_states") == ("base", "shoulder_joint", "elbow.joint")


def test_element_names_in_json_are_in_the_order_of_the_first_message(by_hand):  # noqa: F811
    path = by_hand([(1, 1, {"name": ["b", "a"], "position": [1.0, 2.0]}), (2, 2, {"name": ["a", "b"]})])
    assert Mcap().element_names(path, "/a") == ("b", "a")


@pytest.mark.parametrize("topic", ["/imu", "/force", "/nowhere"])
def test_element_names_are_empty_without_an_array_of_names_or_without_the_topic(written, topic):  # noqa: F811
    assert Mcap().element_names(written(), topic) == ()


@pytest.mark.parametrize(("encoding", "content"), [("json", b"{"), ("json", b"[]"), ("morse", b"...")])
def test_element_names_are_empty_if_the_first_message_cannot_be_decoded(by_hand, encoding, content):  # noqa: F811
    assert Mcap().element_names(by_hand([(1, 1, content)], encoding), "/a") == ()
