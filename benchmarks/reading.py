"""What a user waits for: reading a log, compared with the package that he would use instead.

CPU time of whole reads, each reader in a process of its own that stays, interleaved in five rounds; and the peak memory
of a process that reads a large table. The other package's numbers are those of cdtool, or the benchmark stops.

python benchmarks/reading.py [--seconds 300] [--megabytes 648]    # 10 min; 1 GB in the temporary folder
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
from mcap_logs import write_log
from timing import Spread, main, ratio, table, verdict

from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import read_machine_file

HERE = Path(__file__).resolve().parent
SAMPLES = HERE.parent / "sample_logs" / "gate"
ROUNDS = 5
# Samples and sizes of the logs.
SECONDS, SMALL_TABLE_MB, LARGE_TABLE_MB = 300.0, 50.0, 648.0
# CPU time over that of the peer.
AT_MOST = {"gate, 7 s, CSV": 1.6, "table, CSV": 1.3, "ROS 2, MCAP": 0.1}
# Growth of the peak memory over the size of the columns.
MEMORY_AT_MOST = 1.3
# A file is read again until so many bytes are read: the clock of a short read is too coarse.
LEAST = 20_000_000
# A process that reads the files whose paths it is sent; it answers with seconds of CPU, its peak memory [MiB] and sums.
SERVER = """
import json, resource, sys, time, warnings
warnings.simplefilter("ignore")
import numpy as np
from pathlib import Path
{prepare}
for line in sys.stdin:
    path = Path(line.strip())
    times = max(1, {least} // path.stat().st_size)
    begin = time.process_time()
    for _ in range(times):
        columns = {read}
    seconds = (time.process_time() - begin) / times
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    sums = sorted(float(np.sum(np.asarray(values), dtype=float)) for values in columns)
    del columns
    print(json.dumps([seconds, peak, sums]), flush=True)
"""
CDTOOL = """
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.channels.reading import choose_format
FIELDS = ("position[:]", "velocity[:]", "effort[:]")
sources = [ChannelSource("speed", topic="/joint_states", field=field) for field in FIELDS]
sources += [ChannelSource("force", topic=topic, field="data") for topic in ("/accelerometer", "/load_cell")]
wanted = ChannelMap(TimeSource(clock="log"), tuple(sources), ("gate",), topics=True)
def read(path):
    columns = choose_format(path).columns(path, wanted if path.suffix == ".mcap" else None).columns
    return [column.values for column in columns.values()]
"""
ROSBAGS = """
from rosbags.highlevel import AnyReader
def read(path):
    joint, sensors = [], {"/accelerometer": [], "/load_cell": []}
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/joint_states":
                joint.append((message.position[0], message.velocity[0], message.effort[0]))
            else:
                sensors[connection.topic].append(message.data)
    return [*np.array(joint).T, *map(np.array, sensors.values())]
"""
READERS = {
    "cdtool": (CDTOOL, "read(path)"),
    "pandas": ("import pandas as pd", "pd.read_csv(path).to_numpy().T"),
    "rosbags": (ROSBAGS, "read(path)"),
}


class Reader:
    """A process that reads logs in one way."""

    def __init__(self, way: str) -> None:
        prepare, read = READERS[way]
        code = SERVER.format(prepare=prepare, read=read, least=LEAST)
        pipe = subprocess.PIPE
        self.process = subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe, text=True, cwd=HERE)

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.communicate()

    def read(self, path: Path) -> tuple[float, float, list[float]]:
        """Return the CPU time [s], the largest memory of the process so far [MiB], and the sum of each column."""
        assert self.process.stdin is not None and self.process.stdout is not None
        print(path, file=self.process.stdin, flush=True)
        answer = self.process.stdout.readline()
        if not answer:
            sys.exit(f"error: the reader of {path} failed")
        seconds, peak, sums = json.loads(answer)
        return seconds, peak, sums


def measure(seconds: float, megabytes: float) -> bool:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small, large, mcap = folder / "small.csv", folder / "large.csv", folder / "log.mcap"
        write_table(small, SMALL_TABLE_MB)
        rows = write_table(large, megabytes)
        run = read_as_logged(SAMPLES / "free" / "01.mcap", read_machine_file(SAMPLES / "machine.toml")).recording
        write_log(mcap, run, seconds, "zstd")
        held = [
            _compared("gate, 7 s, CSV", SAMPLES / "stiff" / "03.csv", "pandas"),
            _compared("table, CSV", small, "pandas"),
            _compared("ROS 2, MCAP", mcap, "rosbags"),
        ]
        with Reader("cdtool") as reader:
            _, before, _ = reader.read(SAMPLES / "stiff" / "03.csv")
            _, peak, sums = reader.read(large)
    of_columns = 8 * rows * len(sums) / 2**20
    print(
        f"table of {megabytes:g} MB: peak memory {peak:.0f} MiB, before {before:.0f}, its columns {of_columns:.0f} MiB"
    )
    more = Spread.of([(peak - before) / of_columns])
    held.append(verdict("growth of the peak memory / columns", more, MEMORY_AT_MOST, at_most=True))
    return all(held)


def write_table(path: Path, megabytes: float) -> int:
    """Write a table of about that size: about 9 MB of rows, repeated; return its rows."""
    rng, rows = np.random.default_rng(648), 200_000
    columns = [np.arange(rows) * 0.5, *(rng.normal(0.0, scale, rows) for scale in (30.0, 2.0, 100.0, 5.0))]
    row = "%.3f,%.6f,%.6f,%.6f,%.4f\n"
    body = (row * rows % tuple(np.column_stack(columns).ravel().tolist())).encode()
    times = max(1, round(1e6 * megabytes / len(body)))
    with path.open("wb") as file:
        file.write(b"t,torque,speed,position,force\n")
        for _ in range(times):
            file.write(body)
    return times * rows


def _compared(log: str, path: Path, peer: str) -> bool:
    with Reader("cdtool") as ours, Reader(peer) as theirs:
        seconds: dict[str, list[float]] = {"cdtool": [], peer: []}
        for number in range(-1, ROUNDS):
            sums = []
            for name, reader in ((("cdtool", ours), (peer, theirs)))[:: 1 if number % 2 else -1]:
                took, _, of_columns = reader.read(path)
                sums.append(of_columns)
                if number >= 0:
                    seconds[name].append(took)
            ours_sums, peer_sums = sums
            if len(ours_sums) != len(peer_sums) or not np.allclose(ours_sums, peer_sums, rtol=1e-12):
                sys.exit(f"error: {log}: {peer} reads other numbers than cdtool")
    held = verdict(
        f"{log}: cdtool / {peer}, CPU time", ratio(seconds["cdtool"], seconds[peer]), AT_MOST[log], at_most=True
    )
    table(("reader", "CPU s (low-high)"), [(name, Spread.of(each)) for name, each in seconds.items()])
    print(flush=True)
    return held


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of the MCAP log")
    parser.add_argument("--megabytes", type=float, default=LARGE_TABLE_MB, help="of the large table")
    given = parser.parse_args()
    main("what a user waits for", partial(measure, given.seconds, given.megabytes))
