"""Machines with several joints in every command: selected joints, unassessable joints, alarms that name their joint."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import cdtool as api
from cdtool.base.errors import UsageError
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.detectors import DETECTORS
from tests.command import cdtool


@pytest.fixture(scope="module")
def forearm(tmp_path_factory) -> Path:
    """Trial 2: the forearm is hit while it keeps its direction, and the arm leads the motion."""
    folder = tmp_path_factory.mktemp("forearm") / "logs"
    simulate_arm(folder, {"free": 10, "holdout": 2, "stiff": 2, "soft": 1}, seed=5, trial=2)
    return folder


def learn(folder: Path, output: Path, *options: object) -> None:
    free = sorted((folder / "free").iterdir())
    done = cdtool("learn-signature", *free, "-m", folder / "machine.toml", "-d", "gm", "-o", output, *options)
    assert done.status == 0, done.err


def test_a_benchmark_monitors_the_joints_it_names_and_shows_them(forearm):
    results = api.benchmark(forearm / "benchmark.toml").results
    assert results.provenance["watched_joints"] == "forearm"
    assert {item.joint for item in results.contacts if item.joint} == {"forearm"}
    done = cdtool("benchmark", forearm / "benchmark.toml")
    # The friction EKF cannot assess a joint at rest, which is reported and counts as left out.
    assert done.status == 3 and "joints monitored, of all: forearm" in done.out


def test_a_detector_without_assessable_samples_does_not_stop_the_others(forearm):
    results = api.benchmark(forearm / "benchmark.toml").results
    blind = [item for item in results.contacts if item.detector == "friction_ekf"]
    assert len(blind) == 3 and {item.outcome for item in blind} == {"not_assessable"}
    assert all("not applicable" in (item.reason or "") for item in blind)
    assert not [item for item in results.false_alarms if item.detector == "friction_ekf"]
    assert any(item.recording == "friction_ekf" and "not assessable" in item.reason for item in results.findings)
    assert not results.skipped
    seen = [item.outcome for item in results.contacts if item.detector == "inertial_momentum"]
    assert seen == ["detected"] * 3


def test_a_signature_monitors_the_joints_it_was_learned_for(forearm, tmp_path):
    signature = tmp_path / "forearm.json"
    learn(forearm, signature, "--set=joints=forearm")
    log = forearm / "stiff" / "01.csv"
    done = cdtool("detect", log, "-m", forearm / "machine.toml", "-s", signature, "--json")
    alarms = json.loads(done.out)[0]["alarms"]
    assert alarms and {alarm["joint"] for alarm in alarms} == {"forearm"}
    refused = cdtool("detect", log, "-m", forearm / "machine.toml", "-s", signature, "--set=joints=arm")
    assert refused.status == 2 and "joints: cannot be combined with a signature" in refused.err
    more = forearm / "holdout" / "01.csv"
    added = cdtool("signature", "update", signature, more, "-m", forearm / "machine.toml", "--json")
    assert added.status == 0 and len(json.loads(added.out)["added"]) == 1


def test_a_robot_signature_monitors_every_joint_on_both_sides_by_default(forearm, tmp_path):
    learn(forearm, tmp_path / "all.json")
    stored = json.loads((tmp_path / "all.json").read_text())["current"][0]
    assert stored["joints"] == ["arm", "forearm"] and stored["sides"] == "two"


def test_a_benchmark_runs_the_given_detectors_or_all_that_the_logs_allow(forearm, tmp_path):
    results = api.benchmark(forearm / "benchmark.toml", detectors=("vo", "gm")).results
    assert results.detectors == ("velocity", "momentum")
    every = api.benchmark(forearm / "benchmark.toml", detectors=("all",)).results
    without_reference = {name for name in DETECTORS.names() if "reference_torque" in DETECTORS.load(name).needs}
    assert list(every.detectors) == [name for name in DETECTORS.names() if name not in without_reference]
    assert {item.recording for item in every.findings if "needs the channel" in item.reason} == without_reference
    assert not every.skipped
    text = (forearm / "machine.toml").read_text()
    (forearm / "blind.toml").write_text("".join(line for line in text.splitlines(True) if "az_1" not in line))
    setup = (forearm / "benchmark.toml").read_text().replace("machine.toml", "blind.toml")
    (forearm / "without.toml").write_text(setup)
    fewer = api.benchmark(forearm / "without.toml", detectors=("all",)).results
    left = {item.recording for item in fewer.findings if "needs the channel 'acceleration'" in item.reason}
    assert left == {name for name in DETECTORS.names() if "acceleration" in DETECTORS.load(name).needs}
    assert list(fewer.detectors) == [name for name in DETECTORS.names() if name not in left | without_reference]
    with pytest.raises(UsageError, match="contain a repetition"):
        api.benchmark(forearm / "benchmark.toml", detectors=("gm", "momentum"))
