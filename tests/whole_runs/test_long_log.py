"""The Python API on one long log of an axis that opens and closes, with contacts in both directions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import SignatureError
from cdtool.formats.signature_store import write_signature
from tests.command import cdtool as run
from tests.synthetic.door import MACHINE, write_log


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("door")
    (path / "machine.toml").write_text(MACHINE)
    write_log(path / "free.csv", 24, {}, 1)
    write_log(path / "quiet.csv", 6, {}, 2)
    write_log(path / "hits.csv", 6, {1: 60.0, 2: 60.0, 5: 60.0}, 3)
    return path


def test_one_long_log_gives_a_signature_for_each_direction(folder):
    learned = cdtool.learn_signature([folder / "free.csv"], folder / "machine.toml", "gm", settings=MOTION)
    assert [(motion.direction, runs) for motion, runs in learned.runs] == [(1, 12), (-1, 12)]
    with pytest.raises(SignatureError, match="1 impact-free run "):
        cdtool.learn_signature([folder / "free.csv"], folder / "machine.toml", "gm")


def test_contacts_are_found_in_both_directions_and_nothing_else(folder, tmp_path):
    learned = cdtool.learn_signature([folder / "free.csv"], folder / "machine.toml", "gm", settings=MOTION)
    write_signature(tmp_path / "door.json", learned.signature)
    found = cdtool.detect(
        folder / "hits.csv", folder / "machine.toml", signature=tmp_path / "door.json", settings=MOTION
    )
    outcomes = [detection.verdict.outcome for detection in found.detections]
    assert outcomes == ["no alarm", "alarm", "alarm", "no alarm", "no alarm", "alarm"]
    sides = [detection.verdict.alarms[0].side for detection in found.detections if detection.verdict.alarms]
    assert sides == ["below", "above", "below"]
    assert found.contacts.onset_s.tolist() == pytest.approx([6.0, 10.0, 22.0], abs=0.01)


MOTION = {"operations": "motion"}
BENCHMARK = """
machine = "machine.toml"
detectors = ["gm", "pt"]
operations = "motion"
[learn]
logs = ["free.csv"]
[holdout]
logs = ["quiet.csv"]
[impacts.push]
logs = ["hits.csv"]
"""


def test_a_benchmark_scores_every_operation_of_a_long_log(folder):
    (folder / "benchmark.toml").write_text(BENCHMARK)
    results = cdtool.benchmark(folder / "benchmark.toml").results
    exposure = {(item.group, item.detector): (item.recordings, item.operations) for item in results.exposure}
    assert exposure["push", "momentum"] == (1, 6) and exposure["holdout", "pure_torque"] == (1, 6)
    rows = [(row.recording, row.contact, row.detector, row.outcome) for row in results.contacts]
    assert rows == [
        ("hits.csv", number, detector, "detected") for number in (1, 2, 3) for detector in ("momentum", "pure_torque")
    ]
    assert all(10.0 < row.latency_ms < 150.0 for row in results.contacts)
    assert results.false_alarms == () and results.skipped == ()
    assert results.contacts[0].force_at_alarm_n > 10.0


def test_forgetting_updates_follow_and_the_first_signature_stays(folder, tmp_path):
    path = tmp_path / "door.json"
    machine, cut = ("-m", folder / "machine.toml"), "--set=operations=motion"
    assert run("learn-signature", folder / "free.csv", *machine, cut, "-d", "gm", "-o", path).status == 0
    first = json.loads(path.read_text())
    done = run("signature", "update", path, folder / "quiet.csv", *machine, "--forget", 20)
    assert done.status == 0 and "6 runs added" in done.out
    second = json.loads(path.read_text())
    assert second["first"] == first["first"] and len(second["runs"]) == 30
    assert second["current"][0]["by_position"]["count"] == first["current"][0]["by_position"]["count"]
    assert second["current"][0]["by_position"]["mean"] != first["current"][0]["by_position"]["mean"]


def test_a_contact_outside_all_operations_is_reported(folder):
    write_log(folder / "rest.csv", 6, {1: 60.0}, 4)
    table = np.loadtxt(folder / "rest.csv", delimiter=",", skiprows=1)
    resting = table[-1].copy()
    tail = np.tile(resting, (4000, 1))
    tail[:, 0] = table[-1, 0] + 1e-3 * np.arange(1, 4001)
    tail[:, 2], tail[:, 4] = 0.0, 0.0
    tail[2500:2800, 4] = 200.0  # an impact on the cell long after the last stroke
    rows = np.vstack((table, tail))
    header = "t,drive,v,x,cell,hit"
    np.savetxt(folder / "rest.csv", rows, delimiter=",", header=header, comments="", fmt="%.7g")
    (folder / "rest.toml").write_text(BENCHMARK.replace("hits.csv", "rest.csv"))
    results = cdtool.benchmark(folder / "rest.toml").results
    assert [item.reason for item in results.skipped] == [
        "the contact at 26.500 s is outside all operations (cut by motion)"
    ]
    assert len(results.contacts) == 2


def test_an_unassessable_contact_has_a_reason(folder, tmp_path):
    """The speed is lost before the contact: the momentum observer is not assessable, and reports it."""
    table = np.loadtxt(folder / "hits.csv", delimiter=",", skiprows=1)
    table[(table[:, 0] > 5.9) & (table[:, 0] < 8.0), 2] = np.nan
    np.savetxt(folder / "lost.csv", table, delimiter=",", header="t,drive,v,x,cell,hit", comments="", fmt="%.7g")
    (folder / "lost.toml").write_text(BENCHMARK.replace("hits.csv", "lost.csv"))
    row = cdtool.benchmark(folder / "lost.toml").results.contacts[0]
    assert (row.detector, row.outcome) == ("momentum", "not_assessable")
    assert "missing samples" in row.reason


def test_false_alarms_are_counted_by_operation_and_named_by_the_log(folder):
    (folder / "sensitive.toml").write_text(BENCHMARK + "[signature]\nsafety_factor = 0.5\n")
    results = cdtool.benchmark(folder / "sensitive.toml").results
    alarms = [row for row in results.false_alarms if (row.group, row.detector) == ("holdout", "momentum")]
    assert {row.recording for row in alarms} == {"quiet.csv"}
    (reason,) = (text for text in results.conclusion.reasons if text.startswith("momentum, holdout: "))
    assert [row.operation for row in alarms] == [1, 3, 4, 5, 6]
    assert "5 false alarms in 5 of 6 operations" in reason
