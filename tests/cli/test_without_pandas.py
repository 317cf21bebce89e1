"""No command imports pandas, which would double the start-up time of each command.

Reading Parquet and Feather is excluded: pyarrow imports it there.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from cdtool.cli.app import COMMANDS

ROOT = Path(__file__).parents[2]
# Run every command and print, as JSON, its status and whether pandas was imported by then.
CHILD = """
import json, sys
from pathlib import Path
from tests.command import cdtool
from tests.fuzz.hostile_commands import make_bench
folder = Path(sys.argv[1])
make_bench(folder)
log, machine, signature = folder / "stiff" / "01.csv", folder / "machine.toml", folder / "gate.json"
commands = [
    ("--help",), ("list", "detectors"), ("info", log), ("info", log, "-m", machine), ("info", folder / "log.mat"),
    ("init", log, "-o", folder / "drafted.toml"),
    ("learn-signature", *sorted(folder.glob("free/*.csv")), "-m", machine, "-d", "feekf", "--force",
     "-o", folder / "feekf.json"),
    ("detect", log, "-m", machine, "-s", signature, "--plot", folder / "a.png"),
    ("explain", log, "-m", machine, "-s", signature, "--plot", folder / "b.svg"),
    ("benchmark", folder / "benchmark.toml", "-o", folder / "report.md", "--store", folder / "store"),
    ("benchmark", folder / "benchmark.toml", "--store", folder / "store", "--trust-mtime"),
    ("protocol", "init", folder / "benchmark.toml", "-o", folder / "protocol.toml"),
    ("protocol", "check", folder / "protocol.toml"),
    ("protocol", "write", folder / "protocol.toml", "-o", folder / "p.html"),
    ("benchmark", folder / "benchmark.toml", "-p", folder / "protocol.toml", "-o", folder / "protocol.html"),
    ("store", "status", folder / "store"),
    ("store", "gc", folder / "store"),
    ("report", folder / "results.json", "-o", folder / "again.html"),
    ("score", folder / "triggers.csv", "-b", folder / "benchmark.toml"),
    ("compare", folder / "results.json", folder / "other.json", "-o", folder / "compared.md"),
    ("plan", "--difference-ms", "5", "--std-ms", "3"),
    *(("convert", log, folder / f"to{suffix}") for suffix in (".csv", ".mcap", ".parquet", ".feather", ".h5", ".tdms")),
    *(("info", folder / f"to{suffix}") for suffix in (".mcap", ".h5", ".tdms")),
    ("recover", folder / "log.mcap", "-o", folder / "recovered.mcap"),
    ("signature", "show", signature),
    ("signature", "check", signature, *sorted(folder.glob("free/*.csv")), "-m", machine),
    ("signature", "update", signature, folder / "holdout" / "01.csv", "-m", machine),
    ("simulate", "arm", "--free", "1", "--holdout", "0", "--stiff", "0", "--soft", "0", "-o", folder / "arm"),
    ("study", "sensors", "-m", machine),
    ("identify", *sorted(folder.glob("free/*.csv")), "-m", machine, "-o", folder / "identified.toml"),
    ("inject", folder / "inject.toml", "-o", folder / "crash_tests"),
    ("coverage", folder / "inject.toml", "-o", folder / "coverage.png"),
    ("tune", folder / "benchmark.toml", "--false-alarm-budget", "1/2op", "--thresholds", "limit", "-o", folder / "t"),
]
print(json.dumps([(" ".join(map(str, item[:2])), cdtool(*item).status, "pandas" in sys.modules) for item in commands]))
"""


def test_no_command_imports_pandas(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path / "bench")], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    ran = json.loads(done.stdout.splitlines()[-1])
    assert not [name for name, _, imported in ran if imported]
    assert {name for name, status, _ in ran if status not in (0, 1, 3, 4)} == set()
    assert set(COMMANDS) <= {name.split()[0] for name, _, _ in ran}  # add a new command to the list above
