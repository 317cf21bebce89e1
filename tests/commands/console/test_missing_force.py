"""Missing load-cell samples during a contact, in the commands: no pass, and no unmarked latency."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from cdtool.results.files.results_file import read_results
from tests.command import cdtool
from tests.commands.console.changed_logs import changed, folder_of

PROFILE = """
[yard]
title = "yard gate"
source = "own"
checked = true
steps = [{ from_s = 0.0, at_most_n = 3000, name = "dynamic" }, { from_s = 0.5, at_most_n = 150, name = "static" }]
"""
MORE = """[force]
profile = "yard"
limits = "force.toml"
[limits]
"pi.stiff.max_ms" = { max = 15 }
"pi.stiff.median_ms" = { max = 40 }
"pi.stiff.peak_force_n" = { max = 5000 }
"pi.stiff.force_at_alarm_max_n" = { max = 5000 }
"pi.stiff.detected" = { min = 1 }
"""


def without(begin: float, end: float):
    """Blank the load cell from `begin` to `end` [s after the onset at 6.266 s]."""

    def change(time: np.ndarray, force: np.ndarray) -> np.ndarray:
        return np.where((time >= 6.266 + begin - 5e-4) & (time < 6.266 + end - 5e-4), np.nan, force)

    return change


def benchmark(folder: Path, change, more: str = MORE):
    (folder / "force.toml").write_text(PROFILE, encoding="utf-8")
    file = folder_of(folder, {"a": change}, more)
    names = ("results.json", "contacts.csv", "summary.md", "junit.xml", "report.html")
    done = cdtool("benchmark", file, *(part for name in names for part in ("-o", folder / name)))
    return file, done, read_results(folder / "results.json")


@pytest.mark.parametrize("begin, end", [(-0.003, 0.186), (0.0, 0.17)])
def test_a_hole_over_the_onset_prevents_a_pass_and_marks_the_latency(tmp_path, begin, end):
    file, done, results = benchmark(tmp_path, without(begin, end))
    hole = 1e3 * (end - begin) + 1
    (row,) = results.contacts
    assert row.outcome == "detected"
    assert row.onset_hole_ms == pytest.approx(hole, abs=2.0) and row.force_hole_ms >= row.onset_hole_ms
    assert row.resolution_ms >= row.onset_hole_ms
    true_latency = 1e3 * (row.alarm_s - 6.266)
    assert row.latency_ms <= true_latency <= row.latency_ms + 1e3 * row.onset_uncertainty_s + 1.0
    (force,) = results.forces
    assert force.verdict == "not_assessable" and f"{row.onset_hole_ms:.0f} ms" in force.reason
    # Limits on partly measured contacts are not met, so the status is 1; without limits it is 3.
    outcomes = {item.figure: item.outcome for item in results.limits}
    assert outcomes == {
        "max_ms": "not_assessable",
        "median_ms": "met",
        "peak_force_n": "not_assessable",
        "force_at_alarm_max_n": "not_assessable",
        "detected": "met",
    }
    assert done.status == 1 and results.conclusion.outcome == "not_assessable"
    assert "force profile not assessable for 1 of 1 contact" in results.conclusion.headline
    assert "where contact 1, first seen at" in done.err and "samples are missing for" in done.err
    assert "1 contact may have begun where load-cell samples are missing" in " ".join(done.out.split())
    tree = ElementTree.parse(tmp_path / "junit.xml")
    (suite,) = [item for item in tree.getroot() if item.get("name") == "force"]
    assert suite.get("errors") == "1"
    texts = [item.text or "" for item in tree.getroot().iter("system-out")]
    assert any("ms later (load-cell samples missing at the onset)" in item for item in texts)
    for name in ("summary.md", "report.html"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert "1 contact may have begun where load-cell samples are missing" in text
    shown = cdtool("detect", tmp_path / "stiff" / "a.csv", "-b", file)
    assert shown.status == 3 and "load-cell samples missing at the onset" in " ".join(shown.out.split())
    headline = " ".join(cdtool("explain", tmp_path / "stiff" / "a.csv", "-b", file).out.split())
    assert f"ms earlier, since {row.onset_hole_ms:.0f} ms of it are missing)" in headline
    for command in ("detect", "explain"):
        told = cdtool(command, tmp_path / "stiff" / "a.csv", "-b", file, "--json")
        values = json.loads(told.out)
        (contact,) = (values[0] if command == "detect" else values)["contacts"]
        assert told.status == 3 and contact["onset_hole_ms"] == row.onset_hole_ms


def test_a_hole_over_the_peak_prevents_a_pass_with_its_length_as_reason(tmp_path):
    profile = '[force]\nprofile = "yard"\nlimits = "force.toml"\n'
    _, done, results = benchmark(tmp_path, without(0.07, 0.19), profile)
    (row,), (force,) = results.contacts, results.forces
    assert done.status == 3 and results.conclusion.exit_status == 3
    assert row.onset_hole_ms is None and row.force_hole_ms == pytest.approx(121.0, abs=1.5)
    assert force.verdict == "not_assessable" and force.reason == "dynamic: load-cell samples are missing for 121 ms"
    assert row.latency_ms == pytest.approx(25.0, abs=1.5)
    assert "is not assessable by yard: dynamic: load-cell samples are missing for 121 ms" in done.err


def test_a_measured_violation_counts_despite_a_hole(tmp_path):
    profile = '[force]\nprofile = "yard"\nlimits = "force.toml"\n'
    _, done, results = benchmark(tmp_path, without(-0.003, 0.08), profile)
    assert [item.verdict for item in results.forces] == ["fail"] and done.status == 1


def test_a_hole_as_long_as_the_window_leaves_no_latency(tmp_path):
    file, done, results = benchmark(tmp_path, without(-1.1, 0.138), "")
    (row,) = results.contacts
    assert (row.outcome, row.latency_ms, done.status) == ("not_assessable", None, 3)
    assert "its onset is not known" in row.reason
    shown = cdtool("detect", tmp_path / "stiff" / "a.csv", "-b", file)
    words = " ".join(shown.out.split())
    assert shown.status == 3 and "its onset is not known" in words and "after its onset" not in words


def test_single_lost_samples_change_nothing(tmp_path):
    lost = np.random.default_rng(5).choice(7200, 60, replace=False)

    def change(time: np.ndarray, force: np.ndarray) -> np.ndarray:
        made = force.copy()
        made[lost] = np.nan
        return made

    profile = '[force]\nprofile = "high"\nlimits = "high.toml"\n'
    (tmp_path / "high.toml").write_text(PROFILE.replace("yard]", "high]").replace("3000", "9000"), encoding="utf-8")
    _, done, results = benchmark(tmp_path, change, profile)
    assert [item.verdict for item in results.forces] == ["pass"] and done.status == 0
    assert [row.onset_hole_ms for row in results.contacts] == [None]


def test_a_group_whose_logs_were_all_left_out_counts_no_contact_and_gives_the_true_reason(tmp_path):
    (tmp_path / "force.toml").write_text(PROFILE, encoding="utf-8")
    file = folder_of(
        tmp_path,
        {"felt": lambda _, force: force},
        '[force]\nprofile = "yard"\nlimits = "force.toml"\n[impacts.soft]\nlogs = ["none.csv"]\n',
    )
    source = Path(__file__).parents[3] / "sample_logs" / "gate" / "stiff" / "03.csv"
    changed(source, tmp_path / "none.csv", lambda _, force: 0.0 * force)
    done = cdtool("benchmark", file, "-o", tmp_path / "results.json", "-o", tmp_path / "results.xml")
    conclusion = read_results(tmp_path / "results.json").conclusion
    words = " ".join(done.out.split())
    assert "force profile not assessable in soft, where no contact was scored" in conclusion.headline
    assert "of 1 contact;" in f"{conclusion.headline};" and "of 2 contacts" not in words
    assert "force, soft, yard: not assessable: no contact of the group was scored" in words
    assert "no load-cell force" not in words and "every contact:" not in words
    assert "no contact found" in done.err and done.status in (1, 3)
    assert 'name="soft: no contact"' in (tmp_path / "results.xml").read_text(encoding="utf-8")


def test_a_contact_in_progress_does_not_count_for_the_force_profile(tmp_path):
    (tmp_path / "high.toml").write_text(PROFILE.replace("yard]", "high]").replace("3000", "9000"), encoding="utf-8")

    def begun(time: np.ndarray, force: np.ndarray) -> np.ndarray:
        return force + 500.0 * (time < 0.6)

    file = folder_of(
        tmp_path, {"begun": begun, "clean": lambda _, f: f}, '[force]\nprofile = "high"\nlimits = "high.toml"\n'
    )
    done = cdtool("benchmark", file, "-o", tmp_path / "results.json")
    results = read_results(tmp_path / "results.json")
    assert results.conclusion.headline == "1 entry left out; force profile met by 2 contacts; no limits are set"
    assert "no load-cell force" not in done.out + done.err and done.status == 3
