"""Files of earlier versions are read with a note on missing data, or refused with a hint how to migrate.

They were written by the commands of an earlier version, from the gate of `cdtool simulate`.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.command import cdtool

OLDER = Path(__file__).parent / "older_files"
SAID = "of an earlier version, without the speed profiles, plausible ranges and normal motions of its runs"


@pytest.fixture
def signature(tmp_path: Path) -> Path:
    return Path(shutil.copy(OLDER / "signature_version_3.json", tmp_path / "older.json"))


@pytest.mark.parametrize("command", ["detect", "detect --benchmark", "explain", "show", "check", "update"])
def test_every_command_reports_once_what_is_missing_from_an_older_signature_file(command, gate_folder, signature):
    machine, logs = ("-m", gate_folder / "machine.toml"), [gate_folder / "stiff" / f"0{i}.csv" for i in (1, 2)]
    new = gate_folder / "holdout" / "01.csv"
    arguments: tuple[object, ...] = {
        "detect": ("detect", *logs, *machine, "--signature", signature),
        "detect --benchmark": (
            *("detect", *logs, "--benchmark", gate_folder / "benchmark.toml"),
            *("--signature", signature),
        ),
        "explain": ("explain", logs[0], *machine, "--signature", signature),
        "show": ("signature", "show", signature),
        "check": ("signature", "check", signature, new, *machine),
        "update": ("signature", "update", signature, new, *machine),
    }[command]
    done = cdtool(*arguments)
    assert done.status == 0, done.err
    (line,) = [line for line in done.err.splitlines() if SAID in line]
    assert line.startswith(f"note: {signature}: ") and "relearn it with cdtool learn-signature" in line
    assert (done.out + done.err).count(SAID) == 1


def test_adding_runs_does_not_migrate_an_older_file(gate_folder, signature):
    machine = ("-m", gate_folder / "machine.toml")
    assert cdtool("signature", "update", signature, gate_folder / "holdout" / "01.csv", *machine).status == 0
    assert json.loads(signature.read_text(encoding="utf-8"))["schema_version"] == 5
    assert SAID in cdtool("signature", "show", signature).err


def test_a_file_of_this_version_causes_no_note_on_versions(gate_folder, feekf_signature):
    assert "version" not in cdtool("signature", "show", feekf_signature).err


def test_an_older_signature_raises_the_same_alarms_as_a_new_one(gate_folder, signature, tmp_path):
    machine, log = ("-m", gate_folder / "machine.toml"), gate_folder / "stiff" / "01.csv"
    free = sorted((gate_folder / "free").glob("*.csv"))
    steps = ("--set=signature.position_step=0.05", "--set=signature.position_window=0.1")
    new = tmp_path / "new.json"
    learned = cdtool("learn-signature", *free, *machine, "-d", "pi", *steps, "-o", new)
    assert learned.status == 0, learned.err
    times = [
        [
            alarm["time_s"]
            for alarm in json.loads(cdtool("detect", log, *machine, "--signature", file, "--json").out)[0]["alarms"]
        ]
        for file in (signature, new)
    ]
    assert times[0] and times[0] == pytest.approx(times[1], abs=0.003)


def test_results_of_version_4_are_read_and_compared_with_each_other(tmp_path):
    older = OLDER / "results_version_4.json"
    done = cdtool("report", older, "-o", tmp_path / "report.md")
    assert done.status == 0 and done.out.startswith("all 2 limits are met")
    assert cdtool("compare", older, older).status == 0


def test_results_of_an_older_version_are_refused_with_a_hint_to_run_the_benchmark(tmp_path):
    values = json.loads((OLDER / "results_version_4.json").read_text(encoding="utf-8"))
    (tmp_path / "first.json").write_text(json.dumps({**values, "schema_version": 3}), encoding="utf-8")
    done = cdtool("report", tmp_path / "first.json")
    assert done.status == 2 and done.err.count("\n") == 1
    assert "schema_version is 3; this version of cdtool reads 4 and 5" in done.err
    assert "run cdtool benchmark again" in done.err
