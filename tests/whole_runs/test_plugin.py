"""A detector and a threshold of another, installed package, in every command."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cdtool.detectors import DETECTORS
from tests.command_server import CommandServer, Ended, command_server

ROOT = Path(__file__).parents[2]
GATE = ROOT / "sample_logs" / "gate"
CONTRACTS = "torque_rate or robust_limit"
MAIN = "from cdtool.commands.app import main; main()"

Command = Callable[..., Ended]


def python(*arguments: object, site: Path, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Run another interpreter that finds the packages in `site`."""
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{site}", "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, text=True, env=environment, cwd=folder, check=False
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder in which pip has installed the example package."""
    folder = tmp_path_factory.mktemp("plugin")
    shutil.copytree(ROOT / "tests" / "plugin_example", folder / "source")
    install = ("install", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-index", "--no-build-isolation")
    done = python("-m", "pip", *install, "--target", folder / "site", folder / "source", site=folder, folder=folder)
    assert done.returncode == 0, done.stderr
    return folder / "site"


@pytest.fixture(scope="module")
def server(site: Path) -> Iterator[CommandServer]:
    """Another interpreter that finds the example package."""
    found = {"PYTHONPATH": f"{ROOT}{os.pathsep}{site}", "PYTHONDONTWRITEBYTECODE": "1"}
    with command_server(environment=found) as running:
        log = (GATE / "free" / "03.csv", "-m", GATE / "machine.toml")
        running.warm_up("info", *log)
        running.warm_up("detect", *log, "-d", "gm", "--set=threshold.limits=1e6")
        running.warm_up("benchmark", GATE / "benchmark.toml", "--detectors", "gm", "--json")
        yield running


@pytest.fixture
def command(server: CommandServer, tmp_path: Path) -> Command:
    """Run `cdtool ARGUMENTS` with the example package, in a new folder."""
    return lambda *arguments: server.run(*arguments, folder=tmp_path)


def machine_with(folder: Path, more: str) -> Path:
    path = folder / "machine.toml"
    path.write_text((GATE / "machine.toml").read_text(encoding="utf-8") + more, encoding="utf-8")
    return path


def test_list_shows_the_plugins_with_gains_units_and_defaults(command):
    entries = {entry["name"]: entry for entry in json.loads(command("list", "detectors", "--json").out)}
    assert list(entries) == [*DETECTORS.names(), "torque_rate"]
    assert entries["torque_rate"]["short_name"] == "tr" and entries["torque_rate"]["needs"] == ["torque"]
    (gain,) = entries["torque_rate"]["gains"]
    assert (gain["name"], gain["default"], gain["unit"]) == ("cutoff", 2.0, "Hz")
    shown = command("list", "detectors")
    assert shown.status == 0 and "torque_rate (tr): Torque rate; needs torque" in shown.out
    assert "robust_limit" in command("list", "thresholds").out


def test_its_signature_is_learned_used_explained_and_refused_for_other_gains(command, tmp_path):
    machine = ("--machine", GATE / "machine.toml")
    free = sorted(GATE.glob("free/*.csv"))
    learned = command("learn-signature", *free, *machine, "-d", "tr", "-o", "tr.json", "--set=signature.force=true")
    assert learned.status == 0, learned.err
    assert json.loads((tmp_path / "tr.json").read_text(encoding="utf-8"))["detector"]["name"] == "torque_rate"
    log = GATE / "stiff" / "03.csv"
    (found,) = json.loads(command("detect", log, *machine, "-s", "tr.json", "--json").out)
    assert (found["detector"], found["unit"], found["verdict"]) == ("torque_rate", "N/s", "alarm")
    assert 50.0 < found["contacts"][0]["latency_ms"] < 250.0
    explained = command("explain", log, *machine, "-s", "tr.json")
    assert explained.status == 0 and "First input of torque_rate: torque" in explained.out
    other = machine_with(tmp_path, "\n[detectors.tr]\ncutoff = 3.0\n")
    refused = command("detect", log, "-m", other, "-s", "tr.json")
    assert refused.status == 2 and "learned with cutoff = 2.0" in refused.err
    without = python("-c", MAIN, "detect", log, *machine, "-s", tmp_path / "tr.json", site=tmp_path)
    assert without.returncode == 2 and "unknown detector 'torque_rate'" in without.stderr


def test_its_gains_can_be_set_in_the_machine_file_under_either_name(command, tmp_path):
    log = GATE / "stiff" / "03.csv"
    alarms = []
    for name in ("tr", "torque_rate"):
        machine = machine_with(tmp_path, f"\n[detectors.{name}]\ncutoff = 5.0\n")
        assert command("info", log, "-m", machine).status == 0
        (found,) = json.loads(
            command("detect", log, "-m", machine, "-d", "tr", "--set=threshold.limits=400", "--json").out
        )
        alarms.append(found["alarms"])
    machine = GATE / "machine.toml"
    (plain,) = json.loads(command("detect", log, "-m", machine, "-d", "tr", "--set=threshold.limits=400", "--json").out)
    assert alarms[0] == alarms[1] != plain["alarms"]
    for more, words in (
        ("[detectors.tr]\ncut = 5.0\n", "detectors.tr.cut: unknown key (did you mean cutoff?"),
        ("[detectors.tr]\ncutoff = -1\n", "detectors.tr.cutoff: is -1"),
        ("[detectors.tr]\n[detectors.torque_rate]\n", "torque_rate: repeats torque_rate"),
    ):
        wrong = command(
            "detect", log, "-m", machine_with(tmp_path, "\n" + more), "-d", "tr", "--set=threshold.limits=4"
        )
        assert wrong.status == 2 and words in wrong.err and wrong.err.count("\n") == 1, wrong.err


def test_a_benchmark_runs_both_and_its_reports_name_the_package(command, tmp_path):
    text = f'machine = "{GATE}/machine.toml"\ndetectors = ["torque_rate", "gm"]\nthreshold = "robust_limit"\n'
    text += f'[learn]\nlogs = ["{GATE}/free/*.csv"]\n[impacts.stiff]\nlogs = ["{GATE}/stiff/*.csv"]\n'
    text += '[limits]\n"tr.stiff.contacts" = { min = 2 }\n'
    (tmp_path / "benchmark.toml").write_text(text, encoding="utf-8")
    done = command("benchmark", "benchmark.toml", "-o", "results.json", "-o", "summary.md", "-o", "report.html")
    assert done.status == 0 and "the limit is met" in done.out, done.out + done.err
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert results["detectors"] == ["torque_rate", "momentum"]
    provenance = results["provenance"]
    assert provenance["threshold"] == "robust_limit"
    assert provenance["plugins"] == {"cdtool-plugin-example": "0.1.0"}
    assert provenance["gains"]["torque_rate"] == {"cutoff": 2.0} and provenance["units"]["torque_rate"] == "N/s"
    for report in ("summary.md", "report.html"):
        assert "cdtool-plugin-example" in (tmp_path / report).read_text(encoding="utf-8"), report


def test_the_examples_in_its_docstrings_run(site):
    modules = [site / "cdtool_plugin_example" / f"{name}.py" for name in ("torque_rate", "robust_limit")]
    done = python("-m", "doctest", "-v", *modules, site=site)
    assert done.returncode == 0, done.stdout[-3000:]
    assert done.stdout.count("Test passed.") == 2


def test_the_page_shows_the_entry_points_of_the_package_and_its_commands_run(command, tmp_path):
    page = (ROOT / "docs" / "own-detector.md").read_text(encoding="utf-8")
    example = ROOT / "tests" / "plugin_example"
    shown = set(re.findall(r"^```\w+\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    assert (example / "pyproject.toml").read_text(encoding="utf-8") in shown
    (tmp_path / "sample_logs").symlink_to(ROOT / "sample_logs")
    blocks = re.findall(r"^```bash\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    lines = [shlex.split(line) for block in blocks for line in block.splitlines()]
    assert lines[0] == ["pip", "install", "tests/plugin_example"]
    assert lines[-1][:4] == ["python", "-m", "pytest", "tests/contracts"] and lines[-1][-1] == CONTRACTS
    for words in lines[1:-1]:
        assert words[0] == "cdtool"
        logs = sorted(GATE.glob("free/*"))
        done = command(*(name for word in words[1:] for name in (logs if word.endswith("free/*") else [word])))
        assert done.status == 0, (words, done.err)
