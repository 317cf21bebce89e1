"""What a user waits for: reading a log, a benchmark of 200 recordings, a first start; against what else could be used.

CPU time and peak memory of whole reads, each reader in a process of its own that stays, interleaved in five
rounds. `--before` names the Python of an environment with an earlier cdtool, for the rows that compare with it.

python benchmarks/reading.py [--before ../before/.venv/bin/python]    # 20 min; 2 GB in the temporary folder
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
from mcap_logs import FLAT, JOINTS, write_log
from timing import Spread, main, ratio, table, verdict

from cdtool.commands.simulate.gate_recordings import simulate_gate

HERE = Path(__file__).resolve().parent
SAMPLES = HERE.parent / "sample_logs" / "gate"
ROUNDS = 5
COUNTS = {"free": 14, "holdout": 66, "stiff": 67, "soft": 67}
# A file is read again until so many bytes are read: the clock of a short read is too coarse.
LEAST = 20_000_000
# A process that reads the files whose paths it is sent, and answers with seconds of CPU and its peak memory [KiB].
SERVER = """
import json, resource, sys, time, warnings
warnings.simplefilter("ignore")
sys.path.insert(0, sys.argv[1])
from pathlib import Path
{prepare}
for line in sys.stdin:
    path = Path(line.strip())
    times = max(1, {least} // path.stat().st_size)
    begin = time.process_time()
    for _ in range(times):
        result = {read}
    seconds = (time.process_time() - begin) / times
    del result
    print(json.dumps([seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss]), flush=True)
"""
# What each reader prepares, and what it returns of `path`: all columns of a table, the same fields of an MCAP log.
READERS = {
    "cdtool": (
        f"""
try:
    from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
    from cdtool.formats.channels.reading import choose_format
except ImportError:  # the earlier cdtool
    from cdtool.channels import ChannelMap, ChannelSource, TimeSource
    from cdtool.ingest.reading import choose_format
fields = tuple(ChannelSource("speed", topic=topic, field=field) for topic, field in {FLAT.wanted!r})
wanted = ChannelMap(TimeSource(clock="log"), fields, {JOINTS!r}, topics=True)
""",
        "choose_format(path).columns(path, wanted if path.suffix == '.mcap' else None)",
    ),
    "pandas": ("import pandas as pd", "pd.read_csv(path)"),
    "rosbags": ("from mcap_logs import FLAT, by_rosbags", "by_rosbags(path, FLAT)"),
    "protobuf (upb)": ("from mcap_logs import FLAT, by_protobuf", "by_protobuf(path, FLAT)"),
    "orjson": ("from mcap_logs import FLAT, by_orjson", "by_orjson(path, FLAT)"),
}


BEFORE = "cdtool before"
# A log, what cdtool is compared with, and at most how many times its CPU time cdtool may take.
QUESTIONS = (
    ("gate, 7 s, CSV", "pandas", 1.6),
    ("table, 50 MB", "pandas", 1.3),
    ("cdr, 7 s", BEFORE, 1.3),
    ("cdr, 300 s", BEFORE, 3.5),
    ("cdr, 300 s", "rosbags", 0.1),
    ("protobuf, 300 s", "protobuf (upb)", 0.1),
    ("json, 300 s", "orjson", 1 / 1.5),
)
LARGE = ("table, 648 MB", "cdr, 300 s")
MEMORY_AT_MOST, BENCHMARK_AT_MOST, FIRST_START_AT_MOST = 1.3, 1.35, 0.65  # of those before


class Reader:
    """A process that reads logs in one way; `python` is the interpreter of its environment."""

    def __init__(self, way: str, python: str = sys.executable) -> None:
        prepare, read = READERS[way]
        code = SERVER.format(prepare=prepare, read=read, least=LEAST)
        pipe = subprocess.PIPE
        self.process = subprocess.Popen([python, "-c", code, str(HERE)], stdin=pipe, stdout=pipe, text=True, cwd=HERE)

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.communicate()

    def read(self, path: Path) -> tuple[float, float]:
        """Return the CPU time [s], and the largest memory of the process so far [MiB]."""
        assert self.process.stdin is not None and self.process.stdout is not None
        print(path, file=self.process.stdin, flush=True)
        answer = self.process.stdout.readline()
        if not answer:
            sys.exit(f"error: the reader of {path} failed")
        seconds, peak = json.loads(answer)
        return seconds, peak / 1024.0


def measure(before: str | None) -> bool:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        logs = write_logs(folder)
        held = [
            _compared(log, logs[log], peer, at_most, before)
            for log, peer, at_most in QUESTIONS
            if before or peer != BEFORE
        ]
        if before is None:
            print("skip  what is compared with an earlier cdtool: name its Python by --before")
            return all(held)
        held += [_memory(log, logs[log], before) for log in LARGE]
        simulate_gate(folder / "gate", COUNTS, seed=1, file_format="csv")
        whole = ["benchmark", str(folder / "gate" / "benchmark.toml"), "--json"]
        first = ["benchmark", str(SAMPLES / "benchmark.toml"), "--json"]
        held.append(_commands("benchmark of 200 recordings", whole, before, BENCHMARK_AT_MOST))
        held.append(_commands("first start, no kernel cached", first, before, FIRST_START_AT_MOST, is_first=True))
    return all(held)


def write_logs(folder: Path) -> dict[str, Path]:
    """Write the logs, and return their paths by name."""
    logs = {"gate, 7 s, CSV": SAMPLES / "stiff" / "03.csv"}
    for encoding, seconds in (("cdr", 7), ("cdr", 300), ("protobuf", 300), ("json", 300)):
        path = logs[f"{encoding}, {seconds} s"] = folder / f"{encoding}_{seconds}.mcap"
        write_log(path, seconds, encoding, "zstd")
    for megabytes in (50, 648):
        path = logs[f"table, {megabytes} MB"] = folder / f"{megabytes}.csv"
        write_table(path, megabytes * 1_000_000)
    return logs


def write_table(path: Path, size: int) -> None:
    """Write a table of about `size` bytes: about 9 MB of rows, repeated."""
    rng = np.random.default_rng(648)
    columns = [np.arange(200_000) * 0.5, *(rng.normal(0.0, scale, 200_000) for scale in (30.0, 2.0, 100.0, 5.0))]
    row = "%.3f,%.6f,%.6f,%.6f,%.4f\n"
    body = (row * 200_000 % tuple(np.column_stack(columns).ravel().tolist())).encode()
    with path.open("wb") as file:
        file.write(b"t,torque,speed,position,force\n")
        for _ in range(max(1, round(size / len(body)))):
            file.write(body)


def _compared(log: str, path: Path, peer: str, at_most: float, before: str | None) -> bool:
    python = before if before and peer == BEFORE else sys.executable
    with Reader("cdtool") as ours, Reader("cdtool" if peer == BEFORE else peer, python) as theirs:
        seconds: dict[str, list[float]] = {"cdtool": [], peer: []}
        for number in range(-1, ROUNDS):
            for name, reader in ((("cdtool", ours), (peer, theirs)))[:: 1 if number % 2 else -1]:
                took, _ = reader.read(path)
                if number >= 0:
                    seconds[name].append(took)
    spread = ratio(seconds["cdtool"], seconds[peer])
    held = verdict(f"{log}: cdtool / {peer}, CPU time", spread, at_most, at_most=True)
    table(("reader", "CPU s (low-high)"), [(name, Spread.of(each)) for name, each in seconds.items()])
    print(flush=True)
    return held


def _memory(log: str, path: Path, before: str) -> bool:
    """Peak memory of a process that reads one log once, over that before."""
    peaks: dict[str, list[float]] = {sys.executable: [], before: []}
    for _ in range(3):
        for python, each in peaks.items():
            with Reader("cdtool", python) as reader:
                each.append(reader.read(path)[1])
    shown = f"{log}: peak memory, {Spread.of(peaks[sys.executable])} MiB, over that before"
    return verdict(shown, ratio(peaks[sys.executable], peaks[before]), MEMORY_AT_MOST, at_most=True)


def _commands(name: str, arguments: list[str], before: str, at_most: float, is_first: bool = False) -> bool:
    """CPU time of a whole command over that before; `is_first`: each time with a kernel cache that is empty."""
    seconds: dict[str, list[float]] = {sys.executable: [], before: []}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(-1, ROUNDS):
            for place, (python, each) in enumerate(seconds.items()):
                kernels = f"{folder}/{place}_{number if is_first else 0}"
                # Modules are compiled before, as after an installation.
                caches = {"NUMBA_CACHE_DIR": kernels, "PYTHONPYCACHEPREFIX": f"{folder}/{place}_bytecode"}
                environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "", **caches}
                took = _cpu_time([python, "-m", "cdtool", *arguments], environment)
                if number >= 0:
                    each.append(took)
    shown = f"{name}: CPU time, {Spread.of(seconds[sys.executable])} s, over that before"
    return verdict(shown, ratio(seconds[sys.executable], seconds[before]), at_most, at_most=True)


def _cpu_time(command: list[str], environment: dict[str, str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=False, cwd=HERE)
    if done.returncode not in (0, 1):
        sys.exit(f"error: {' '.join(command)}: status {done.returncode}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", help="the Python of an environment with an earlier cdtool")
    main("what a user waits for", partial(measure, parser.parse_args().before))
