"""Logs without an assessable contact (other speed, several strokes in one operation) are reported by all commands."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

from tests.command import cdtool, keys
from tests.commands.console.changed_logs import damaged

SAMPLES = Path(__file__).parents[3] / "sample_logs" / "gate"
COLUMNS = ["t", "i_motor", "n_motor", "phi", "acc_x", "load_cell"]
Rows = list[list[float]]


def rows_of(name: str) -> Rows:
    """Time [ms], current, speed [rpm], position [rad], acceleration and force of one sample log."""
    with (SAMPLES / name).open(encoding="utf-8") as stream:
        return [[float(row[column]) for column in COLUMNS] for row in csv.DictReader(stream)]


def benchmark_of(folder: Path, rows: Rows, more: str = "") -> tuple[Path, Path]:
    """Return a benchmark file with one impact log, without reference channels, and that log."""
    log = folder / "stiff" / "hit.csv"
    log.parent.mkdir()
    lines = [",".join(COLUMNS), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    log.write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = (SAMPLES / "machine.toml").read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith("reference_")]
    (folder / "machine.toml").write_text("\n".join(kept) + "\n", encoding="utf-8")
    file = folder / "benchmark.toml"
    file.write_text(
        f'machine = "machine.toml"\ndetectors = ["gm"]\n{more}[learn]\nlogs = ["{SAMPLES}/free/*.*"]\n'
        '[impacts.stiff]\nlogs = ["stiff/*.csv"]\n[onset]\nabove_n = 20.0\nback_to_n = 8.0\n',
        encoding="utf-8",
    )
    return file, log


def test_all_three_commands_exit_with_3_if_no_contact_is_assessable(tmp_path):
    """An additional false alarm does not change the result."""
    rows = [[1.3 * row[0], row[1], row[2] / 1.3, *row[3:]] for row in rows_of("stiff/04.csv")]
    file, log = benchmark_of(tmp_path, rows)
    scored = cdtool("benchmark", file)
    detected, explained = cdtool("detect", log, "-b", file), cdtool("explain", log, "-b", file)
    assert (scored.status, detected.status, explained.status) == (3, 3, 3)
    assert "nothing could be assessed" in scored.out
    for done in (detected, explained):
        assert "not assessable: stiff/hit.csv: " in done.err.replace(f"{tmp_path}/", "") and "other speed" in done.err


def two_strokes() -> Rows:
    """One run followed by four seconds of rest and an impact, with a continuous position."""
    rows, hit = rows_of("free/05.csv"), rows_of("stiff/03.csv")
    speed, place = rows[-1][2], rows[-1][3]
    for i in range(400):
        now = speed * (1.0 - i / 400.0)
        place += now * 0.10472e-3
        rows.append([0.0, 0.1, now, place, speed * 0.10472 * 0.001333 / 0.4 / 9.81, 0.0001])
    rows += [[0.0, *hit[i % 300][1:3], place, *hit[i % 300][4:]] for i in range(4000)]
    rows += [[*row[:3], row[3] + place, *row[4:]] for row in hit]
    return [[float(k), *row[1:]] for k, row in enumerate(rows)]


@pytest.mark.parametrize("more", ["", 'operations = "motion"\n'])
def test_an_uncut_log_of_two_strokes_gets_a_hint_how_to_cut_it(tmp_path, more):
    file, log = benchmark_of(tmp_path, two_strokes(), more)
    scored, detected = cdtool("benchmark", file), cdtool("detect", log, "-b", file)
    for done in (scored, detected):
        told = 'not assessable: cut it with operations = "motion"'
        assert (told in done.err) == (not more)
        assert done.err.count("cut it with") <= 1
    assert ("1 not assessable" in scored.out) == (not more)


@pytest.fixture(scope="module")
def rebounding(tmp_path_factory) -> Path:
    """Return the folder of a gate that rebounds after its impact, without reference channels."""
    folder = tmp_path_factory.mktemp("gate") / "gate"
    counts = keys(free=8, holdout=0, stiff=1, soft=0)
    assert cdtool("simulate", "gate", *counts, "--set", "reference=false", "-o", folder).status == 0
    text = (folder / "benchmark.toml").read_text(encoding="utf-8")
    text = re.sub("(?m)^detectors = .*", 'detectors = ["feekf", "pt"]', text)
    (folder / "benchmark.toml").write_text(text, encoding="utf-8")
    (folder / "cut.toml").write_text(f'operations = "motion"\n{text}', encoding="utf-8")
    return folder


def test_a_rebound_after_the_contact_is_no_warning(rebounding):
    scored = cdtool("benchmark", rebounding / "benchmark.toml")
    assert scored.status == 0 and "1 contact with 2 detectors: 2 detected" in scored.out
    assert "strokes in one operation" not in scored.err


def test_an_alarm_after_the_cut_at_a_rebound_is_scored_and_explained(rebounding):
    """The contact is in the first stroke, the alarm of pure torque in the second one."""
    scored = cdtool("benchmark", rebounding / "cut.toml")
    assert scored.status == 0 and "1 contact with 2 detectors: 2 detected" in scored.out
    explained = cdtool("explain", rebounding / "stiff" / "01.csv", "-b", rebounding / "cut.toml", "-d", "pt")
    assert explained.status == 0
    assert "of a contact in another operation" in explained.out and "false alarm at" not in explained.out


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
