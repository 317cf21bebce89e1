"""Kills and failing calls at random points of every command that writes: the benchmark, reduced."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer.main

from cdtool.commands.app import app

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
# Names of parameters of commands for output files.
WRITTEN = {"output", "plot"}


def commands() -> set[str]:
    """Every command with a parameter for its output, and the one that changes the file it reads."""
    found = {"signature update"}
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        for subname, item in getattr(command, "commands", {"": command}).items():
            if WRITTEN & {parameter.name for parameter in item.params}:
                found.add(f"{name} {subname}".strip())
    return found


def test_every_command_that_writes_is_tried(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from writing_commands import cases

    tried = [" ".join(case.new[:2]) for case in cases(Path("inputs"))]
    missing = [name for name in commands() if not any(words == name or words.startswith(f"{name} ") for words in tried)]
    assert not missing and len(tried) >= len(commands())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills and failing calls need fork")
def test_kills_and_failing_calls_leave_old_or_new_files_and_nothing_else():
    """A few tries, all in one run: importing and preparing takes longer than the tries."""
    arguments = [sys.executable, str(BENCHMARKS / "kills_and_faults.py"), "--kills", "5", "--faults", "5"]
    package = {"PYTHONPATH": str(BENCHMARKS.parent)}
    done = subprocess.run(arguments, env=os.environ | package, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    if "skipped: " in done.stdout:
        pytest.skip(next(line for line in done.stdout.splitlines() if line.startswith("skipped: ")))
    rows = [line.split()[:7] for line in done.stdout.splitlines() if line.startswith(("kills ", "faults "))]
    assert rows == [["kills", "5", "5", *"0000"], ["faults", "5", "5", *"0000"]]
