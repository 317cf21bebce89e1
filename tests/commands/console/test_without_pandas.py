"""A command that reads no log imports no pandas, which would double its start-up time."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from tests.fuzz.hostile_commands import make_bench

ROOT = Path(__file__).parents[3]
# Run commands and print, as JSON, the status of each and whether pandas was imported by then.
CHILD = """
import json, sys
from pathlib import Path
from tests.command import cdtool
folder = Path(sys.argv[1])
commands = [
    ("--help",),
    ("list", "detectors"),
    ("plan", "--difference-ms", "5", "--std-ms", "3"),
    ("protocol", "check", folder / "plan.toml"),
    ("signature", "show", folder / "gate.json"),
    ("report", folder / "results.json", "-o", folder / "again.html"),
    ("compare", folder / "results.json", folder / "other.json", "-o", folder / "compared.md"),
]
print(json.dumps([(" ".join(map(str, item[:2])), cdtool(*item).status, "pandas" in sys.modules) for item in commands]))
"""


def test_a_command_that_reads_no_log_imports_no_pandas(tmp_path):
    make_bench(tmp_path / "bench")
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path / "bench")], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    ran = json.loads(done.stdout.splitlines()[-1])
    assert not [name for name, _, imported in ran if imported]
    assert {name: status for name, status, _ in ran if status not in (0, 1, 3, 4)} == {}
