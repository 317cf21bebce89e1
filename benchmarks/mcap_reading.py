"""Reading MCAP: wanted fields of a log into columns, against decompression alone and against packages for messages.

Every peer is interleaved with cdtool in at least five rounds, in CPU time (of all threads) and wall clock.
Decompression has its chunks in memory, and runs in the same process, where memory for a chunk is already mapped: in a
process of its own it would take up to four times as long.

python benchmarks/mcap_reading.py           # 5 min of four topics at 1 kHz, about 20 minutes
python benchmarks/mcap_reading.py 20        # 20 s of them
"""

from __future__ import annotations

import gc
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time
from typing import Any
from zlib import crc32 as zlib_crc32

import numpy as np
from mcap_logs import FLAT, NESTED, Content, channel_map, write_log
from mcap_peers import by_mcap_ros2_support, by_orjson, by_protobuf, by_rosbags, decompression
from timing import Spread, interleaved, main, ratio, table, verdict

from cdtool.formats.mcap import Mcap
from cdtool.formats.mcap.records import crc32

SECONDS = 300.0
ROUNDS, PEER_ROUNDS = 9, 5


@dataclass(frozen=True)
class Log:
    """A log of the benchmark."""

    encoding: str
    compression: str
    content: Content = FLAT
    seconds: float | None = None  # None: all


LOGS = {
    "cdr, zstd": Log("cdr", "zstd"),
    "cdr, lz4": Log("cdr", "lz4"),
    "protobuf, zstd": Log("protobuf", "zstd"),
    "json, zstd": Log("json", "zstd"),
    "nested cdr, zstd": Log("cdr", "zstd", NESTED),
    "nested protobuf, zstd": Log("protobuf", "zstd", NESTED),
    "nested json, zstd": Log("json", "zstd", NESTED),
    "cdr, zstd, 10 s": Log("cdr", "zstd", seconds=10.0),
}
# Log, peer, its module, how much more CPU time it takes at least.
PEERS: tuple[tuple[str, str, str, Callable[[Path, Content], Any], float], ...] = (
    ("cdr, zstd", "rosbags", "rosbags", by_rosbags, 10.0),
    ("cdr, lz4", "rosbags", "rosbags", by_rosbags, 10.0),
    ("nested cdr, zstd", "mcap-ros2-support", "mcap_ros2", by_mcap_ros2_support, 10.0),
    ("protobuf, zstd", "protobuf", "google.protobuf", by_protobuf, 10.0),
    ("nested protobuf, zstd", "protobuf", "google.protobuf", by_protobuf, 2.0),
    ("json, zstd", "orjson", "orjson", by_orjson, 0.6),
    ("nested json, zstd", "orjson", "orjson", by_orjson, 0.25),
)
PACKAGES = ("zstandard", "lz4", "isal", "mcap", "mcap-ros2-support", "rosbags", "protobuf", "orjson")


def measure() -> bool:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    print(", ".join(_versions()), flush=True)
    with tempfile.TemporaryDirectory() as name:
        paths = write_logs(Path(name), seconds)
        print("; ".join(f"{log}: {path.stat().st_size / 1e6:.0f} MB" for log, path in paths.items()), flush=True)
        gc.freeze()  # as in a command: objects of the imports are not searched for garbage
        held = _checksums()
        for log, path in paths.items():
            _decompression(log, path)
        for log, peer, module, read, at_least in PEERS:
            if find_spec(module.partition(".")[0]) is None:
                print(f"skip  {log} / {peer}: {peer} is not installed")
            else:
                held &= _against(log, paths[log], peer, read, at_least)
    return held


def write_logs(folder: Path, seconds: float) -> dict[str, Path]:
    """Write the logs, those of protobuf only if it is installed."""
    paths = {}
    for log, kind in LOGS.items():
        if kind.encoding != "protobuf" or find_spec("google") is not None:
            paths[log] = folder / f"{len(paths)}.mcap"
            write_log(paths[log], kind.seconds or seconds, kind.encoding, kind.compression, kind.content)
    return paths


def cpu_and_wall(
    tasks: Mapping[str, Callable[[], Any]], rounds: int
) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """CPU and wall-clock seconds of every task in every round; the order turns, and one round before is not counted."""
    names = list(tasks)
    cpu: dict[str, list[float]] = {name: [] for name in names}
    wall: dict[str, list[float]] = {name: [] for name in names}
    for number in range(-1, rounds):
        turn = number % len(names)
        for name in names[turn:] + names[:turn]:
            begin, begin_cpu = perf_counter(), process_time()
            tasks[name]()
            if number >= 0:
                cpu[name].append(process_time() - begin_cpu)
                wall[name].append(perf_counter() - begin)
    return cpu, wall


def _against(log: str, path: Path, peer: str, read: Callable[[Path, Content], Any], at_least: float) -> bool:
    content = LOGS[log].content
    expected, columns = read(path, content), Mcap().columns(path, channel_map(content)).columns
    for name, values in expected.items():
        if values.shape != columns[name].values.shape or values.tobytes() != columns[name].values.tobytes():
            sys.exit(f"error: {name} of {log} is not that of {peer}")
    del expected, columns
    gc.collect()
    tasks = {"cdtool": lambda: Mcap().columns(path, channel_map(content)), peer: lambda: read(path, content)}
    cpu, wall = cpu_and_wall(tasks, ROUNDS if log.endswith("10 s") else PEER_ROUNDS)
    held = verdict(f"{log}: {peer} / cdtool, CPU time", ratio(cpu[peer], cpu["cdtool"]), at_least)
    print(f"      {log}: {peer} / cdtool, wall clock: {ratio(wall[peer], wall['cdtool'])}")
    _print_times(cpu, wall)
    return held


def _decompression(log: str, path: Path) -> None:
    kind, alone = LOGS[log], f"{LOGS[log].compression} alone"
    tasks = {
        "cdtool": lambda: Mcap().columns(path, channel_map(kind.content)),
        alone: decompression(path),
    }
    cpu, wall = cpu_and_wall(tasks, ROUNDS)
    text = f"{log}: cdtool / decompression alone"
    print(f"      {text}, CPU time: {ratio(cpu['cdtool'], cpu[alone])}")
    print(f"      {text}, wall clock: {ratio(wall['cdtool'], wall[alone])}")
    _print_times(cpu, wall)
    print(f"{kind.content.numbers} numbers a step of 1 ms\n", flush=True)


def _print_times(cpu: Mapping[str, list[float]], wall: Mapping[str, list[float]]) -> None:
    head = ("task", "CPU s (low-high)", "wall s (low-high)")
    table(head, [(task, Spread.of(each), Spread.of(wall[task])) for task, each in cpu.items()])
    print(flush=True)


def _checksums() -> bool:
    """CRC-32 of 8 MB: the library's that cdtool uses over zlib's; it has no target."""
    content = np.random.default_rng(1).bytes(8 << 20)
    seconds = interleaved({"zlib": lambda: zlib_crc32(content), "cdtool": lambda: crc32(content)}, 3 * ROUNDS)
    print(f"      CRC-32: zlib / cdtool, seconds: {ratio(seconds['zlib'], seconds['cdtool'])}")
    return True


def _versions() -> list[str]:
    versions = []
    for name in PACKAGES:
        try:
            versions.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            versions.append(f"no {name}")
    return versions


if __name__ == "__main__":
    main("reading MCAP", measure)
