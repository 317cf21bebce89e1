"""A detector with a missing channel is not assessable and does not stop others; if none can run, it is an error."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from tests.command import cdtool


@pytest.fixture
def folder(gate_folder: Path, tmp_path: Path) -> Path:
    """3 logs to learn from, a hold-out, an impact; the machine file maps no accelerometer."""
    for name in ("free/01.csv", "free/02.csv", "free/03.csv", "holdout/01.csv", "stiff/01.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copyfile(gate_folder / name, tmp_path / name)
    lines = (gate_folder / "machine.toml").read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line.startswith("acceleration")]
    (tmp_path / "machine.toml").write_text("\n".join(kept) + "\n", encoding="utf-8")
    return tmp_path


def benchmark(folder: Path, detectors: str, *more: object, limits: str = ""):
    (folder / "benchmark.toml").write_text(
        f'machine = "machine.toml"\ndetectors = {detectors}\n[signature]\nforce = true\n'
        f'[learn]\nlogs = ["free/*.csv"]\n'
        f'[holdout]\nlogs = ["holdout/*.csv"]\n[impacts.stiff]\nlogs = ["stiff/*.csv"]\n{limits}',
        encoding="utf-8",
    )
    return cdtool("benchmark", folder / "benchmark.toml", *more)


def test_other_detectors_run_and_its_contacts_are_not_assessable(folder):
    done = benchmark(folder, '["gm", "pi"]', "-o", folder / "r.json", "-o", folder / "r.md", "-o", folder / "r.html")
    assert done.status == 3
    why = "pure_inertia needs the channel 'acceleration'"
    assert f"left out: pure_inertia: not assessable: free/01.csv: {why}" in done.err
    results = json.loads((folder / "r.json").read_text(encoding="utf-8"))
    rows = {item["detector"]: item for item in results["contacts"]}
    assert rows["momentum"]["outcome"] == "detected"
    assert rows["pure_inertia"]["outcome"] == "not_assessable" and why in rows["pure_inertia"]["reason"]
    watched = {
        (item["group"], item["detector"]): (item["hours"], item["not_assessable"]) for item in results["exposure"]
    }
    assert watched["holdout", "pure_inertia"] == (0.0, 1) and watched["holdout", "momentum"][0] > 0.0
    assert re.search(r"stiff +pure_inertia +- +- +- +1 of 1 +-", done.out)
    assert "1 not assessable" in (folder / "r.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("channel", "renamed", "named"),
    [
        (
            "force",
            'column = "cell"',
            "stiff/01.csv: no ground truth: force: is not in this log: no column 'cell'",
        ),
        ("speed", 'column = "rpm"', "free/01.csv: no column 'rpm' (channel 'speed')"),
    ],
)
def test_a_dry_run_names_the_column_that_a_log_does_not_have(folder, channel, renamed, named):
    assert benchmark(folder, '["gm"]', "--dry-run").status == 0
    text = (folder / "machine.toml").read_text(encoding="utf-8")
    wrong = re.sub(rf'^({channel} = \{{ )column = "\w+"', rf"\g<1>{renamed}", text, count=1, flags=re.MULTILINE)
    (folder / "machine.toml").write_text(wrong, encoding="utf-8")
    done = benchmark(folder, '["gm"]', "--dry-run")
    assert done.status == 3
    assert f"left out: {named}" in done.err
    assert "nothing was computed" in done.out
    assert benchmark(folder, '["gm"]', "--dry-run", "--json").status == 3


def test_a_limit_on_it_is_not_met(folder):
    limit = '[limits]\n"pi.stiff.missed" = { max = 0 }\n"gm.stiff.missed" = { max = 0 }\n'
    done = benchmark(folder, '["gm", "pi"]', limits=limit)
    assert (
        done.status == 1
        and "limit not assessable: pure_inertia.stiff.missed" in done.out
        and "1 of 2 limits not met" in done.out
    )


def test_if_no_detector_can_run_the_error_says_which_to_remove(folder):
    done = benchmark(folder, '["pi", "igm"]')
    assert done.status == 2 and done.err.count("\n") == 1
    assert "needs the channel 'acceleration'" in done.err
    assert "remove pure_inertia, inertial_momentum from `detectors`" in done.err


def test_if_no_log_can_be_read_the_detectors_are_not_blamed(folder):
    for path in (folder / "free").iterdir():
        path.write_text("", encoding="utf-8")
    done = benchmark(folder, '["gm", "pi"]')
    assert done.status == 2 and "is empty" in done.err and "take" not in done.err
