"""Unusual logs: backward clocks, several writers of a topic, appended files, images in the dark, cuts at any byte."""

from __future__ import annotations

import struct

import pytest
from mcap.writer import CompressionType, Writer

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.mcap import Mcap, chunks
from cdtool.formats.mcap.log import Log
from tests.base.findings.facts import fact_of
from tests.formats.mcap.small_files import COMPRESSIONS, read, read_or_refused, small_file

MS = 10**6
FORCE = "float64 force\nfloat64 temperature"
STATE = "string[] name\nfloat64[] position"


def wanted(*fields, joints=("axis",), clock="log", named=True):
    sources = tuple(ChannelSource("speed", topic=topic, field=field) for topic, field in fields)
    return ChannelMap(TimeSource(clock=clock), sources, joints, topics=True, named=named)


def write(path, messages, schema=FORCE, encoding="cdr", channels=1):
    """Write messages (channel number, log time [ns], payload) of topic /a with this number of `channels`."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=200)
        writer.start("ros2")
        number = writer.register_schema("a/msg/A", "ros2msg", schema.encode()) if encoding == "cdr" else 0
        writers = [writer.register_channel("/a", encoding, number, {"publisher": str(i)}) for i in range(channels)]
        for channel, time, payload in messages:
            writer.add_message(writers[channel], time, payload, time)
        writer.finish()
    return path


def cdr(*numbers):
    return b"\0\1\0\0" + struct.pack(f"<{len(numbers)}d", *numbers)


def json_state(names, position):
    import json

    return json.dumps({"name": names, "position": position}).encode()


def facts_above_notes(source):
    return [fact_of(finding) for finding in source.findings if finding.severity != "note"]


@pytest.mark.parametrize("encoding", ["cdr", "json"])
@pytest.mark.parametrize(
    ("lengths", "kind", "numbers"),
    [
        ([20, 18], "long_arrays", {"longest": 20, "most": 16}),
        ([6, 20], "array_lengths_differ", {"lengths": (6, 20)}),
        ([20, 6], "array_lengths_differ", {"lengths": (6, 20)}),
    ],
)
def test_long_arrays_that_a_survey_leaves_out_are_named(tmp_path, encoding, lengths, kind, numbers):
    def payload(size):
        names, position = ["j"] * size, [0.5] * size
        if encoding == "json":
            return json_state(names, position)
        return b"\0\1\0\0" + struct.pack(f"<2I{size}d", 0, size, *position)

    messages = [(0, (i + 1) * MS, payload(lengths[i >= 10])) for i in range(20)]
    source = Mcap().columns(write(tmp_path / "log.mcap", messages, STATE, encoding))
    assert "/a position[:]" not in source.columns
    found = [(each.kind, each.numbers) for each in source.findings if each.channel == "/a position[:]"]
    assert found == [(kind, numbers)]


@pytest.mark.parametrize(("late", "severity"), [(2, "note"), (300, "warning")])
@pytest.mark.parametrize("survey", [True, False])
def test_backward_stamps_are_reported_with_the_message(tmp_path, late, severity, survey):
    times = [1000 + i for i in range(400)]
    times[350] -= late
    path = write(tmp_path / "log.mcap", [(0, time * MS, cdr(float(i), 0.0)) for i, time in enumerate(times)])
    source = Mcap().columns(path, None if survey else wanted(("/a", "force")))
    (finding,) = [finding for finding in source.findings if finding.kind == "out_of_order"]
    assert finding.severity == severity
    back = pytest.approx((late - 1) / 1e3)
    assert fact_of(finding) == (
        "out_of_order",
        {"count": 1, "messages": 400, "back": back, "set_back": severity == "warning", "worst": 350},
    )


def test_two_channels_of_a_topic_are_reported(tmp_path):
    messages = [(i % 2, i * MS, cdr(float(i), 0.0)) for i in range(20)]
    path = write(tmp_path / "log.mcap", messages, channels=2)
    for source in (Mcap().columns(path), Mcap().columns(path, wanted(("/a", "force")))):
        assert facts_above_notes(source) == [("several_writers", {"channels": 2})]
    path = write(tmp_path / "log.mcap", [(0, time, payload) for _, time, payload in messages], channels=2)
    assert not facts_above_notes(Mcap().columns(path))


@pytest.mark.parametrize("every", [1, 3])
def test_a_message_longer_than_its_definition_is_not_read(tmp_path, every):
    payloads = [cdr(float(i), 1.0) if i % every else cdr(1e9, float(i), 1.0) for i in range(30)]
    path = write(tmp_path / "log.mcap", [(0, i * MS, payload) for i, payload in enumerate(payloads)])
    if every == 1:
        with pytest.raises(RecordingError, match="go on after its last field: written by another definition"):
            Mcap().columns(path, wanted(("/a", "force")))
        return
    source = Mcap().columns(path, wanted(("/a", "force")))
    assert source.columns["/a force"].values.tolist() == [float(i) for i in range(30) if i % every]
    fact = facts_above_notes(source)[0]
    assert fact.kind == "undecodable_messages" and (fact.numbers["count"], fact.numbers["messages"]) == (10, 30)


def test_names_also_select_a_single_joint(tmp_path):
    payloads = [json_state(["grip"], [-99.0]) if i % 2 else json_state(["arm"], [float(i)]) for i in range(10)]
    path = write(tmp_path / "log.mcap", [(0, i * MS, each) for i, each in enumerate(payloads)], encoding="json")
    with pytest.raises(RecordingError, match="its messages name grip, not 'arm'"):
        Mcap().columns(path, wanted(("/a", "position[:]"), joints=("arm",)))
    source = Mcap().columns(path, wanted(("/a", "position[arm]"), joints=("arm",)))
    assert source.columns["/a position[arm]"].values.tolist() == [0.0, 2.0, 4.0, 6.0, 8.0]


def test_a_joint_without_a_name_may_have_any_name_in_messages(tmp_path):
    path = write(tmp_path / "log.mcap", [(0, i * MS, json_state(["motor"], [1.0])) for i in range(3)], encoding="json")
    source = Mcap().columns(path, wanted(("/a", "position[:]"), named=False))
    assert source.columns["/a position[:]"].values.tolist() == [[1.0]] * 3


def test_different_numbers_of_names_and_elements_are_refused(tmp_path):
    payload = json_state(["a", "b", "c"], [1.0, 2.0])
    path = write(tmp_path / "log.mcap", [(0, i * MS, payload) for i in range(3)], encoding="json")
    with pytest.raises(RecordingError, match="3 names for 2 elements, so the names cannot be assigned"):
        Mcap().columns(path, wanted(("/a", "position[:]"), joints=("b", "a")))


def test_a_file_appended_to_a_log_is_reported_and_not_as_a_false_summary(tmp_path):
    first, second = tmp_path / "a.mcap", tmp_path / "b.mcap"
    small_file(first)
    small_file(second, messages=30)
    size, after = first.stat().st_size, second.stat().st_size
    first.write_bytes(first.read_bytes() + second.read_bytes())
    (fact,) = facts_above_notes(Mcap().columns(first))
    assert fact == (
        "damaged_at",
        {
            "byte": size,
            "reason": "the log ends here: was another file appended?",
            "lost": {"size": after, "is_chunk": False, "messages": None, "time": None},
            "read_before": None,
        },
    )


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
