"""The conformance suite of MCAP: every record with all its fields, and the messages by both readers."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cdtool.formats.mcap.container.chunks import Decompressor, chunk_header
from cdtool.formats.mcap.container.log import Log
from cdtool.formats.mcap.container.records import MAGIC, Chunk, MessageIndex
from cdtool.formats.mcap.container.summary import parse_records
from tests.data_folder import data, needs_data
from tests.formats.mcap.small_files import read

GROUPS = ("NoData", "OneAttachment", "OneMessage", "OneMetadata", "OneSchemalessMessage", "TenMessages")
pytestmark = needs_data("mcap_conformance")


def files(group):
    return sorted((data("mcap_conformance") / group).glob("*.mcap"))


def stated(path):
    return json.loads(path.with_suffix(".json").read_text())["records"]


def as_json(value):
    if isinstance(value, bytes | memoryview):
        return [str(byte) for byte in value]
    if isinstance(value, dict):
        return {str(key): as_json(item) for key, item in value.items()}
    return str(value)


def every_record(path):
    """Yield the records in the suite's order: those of a chunk in its place, without message indexes."""
    content = memoryview(path.read_bytes())
    assert bytes(content[: len(MAGIC)]) == bytes(content[-len(MAGIC) :]) == MAGIC
    at = len(MAGIC)
    for record in parse_records(content[at : -len(MAGIC)]):
        length = 9 + int.from_bytes(content[at + 1 : at + 9], "little")
        if isinstance(record, Chunk):
            room = np.empty(record.uncompressed_size, np.uint8)
            header = chunk_header(at, content[at : at + length])
            packed = np.frombuffer(record.records, np.uint8)
            if record.compression:
                Decompressor().fill(header, packed, room)
            else:
                room[:] = packed
            yield from parse_records(room.data)
        elif not isinstance(record, MessageIndex):
            yield record
        at += length


def test_the_suite_is_complete():
    assert sum(len(files(group)) for group in GROUPS) == 416
    assert {path.parent.name for path in data("mcap_conformance").glob("*/*.mcap")} == set(GROUPS)


@pytest.mark.parametrize("group", GROUPS)
def test_every_record_of_every_file_has_the_fields_of_its_json(group):
    for path in files(group):
        found = list(every_record(path))
        expected = stated(path)
        assert [type(record).__name__ for record in found] == [record["type"] for record in expected], path.name
        for record, wanted in zip(found, expected, strict=True):
            for name, value in wanted["fields"]:
                assert as_json(getattr(record, name)) == as_json_of(value), (path.name, wanted["type"], name)


def as_json_of(value):
    return value if not isinstance(value, dict) else {key: as_json_of(item) for key, item in value.items()}


@pytest.mark.parametrize("group", GROUPS)
@pytest.mark.parametrize("reader", ["from the start", "by the index"])
def test_the_messages_of_every_file_are_those_of_its_json(group, reader):
    for path in files(group):
        records = stated(path)
        fields = [dict(record["fields"]) for record in records if record["type"] == "Message"]
        expected = [(int(item["log_time"]), bytes(map(int, item["data"]))) for item in fields]
        if reader == "from the start":
            found, findings, log = read(path, use_index=False)
        else:
            topics = {dict(item["fields"])["topic"] for item in records if item["type"] == "Channel"} or {"none"}
            found, findings = [], []
            for topic in sorted(topics):
                part, noted, log = read(path, wanted=topic.__eq__)
                found, findings = found + part, findings + noted
        assert [message[1:] for message in found] == expected, path.name
        assert not [finding for finding in findings if finding.severity == "loss"], path.name
        assert log.count == len(expected), path.name


def test_the_records_of_a_summary_are_read():
    for path in (path for group in GROUPS for path in files(group)):
        records = stated(path)
        names = [record["type"] for record in records]
        after_data_end = names[names.index("DataEnd") + 1 : -1]
        log = Log(path)
        assert not log.summary.problem, path.name
        assert [type(record).__name__ for record in log.summary.records] == after_data_end, path.name


@needs_data("mcap_samples")
def test_samples_of_other_writers_are_read_without_loss():
    for path in sorted(data("mcap_samples").glob("*.mcap")):
        found, findings, log = read(path)
        assert len(found) == log.count > 0, path.name
        assert all(finding.severity == "note" for finding in findings), (path.name, findings)
