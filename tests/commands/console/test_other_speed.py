"""A log at a speed that was not learned: every command names the measured and the learned speeds."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.command import cdtool
from tests.commands.console.damaged_copies import damaged

MEASURED = re.compile(r"measured forward at ([\d.]+) m/s, learned forward at 0\.20\d* m/s")


@pytest.fixture
def at_speed(gate_folder: Path, tmp_path: Path):
    """at_speed(factor, rows): an impact-free log with its speed multiplied by a factor in these rows."""
    log = gate_folder / "holdout" / "01.csv"
    head, *lines = log.read_text(encoding="utf-8").splitlines()
    names, columns = head.split(","), list(zip(*(line.split(",") for line in lines), strict=True))

    def make(factor: float, rows: range) -> Path:
        cells = {
            (name, row): f"{factor * float(columns[names.index(name)][row]):.3f}"
            for name in ("n_motor", "n_ref")
            for row in rows
        }
        return damaged(log, tmp_path / "other.csv", cells)

    return make


def test_not_assessable_names_the_speed_measured_and_the_classes_learned(at_speed, gate_folder, feekf_signature):
    log = at_speed(1.4, range(8200))
    machine = ("-m", gate_folder / "machine.toml", "--signature", feekf_signature)
    (row,) = json.loads(cdtool("detect", log, *machine, "--json").out)
    assert row["verdict"] == "not_assessable" and row["reason"].startswith("other speed ")
    found = MEASURED.search(row["reason"])
    assert found and float(found[1]) == pytest.approx(0.28, abs=0.005)
    for command in ("detect", "explain"):
        done = cdtool(command, log, *machine)
        assert done.status == 3 and MEASURED.search(done.err) and MEASURED.search(" ".join(done.out.split()))


@pytest.mark.parametrize("verdict", ["alarm", "no alarm"])
def test_a_partly_matching_speed_is_named_with_and_without_an_alarm(at_speed, gate_folder, tmp_path, verdict):
    log = at_speed(0.5, range(4000, 6000))
    signature = tmp_path / "pi.json"
    free = sorted((gate_folder / "free").glob("*.csv"))
    factor = f"--set=signature.safety_factor={0.5 if verdict == 'alarm' else 50}"
    machine = ("-m", gate_folder / "machine.toml")
    done = cdtool("learn-signature", *free, *machine, "-d", "pi", factor, "-o", signature)
    assert done.status == 0, done.err
    (row,) = json.loads(cdtool("detect", log, *machine, "--signature", signature, "--json").out)
    assert row["verdict"] == verdict and 0.0 < row["not_judged"]["other speed"] < 0.5
    found = MEASURED.fullmatch(row["other_speed"])
    assert found and float(found[1]) == pytest.approx(0.1, abs=0.002)
    for command in ("detect", "explain"):
        shown = " ".join(cdtool(command, log, *machine, "--signature", signature).out.split())
        assert MEASURED.search(shown)


def test_a_log_at_the_learned_speed_causes_no_note_on_speeds(gate_folder, feekf_signature):
    machine = ("-m", gate_folder / "machine.toml", "--signature", feekf_signature)
    done = cdtool("detect", gate_folder / "stiff" / "01.csv", *machine, "--json")
    assert json.loads(done.out)[0]["other_speed"] is None


def test_sections_not_assessable_are_counted_beyond_those_shown(gate_folder, tmp_path, feekf_signature):
    cells = {("i_motor", row + i): "nan" for row in range(2000, 7000, 500) for i in range(60)}
    log = damaged(gate_folder / "holdout" / "01.csv", tmp_path / "holes.csv", cells)
    machine = ("-m", gate_folder / "machine.toml", "--signature", feekf_signature)
    (row,) = json.loads(cdtool("detect", log, *machine, "--json").out)
    sections = len(row["stretches_not_judged"])
    assert sections > 4
    shown = " ".join(cdtool("detect", log, *machine).out.split())
    assert f"and {sections - 3} shorter sections (--json has all)" in shown
