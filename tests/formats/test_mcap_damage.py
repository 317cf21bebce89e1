from __future__ import annotations

import struct

import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.mcap import Mcap
from tests.base.findings.facts import fact_of
from tests.command import cdtool
from tests.formats.mcap_files import STREAMS, by_hand, wanted, written

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
