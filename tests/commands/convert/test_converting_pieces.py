"""`cdtool convert` of logs in many pieces, or out of order."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdtool.commands.convert.converting import convert
from cdtool.formats import time_order
from cdtool.formats.channels.reading import survey
from cdtool.formats.csv import text
from tests.commands.convert.kinds import SEVERAL_CLOCKS, needs, table


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
