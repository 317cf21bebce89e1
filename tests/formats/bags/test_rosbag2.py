"""ROS 2 bags in SQLite: with and without definitions, compressed, not closed, in parts, damaged and hostile."""

from __future__ import annotations

import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import zstandard

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import read_recording, survey
from cdtool.formats.machine_file import read_machine_file

START = 1_700_000_000_000_000_000
MACHINE = """[machine]
type = "rotary_axis"
coordinates = "load"

[channels.mcap]
speed = { topic = "/speed", field = "data" }
force = { topic = "/cell", field = "data" }
"""
# The tables of ROS 2 Foxy; from Iron on, message_definitions and further columns.
FOXY = """
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
    data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""
FLOAT = "std_msgs/msg/Float64"


def number(value: float) -> bytes:
    """A std_msgs/Float64 in CDR."""
    return b"\x00\x01\x00\x00" + struct.pack("<d", value)


def rows(first: float = 0.0, count: int = 100) -> list[tuple[int, int, bytes]]:
    """Topic, time and message: speeds at 100 Hz, forces at 50 Hz."""
    found = []
    for k in range(count):
        time = first + k / 100
        found.append((1, START + round(time * 1e9), number(np.sin(time))))
        if k % 2 == 0:
            found.append((7, START + round(time * 1e9) + 1000, number(time)))
    return found


def write_bag(path: Path, messages=None, kinds=(FLOAT, FLOAT), schema: str = FOXY, definitions=()) -> Path:
    with closing(sqlite3.connect(path)) as base, base:
        base.executescript(schema)
        topics = [(1, "/speed", kinds[0], "cdr"), (7, "/cell", kinds[1], "cdr")]
        base.executemany("INSERT INTO topics(id, name, type, serialization_format) VALUES(?, ?, ?, ?)", topics)
        base.executemany(
            "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", rows() if messages is None else messages
        )
        base.executemany(
            "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition, type_description_hash) "
            "VALUES(?, ?, ?, '')",
            definitions,
        ) if definitions else None
    return path


@pytest.fixture
def machine(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE)
    return read_machine_file(path)


def check(recording, count: int = 100, first: float = 0.0) -> None:
    """The values and times that `rows` wrote."""
    time = first + np.arange(count) / 100
    np.testing.assert_allclose(recording["speed"].values[:, 0], np.sin(time), atol=1e-12)
    np.testing.assert_allclose(recording["speed"].time, time, atol=1e-9)
    np.testing.assert_allclose(recording["force"].time, time[::2] + 1e-6, atol=1e-9)
    np.testing.assert_allclose(recording["force"].values[:, 0], time[::2], atol=1e-12)


def kinds_of(findings) -> list[str]:
    return [item.kind for item in findings if not item.channel.endswith("time")]


def test_a_bag_without_definitions_is_read_with_the_standard_ones_and_says_so(tmp_path, machine):
    path = write_bag(tmp_path / "log.db3")
    recording = read_recording(path, machine)
    check(recording)
    assert recording.origin == START / 1e9
    (said,) = [item for item in recording.findings if item.kind == "standard_definitions"]
    assert said.severity == "note" and "standard ones of std_msgs/msg/Float64" in str(said)


def test_a_type_without_a_definition_is_named_with_the_next_step(tmp_path, machine):
    path = write_bag(tmp_path / "log.db3", kinds=("my_msgs/msg/Speed", FLOAT))
    with pytest.raises(
        RecordingError, match=r"/speed can be decoded: .*'my_msgs/msg/Speed' \(`ros2 bag convert` to MCAP"
    ):
        read_recording(path, machine)
    source = survey(path)
    assert list(source.columns) == ["/cell data"]
    assert "undecodable_messages" in kinds_of(source.findings)


@pytest.mark.parametrize("end", ["zstd", "zst"])
def test_a_bag_compressed_as_a_file_is_refused_with_the_next_step(tmp_path, machine, end):
    plain = write_bag(tmp_path / "log.db3")
    packed = tmp_path / f"packed.db3.{end}"
    packed.write_bytes(zstandard.compress(plain.read_bytes()))
    with pytest.raises(RecordingError, match=r"it is zstd-compressed \(unpack it first"):
        read_recording(packed, machine)
    folder = bag_folder(tmp_path / "bag", 2, compress=True)
    with pytest.raises(RecordingError, match=r"bag_0\.db3\.zstd: .*zstd-compressed"):
        read_recording(folder, machine)


def test_a_bag_compressed_message_by_message_is_read(tmp_path, machine):
    compressed = [(topic, time, zstandard.compress(raw)) for topic, time, raw in rows()]
    check(read_recording(write_bag(tmp_path / "by_message.db3", compressed), machine))


def test_a_bag_that_was_not_closed_is_read_with_its_journal_and_left_as_it_is(tmp_path, machine):
    folder = tmp_path / "written"
    folder.mkdir()
    base = sqlite3.connect(folder / "log.db3")
    try:
        base.execute("PRAGMA journal_mode = WAL")
        base.execute("PRAGMA wal_autocheckpoint = 0")
        base.executescript(FOXY)
        base.execute("INSERT INTO topics VALUES(1, '/speed', ?, 'cdr'), (7, '/cell', ?, 'cdr')", (FLOAT, FLOAT))
        base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", rows())
        base.commit()
        copied = tmp_path / "copied"
        copied.mkdir()
        for name in ("log.db3", "log.db3-wal"):
            (copied / name).write_bytes((folder / name).read_bytes())
    finally:
        base.close()
    before = {path.name: path.read_bytes() for path in copied.iterdir()}
    recording = read_recording(copied / "log.db3", machine)
    check(recording)
    assert "bag_not_closed" in kinds_of(recording.findings)
    assert {path.name: path.read_bytes() for path in copied.iterdir()} == before


def test_reading_neither_changes_the_bag_nor_makes_files_beside_it_even_if_it_is_locked(tmp_path, machine):
    folder = tmp_path / "a folder #1?"
    folder.mkdir()
    path = write_bag(folder / "log.db3")
    with closing(sqlite3.connect(path)) as base:
        base.execute("PRAGMA journal_mode = WAL")
        base.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, 0, x'00')")
        base.rollback()
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with closing(sqlite3.connect(path, isolation_level=None)) as base:
        base.execute("PRAGMA journal_mode = DELETE")
        base.execute("BEGIN EXCLUSIVE")
        check(read_recording(path, machine))
        base.execute("ROLLBACK")
    assert {path.name for path in folder.iterdir()} == set(before)


def bag_folder(folder: Path, parts: int = 3, compress: bool = False) -> Path:
    folder.mkdir()
    names = []
    for part in range(parts):
        path = write_bag(folder / f"bag_{part}.db3", rows(part * 1.0))
        if compress:
            packed = path.with_name(f"{path.name}.zstd")
            packed.write_bytes(zstandard.compress(path.read_bytes()))
            path.unlink()
            path = packed
        names.append(f"    - {path.name}\n")
    (folder / "metadata.yaml").write_text(f"rosbag2_bagfile_information:\n  relative_file_paths:\n{''.join(names)}")
    return folder


@pytest.mark.parametrize(
    ("row", "count"),
    [
        ((1, "later", number(1.0)), 1),
        ((1, START, None), 1),
        ((1, START, "text"), 1),
        ((99, START, number(1.0)), 1),
        ((1, -5, number(1.0)), 1),
        ((1, START, b"\x28\xb5\x2f\xfd broken"), 1),
    ],
)
def test_rows_that_are_no_messages_are_counted(tmp_path, row, count):
    schema = FOXY.replace("data BLOB NOT NULL", "data BLOB").replace("timestamp INTEGER NOT NULL", "timestamp INTEGER")
    path = write_bag(tmp_path / "log.db3", [*rows(), row], schema=schema)
    source = survey(path)
    assert len(source.columns["/speed data"].values) == 100
    assert [item.numbers["count"] for item in source.findings if item.kind == "damaged_rows"] == [count]


@pytest.mark.parametrize(
    "script",
    [
        "DROP TABLE messages; CREATE VIEW messages AS SELECT 1 AS topic_id, 0 AS timestamp, zeroblob(10000) AS data",
        "DROP TABLE messages; CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n) "
        "SELECT 1 AS topic_id, i AS timestamp, x'00' AS data FROM n",
        "DROP TABLE topics; CREATE TABLE topic(a); CREATE TABLE messagesx(a)",
    ],
    ids=["view", "endless view", "no topics"],
)
def test_a_view_in_place_of_a_table_is_refused_in_one_line_without_being_evaluated(tmp_path, script):
    path = write_bag(tmp_path / "log.db3")
    with closing(sqlite3.connect(path)) as base:
        base.executescript(script)
    with pytest.raises(RecordingError) as fault:
        survey(path)
    assert "\n" not in str(fault.value) and str(path) in str(fault.value)


def test_decompression_bombs_are_refused(tmp_path):
    zeros = zstandard.compress(bytes(2**29))
    bomb = write_bag(tmp_path / "messages.db3", [(1, START + k, zeros) for k in range(3)])
    assert [item.numbers["count"] for item in survey(bomb).findings if item.kind == "damaged_rows"] == [3]
