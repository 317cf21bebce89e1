"""A large MCAP file at a URL is read by ranges: chunks without mapped topics are not transferred."""

from __future__ import annotations

import io
import json
import os

import pytest
from mcap.writer import CompressionType, Writer

import cdtool
from cdtool.base.errors import CdtoolError, RecordingError, is_lasting
from cdtool.base.remote import remote_path, session, staging
from cdtool.formats.mcap.file_bytes import FileBytes

MACHINE = """
[machine]
type = "linear_axis"
name = "axis"
motor_inertia = 0.001
load_mass = 100
transmission_ratio = 0.001
[channels.mcap]
position = { topic = "/axis", field = "q" }
torque = { topic = "/axis", field = "i", unit = "A", scale = 0.5 }
"""
NOISE = os.urandom(1 << 20)
URL = "memory://logs/large.mcap"


def recorded(chunks: int = 24, every: int = 20, crc: bool = True, attachment: bool = False) -> bytes:
    """Return a file with a chunk of the mapped topic after each `every` chunks of another one of 1 MiB."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=1 << 40, compression=CompressionType.NONE, enable_crcs=crc, enable_data_crcs=crc)
    writer.start()
    axis = writer.register_channel("/axis", "json", writer.register_schema("axis", "jsonschema", b"{}"))
    camera = writer.register_channel("/camera", "json", writer.register_schema("camera", "jsonschema", b"{}"))
    time = 0
    for number in range(chunks):
        if number % every == 0:
            for _ in range(5000):
                time += 1
                row = json.dumps({"q": 1e-6 * (time % 1000) ** 2, "i": 0.5 + 1e-4 * (time % 77)}).encode()
                writer.add_message(axis, 10**18 + time * 10**6, row, 10**18 + time * 10**6)
            writer._Writer__finalize_chunk()
        writer.add_message(camera, 10**18 + time * 10**6, NOISE, 10**18 + time * 10**6)
        writer._Writer__finalize_chunk()
    if attachment:
        writer.add_attachment(1, 1, "map", "application/octet-stream", NOISE)
    writer.finish()
    return stream.getvalue()


@pytest.fixture
def memory(monkeypatch):
    from fsspec.implementations.memory import MemoryFileSystem

    monkeypatch.setattr(MemoryFileSystem, "store", {})
    staging.release()
    yield MemoryFileSystem()
    staging.release()


@pytest.fixture
def machine(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE)
    return path


def read_both(content, memory, machine, tmp_path):
    """Return the recording from a local file and from a URL, and the bytes that the second one has transferred."""
    (tmp_path / "large.mcap").write_bytes(content)
    memory.pipe_file("/logs/large.mcap", content)
    before = session.amount_read()[0]
    there = cdtool.read(URL, machine)
    return cdtool.read(tmp_path / "large.mcap", machine), there, session.amount_read()[0] - before


@pytest.mark.parametrize("attachment", [False, True])
def test_at_most_a_tenth_is_transferred_and_everything_is_as_in_a_local_file(memory, machine, tmp_path, attachment):
    content = recorded(attachment=attachment)
    here, there, size = read_both(content, memory, machine, tmp_path)
    assert size < 0.1 * len(content)
    assert list(here.channels) == list(there.channels) and len(there["torque"].time) == 10_000
    for name, series in here.channels.items():
        assert series.values.tobytes() == there[name].values.tobytes()
        assert series.time.tobytes() == there[name].time.tobytes()
    assert there.findings == here.findings and there.origin == here.origin
    assert len(here.digest) == 64 and there.digest.startswith("modified:")


def flipped(content: bytes) -> bytes:
    return content[:200_000] + bytes([content[200_000] ^ 1]) + content[200_001:]


@pytest.mark.parametrize(
    ("make", "share", "count"),
    [
        (lambda: recorded(crc=False), (0.9, 2.0), 10_000),
        (lambda: flipped(recorded()), (0.0, 2.0), 5000),
        (lambda: recorded()[:-5_000_000], (0.0, 2.0), 5000),
        (lambda: recorded(chunks=2, every=2), (1.0, 1.0), 5000),
    ],
    ids=["without checksums: as a whole", "damaged", "cut", "small: in one request"],
)
def test_any_other_file_has_the_same_samples_and_losses_as_a_local_one(memory, machine, tmp_path, make, share, count):
    content = make()
    here, there, size = read_both(content, memory, machine, tmp_path)
    assert share[0] * len(content) <= size <= share[1] * len(content)
    assert {str(item) for item in there.findings} == {str(item) for item in here.findings}
    assert there["torque"].values.tobytes() == here["torque"].values.tobytes() and len(there["torque"]) == count


def test_a_file_that_is_replaced_while_it_is_read_is_not_used(memory, machine, monkeypatch):
    content = recorded()
    memory.pipe_file("/logs/large.mcap", content)
    whole = FileBytes.check_unchanged

    def replace(self):
        memory.pipe_file("/logs/large.mcap", content[:-1] + b"\n")
        whole(self)

    monkeypatch.setattr(FileBytes, "check_unchanged", replace)
    with pytest.raises(RecordingError, match=r"cannot be read to its end: .*changed while it was read") as caught:
        cdtool.read(URL, machine)
    assert not is_lasting(caught.value)


@pytest.mark.parametrize("after", [3, 5, 7, 9])
def test_a_storage_that_fails_meanwhile_is_one_line_that_is_not_lasting(memory, machine, monkeypatch, after):
    memory.pipe_file("/logs/large.mcap", recorded())
    reads = iter(range(1000))
    cat = type(memory).cat_file

    def fail(self, path, start=None, end=None, **settings):
        if next(reads) >= after:
            raise ConnectionResetError("connection reset")
        return cat(self, path, start, end, **settings)

    monkeypatch.setattr(type(memory), "cat_file", fail)
    with pytest.raises(CdtoolError, match="connection reset") as caught:
        cdtool.read(URL, machine)
    assert not is_lasting(caught.value) and "\n" not in str(caught.value)


def test_a_converted_file_keeps_its_exact_times(memory, machine, tmp_path, monkeypatch):
    monkeypatch.setattr(remote_path, "SMALLEST_BY_RANGES", 1)
    rows = "\n".join(f"{5 + i * 0.0010001},{0.001 * i * i},{0.5}" for i in range(3000))
    (tmp_path / "log.csv").write_text(f"t,q,i\n{rows}\n")
    text = MACHINE.partition("[channels.mcap]")[0] + (
        '[channels]\ntime = { column = "t", unit = "s" }\nposition = { column = "q", unit = "m" }\n'
        'torque = { column = "i", unit = "A", scale = 0.5 }\n'
    )
    (tmp_path / "csv.toml").write_text(text)
    cdtool.convert(tmp_path / "log.csv", tmp_path / "log.mcap", machine=tmp_path / "csv.toml")
    memory.pipe_file("/logs/log.mcap", (tmp_path / "log.mcap").read_bytes())
    here = cdtool.read(tmp_path / "log.mcap", tmp_path / "log.mcap.machine.toml")
    there = cdtool.read("memory://logs/log.mcap", tmp_path / "log.mcap.machine.toml")
    assert here["torque"].time.tobytes() == there["torque"].time.tobytes() and here.origin == there.origin
    assert there.digest.startswith("modified:")
