"""What a command starts and imports: one thread, and no pandas where no log is read; both would double its start-up."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.hostile_commands import make_bench

THREADS = Path("/proc/self/task")
# Count the threads after a command that imports NumPy.
CHILD = """
import sys
from pathlib import Path
from tests.command import cdtool
assert "numpy" not in sys.modules
assert cdtool("list", "detectors").status == 0 and "numpy" in sys.modules
print(len(list(Path("/proc/self/task").iterdir())))
"""


def _threads(**environment: str) -> int:
    inherited = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", CHILD],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[3],
        env={**inherited, **environment},
    )
    return int(done.stdout)


@pytest.mark.skipif(not THREADS.is_dir(), reason="threads are counted as Linux lists them")
def test_a_command_runs_in_one_thread_unless_the_environment_says_otherwise():
    assert _threads() == 1
    if len(os.sched_getaffinity(0)) > 1:
        assert _threads(OPENBLAS_NUM_THREADS="2") == 2


ROOT = Path(__file__).parents[3]
# Run commands and print, as JSON, the status of each and whether pandas was imported by then.
READS_NO_LOG = """
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
        [sys.executable, "-c", READS_NO_LOG, str(tmp_path / "bench")],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    ran = json.loads(done.stdout.splitlines()[-1])
    assert not [name for name, _, imported in ran if imported]
    assert {name: status for name, status, _ in ran if status not in (0, 1, 3, 4)} == {}
