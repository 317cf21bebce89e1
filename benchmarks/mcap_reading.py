"""Reading MCAP: wanted fields of a log into columns, against the packages that decode message by message.

python benchmarks/mcap_reading.py           # 5 min of four topics at 1 kHz, some minutes
python benchmarks/mcap_reading.py 20        # 20 s of them
"""

from __future__ import annotations

import gc
import sys
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from zlib import crc32 as zlib_crc32

import numpy as np
from mcap_logs import TOPICS, channel_map, write_log
from mcap_peers import by_mcap_ros2_support, by_orjson, by_protobuf, by_rosbags, decompression
from timing import Spread, interleaved, main, ratio, table, verdict

from cdtool.formats.mcap import Mcap
from cdtool.formats.mcap.container.checksums import crc32

SECONDS = 300.0
ROUNDS, PEER_ROUNDS = 9, 1
# Log -> encoding, compression, seconds (None: all).
LOGS = {
    "cdr, zstd": ("cdr", "zstd", None),
    "cdr, lz4": ("cdr", "lz4", None),
    "protobuf, zstd": ("protobuf", "zstd", None),
    "json, zstd": ("json", "zstd", None),
    "cdr, zstd, 10 s": ("cdr", "zstd", 10.0),
}
# Log, peer, its module, how much slower it is at least.
PEERS: tuple[tuple[str, str, str, Callable[[Path], Any], float], ...] = (
    ("cdr, zstd", "mcap-ros2-support", "mcap_ros2", by_mcap_ros2_support, 40.0),
    ("cdr, lz4", "mcap-ros2-support", "mcap_ros2", by_mcap_ros2_support, 80.0),
    ("cdr, zstd", "rosbags", "rosbags", by_rosbags, 20.0),
    ("protobuf, zstd", "protobuf", "google.protobuf", by_protobuf, 20.0),
    ("json, zstd", "orjson", "orjson", by_orjson, 5.0),
    ("cdr, zstd, 10 s", "mcap-ros2-support", "mcap_ros2", by_mcap_ros2_support, 30.0),
)
DECOMPRESSION_AT_MOST = 1.5


def measure() -> bool:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    with tempfile.TemporaryDirectory() as name:
        logs = {log: Path(name) / f"{i}.mcap" for i, log in enumerate(LOGS)}
        for log, (encoding, compression, length) in LOGS.items():
            if encoding != "protobuf" or find_spec("google") is not None:
                write_log(logs[log], length or seconds, encoding, compression)
        sizes = {log: f"{path.stat().st_size / 1e6:.0f} MB" for log, path in logs.items() if path.exists()}
        print("; ".join(f"{log}: {size}" for log, size in sizes.items()), flush=True)
        held = _checksums()
        held &= _decompression(logs["cdr, zstd"], "zstd", DECOMPRESSION_AT_MOST)
        held &= _decompression(logs["cdr, lz4"], "lz4", None)
        for log, peer, module, read, at_least in PEERS:
            if find_spec(module.partition(".")[0]) is None:
                print(f"skip  {log} / {peer}: {peer} is not installed")
            else:
                held &= _against(log, logs[log], peer, read, at_least)
    return held


def _against(log: str, path: Path, peer: str, read: Callable[[Path], Any], at_least: float) -> bool:
    expected, columns = read(path), Mcap().columns(path, channel_map()).columns
    for name, values in expected.items():
        if values.shape != columns[name].values.shape or values.tobytes() != columns[name].values.tobytes():
            sys.exit(f"error: {name} of {log} is not that of {peer}")
    del expected, columns
    gc.collect()
    tasks = {"cdtool": lambda: Mcap().columns(path, channel_map()), peer: lambda: read(path)}
    rounds = ROUNDS if log.endswith("10 s") else PEER_ROUNDS
    seconds = interleaved(tasks, rounds)
    spread = ratio(seconds[peer], seconds["cdtool"])
    held = verdict(f"{log}: {peer} / cdtool, seconds", spread, at_least)
    table(("task", "s (low-high)"), [(task, Spread.of(each)) for task, each in seconds.items()])
    print(flush=True)
    return held


def _decompression(path: Path, name: str, at_most: float | None) -> bool:
    alone = decompression(path)
    tasks = {"cdtool": lambda: Mcap().columns(path, channel_map()), f"{name} alone": alone}
    seconds = interleaved(tasks, ROUNDS)
    spread = ratio(seconds["cdtool"], seconds[f"{name} alone"])
    text = f"cdr, {name}: cdtool / decompression alone, seconds"
    held = verdict(text, spread, at_most, at_most=True) if at_most is not None else True
    if at_most is None:
        print(f"      {text}: {spread}")
    table(("task", "s (low-high)"), [(task, Spread.of(each)) for task, each in seconds.items()])
    print(
        f"{sum(size or 1 for _, fields in TOPICS.values() for size in fields.values())} numbers a step of 1 ms\n",
        flush=True,
    )
    return held


def _checksums() -> bool:
    """CRC-32 of 8 MB: the library's that cdtool uses over zlib's; it has no target."""
    content = np.random.default_rng(1).bytes(8 << 20)
    seconds = interleaved({"zlib": lambda: zlib_crc32(content), "cdtool": lambda: crc32(content)}, 3 * ROUNDS)
    print(f"      CRC-32: zlib / cdtool, seconds: {ratio(seconds['zlib'], seconds['cdtool'])}")
    return True


if __name__ == "__main__":
    main("reading MCAP", measure)
