"""The lower bounds of pyproject.toml: each dependency has one, none is withdrawn, and CI installs exactly these."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / ".ci" / "lowest_versions.py"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def pins(*extras: str) -> dict[str, str]:
    done = subprocess.run([sys.executable, SCRIPT, *extras], capture_output=True, text=True, check=True)
    return dict(line.split("==") for line in done.stdout.splitlines())


def distribution(requirement: str) -> str:
    return re.match(r"[A-Za-z0-9-]+", requirement)[0]


def test_every_dependency_is_pinned_to_its_lower_bound():
    found = pins()
    assert len(found) == len(PROJECT["dependencies"])
    for text in PROJECT["dependencies"]:
        assert f">={found[distribution(text)]}" in text


def test_extras_and_the_extras_that_they_name_are_pinned_too():
    others = ("all", "test", "dev", "benchmarks", "s3test")
    named = [name for name in PROJECT["optional-dependencies"] if name not in others]
    of_extras = {distribution(text) for name in named for text in PROJECT["optional-dependencies"][name]}
    assert set(pins("all")) == {distribution(text) for text in PROJECT["dependencies"]} | of_extras


def test_no_lower_bound_is_a_withdrawn_or_failing_version():
    assert tuple(map(int, pins()["typer"].split("."))) >= (0, 19)


def test_every_dependency_is_imported():
    names = {"mcap-ros2-support": "mcap_ros2"}
    text = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "cdtool").rglob("*.py"))
    unused = [
        name for name in pins() if not re.search(rf"^\s*(?:from|import) {names.get(name, name)}\b", text, re.MULTILINE)
    ]
    assert not unused


def test_ci_installs_the_lower_bounds_and_runs_the_main_job():
    run = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert ".ci/lowest_versions.sh" in run
    job = (ROOT / ".ci" / "lowest_versions.sh").read_text(encoding="utf-8")
    for part in ("lowest_versions.py", "python3.11", "--help", "learn-signature", "detect", "benchmark"):
        assert part in job
    assert "://" not in job  # the source of packages is configured on the machine
