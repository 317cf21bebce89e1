"""`cdtool score`: external triggers get the same results as a detector's alarms, and problems are reported."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from tests.command import Outcome, cdtool, one_line

QUIET = "holdout/01.csv,,plc,\nholdout/02.csv,,plc,\n"


@pytest.fixture(scope="module")
def logs(gate_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder's logs with a benchmark file without logs to learn from."""
    folder = tmp_path_factory.mktemp("score")
    for name in ("stiff", "soft", "holdout", "free", "machine.toml"):
        (folder / name).symlink_to(gate_folder / name)
    write_benchmark(folder)
    return folder


def write_benchmark(folder: Path, more: str = "", name: str = "benchmark.toml") -> Path:
    groups = "".join(f'[impacts.{group}]\nlogs = ["{group}/*.csv"]\n' for group in ("stiff", "soft"))
    onset = "[onset]\nabove_n = 20.0\nback_to_n = 8.0\n"
    text = f'machine = "machine.toml"\n{groups}[holdout]\nlogs = ["holdout/*.csv"]\n{onset}{more}'
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@pytest.fixture(scope="module")
def measured(gate_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The benchmark's results with two detectors."""
    path = tmp_path_factory.mktemp("measured") / "results.json"
    done = cdtool("benchmark", gate_folder / "benchmark.toml", "--detectors", "feekf,pi", "-o", path)
    assert done.status == 0, done.err
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def score(folder: Path, rows: str, *more: object, header: str = "recording,time_s,detector,blind_until_s\n") -> Outcome:
    path = folder / "triggers.csv"
    path.write_text(header + rows, encoding="utf-8")
    return cdtool("score", path, "--benchmark", folder / "benchmark.toml", *more)


def scored(folder: Path, rows: str, *more: object, status: int = 0) -> tuple[dict[str, Any], str]:
    done = score(folder, rows, "--json", *more)
    assert done.status == status, done.err
    return json.loads(done.out), done.err


def onsets(measured: dict[str, Any]) -> dict[str, float]:
    return {row["recording"]: row["onset_s"] for row in measured["contacts"]}


def after(measured: dict[str, Any], seconds: float) -> str:
    """Return a row per contact, with an alarm at that time after its onset; no rows for the hold-out."""
    rows = [f"{name},{onset + seconds!r},plc,\n" for name, onset in onsets(measured).items()]
    return "".join(rows) + QUIET


def test_the_alarms_of_a_benchmark_get_the_same_results_again(logs, measured):
    contacts = measured["contacts"]
    rows = "".join(f"{row['recording']},{row['alarm_s']!r},{row['detector']},\n" for row in contacts)
    quiet = QUIET.replace("plc", "friction_ekf") + QUIET.replace("plc", "pure_inertia")
    values, _ = scored(logs, rows + quiet)
    assert values["detectors"] == measured["detectors"] and len(values["contacts"]) == len(contacts) == 8
    for ours, theirs in zip(values["contacts"], contacts, strict=True):
        for key in ("recording", "detector", "outcome", "onset_s", "force_at_alarm_n", "peak_force_n", "watched_ms"):
            assert ours[key] == theirs[key], key
        assert ours["latency_ms"] == pytest.approx(theirs["latency_ms"])
    assert values["false_alarms"] == measured["false_alarms"] == []
    hours = {(row["detector"], row["group"]): row["hours"] for row in values["exposure"]}
    assert hours["friction_ekf", "stiff"] == pytest.approx(2 * 7.2 / 3600.0, rel=1e-3)
    assert values["provenance"]["trigger_clock"] == "recording" and len(values["provenance"]["triggers_sha256"]) == 64


def test_an_alarm_outside_every_window_is_false_and_two_within_half_a_second_are_one(logs, measured):
    rows = after(measured, 0.05) + "holdout/01.csv,2.0,plc,\nholdout/01.csv,2.2,plc,\nholdout/01.csv,3.0,plc,\n"
    values, _ = scored(logs, rows)
    assert [(row["recording"], row["time_s"]) for row in values["false_alarms"]] == [
        ("holdout/01.csv", 2.0),
        ("holdout/01.csv", 3.0),
    ]


def test_a_late_alarm_and_none_are_missed_contacts_at_the_end_of_the_window(logs, measured):
    at = onsets(measured)
    rows = f"stiff/01.csv,{at['stiff/01.csv'] + 1.01},plc,\nstiff/02.csv,,plc,\n"
    rows += f"soft/01.csv,{at['soft/01.csv'] + 0.2},plc,\n"
    values, err = scored(logs, rows + QUIET)
    outcomes = {row["recording"]: (row["outcome"], row["latency_ms"]) for row in values["contacts"]}
    assert outcomes["stiff/01.csv"] == outcomes["stiff/02.csv"] == outcomes["soft/02.csv"] == ("missed", None)
    assert outcomes["soft/01.csv"] == ("detected", pytest.approx(200.0))
    assert all(row["watched_ms"] == pytest.approx(1000.0, abs=300.0) for row in values["contacts"])
    assert "plc: 1 of 6 recordings without a row: counted as monitored without an alarm; first soft/02.csv" in err


def test_an_unassessable_section_over_a_contact_shortens_the_exposure(logs, measured):
    onset = onsets(measured)["stiff/01.csv"]
    others = after(measured, 0.05).replace(f"stiff/01.csv,{onset + 0.05!r},plc,\n", "")
    values, _ = scored(logs, f"stiff/01.csv,{onset - 0.5},plc,{onset + 1.5}\n" + others)
    contact = next(row for row in values["contacts"] if row["recording"] == "stiff/01.csv")
    assert contact["outcome"] == "not_assessable" and "not applicable" in contact["reason"]
    (stiff,) = [row for row in values["exposure"] if row["group"] == "stiff"]
    whole = 2 * 7.2 / 3600.0
    assert whole - 2.1 / 3600.0 < stiff["hours"] < whole - 1.0 / 3600.0
    part, _ = scored(logs, f"stiff/01.csv,{onset - 0.5},plc,{onset + 0.1}\n" + others)
    assert next(row for row in part["contacts"] if row["recording"] == "stiff/01.csv")["outcome"] == "missed"


def test_listed_only_leaves_recordings_out_detector_by_detector(logs, measured):
    at = onsets(measured)
    rows = f"stiff/01.csv,{at['stiff/01.csv'] + 0.04},plc,\nstiff/02.csv,{at['stiff/02.csv'] + 0.04},plc,\n"
    rows += f"stiff/02.csv,{at['stiff/02.csv'] + 0.06},edge,\n"
    values, err = scored(logs, rows, "--set=triggers.listed_only=true")
    found = {(row["detector"], row["recording"]): row["latency_ms"] for row in values["contacts"]}
    assert found == {
        ("plc", "stiff/01.csv"): pytest.approx(40.0),
        ("plc", "stiff/02.csv"): pytest.approx(40.0),
        ("edge", "stiff/02.csv"): pytest.approx(60.0),
    }
    assert "plc: 4 of 6" in err and "edge: 5 of 6" in err and "left out" in err
    everything, _ = scored(logs, rows)
    assert len(everything["contacts"]) == 8


def epoch_folder(folder: Path, logs: Path) -> float:
    """Logs with a time column since 1970; returns the first stamp of stiff/01.csv [s]."""
    (folder / "machine.toml").symlink_to(logs / "machine.toml")
    for name in ("stiff/01.csv", "soft/01.csv", "holdout/01.csv"):
        with (logs / name).open(encoding="utf-8", newline="") as stream:
            header, *rows = csv.reader(stream)
        (folder / name).parent.mkdir()
        lines = [header, *([f"{float(row[0]) + 1.7e12:.0f}", *row[1:]] for row in rows)]
        (folder / name).write_text("\n".join(map(",".join, lines)) + "\n", encoding="utf-8")
    write_benchmark(folder)
    return 1.7e9


def test_triggers_on_the_source_clock_are_converted_and_a_wrong_clock_is_reported(logs, measured, tmp_path):
    origin = epoch_folder(tmp_path, logs)
    at = onsets(measured)
    times = {name: origin + at[name] + 0.045 for name in ("stiff/01.csv", "soft/01.csv")}
    rows = "".join(f"{name},{time:.4f},plc,\n" for name, time in times.items()) + "holdout/01.csv,,plc,\n"
    values, err = scored(tmp_path, rows, "--set=triggers.clock=source")
    assert [row["latency_ms"] for row in values["contacts"]] == [pytest.approx(45.0, abs=1.0)] * 2 and err == ""
    assert values["provenance"]["trigger_clock"] == "source"
    wrong, err = scored(tmp_path, rows, status=3)
    assert {row["outcome"] for row in wrong["contacts"]} == {"missed"}
    assert "1 of 1 row outside all operations" in err and "try --set triggers.clock=source" in err
    assert [item["recording"] for item in wrong["skipped"]] == ["stiff/01.csv", "soft/01.csv"]


def test_rows_of_recordings_that_are_not_scored_are_a_note(logs, measured):
    """Without a row about a scored recording, all of them would count as monitored without an alarm."""
    done = score(logs, after(measured, 0.05) + "stiff/99.csv,1.0,plc,\nfree/01.csv,2.0,plc,\n")
    assert done.status == 0, done.err
    assert "not scored are not used: free/01.csv, stiff/99.csv" in one_line(done.err) and "left out" not in done.err
    done = score(logs, "stiff/99.csv,1.0,plc,\n")
    assert done.status == 2 and "no row is about a scored recording: stiff/99.csv" in one_line(done.err)


def test_a_log_of_nothing_but_the_load_cell_can_be_scored(logs, measured, tmp_path):
    with (logs / "stiff" / "01.csv").open(encoding="utf-8", newline="") as stream:
        lines = [f"{row['t']},{row['load_cell']}\n" for row in csv.DictReader(stream)]
    (tmp_path / "cell.csv").write_text("t,load_cell\n" + "".join(lines), encoding="utf-8")
    channels = 'time = { column = "t", unit = "ms" }\nforce = { column = "load_cell", unit = "kN" }\n'
    machine = f'[machine]\ntype = "linear_axis"\ntransmission_ratio = 1\n[channels]\n{channels}'
    (tmp_path / "machine.toml").write_text(machine, encoding="utf-8")
    benchmark = 'machine = "machine.toml"\n[impacts.x]\nlogs = ["cell.csv"]\n[onset]\nabove_n = 20.0\nback_to_n = 8.0\n'
    (tmp_path / "benchmark.toml").write_text(benchmark, encoding="utf-8")
    values, _ = scored(tmp_path, f"cell.csv,{onsets(measured)['stiff/01.csv'] + 0.03},plc,\n")
    assert [item["latency_ms"] for item in values["contacts"]] == [pytest.approx(30.0)]


def test_limits_apply_to_external_triggers(logs, measured, tmp_path):
    (tmp_path / "limits").mkdir()
    folder = tmp_path / "limits"
    for name in ("stiff", "soft", "holdout", "machine.toml"):
        (folder / name).symlink_to(logs / name)
    write_benchmark(folder, '[limits]\n"plc.stiff.p95_ms" = { max = 60 }\n"*.missed" = { max = 0 }\n')
    kept = score(folder, after(measured, 0.05))
    assert kept.status == 0 and kept.out.startswith("all 3 limits are met\n")
    slow = score(folder, after(measured, 0.07) + "stiff/99.csv,1.0,plc,\n")
    assert slow.status == 1 and "limit violated: plc.stiff.p95_ms: 70 is more than 60" in slow.out
