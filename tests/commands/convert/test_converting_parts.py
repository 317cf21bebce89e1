"""`cdtool convert` and `info` of a log in parts, as rosbag2 splits one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.commands.convert.converting import convert
from cdtool.formats import time_order
from cdtool.formats.channels.reading import read_recording, survey
from cdtool.formats.csv import text
from cdtool.formats.machine_file import read_machine_file
from tests.command import cdtool as command
from tests.commands.convert.bags import bag, write_part
from tests.commands.convert.kinds import KINDS, SEVERAL_CLOCKS, needs, table
from tests.formats.container_files import assert_same, logged

MACHINE = """[machine]
type = "linear_axis"
name = "gate"
coordinates = "load"
load_mass = 10.0

[channels.mcap]
speed = { topic = "/speed", field = "data" }
force = { topic = "/cell", field = "data" }
"""


def machine(folder: Path) -> Path:
    (folder / "machine.toml").write_text(MACHINE)
    return folder / "machine.toml"


@pytest.mark.parametrize("suffix", KINDS)
def test_the_columns_of_all_parts_are_written_in_the_order_of_time(suffix, tmp_path):
    needs(suffix)
    folder = bag(tmp_path / "bag")
    done = convert(folder, tmp_path / f"out{suffix}")
    assert done.columns == done.clocks == 2 and done.findings == ()
    original = survey(folder).columns
    columns = {name: column for path in done.files for name, column in survey(Path(path)).columns.items()}
    for topic in ("speed", "cell"):
        expected = original[f"/{topic} data"]
        (found,) = [
            column for name, column in columns.items() if topic in name.replace("_", " ").split() or topic in name
        ]
        assert found.values.tobytes() == expected.values.tobytes()
        if found.time is not None:
            assert found.time == pytest.approx(expected.time, abs=1e-9)


@pytest.mark.parametrize("suffix", SEVERAL_CLOCKS)
def test_the_channels_of_all_parts_are_read_back_as_those_of_the_log(suffix, tmp_path):
    needs(suffix)
    folder, known = bag(tmp_path / "bag"), machine(tmp_path)
    done = convert(folder, tmp_path / f"out{suffix}", machine=known)
    # Already on the load side: the machine accepts load coordinates unchanged, and derives only a position.
    whole = read_recording(folder, read_machine_file(known))
    whole = replace(whole, channels={name: whole[name] for name in ("speed", "force")})
    assert_same(whole, logged(done.files[0], done.machine_files[0]), exact_time=suffix != ".mcap")


@pytest.mark.parametrize("arguments", [(), ("-m",)], ids=["all columns", "channels"])
def test_missing_or_unreadable_parts_are_reported_with_status_3(arguments, tmp_path):
    folder = bag(tmp_path / "bag", count=4, listed=5)
    (folder / "bag_1.mcap").write_bytes(b"")
    (folder / "bag_2.mcap").write_bytes((folder / "bag_2.mcap").read_bytes()[:60])
    options = ("-m", machine(tmp_path)) if arguments else ()
    done = command("convert", folder, tmp_path / "out.mcap", *options)
    assert done.status == 3
    for words in (
        "loss: part bag_4.mcap of metadata.yaml is not in the folder",
        "loss: part bag_1.mcap is left out, it cannot be read: is empty",
        "loss: part bag_2.mcap is left out, it cannot be read: ",
    ):
        assert words in done.err
    (column, *_) = [
        c for name, c in survey(tmp_path / "out.mcap").columns.items() if c.time is not None and "speed" in name
    ]
    assert len(column.values) == 256
    from mcap.reader import make_reader

    with (tmp_path / "out.mcap").open("rb") as file:
        told = next(iter(make_reader(file).iter_metadata())).metadata
    assert "bag_4.mcap" in told["cdtool.lost"] and "bag_1.mcap" in told["cdtool.lost"]
    info = command("info", folder, *options)
    assert info.status == 3 and "loss: part bag_1.mcap is left out" in info.out


def test_a_load_cell_that_only_some_parts_hold_is_written_from_these(tmp_path):
    folder = bag(tmp_path / "bag", count=2)
    write_part(folder / "bag_2.mcap", 2.0, ("speed",))
    done = convert(folder, tmp_path / "out.mcap", machine=machine(tmp_path))
    recording = logged(done.files[0], done.machine_files[0])
    assert (len(recording["speed"]), len(recording["force"])) == (384, 128)


def test_a_log_without_any_mapped_channel_is_one_line(tmp_path):
    known = machine(tmp_path)
    known.write_text(MACHINE.replace('speed = { topic = "/speed", field = "data" }\n', ""))
    log = write_part(tmp_path / "log.mcap", 0.0, ("speed",))
    done = command("convert", log, tmp_path / "out.csv", "-m", known)
    assert done.status == 2 and "contains none of the mapped channels" in done.err and done.err.count("\n") == 1


def test_no_part_is_overwritten_and_none_is_added(tmp_path):
    folder = bag(tmp_path / "bag", count=2)
    with pytest.raises(UsageError, match="would be a part of the log"):
        convert(folder, folder / "bag_2.mcap")
    (tmp_path / "link.mcap").symlink_to(folder / "bag_1.mcap")
    with pytest.raises(UsageError, match="is the log itself"):
        convert(folder, tmp_path / "link.mcap", force=True)
    assert len(list(folder.iterdir())) == 3


def shuffled(path: Path) -> Path:
    """Two topics whose messages are up to 30 late; every tenth has the time of the preceding one."""
    from mcap.writer import Writer

    from cdtool.formats.messages.schemas import DEFINITIONS

    random = np.random.default_rng(11)
    stamps = np.arange(1, 501) * 10**6
    stamps[::10] -= 10**6
    order = np.argsort(np.arange(len(stamps)) + random.uniform(0, 30, len(stamps)), kind="stable")
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=2000)
        writer.start()
        text = DEFINITIONS["std_msgs/msg/Float64"].encode()
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", text)
        channels = [writer.register_channel(f"/{name}", "cdr", schema) for name in "ab"]
        for row in order.tolist():
            for channel, every in zip(channels, (1, 3), strict=True):
                if row % every == 0:
                    stamp = int(stamps[row])
                    writer.add_message(channel, stamp, b"\0\1\0\0" + np.float64(row).tobytes(), stamp)
        writer.finish()
    return path


@pytest.mark.parametrize("suffix", SEVERAL_CLOCKS)
def test_messages_out_of_order_are_written_by_time_and_none_of_equal_time_is_lost(suffix, tmp_path, monkeypatch):
    needs(suffix)
    log = shuffled(tmp_path / "run.mcap")
    monkeypatch.setattr(time_order.by_time, "__defaults__", (16,))  # small buffer, so that there are many parts
    read = survey(Path(convert(log, tmp_path / f"out{suffix}").files[0])).columns
    original = survey(log).columns
    for topic, count in (("a", 500), ("b", 167)):
        (name,) = [key for key in read if key.replace("_", " ").endswith(f"{topic} data")]
        expected = original[f"/{topic} data"]
        assert len(expected.values) == count
        assert read[name].values.tobytes() == expected.values.tobytes()
        assert read[name].time is not None and expected.time is not None
        assert read[name].time == pytest.approx(expected.time, abs=1e-9)


@pytest.mark.parametrize("suffix", [".csv", ".mcap", ".parquet"])
def test_a_log_in_many_pieces_becomes_the_same_file_as_in_one(suffix, tmp_path, monkeypatch):
    needs(suffix)
    log = table(tmp_path / "run.csv", rows=3000)
    at_once = survey(Path(convert(log, tmp_path / f"one{suffix}").files[0])).columns
    monkeypatch.setattr(text, "BLOCK_BYTES", 1 << 12)
    monkeypatch.setattr(time_order.by_time, "__defaults__", (100,))
    in_pieces = survey(Path(convert(log, tmp_path / f"many{suffix}").files[0])).columns
    assert list(at_once) == list(in_pieces)
    assert all(at_once[name].values.tobytes() == in_pieces[name].values.tobytes() for name in at_once)
