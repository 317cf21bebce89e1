"""Special keys of a benchmark file and their effect on results."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.commands.scoring.benchmark import benchmark
from cdtool.results.files.results_file import read_results, to_json

HEAD = 'machine = "machine.toml"\ndetectors = ["feekf", "gm"]\n'
LEARN = '[learn]\nlogs = ["free/*.csv"]\n'
ONSET = "[onset]\nabove_n = 20.0\nback_to_n = 8.0\n"
STIFF = '[impacts.stiff]\nlogs = ["stiff/*.csv"]\n'
HOLDOUT = '[holdout]\nlogs = ["holdout/*.csv"]\n'


@pytest.fixture(scope="module")
def gate(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("gate")
    cdtool.simulate_gate(folder, {"free": 12, "holdout": 3, "stiff": 3}, seed=77)
    return folder


def run(folder: Path, *parts: str, **settings):
    file = folder / "b.toml"
    file.write_text("".join(parts), encoding="utf-8")
    return benchmark(file, **settings)


def test_a_groups_own_window_determines_misses(gate):
    done = run(gate, HEAD, LEARN, ONSET, STIFF, "window_s = 0.045\n")
    by_name = {item.detector: item for item in done.evaluated.summaries}
    assert by_name["momentum"].missed == 3 and by_name["friction_ekf"].detected == 3
    missed = [item for item in done.results.contacts if item.outcome == "missed"]
    assert all(item.watched_ms == pytest.approx(45.0) for item in missed)
    assert done.results.provenance["window_s"] == {"stiff": 0.045}


def test_a_label_file_replaces_the_load_cell(gate):
    plain = run(gate, HEAD, LEARN, ONSET, STIFF)
    rows = sorted({(item.recording, item.onset_s) for item in plain.results.contacts})
    with (gate / "labels.csv").open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["recording", "start_s", "end_s", "kind"])
        writer.writerows([name, onset - 0.01, onset + 0.2, "head"] for name, onset in rows)
    labelled = run(gate, HEAD, LEARN, ONSET, 'labels = "labels.csv"\n', STIFF)
    for ours, theirs in zip(labelled.results.contacts, plain.results.contacts, strict=True):
        assert (ours.kind, ours.found_by) == ("head", "label file")
        assert ours.latency_ms == pytest.approx(theirs.latency_ms + 10.0, abs=1e-6)


def test_force_profile_points_and_campaigns_become_rows(gate):
    force = '[force]\nprofile = "en_12453_reducing_gap"\n'
    points = '[points.middle]\nlogs = ["stiff/*.csv"]\n[campaigns.monday]\nlogs = ["stiff/01.csv"]\n'
    done = run(gate, HEAD, LEARN, ONSET, STIFF, force, points)
    assert [item.verdict for item in done.results.forces] == ["fail"] * 3
    assert all(2.5 < item.time_budget_ms < 3.5 and item.point == "middle" for item in done.results.forces)
    (point,) = done.results.points
    assert (point.tests, point.verdict, point.note) == (3, "fail", "mean of 3 tests")
    assert [item.campaign for item in done.results.recordings] == ["monday", None, None]
    assert to_json(read_back(gate, done.results)) == to_json(done.results)


def test_a_mass_before_the_cell_changes_the_force_and_the_synchronisation_the_resolution(gate):
    plain = run(gate, HEAD, LEARN, ONSET, STIFF).results.contacts[0]
    settings = "synchronisation_s = 0.002\n[force]\nmass_before_cell_kg = 5.0\n"
    other = run(gate, HEAD, LEARN, ONSET, settings, STIFF).results.contacts[0]
    assert other.resolution_ms == pytest.approx(plain.resolution_ms + 2.0)
    assert 0.0 < other.peak_force_n - plain.peak_force_n < 100.0


def test_a_budget_sets_the_safety_factor_on_the_runs_learned_from(gate):
    done = run(gate, 'false_alarm_budget = "1/4op"\n', HEAD, LEARN, ONSET, STIFF)
    rows = {item.detector: item for item in done.results.calibration}
    assert set(rows) == {"friction_ekf", "momentum"}
    for row in rows.values():
        assert (row.budget, row.operations, row.alarms) == ("1/4op", 12, 2)
        assert 0.5 < row.safety_factor < 5.5
    faster = {item.detector: item.mean_ms for item in done.evaluated.summaries}
    slower = {item.detector: item.mean_ms for item in run(gate, HEAD, LEARN, ONSET, STIFF).evaluated.summaries}
    assert all(faster[name] < slower[name] for name in faster)


def test_a_budget_that_the_runs_cannot_set_is_refused_with_what_is_missing(gate):
    with pytest.raises(UsageError, match=r"friction_ekf: false-alarm budget 1/1000op needs 999 .* 12 were assessable"):
        run(gate, HEAD, LEARN, ONSET, STIFF, false_alarm_budget="1/1000op")


def test_the_sweep_counts_false_alarms_in_the_hold_out_and_its_middle_is_the_benchmark_itself(gate):
    done = run(gate, HEAD, LEARN, ONSET, STIFF, HOLDOUT)
    for summary in done.evaluated.summaries:
        rows = [item for item in done.results.sweep if (item.detector, item.group) == (summary.detector, summary.group)]
        if not summary.contacts:
            assert not rows
            continue
        (middle,) = [item for item in rows if item.in_use]
        assert middle.safety_factor == pytest.approx(5.5)
        assert middle.mean_ms == pytest.approx(summary.mean_ms) and middle.detected == summary.detected
        assert rows[0].false_alarms > 0 and rows[0].mean_ms < middle.mean_ms < rows[-1].mean_ms


def test_a_copy_of_a_learned_log_is_not_scored_under_another_name(gate):
    shutil.copy(gate / "free" / "03.csv", gate / "copy.csv")
    with pytest.raises(ConfigurationError, match=r"copy\.csv has the same content as free/03\.csv"):
        run(gate, HEAD, LEARN, ONSET, STIFF, '[holdout]\nlogs = ["copy.csv"]\n')


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[force]\nprofile = "en_12453"\n', "force.profile: unknown force profile 'en_12453'.*en_12453_reducing_gap"),
        (
            '[impacts.x]\nlogs = ["holdout/*.csv"]\nforce_profile = "yard"\n',
            "x.force_profile: .*'yard'; .force. limits does not name",
        ),
        ('[force]\nprofile = "yard"\nfile = "yard.toml"\n', "force.file: unknown key"),
        ('[force]\nprofil = "x"\n', "force.profil: unknown key"),
        ('[points.a]\nlogs = ["stiff/*.csv"]\n[points.b]\nlogs = ["stiff/01.csv"]\n', "points.b.*also in 'a'"),
        ('[limits]\n"gm.stiff.p9_ms" = { max = 1 }\n', "limits.gm.stiff.p9_ms: unknown metric"),
        ('[limits]\n"gm.stiff.p95_ms" = 50\n', "limits.gm.stiff.p95_ms: is 50 .give { max = 50 }, { min = 1 } or both"),
    ],
)
def test_a_wrong_key_is_one_line_that_names_it(gate, text, said):
    with pytest.raises((ConfigurationError, UsageError), match=said):
        run(gate, HEAD, LEARN, ONSET, STIFF, text)


def read_back(folder: Path, results):
    path = folder / "results.json"
    path.write_text(to_json(results), encoding="utf-8")
    return read_results(path)


def test_each_run_of_a_budget_is_tested_with_thresholds_of_the_others(gate, monkeypatch):
    from cdtool.commands.learning import calibration, fitting

    taught: list[tuple[set[str], set[str]]] = []
    judge = calibration.judge_alone
    checked_fit = fitting.checked_fit
    latest: set[str] = set()

    def fit(rule, pairs):
        nonlocal latest
        latest = {item.name for item, _ in pairs}
        return checked_fit(rule, pairs)

    def seen(operation, *others):
        taught.append(({operation.name}, latest))
        return judge(operation, *others)

    monkeypatch.setattr(fitting, "checked_fit", fit)
    monkeypatch.setattr(calibration, "judge_alone", seen)
    run(gate, 'false_alarm_budget = "1/4op"\n', HEAD, LEARN, ONSET, STIFF)
    assert len(taught) == 24 and not any(judged & learned for judged, learned in taught)


def test_identical_files_under_two_names_are_not_scored_twice(gate):
    shutil.copy(gate / "stiff" / "01.csv", gate / "twice.csv")
    with pytest.raises(ConfigurationError, match=r"twice\.csv and stiff/01\.csv have identical content"):
        run(gate, HEAD, LEARN, ONSET, STIFF, '[impacts.again]\nlogs = ["twice.csv"]\n')


def test_the_force_of_a_contact_ends_where_the_next_begins(gate):
    """Two labelled contacts in one log: the force of the second does not count for the first."""
    done = run(gate, HEAD, LEARN, ONSET, STIFF)
    first = done.results.contacts[0]
    with (gate / "two.csv").open("w", newline="") as stream:
        rows = [["recording", "start_s", "end_s"]]
        rows += [[first.recording, first.onset_s - delay, first.onset_s - delay] for delay in (2.0, 0.0)]
        csv.writer(stream).writerows(rows)
    labelled = run(gate, HEAD, LEARN, ONSET, 'labels = "two.csv"\n', STIFF)
    peaks = [row.peak_force_n for row in labelled.results.contacts if row.recording == first.recording][:2]
    assert peaks[0] < 50.0 < 1000.0 < peaks[1]


def test_a_missing_machine_file_hides_no_other_mistake(gate):
    wrong = (
        HEAD.replace("machine.toml", "machin.toml").replace('"gm"', '"gmm"')
        + 'threshold = "cusun"\njoints = ["gate"]\n'
    )
    limits = '[limits]\n"gmm.stif.p95_ms" = { max = 3 }\n"*.stiff.p96_ms" = { max = 3 }\n[inject]\nseed = -1\n'
    with pytest.raises(ConfigurationError) as fault:
        run(gate, wrong, '[learn]\nlogs = ["fre/*.csv"]\n', STIFF, limits)
    said = [line.split("b.toml: ")[1].split(" (")[0] for line in str(fault.value).splitlines()]
    of_inject = ["inject.seed", "inject.logs", "inject.positions"]
    of_limits = ["limits.gmm.stif.p95_ms", "limits.*.stiff.p96_ms"]
    expected = ["machine", "detectors[2]", "threshold", "learn.logs", *of_inject, *of_limits]
    assert [line.split(": ")[0] for line in said] == expected
    assert "machin.toml: no such file" in said[0] and "unknown detector 'gmm'" in said[1]
