"""Recordings in several MCAP files, as rosbag2 splits them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdtool.formats.mcap.write import Stream, write_mcap

START_NS = 1_700_000_000 * 10**9


def write_part(path: Path, start: float, names: tuple[str, ...] = ("speed", "cell"), rows: int = 128) -> Path:
    """A log of one second: speeds at 128 Hz, a load cell at half of that rate."""
    time = start + np.arange(rows) / 128.0
    streams = {
        "speed": Stream("/speed", "std_msgs/msg/Float64", time, {"data": np.sin(time)}),
        "cell": Stream("/cell", "std_msgs/msg/Float64", time[::2] + 1 / 512, {"data": 7.0 * time[::2]}),
    }
    write_mcap(path, [streams[name] for name in names], start_ns=START_NS)
    return path


def bag(folder: Path, count: int = 11, listed: int | None = None) -> Path:
    """Parts of one second each, numbered as by rosbag2, so that the tenth sorts before the second."""
    folder.mkdir()
    for number in range(count):
        write_part(folder / f"bag_{number}.mcap", float(number))
    names = "".join(f"    - bag_{number}.mcap\n" for number in range(listed or count))
    (folder / "metadata.yaml").write_text(f"rosbag2_bagfile_information:\n  relative_file_paths:\n{names}")
    return folder
