"""The load cell as ground truth in the commands: contacts in progress, drift, negative latencies, forces."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import cdtool as api
from cdtool.commands.compare.comparison import compare
from cdtool.results.files.results_file import read_results
from cdtool.results.summary import summarise
from tests.command import FEW, cdtool
from tests.commands.console.changed_logs import SAMPLES, changed, folder_of
from tests.synthetic.builds import build_results

BEGUN = "a contact is in progress when it begins, until 0.599 s: its onset is not recorded, it is not scored"


def drifting(time: np.ndarray, force: np.ndarray) -> np.ndarray:
    return force + 30.0 * time / 7.0


def begun(time: np.ndarray, force: np.ndarray) -> np.ndarray:
    return force + 500.0 * (time < 0.6)


def test_a_contact_in_progress_is_counted_and_named_in_every_output_and_scored_in_none(tmp_path):
    file = folder_of(tmp_path, {"begun": begun, "clean": lambda _, force: force})
    names = ("results.json", "contacts.csv", "summary.md", "junit.xml", "report.html")
    done = cdtool("benchmark", file, *(part for name in names for part in ("-o", tmp_path / name)))
    assert done.status == 3
    assert f"left out: stiff/begun.csv: {BEGUN}" in done.err
    assert "1 contact in progress at the start, not scored" in " ".join(done.out.split())
    results = read_results(tmp_path / "results.json")
    by_log = {(row.recording, row.contact): row for row in results.contacts}
    first, later = by_log["stiff/begun.csv", 1], by_log["stiff/begun.csv", 2]
    assert (first.outcome, first.latency_ms, first.onset_uncertainty_s) == ("in_progress", None, None)
    assert later.outcome == "detected"
    assert later.latency_ms == pytest.approx(by_log["stiff/clean.csv", 1].latency_ms, abs=1.01)
    (summary,) = [item for item in summarise(results) if item.group == "stiff"]
    assert (summary.contacts, summary.detected, summary.missed, summary.in_progress) == (2, 2, 0, 1)
    assert not results.false_alarms
    with (tmp_path / "contacts.csv").open(encoding="utf-8") as stream:
        assert [row["outcome"] for row in csv.DictReader(stream)] == ["in_progress", "detected", "detected"]
    assert "1 contact in progress at the start, not scored" in (tmp_path / "summary.md").read_text(encoding="utf-8")
    assert "in progress at the start" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "in progress" in (tmp_path / "junit.xml").read_text(encoding="utf-8")
    shown = cdtool("detect", tmp_path / "stiff" / "begun.csv", "-b", file)
    assert shown.status == 3 and BEGUN in shown.err
    assert "in progress" in shown.out and "contact until 0.599 s" in shown.out
    told = json.loads(cdtool("explain", tmp_path / "stiff" / "begun.csv", "-b", file, "--json").out)
    assert [row["outcome"] for row in told["contacts"]] == ["in_progress", "detected"] and told["missed"] == []
    assert all(item["contact"] is None for item in told["alarms"] if item["role"] == "in progress")


def test_thirty_newtons_of_drift_change_no_result_and_are_reported(tmp_path):
    file = folder_of(tmp_path, {"a": lambda _, force: force, "b": drifting, "free_1": drifting})
    done = cdtool("benchmark", file, "-o", tmp_path / "results.json")
    assert "stiff/b.csv: force: the reading at rest shifted by 27.1 N before the contact at 6.266 s" in done.err
    results = read_results(tmp_path / "results.json")
    assert results.skipped == ()  # the hold-out shows no contact
    clean, drifted = results.contacts
    assert drifted.onset_s == pytest.approx(clean.onset_s, abs=1.01e-3)
    assert drifted.latency_ms == pytest.approx(clean.latency_ms, abs=1.01)
    assert drifted.peak_force_n == pytest.approx(clean.peak_force_n, abs=5.0)
    assert drifted.force_at_alarm_n == pytest.approx(clean.force_at_alarm_n, abs=5.0)
    assert (clean.drift_n_per_s, drifted.drift_n_per_s) == (0.0, pytest.approx(30.0 / 7.0, abs=1.5))
    assert drifted.rest_n == pytest.approx(26.8, abs=2.0)


def test_a_drifting_load_cell_shows_no_contact_in_runs_to_learn_from(tmp_path):
    for i in range(1, 4):
        changed(SAMPLES / "free" / f"0{i + 2}.csv", tmp_path / "free" / f"{i}.csv", drifting)
    logs = sorted((tmp_path / "free").glob("*.csv"))
    done = cdtool("learn-signature", *logs, "-m", SAMPLES / "machine.toml", "-d", "gm", FEW, "-o", tmp_path / "s.json")
    assert done.status == 0 and "shows a contact" not in done.err


def test_a_negative_latency_is_0_and_flagged_everywhere(tmp_path):
    (tmp_path / "labels.csv").write_text(
        "recording,start_s,end_s,kind,uncertainty_s\nstiff/a.csv,6.31,6.5,bump,0.05\n", encoding="utf-8"
    )
    file = folder_of(tmp_path, {"a": lambda _, force: force}, 'labels = "labels.csv"\n')
    names = ("results.json", "contacts.csv", "summary.md", "junit.xml")
    done = cdtool("benchmark", file, *(part for name in names for part in ("-o", tmp_path / name)))
    (row,) = read_results(tmp_path / "results.json").contacts
    assert row.alarm_s < row.onset_s and row.latency_ms == 0.0 and row.clipped
    assert "1 before the onset, counted as 0 ms" in " ".join(done.out.split())
    with (tmp_path / "contacts.csv").open(encoding="utf-8") as stream:
        assert next(csv.DictReader(stream))["clipped"] == "true"
    assert "1 before the onset, counted as 0 ms" in (tmp_path / "summary.md").read_text(encoding="utf-8")
    assert "before the onset, within its uncertainty" in (tmp_path / "junit.xml").read_text(encoding="utf-8")
    shown = cdtool("detect", tmp_path / "stiff" / "a.csv", "-b", file).out
    assert "alarm before the onset, within its uncertainty: counted as 0" in shown
    values = json.loads(cdtool("detect", tmp_path / "stiff" / "a.csv", "-b", file, "--json").out)
    assert values[0]["contacts"][0]["clipped"] is True


def test_the_force_at_the_alarm_is_a_magnitude_like_the_peak(tmp_path):
    def pulled_first(time: np.ndarray, force: np.ndarray) -> np.ndarray:
        return np.where((time > 6.26) & (time < 6.4), -200.0, force)

    file = folder_of(tmp_path, {"a": pulled_first, "b": lambda t, f: -pulled_first(t, f), "c": lambda _, f: -f})
    rows = api.benchmark(file).results.contacts
    assert all(row.outcome == "detected" for row in rows)
    assert rows[0].force_at_alarm_n == pytest.approx(200.0, abs=10.0)
    assert [row.force_at_alarm_n for row in rows[:2]] == pytest.approx([200.0, 200.0], abs=10.0)
    assert all(0.0 <= row.force_at_alarm_n <= row.peak_force_n for row in rows)


def test_benchmark_and_compare_give_the_same_force_at_the_alarm():
    old = build_results({("momentum", "stiff"): [10, 11, 12, 40, 13, 14, 15, 16]})
    new = build_results({("momentum", "stiff"): [20, 21, 22, 50, 23, 24, 25, 26]})
    (row,) = compare(old, new).rows
    asked = row.question("force_at_alarm_n")
    medians = [summarise(item)[0].force_at_alarm for item in (old, new)]
    assert [asked.old, asked.new] == medians
    assert asked.old != np.mean([item.force_at_alarm_n for item in old.contacts])
