"""Do hostile and large inputs take less time than promised?

The tests do the work and record the time (tests/noted_times.py), but have no time limits; this script runs the files of
these tests one by one, on an otherwise idle machine, and exits with status 1 if a bound is violated or a test fails.
Seconds are processor time, and in tests of archives that unpack to gigabytes wall-clock time.

python benchmarks/time_bounds.py
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.noted_times import FILE

ROOT = Path(__file__).resolve().parents[1]


def files_that_note() -> list[str]:
    """Return the test files that record times."""
    found = (path for path in sorted((ROOT / "tests").rglob("*.py")) if path.name.startswith("test_"))
    return [str(path.relative_to(ROOT)) for path in found if "tests.noted_times" in path.read_text(encoding="utf-8")]


def longest(noted: Iterable[dict[str, Any]]) -> list[tuple[str, float, float]]:
    """(test, seconds, bound) of each test's longest time by its bound."""
    found: dict[str, tuple[str, float, float]] = {}
    for item in noted:
        test, seconds, bound = item["test"], item["seconds"], item["bound"]
        if test not in found or seconds / bound > found[test][1] / found[test][2]:
            found[test] = (test, seconds, bound)
    return sorted(found.values(), key=lambda item: -item[1] / item[2])


def main() -> int:
    """Run the tests and print their times; return 1 if a bound is violated or a test fails."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "times.jsonl"
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", *files_that_note()]
        done = subprocess.run(command, cwd=ROOT, env=os.environ | {FILE: str(file)}, check=False)
        noted = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()] if file.exists() else []
    rows = longest(noted)
    for test, seconds, bound in rows:
        print(f"{'ok' if seconds < bound else 'FAIL':4s} {seconds:7.2f} s of {bound:4.1f} s  {test}")
    broken = [row for row in rows if row[1] >= row[2]]
    print(f"{len(rows) - len(broken)} of {len(rows)} within their bounds")
    return int(bool(broken) or not rows or done.returncode != 0)


if __name__ == "__main__":
    raise SystemExit(main())
