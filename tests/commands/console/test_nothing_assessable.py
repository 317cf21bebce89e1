"""Logs without an assessable contact (other speed, several strokes in one operation) are reported by all commands."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from tests.command import cdtool, keys

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


def test_strokes_at_creep_speed_are_a_note_where_faster_ones_are_learned(tmp_path):
    """The friction EKF is not applicable to half of them, and the others are too few to learn from."""
    benchmark_of(tmp_path, rows_of("stiff/04.csv"))
    logs = [tmp_path / f"{number}.csv" for number in range(10)]
    for number, log in enumerate(logs):
        rows = rows_of(f"free/{number % 8 + 3:02}.csv")
        speed = 100.0 if number % 2 else 400.0
        rows += [[0.0, 1.0 + 1e-3 * number, speed * (2000 < k < 5000), 0.0, 0.0, 0.0] for k in range(6000)]
        angle = np.cumsum([row[2] for row in rows]) * 0.10472e-3
        lines = [",".join(f"{v:.9g}" for v in (k, *rows[k][1:3], angle[k], rows[k][4], 0.0)) for k in range(len(rows))]
        log.write_text("\n".join([",".join(COLUMNS), *lines]) + "\n", encoding="utf-8")
    options = ("-m", tmp_path / "machine.toml", "-d", "feekf", "--set=operations=motion")
    learned = cdtool("learn-signature", *logs, *options, "-o", tmp_path / "signature.json")
    assert learned.status == 0
    told = "friction_ekf: 5 strokes at creep speed not learned, and not assessed: runs forward at"
    assert learned.err.count(told) == 2
