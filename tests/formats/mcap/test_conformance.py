"""The conformance suite of MCAP: the messages of every file by both readers."""

from __future__ import annotations

import json

import pytest

from cdtool.formats.mcap.log import Log
from tests.data_folder import data, needs_data
from tests.formats.mcap.small_files import read

GROUPS = ("NoData", "OneAttachment", "OneMessage", "OneMetadata", "OneSchemalessMessage", "TenMessages")
pytestmark = needs_data("mcap_conformance")


def files(group):
    return sorted((data("mcap_conformance") / group).glob("*.mcap"))


def stated(path):
    return json.loads(path.with_suffix(".json").read_text())["records"]


def test_the_suite_is_complete():
    assert sum(len(files(group)) for group in GROUPS) == 416
    assert {path.parent.name for path in data("mcap_conformance").glob("*/*.mcap")} == set(GROUPS)


@pytest.mark.parametrize("group", GROUPS)
@pytest.mark.parametrize("reader", ["from the start", "by the index"])
def test_the_messages_of_every_file_are_those_of_its_json(group, reader):
    for path in files(group):
        records = stated(path)
        fields = [dict(record["fields"]) for record in records if record["type"] == "Message"]
        expected = [(int(item["log_time"]), bytes(map(int, item["data"]))) for item in fields]
        if reader == "from the start":
            found, findings, log = read(path)
        else:
            topics = {dict(item["fields"])["topic"] for item in records if item["type"] == "Channel"} or {"none"}
            found, findings = [], []
            for topic in sorted(topics):
                part, noted, log = read(path, wanted=topic.__eq__)
                found, findings = found + part, findings + noted
        assert [message[1:] for message in found] == expected, path.name
        assert not [finding for finding in findings if finding.severity == "loss"], path.name
        assert log.count == len(expected), path.name


def test_the_summary_of_every_file_is_read():
    for path in (path for group in GROUPS for path in files(group)):
        assert not Log(path).summary.problem, path.name


@needs_data("mcap_samples")
def test_samples_of_other_writers_are_read_without_loss():
    for path in sorted(data("mcap_samples").glob("*.mcap")):
        found, findings, log = read(path)
        assert len(found) == log.count > 0, path.name
        assert all(finding.severity == "note" for finding in findings), (path.name, findings)
