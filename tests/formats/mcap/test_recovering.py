"""cdtool convert --recover: messages are recovered unchanged, and unverified ones never get a checksum."""

from __future__ import annotations

import hashlib

import pytest
import typer
from mcap.reader import make_reader
from typer.testing import CliRunner

from cdtool.base.errors import RecordingError, UsageError
from cdtool.base.exit_status import ExitStatus
from cdtool.commands.convert.command import convert
from cdtool.commands.convert.recovering import recover
from cdtool.formats.mcap.log import Log
from cdtool.formats.mcap.records import Opcode
from tests.base.findings.facts import fact_of
from tests.formats.mcap.small_files import COMPRESSIONS, read, small_file


def provenance_of(path):
    with path.open("rb") as file:
        records = make_reader(file).iter_metadata()
        return next(record.metadata for record in records if record.name == "cdtool.recovered")


def read_by_the_package(path):
    """Return the messages by the mcap package's seeking reader, with every CRC checked."""
    with path.open("rb") as file:
        rows = make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)
        return [(channel.topic, message.log_time, message.data) for _, channel, message in rows]


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_an_undamaged_file_is_recovered_completely(tmp_path, compression):
    source, output = tmp_path / "log.mcap", tmp_path / "out.mcap"
    sent = small_file(source, compression)
    done = recover(source, output)
    assert done.whole
    assert (done.messages, done.unverified, done.left_out) == (len(sent), 0, 0)
    messages, findings, log = read(output)
    assert messages == read_by_the_package(output) == sent
    assert not findings
    assert log.summary.verified
    assert provenance_of(output)["source_sha256"] == hashlib.sha256(source.read_bytes()).hexdigest()
    assert provenance_of(output)["lost"] == "nothing"


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_the_messages_of_a_damaged_chunk_are_left_out_and_reported(tmp_path, compression):
    source, output = tmp_path / "log.mcap", tmp_path / "out.mcap"
    sent = small_file(source, compression)
    whole = bytearray(source.read_bytes())
    hit = sorted(Log(source).summary.chunks.values(), key=lambda index: index.chunk_start_offset)[1]
    whole[hit.chunk_start_offset + hit.chunk_length - 9] ^= 0x21
    source.write_bytes(whole)
    done = recover(source, output)
    assert not done.whole
    messages, findings, _ = read(output)
    assert messages == read_by_the_package(output)
    assert set(messages) < set(sent)
    assert len(messages) == done.messages
    assert not findings
    assert f"a chunk of {hit.chunk_length} bytes lost" in provenance_of(output)["lost"]


@pytest.mark.parametrize("keep", [False, True], ids=["left out", "written"])
def test_messages_of_a_cut_chunk_are_left_out_or_written_without_a_checksum(tmp_path, keep):
    source, output = tmp_path / "log.mcap", tmp_path / "out.mcap"
    sent = small_file(source)
    whole = source.read_bytes()
    source.write_bytes(whole[: whole.index(sent[-1][2], max(Log(source).summary.chunks)) + 3])
    left = read(source)[2].unverified
    done = recover(source, output, unverified=keep)
    messages, _, log = read(output)
    assert not done.whole
    assert messages == sent[: len(sent) - 1 - (0 if keep else left)]
    assert (done.unverified, done.left_out) == ((left, 0) if keep else (0, left))
    assert log.unverified == done.unverified
    assert provenance_of(output)["unverified"].startswith(f"{done.unverified} messages in chunks")


def test_without_any_checksum_nothing_is_recovered_unless_requested(tmp_path):
    source, output = tmp_path / "log.mcap", tmp_path / "out.mcap"
    sent = small_file(source, use_chunking=False)
    with pytest.raises(RecordingError, match=r"none of its 24 messages has a checksum \(--recover all keeps them"):
        recover(source, output)
    assert not output.exists()
    assert recover(source, output, unverified=True).whole
    messages, findings, log = read(output)
    assert messages == sent
    assert log.unverified == len(sent)
    assert not log.summary.verified
    assert fact_of(findings[0]) == ("unverified", {"count": 24, "messages": 24})


def test_attachments_and_metadata_are_recovered(tmp_path):
    from mcap.writer import Writer

    source, output = tmp_path / "log.mcap", tmp_path / "out.mcap"
    with source.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_attachment(1, 2, "note.bin", "application/octet-stream", b"\x00\x01" * 700_000)
        writer.add_metadata("machine", {"name": "gate"})
        writer.add_message(writer.register_channel("/a", "json", 0), 5, b"{}", 5)
        writer.finish()
    assert recover(source, output).whole
    with output.open("rb") as file:
        reader = make_reader(file)
        (attachment,) = reader.iter_attachments()
        assert (attachment.name, attachment.data, attachment.log_time) == ("note.bin", b"\x00\x01" * 700_000, 2)
        assert {record.name: record.metadata for record in reader.iter_metadata()}["machine"] == {"name": "gate"}
    assert [opcode for opcode, _, _ in read(output)[2].section.extras].count(Opcode.ATTACHMENT) == 1


def test_wrong_names_are_one_clear_error(tmp_path):
    source = tmp_path / "log.mcap"
    small_file(source)
    with pytest.raises(UsageError, match="is the file to recover"):
        recover(source, source)
    with pytest.raises(UsageError, match=r"must end in \.mcap"):
        recover(source, tmp_path / "out.txt")
    with pytest.raises(UsageError, match="no folder"):
        recover(source, tmp_path / "none" / "out.mcap")
    with pytest.raises(RecordingError, match="no such file"):
        recover(tmp_path / "none.mcap", tmp_path / "out.mcap")
    (tmp_path / "table.csv").write_text("1,2\n")
    with pytest.raises(RecordingError, match="is not an MCAP file"):
        recover(tmp_path / "table.csv", tmp_path / "out.mcap")
    (tmp_path / "dust.mcap").write_bytes(bytes(200))
    with pytest.raises(RecordingError, match="no message can be recovered"):
        recover(tmp_path / "dust.mcap", tmp_path / "out.mcap")


APP = typer.Typer()
APP.command()(convert)


def run(*arguments, keep="verified"):
    return CliRunner().invoke(APP, [*map(str, arguments), "--recover", keep])


def test_recovering_a_cut_file_exits_with_status_3_and_reports_losses(tmp_path):
    sent = small_file(tmp_path / "log.mcap")
    whole = (tmp_path / "log.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: whole.index(sent[-1][2])])
    done = run(tmp_path / "cut.mcap", tmp_path / "out.mcap")
    assert done.exit_code == ExitStatus.LOST
    assert "loss: damaged at byte" in done.output
    assert "(--recover all keeps them)" in done.output
    kept = run(tmp_path / "cut.mcap", tmp_path / "out.mcap", "--force", keep="all")
    assert kept.exit_code == ExitStatus.LOST
    assert f"{len(sent) - 1} messages" in kept.output
    assert "left out" not in kept.output


def test_an_existing_file_is_overwritten_only_with_force_and_the_source_never(tmp_path):
    for name in ("log.mcap", "other.mcap"):
        small_file(tmp_path / name, messages=12 if name == "log.mcap" else 24)
    other, source = (tmp_path / "other.mcap").read_bytes(), (tmp_path / "log.mcap").read_bytes()
    refused = run(tmp_path / "log.mcap", tmp_path / "other.mcap")
    assert isinstance(refused.exception, UsageError) and "--force" in str(refused.exception)
    assert (tmp_path / "other.mcap").read_bytes() == other
    assert run(tmp_path / "log.mcap", tmp_path / "other.mcap", "--force").exit_code == 0
    assert (tmp_path / "other.mcap").read_bytes() != other
    (tmp_path / "link.mcap").symlink_to(tmp_path / "log.mcap")
    for name in ("log.mcap", "link.mcap"):
        refused = run(tmp_path / "log.mcap", tmp_path / name, "--force")
        assert "is the file to recover" in str(refused.exception)
    assert (tmp_path / "log.mcap").read_bytes() == source
