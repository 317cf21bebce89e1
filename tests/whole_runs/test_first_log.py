"""A stranger's logs without header, free runs or model: from `init` to latencies (docs/init.md), reduced."""

from __future__ import annotations

import csv
import runpy
from pathlib import Path

import numpy as np
import pytest

import cdtool
from tests.project.pages import DOCS

COUNT = 14
THRESHOLDS = ["", 'threshold = "baseline"', 'threshold = { name = "baseline", widen = true }']


@pytest.fixture(scope="module")
def hits(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of collisions, and the true onsets."""
    folder = tmp_path_factory.mktemp("first") / "hits"
    runpy.run_path(str(DOCS / "examples" / "robot_collisions.py"))["write_collisions"](folder)
    return folder


@pytest.fixture(scope="module")
def draft(hits: Path) -> Path:
    """The benchmark file that `init` drafts after the edits of the page."""
    edited = runpy.run_path(str(DOCS / "examples" / "first_log_edits.py"))["edited"]
    logs, study = sorted(hits.glob("hit_*.csv"))[:COUNT], hits.parent / "study"
    machine = study / "machine.toml"
    cdtool.init_study(logs, study)
    machine.write_text(edited(machine.read_text(encoding="utf-8")), encoding="utf-8")
    cdtool.init_study(logs, study, machine=machine, force=True)
    return study / "benchmark.toml"


@pytest.mark.parametrize("threshold", THRESHOLDS, ids=["until the onset", "baseline", "baseline that widens"])
def test_every_collision_is_detected_without_a_false_alarm_and_its_onset_is_right_to_a_sample(threshold, hits, draft):
    text = draft.read_text(encoding="utf-8")
    if threshold:
        head, _, learning = text.partition("threshold = ")
        text = head + threshold + "\n\n[impacts" + learning.partition("[impacts")[2]
    tried = draft.with_name("tried.toml")
    tried.write_text(text, encoding="utf-8")
    done = cdtool.benchmark(tried)
    summary = next(item for item in done.evaluated.summaries if item.detector == "torque_deviation")
    assert (summary.detected, summary.false_alarms) == (COUNT, 0)
    with (hits / "onsets.csv").open(encoding="utf-8") as file:
        onsets = {row["recording"]: float(row["onset_s"]) for row in csv.DictReader(file)}
    for row in done.results.contacts:
        time = np.loadtxt(hits / Path(row.recording).name, delimiter=",", usecols=0)
        onset = onsets[Path(row.recording).name]
        after = int(np.searchsorted(time, onset))
        assert abs(row.onset_s - onset) <= time[after] - time[after - 1]
