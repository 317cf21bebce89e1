"""`cdtool signature show|check|update` on a simulated gate: coverage, a drifting season, and refused runs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.command import Outcome, cdtool
from tests.synthetic.ageing import write_ageing_gate


@pytest.fixture(scope="module")
def seasons(tmp_path_factory) -> Path:
    """30 runs each: no change, friction increased by half, an obstruction growing at 0.9 m."""
    folder = tmp_path_factory.mktemp("seasons")
    for name, change in {"quiet": {}, "friction": {"friction": 1.5}, "stone": {"obstruction": 8.0}}.items():
        write_ageing_gate(folder / name, 30, 3, **change)
    return folder


@pytest.fixture
def signature(gate_folder, feekf_signature, tmp_path) -> Path:
    path = tmp_path / "s.json"
    path.write_bytes(feekf_signature.read_bytes())
    return path


def logs_of(folder: Path) -> list[Path]:
    return sorted((folder / "free").glob("*.csv"))


def check(signature: Path, gate_folder: Path, *arguments: object) -> Outcome:
    return cdtool("signature", "check", signature, *arguments, "-m", gate_folder / "machine.toml")


def test_runs_learned_from_are_checked_against_the_others(signature, gate_folder):
    done = check(signature, gate_folder, *logs_of(gate_folder))
    assert done.status == 0, done.err
    assert (
        "11 runs, each checked against a signature of the others: 0 alarms" in done.out
        and ": keep the signature" in done.out
    )
    values = json.loads(check(signature, gate_folder, *logs_of(gate_folder), "--json").out)
    coverage = values["classes"][0]["coverage"]
    assert len(coverage["runs"]) == 11 and 0.0 < coverage["chance"] < 0.2
    assert values["classes"][0]["drift"] is None


def test_a_steady_season_shows_no_drift_and_another_shows_what_and_where(signature, gate_folder, seasons):
    quiet = check(signature, gate_folder, *logs_of(seasons / "quiet"))
    assert quiet.status == 0 and "no drift shown" in quiet.out, quiet.out + quiet.err
    friction = check(signature, gate_folder, *logs_of(seasons / "friction"))
    assert "no drift shown" not in friction.out and "spreads per run" in friction.out
    stone = check(signature, gate_folder, *logs_of(seasons / "stone"))
    assert "no drift shown" not in stone.out and "inspect" in stone.out, stone.out


def test_an_update_adds_impact_free_runs_and_refuses_impacts_and_repeats(signature, gate_folder, feekf_signature):
    logs = [gate_folder / "holdout" / "01.csv", gate_folder / "stiff" / "01.csv", gate_folder / "free" / "01.csv"]
    done = cdtool("signature", "update", signature, *logs, "-m", gate_folder / "machine.toml")
    assert done.status == 3 and "1 run added" in done.out
    assert "not an impact-free run" in done.err and "already in the signature" in done.err
    before, after = json.loads(feekf_signature.read_text()), json.loads(signature.read_text())
    assert len(after["runs"]) == 12 and after["first"] == before["first"] and after["current"] != before["current"]


def test_a_growing_obstruction_is_refused_before_it_is_learned(signature, gate_folder, seasons):
    logs = logs_of(seasons / "stone")
    done = cdtool("signature", "update", signature, *logs, "-m", gate_folder / "machine.toml", "--forget", 20)
    assert done.status == 3 and ("spreads from the one first learned" in done.err or "not an impact-free" in done.err)
    last = cdtool("detect", logs[-1], "-m", gate_folder / "machine.toml", "-s", signature)
    assert "alarm" in last.out.replace("no alarm", "")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--forget", 0.5), "forget is 0.5"),
        (("--cap", 0), "error: cap is 0"),
        (("--cap", "nan"), "error: cap is nan"),
        (("--reserve", -1), "reserve is -1"),
    ],
)
def test_a_wrong_guard_is_one_line(signature, gate_folder, options, said):
    log = gate_folder / "holdout" / "01.csv"
    done = cdtool("signature", "update", signature, log, "-m", gate_folder / "machine.toml", *options)
    assert done.status == 2 and said in done.err, done.err


def test_wrong_names_and_targets_are_one_line(signature, gate_folder, tmp_path):
    free = logs_of(gate_folder)
    assert "no such file" in cdtool("signature", "show", tmp_path / "none.json").err
    wrong = check(signature, gate_folder, *free, "--target", 2)
    assert wrong.status == 2 and "target is 2" in wrong.err
    assert "target is 1e-60" in check(signature, gate_folder, *free, "--target", 1e-60).err
    other = cdtool("signature", "check", signature, gate_folder / "none.csv", "-m", gate_folder / "machine.toml")
    assert other.status == 2 and other.err.count("Traceback") == 0


def test_a_log_that_is_given_twice_counts_once(gate_folder, signature, tmp_path):
    free = logs_of(gate_folder)
    machine = ("-m", gate_folder / "machine.toml")
    few = cdtool("learn-signature", *free[:5], *free[:5], *machine, "-d", "gm", "-o", tmp_path / "few.json")
    assert few.status == 2 and "5 impact-free runs of one class" in few.err
    twin = tmp_path / "twin.csv"
    twin.write_bytes(free[2].read_bytes())
    done = cdtool("learn-signature", *free, twin, *machine, "-d", "gm", "-o", tmp_path / "s2.json")
    assert done.status == 3 and "twin.csv: has the same content as" in done.err
    assert len(json.loads((tmp_path / "s2.json").read_text())["runs"]) == len(free)
    once, twice = (
        json.loads(check(signature, gate_folder, *logs, "--json").out)["classes"][0]["coverage"]
        for logs in (free, [*free, *free])
    )
    assert once == twice


def test_limits_set_by_hand_exclude_a_factor_and_need_no_runs(gate_folder, tmp_path):
    (log, *_), machine = logs_of(gate_folder), ("-m", gate_folder / "machine.toml")
    learn = ("learn-signature", log, *machine, "-d", "gm", "--set=threshold.limits=400", "-o", tmp_path / "l.json")
    done = cdtool(*learn)
    assert done.status == 0 and "limit 400 N set by hand" in done.out and "less certain" not in done.err
    refused = cdtool(*learn, "--set=threshold.safety_factor=3")
    assert refused.status == 2 and "cannot be combined with limits set by hand" in refused.err
