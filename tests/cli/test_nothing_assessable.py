"""Logs without an assessable contact (other speed, several strokes in one operation) are reported by all commands."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from tests.command import cdtool

SAMPLES = Path(__file__).parents[2] / "sample_logs" / "gate"
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
        told = 'not assessable: cut it with operations = "motion" in the benchmark file, or detect --operations motion'
        assert (told in done.err) == (not more)
        assert done.err.count("cut it with") <= 1
    assert ("1 not assessable" in scored.out) == (not more)
