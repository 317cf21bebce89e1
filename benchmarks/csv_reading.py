"""A CSV of 648 MB, 5 columns: cdtool's reader, including detection and checks, compared with pandas.read_csv.

Each reading runs in a separate process, alternating: wall-clock and CPU seconds are those of the reading, the peak
memory is that of the whole process. Every column is compared bit for bit.

python benchmarks/csv_reading.py [megabytes]
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from timing import Spread, main, ratio, table, verdict

MEGABYTES = 648
ROUNDS = 5
AT_LEAST = 0.75
AT_MOST_CPU = 1.3
AT_MOST_MEMORY = 1.0
COLUMNS = {"t": "%.3f", "torque": "%.6f", "speed": "%.6f", "position": "%.6f", "force": "%.4f"}

_READING = """
import hashlib, json, resource, sys, time
from pathlib import Path
path, small = Path(sys.argv[1]), Path(sys.argv[2])
{prepare}
def read(path):
    {read}
read(small)
begin, cpu_begin = time.perf_counter(), time.process_time()
columns = read(path)
seconds, cpu_seconds = time.perf_counter() - begin, time.process_time() - cpu_begin
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
digests = [hashlib.sha256(column).hexdigest() for column in columns] if len(sys.argv) > 3 else []
print(json.dumps([seconds, cpu_seconds, peak / (1024.0 if sys.platform != "darwin" else 1024.0**2), digests]))
"""
READERS = {
    "pandas.read_csv": _READING.format(
        prepare="import pandas as pd",
        read="frame = pd.read_csv(path, usecols=['t', 'torque', 'speed', 'position', 'force']); "
        "return [frame[name].to_numpy() for name in frame]",
    ),
    "cdtool": _READING.format(
        prepare="from cdtool.formats.csv import Csv",
        read="return [column.values for column in Csv().columns(path).columns.values()]",
    ),
}


def measure() -> bool:
    size = int(sys.argv[1]) if len(sys.argv) > 1 else MEGABYTES
    with tempfile.TemporaryDirectory() as folder:
        log, small = Path(folder) / "log.csv", Path(folder) / "small.csv"
        rows = _write(log, size * 1_000_000)
        _write(small, 100_000)
        digests = {name: _run(code, log, small, "digests")[-1] for name, code in READERS.items()}
        if len({json.dumps(item) for item in digests.values()}) > 1:
            sys.exit("error: the two readers do not give the same bits")
        seconds: dict[str, list[float]] = {name: [] for name in READERS}
        cpu: dict[str, list[float]] = {name: [] for name in READERS}
        memory: dict[str, list[float]] = {name: [] for name in READERS}
        for turn in range(ROUNDS):
            for name in sorted(READERS, reverse=turn % 2 == 1):
                took, cpu_took, peak, _ = _run(READERS[name], log, small)
                seconds[name].append(took)
                cpu[name].append(cpu_took)
                memory[name].append(peak)
    speed = ratio(seconds["pandas.read_csv"], seconds["cdtool"])
    cpu_time = ratio(cpu["cdtool"], cpu["pandas.read_csv"])
    peaks = ratio(memory["cdtool"], memory["pandas.read_csv"])
    fast = verdict("cdtool / bare pandas.read_csv, MB/s", speed, AT_LEAST)
    cheap = verdict("cdtool / bare pandas.read_csv, CPU time", cpu_time, AT_MOST_CPU, at_most=True)
    small_enough = verdict("cdtool / bare pandas.read_csv, peak memory", peaks, AT_MOST_MEMORY, at_most=True)
    print()
    shown = [
        (
            name,
            f"{size / Spread.of(seconds[name]).median:.0f}",
            f"{size / Spread.of(cpu[name]).median:.0f}",
            f"{Spread.of(memory[name]).median:.0f}",
        )
        for name in READERS
    ]
    table(("reader", "MB/s", "MB per CPU second", "peak MB"), shown)
    print(f"{size} MB, {rows} rows of {len(COLUMNS)} columns, all read; the same bits from both.")
    print(f"pandas {version('pandas')}")
    return fast and cheap and small_enough


def _run(code: str, *arguments: object) -> tuple[float, float, float, list[str]]:
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"error: {done.stderr.strip().splitlines()[-1]}")
    seconds, cpu_seconds, peak, digests = json.loads(done.stdout)
    return seconds, cpu_seconds, peak, digests


def _write(path: Path, size: int) -> int:
    """Write a table of about `size` bytes: about 9 MB of rows, repeated."""
    rng = np.random.default_rng(648)
    count = max(1000, min(200_000, size // 45))
    values = [np.arange(count) * 0.5, *(rng.normal(0.0, scale, count) for scale in (30.0, 2.0, 100.0, 5.0))]
    row = ",".join(COLUMNS.values()) + "\n"
    body = (row * count % tuple(np.column_stack(values).ravel().tolist())).encode()
    times = max(1, round(size / len(body)))
    with path.open("wb") as file:
        file.write((",".join(COLUMNS) + "\n").encode())
        for _ in range(times):
            file.write(body)
    return count * times


if __name__ == "__main__":
    measuring: Callable[[], bool] = measure
    main("CSV of 648 MB against a bare pandas.read_csv", measuring)
