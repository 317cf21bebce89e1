from __future__ import annotations

import struct

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.mcap import Mcap
from cdtool.formats.mcap.write import Stream
from tests.base.findings.facts import fact_of
from tests.command import cdtool
from tests.formats.mcap_files import JOINTS, STREAMS, TIME, N, by_hand, wanted, written

__all__ = ["by_hand", "written"]


def test_one_broken_message_is_left_out_and_counted(by_hand):
    path = by_hand([(0, 0, {"x": 1}), (1, 1, b"{"), (2, 2, b""), (3, 3, b"\xff\xfe"), (4, 4, b"[1]"), (5, 5, {"x": 2})])
    for source in (Mcap().columns(path), Mcap().columns(path, wanted(("/a", "x")))):
        assert source.columns["/a x"].values.tolist() == [1, 2]
        finding = source.findings[0]
        assert (finding.channel, finding.severity) == ("/a", "loss")
        assert (finding.numbers["count"], finding.numbers["messages"]) == (4, 6)
        assert finding.numbers["reason"].startswith("JSONDecodeError")


@pytest.mark.parametrize(
    ("payload", "reason"),
    [(b"", "starts with nothing"), (b"\0\1\0\0\1", "error"), (b"\0\7\0\0" + bytes(8), "not plain CDR")],
)
def test_a_cdr_message_that_is_cut_or_of_another_kind_is_never_a_value(by_hand, payload, reason):
    path = by_hand([(0, 0, payload)], "cdr", "ros2msg", b"float64 data")
    with pytest.raises(RecordingError, match=f"no message of /a can be decoded: .*{reason}"):
        Mcap().columns(path, wanted(("/a", "data")))


@pytest.mark.parametrize(
    ("encoding", "schema_encoding", "schema"),
    [("protobuf", "protobuf", b"x"), ("cdr", "ros2idl", b"module a {};"), ("cdr", "ros2msg", b"not ? a definition")],
)
def test_an_unknown_encoding_is_a_finding_of_a_survey_and_an_error_where_it_is_wanted(
    by_hand, encoding, schema_encoding, schema
):
    path = by_hand([(0, 0, b"\0\1\0\0" + bytes(8))], encoding, schema_encoding, schema)
    source = Mcap().columns(path)
    assert not source.columns
    fact = fact_of(source.findings[0])
    assert fact.kind == "undecodable_messages" and (fact.numbers["count"], fact.numbers["messages"]) == (1, 1)
    assert source.findings[0].severity == "loss" and cdtool("info", path).status == 3
    with pytest.raises(RecordingError, match="no message of /a can be decoded"):
        Mcap().columns(path, wanted(("/a", "data")))


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_a_cut_file_yields_the_complete_messages_before_the_cut(written, compression):
    streams = [
        Stream("/force", "std_msgs/msg/Float64", np.arange(400_000 / 8) / 1000, {"data": np.arange(400_000 / 8)})
    ]
    path = written(streams, compression=compression)
    whole = path.read_bytes()
    for share in (0.3, 0.6, 0.9, 0.999):
        path.write_bytes(whole[: int(share * len(whole))])
        try:
            source = Mcap().columns(path, wanted(("/force", "data")))
        except RecordingError as fault:
            assert "before its first message" in fault.message
            continue
        values = source.columns["/force data"].values
        assert np.array_equal(values, np.arange(len(values)))
        fact = fact_of(source.findings[0])
        assert fact.kind == "damaged_at" and fact.numbers["read_before"] == len(values)


def test_an_unchunked_file_yields_every_complete_message_before_the_cut(by_hand):
    path = by_hand([(i, i, {"x": i}) for i in range(50)], use_chunking=False)
    whole = path.read_bytes()
    cut = whole.index(b'{"x": 30}') + 5  # in the middle of a message
    path.write_bytes(whole[:cut])
    source = Mcap().columns(path)
    assert source.columns["/a x"].values.tolist() == list(range(30))
    damage, unverified = (fact_of(finding) for finding in source.findings)
    assert damage.numbers["read_before"] == 30 and unverified.kind == "unverified"


def test_no_flipped_byte_leads_to_a_wrong_value(written):
    """Chunks have a CRC: for any flipped byte, the values are correct, or there is an error."""
    path = written([STREAMS[3]], compression="none")
    whole = path.read_bytes()
    true = dict(zip(TIME.tolist(), JOINTS[:, 2].tolist(), strict=True))
    lost = 0
    for at in range(0, len(whole), 7):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
        try:
            source = Mcap().columns(path, wanted(("/force", "data")))
        except RecordingError as fault:
            assert str(path) in fault.message
            lost += 1
            continue
        column = source.columns["/force data"]
        assert all(true[t] == v for t, v in zip(column.time.tolist(), column.values.tolist(), strict=True)), at
        assert len(column.values) == N or source.findings, at
    assert lost > 10


def test_a_wrong_checksum_of_unchunked_data_is_an_error(by_hand):
    path = by_hand([(i, i, {"x": i}) for i in range(9)], use_chunking=False, enable_data_crcs=True)
    whole = path.read_bytes()
    assert not Mcap().columns(path).findings
    path.write_bytes(whole.replace(b'{"x": 5}', b'{"x": 6}'))
    with pytest.raises(RecordingError, match="checksum of the data does not match"):
        Mcap().columns(path)


def test_an_unknown_compression_is_not_treated_as_uncompressed(written):
    path = written([STREAMS[3]], compression="lz4")
    path.write_bytes(path.read_bytes().replace(struct.pack("<I", 3) + b"lz4", struct.pack("<I", 3) + b"lz5"))
    with pytest.raises(RecordingError, match="unknown compression 'lz5'"):
        Mcap().columns(path)


def test_a_record_that_declares_more_than_the_file_contains_is_refused_without_reading_it(tmp_path):
    path = tmp_path / "oversized.mcap"
    path.write_bytes(b"\x89MCAP0\r\n\x01" + struct.pack("<Q", 2**40) + b"abc")
    with pytest.raises(
        RecordingError, match="damaged at byte 8, before its first message: a record declares 1099511627776"
    ):
        Mcap().columns(path)


@pytest.mark.parametrize("content", [b"", b"\x89MCAP", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" * 3, bytes(100)])
def test_a_file_without_records_is_one_clear_error(tmp_path, content):
    path = tmp_path / "none.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="before its first message"):
        Mcap().columns(path)
