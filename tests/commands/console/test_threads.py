"""A command starts no threads of linear algebra: NumPy would start one per core as it is imported."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

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
