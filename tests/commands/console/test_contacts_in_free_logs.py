"""An impact log among the impact-free ones is left out by name, unless a label file or a manual level accepts it."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cdtool as api
from cdtool.commands.judging.impact_free import contacts_shown
from cdtool.recordings.recording import Recording, Series
from cdtool.truth.onset import OnsetRule
from tests.command import FEW, cdtool

SHOWN = "the load cell shows a contact of "


@pytest.fixture(scope="module")
def mixed(gate_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of 3 impact-free logs with an impact added by mistake, and a hold-out with another."""
    folder = tmp_path_factory.mktemp("mixed")
    copies = {"free/01.csv": "free/01.csv", "free/02.csv": "free/02.csv", "free/03.csv": "free/03.csv"}
    copies |= {"stiff/01.csv": "free/04.csv", "holdout/01.csv": "holdout/01.csv", "stiff/02.csv": "holdout/02.csv"}
    copies |= {"soft/01.csv": "soft/01.csv", "machine.toml": "machine.toml"}
    for source, target in copies.items():
        (folder / target).parent.mkdir(exist_ok=True)
        shutil.copyfile(gate_folder / source, folder / target)
    return folder


def learn(mixed: Path, output: Path, *more: object):
    logs = sorted((mixed / "free").glob("*.csv"))
    return cdtool("learn-signature", *logs, "-m", mixed / "machine.toml", "-d", "gm", FEW, "-o", output, *more)


def benchmark_of(mixed: Path, more: str = "") -> Path:
    file = mixed / "benchmark.toml"
    file.write_text(
        'machine = "machine.toml"\ndetectors = ["gm"]\n[signature]\nforce = true\n[learn]\nlogs = ["free/*.csv"]\n'
        f'[holdout]\nlogs = ["holdout/*.csv"]\n[impacts.soft]\nlogs = ["soft/*.csv"]\n{more}',
        encoding="utf-8",
    )
    return file


def test_a_log_with_a_contact_is_left_out_with_force_and_time(mixed, tmp_path):
    done = learn(mixed, tmp_path / "s.json")
    assert done.status == 3
    (line,) = [line for line in done.err.splitlines() if line.startswith("left out:")]
    assert f"04.csv: {SHOWN}" in line and "onset.above_n" in line and " s: not an impact-free run" in line
    assert "forward at 0.201 m/s     3" in done.out
    checked = cdtool(
        "signature", "check", tmp_path / "s.json", *sorted((mixed / "free").glob("*")), "-m", mixed / "machine.toml"
    )
    assert checked.status == 3 and f"04.csv: {SHOWN}" in checked.err
    updated = cdtool(
        "signature", "update", tmp_path / "s.json", mixed / "free" / "04.csv", "-m", mixed / "machine.toml"
    )
    assert updated.status == 2 and SHOWN in updated.err


def test_a_level_set_by_hand_accepts_it(mixed, tmp_path):
    assert "forward at 0.201 m/s     4" in learn(mixed, tmp_path / "s.json", "--set=onset.above_n=1e6").out


def test_a_benchmark_leaves_it_out_of_learning_and_hold_out(mixed):
    results = api.benchmark(benchmark_of(mixed)).results
    assert [item.recording for item in results.skipped] == ["free/04.csv", "holdout/02.csv"]
    assert all(item.reason.startswith(SHOWN) for item in results.skipped)
    assert results.provenance["learned_runs"] == ["free/01.csv", "free/02.csv", "free/03.csv"]
    (holdout,) = [item for item in results.exposure if item.group == "holdout"]
    assert (holdout.recordings, holdout.operations) == (1, 1)


def test_a_label_file_that_names_a_hold_out_takes_precedence(mixed):
    (mixed / "labels.csv").write_text("recording,start_s,end_s\nholdout/02.csv,,\n", encoding="utf-8")
    results = api.benchmark(benchmark_of(mixed, '[onset]\nlabels = "labels.csv"\n')).results
    assert [item.recording for item in results.skipped] == ["free/04.csv"]


def cell(force: np.ndarray) -> Recording:
    time = np.arange(len(force)) * 1e-3
    series = {"speed": Series(time, np.full(len(force), 0.2), "m/s"), "force": Series(time, force, "N")}
    return Recording("log", "log", ("axis",), series)


@given(seed=st.integers(0, 999), step=st.floats(0.1, 5.0), noise=st.floats(0.05, 0.7))
@settings(max_examples=40, deadline=None)
def test_a_load_cell_that_reads_in_steps_coarser_than_its_noise_shows_no_contact(seed, step, noise):
    reading = np.random.default_rng(seed).normal(0.0, noise * step, 4000)
    assert contacts_shown(cell(step * np.round(reading / step)), OnsetRule()) == ()


@given(seed=st.integers(0, 999), step=st.floats(0.1, 5.0))
@settings(max_examples=40, deadline=None)
def test_a_contact_of_ten_steps_is_found_by_a_coarse_load_cell(seed, step):
    reading = np.random.default_rng(seed).normal(0.0, 0.3, 4000)
    reading[2000:2200] += 10.0
    (found,) = contacts_shown(cell(step * np.round(reading)), OnsetRule())
    assert found.start == pytest.approx(2.0, abs=0.003)


def test_a_log_without_ground_truth_or_with_a_dead_cell_shows_no_contact():
    assert contacts_shown(cell(np.zeros(4000)), OnsetRule()) == ()
    assert contacts_shown(cell(np.full(4000, np.nan)), OnsetRule()) == ()
    quiet = cell(np.zeros(4000))
    assert contacts_shown(replace(quiet, channels={"speed": quiet["speed"]}), OnsetRule()) == ()
