"""The pipeline files in docs/examples: they parse, request few permissions, and work as documented."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from cdtool.base.settings import Place
from cdtool.results.limits import Bounds, limit_rules
from cdtool.results.summary import FIGURES

yaml = pytest.importorskip("yaml")

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "examples"
PAGE = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")


def parsed(name: str) -> dict[Any, Any]:
    values = yaml.safe_load((EXAMPLES / name).read_text(encoding="utf-8"))
    assert isinstance(values, dict)
    return values


def github_job() -> dict[str, Any]:
    (job,) = parsed("github-actions.yml")["jobs"].values()
    return dict(job)


def github_step(words: str) -> str:
    """Return the shell lines of the only step that contains these words."""
    (found,) = [step["run"] for step in github_job()["steps"] if words in step.get("run", "")]
    return str(found)


class Shell:
    """Run lines like a runner: bash that stops at the first failure, in a checkout with sample logs."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "sample_logs").symlink_to(ROOT / "sample_logs")
        programs = folder / "programs"
        programs.mkdir()
        program = programs / "cdtool"
        program.write_text(f"#!{sys.executable}\nfrom cdtool.commands.app import main\nmain()\n", encoding="utf-8")
        program.chmod(0o755)
        self.environment = {
            **os.environ,
            "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT),
            "GITHUB_STEP_SUMMARY": str(folder / "step_summary.md"),
            "BENCHMARK": str(github_job()["env"]["BENCHMARK"]),
        }

    def __call__(self, lines: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["bash", "-e", "-c", lines],
            capture_output=True,
            text=True,
            cwd=self.folder,
            env=self.environment,
            check=False,
        )

    def names(self, folder: str) -> set[str]:
        return {path.name for path in (self.folder / folder).iterdir()}


@pytest.fixture
def shell(tmp_path: Path) -> Shell:
    if shutil.which("bash") is None:
        pytest.skip("bash is not installed")
    return Shell(tmp_path)


REPORTS = {"junit.xml", "summary.md", "report.html", "results.json", "results.traces.json.gz"}


def test_the_steps_of_github_make_every_report_compare_and_show_the_summary(shell):
    compare, show = github_step("cdtool compare"), github_step("GITHUB_STEP_SUMMARY")
    done = shell(github_step("cdtool benchmark"))
    assert done.returncode == 0, done.stderr
    assert shell.names("out") == REPORTS
    assert shell(compare).returncode == 0 and shell.names("out") == REPORTS  # the first run has no results of main
    (shell.folder / "baseline").mkdir()
    shutil.copy(shell.folder / "out" / "results.json", shell.folder / "baseline")
    done = shell(compare)
    assert done.returncode == 0 and "no change shown" in done.stdout, done.stderr
    assert shell(show).returncode == 0
    shown = (shell.folder / "step_summary.md").read_text(encoding="utf-8")
    parts = [(shell.folder / "out" / name).read_text(encoding="utf-8") for name in ("summary.md", "compare.md")]
    assert shown == "".join(parts)


def test_a_violated_limit_fails_the_job_and_the_reports_exist(shell):
    gate = shell.folder / "sample_logs" / "gate"
    text = f'machine = "{gate}/machine.toml"\ndetectors = ["pi"]\n[learn]\nlogs = ["{gate}/free/*"]\n'
    text += f'[impacts.stiff]\nlogs = ["{gate}/stiff/03.csv"]\n[limits]\n"pi.stiff.max_ms" = {{ max = 20 }}\n'
    (shell.folder / "broken.toml").write_text(text, encoding="utf-8")
    shell.environment["BENCHMARK"] = "broken.toml"
    done = shell(github_step("cdtool benchmark"))
    assert done.returncode == 1 and "limit violated: pure_inertia.stiff.max_ms" in done.stdout
    assert shell.names("out") == REPORTS
    assert ElementTree.parse(shell.folder / "out" / "junit.xml").findall(".//failure")
    assert shell(github_step("GITHUB_STEP_SUMMARY")).returncode == 0


def test_a_benchmark_that_cannot_run_fails_the_job_and_later_steps_continue(shell):
    shell.environment["BENCHMARK"] = "none.toml"
    assert shell(github_step("cdtool benchmark")).returncode == 2
    assert shell(github_step("cdtool compare")).returncode == shell(github_step("GITHUB_STEP_SUMMARY")).returncode == 0


def test_the_page_names_every_quantity_and_its_limits_are_valid():
    section = PAGE.partition("\n## Limits\n")[2].partition("\n## ")[0]
    table = [line for line in section.splitlines() if line.startswith("| `")]
    assert set(re.findall(r"`(\w+)`", "".join(line.split("|")[1] for line in table))) == set(FIGURES)
    (block,) = re.findall(r"```toml\n(.*?)```", section, re.DOTALL)
    limits = {key: Bounds(**value) for key, value in tomllib.loads(block)["limits"].items()}
    place = Place("ci.md", "limits.")
    known = [("friction_ekf", "feekf"), ("momentum", "gm")]
    assert len(limit_rules(limits, place, known, ("stiff", "soft"))) == len(block.strip().splitlines()) - 1
