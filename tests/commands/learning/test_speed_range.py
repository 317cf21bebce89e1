"""Signatures for the speeds between learned ones, from logs to verdicts: learned, stored, set for a budget, updated."""

from __future__ import annotations

from pathlib import Path

import pytest

import cdtool
from cdtool.commands.signature.shown import show_file
from cdtool.formats.signature_store import read_signature, write_signature
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.signature import Signature
from tests.synthetic.door import MACHINE, write_log

SPEEDS = {"slow": 0.2, "fast": 0.3, "middle": 0.25}
RULE = Signature(sides="one", speed_range=True)


@pytest.fixture(scope="module")
def door(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("door")
    (path / "machine.toml").write_text(MACHINE)
    for seed, (name, speed) in enumerate(SPEEDS.items()):
        write_log(path / f"{name}.csv", 24, {}, seed, speed)
        write_log(path / f"{name}_hits.csv", 6, {1: 60.0, 2: 60.0, 5: 60.0}, 10 + seed, speed)
    return path


def learn(door: Path, *names: str, rule: Signature = RULE, **options):
    logs = [door / f"{name}.csv" for name in names]
    return cdtool.learn_signature(
        logs, door / "machine.toml", "gm", rule=rule, settings={"operations": "motion"}, **options
    )


def outcomes(door: Path, name: str, learned) -> list[str]:
    write_signature(door / "s.json", learned.signature)
    found = cdtool.detect(
        door / f"{name}.csv", door / "machine.toml", signature=door / "s.json", settings={"operations": "motion"}
    )
    return [item.verdict.outcome for item in found.detections]


@pytest.fixture(scope="module")
def learned(door):
    return learn(door, "slow", "fast")


def test_contacts_between_the_speeds_raise_alarms_and_free_strokes_do_not(door, learned):
    hits = ["no alarm", "alarm", "alarm", "no alarm", "no alarm", "alarm"]
    assert [outcomes(door, f"{name}_hits", learned) for name in ("slow", "middle", "fast")] == [hits] * 3
    assert set(outcomes(door, "middle", learned)) == {"no alarm"}


def test_the_file_holds_the_classes_and_the_option(door, learned, capsys):
    write_signature(door / "stored.json", learned.signature)
    stored = read_signature(door / "stored.json")
    assert stored.settings == {"sides": "one", "speed_range": True}
    assert [item.to_dict() for item in stored.current] == [item.to_dict() for item in learned.signature.current]
    assert len(stored.current) == 4 and all(item.speed_range for item in stored.current)
    assert not learned.findings
    show_file(stored)
    shown = capsys.readouterr().out
    assert "speed_range True" in shown
    assert "between learned speeds: forward at 0.2 m/s to 0.3 m/s" in shown
    assert "between learned speeds: backward at 0.2 m/s to 0.3 m/s" in shown


def test_a_single_speed_is_reported_once_for_each_direction(door):
    findings = learn(door, "slow").findings
    assert [item.kind for item in findings] == ["single_speed"] * 2
    assert "speed_range has no effect" in findings[0].reason and "forward at 0.2" in findings[0].reason
    assert "backward at 0.2" in findings[1].reason
    file = door / "benchmark.toml"
    file.write_text(
        'machine = "machine.toml"\ndetectors = ["gm"]\noperations = "motion"\n[learn]\nlogs = ["slow.csv"]\n'
        '[signature]\nspeed_range = true\n[impacts.push]\nlogs = ["slow_hits.csv"]\n',
        encoding="utf-8",
    )
    results = cdtool.benchmark(file).results
    assert [item.kind for item in results.findings].count("single_speed") == 2
    assert [row.outcome for row in results.contacts] == ["detected"] * 3


@pytest.mark.parametrize(("logs", "pooled"), [(["slow"], 0), (["slow", "fast"], 2)])
def test_limits_of_two_speeds_in_one_are_reported_with_both(door, logs, pooled):
    """Of each direction; a threshold with classes of motion does not pool them."""
    found = [item for item in learn(door, *logs, rule=Limit()).findings if item.kind == "speeds_pooled"]
    assert len(found) == pooled and all("0.2 m/s and" in item.reason and "0.3 m/s" in item.reason for item in found)
    assert "speeds_pooled" not in [item.kind for item in learn(door, *logs, rule=Signature(force=True)).findings]


def test_a_run_between_the_classes_teaches_none_of_them(door, learned):
    write_log(door / "near.csv", 2, {}, 20, 0.214)
    write_signature(door / "updated.json", learned.signature)
    done = cdtool.update_signature(
        door / "updated.json", [door / "near.csv", door / "slow_hits.csv"], door / "machine.toml"
    )
    assert all("no signature for its class" in item.reason for item in done.refused if "near" in item.recording)
    assert len(done.added) == 3 and all("slow" in name for name in done.added)
