"""Arm recordings on disk: what is read back is what was simulated, and the folder stands on its own."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import UsageError
from cdtool.commands.simulate.arm_model import ArmRun, Impact, simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.recording import Recording
from tests.command import cdtool as command
from tests.synthetic.arm_as_recording import as_recording

ARM = ArmParameters()
COUNTS = {"free": 1, "holdout": 1, "stiff": 3, "soft": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Trial 1 with three stiff impacts: two as MCAP, the third as CSV."""
    made = tmp_path_factory.mktemp("arm") / "logs"
    assert simulate_arm(made, COUNTS, seed=6, trial=1, file_format="mixed") == 6
    return made


@cache
def simulated(trial: Trial, group: int, impact: Impact, number: int) -> ArmRun:
    return simulate_arm_run(ARM, np.random.default_rng([6, trial, group, number]), trial, impact)


def on_load(run: ArmRun, machine_file: MachineFile) -> Recording:
    referred: Recording = machine_file.machine.referred_to_load(as_recording(run, "run"))
    return referred


@pytest.mark.parametrize(("name", "number"), [("02.mcap", 2), ("03.csv", 3)])
def test_a_log_read_back_is_the_simulated_run_but_for_rounding(folder: Path, name: str, number: int) -> None:
    machine_file = read_machine_file(folder / "machine.toml")
    expected = on_load(simulated(1, 2, "stiff", number), machine_file)
    read = cdtool.read(folder / "stiff" / name, folder / "machine.toml")
    assert read.joints == ("arm", "forearm")
    assert set(read.channels) == set(expected.channels)
    # Far below the noise of the sensor concerned, and below one count of the encoders.
    rounding = {
        "torque": 4e-3,
        "speed": 1e-4,
        "position": 5e-6,
        "acceleration": 0.08,
        "reference_speed": 1e-4,
        "reference_position": 3e-5,
        "force": 6e-3,
    }
    for channel, limit in rounding.items():
        assert read[channel].unit == expected[channel].unit
        np.testing.assert_allclose(read[channel].time, expected[channel].time, atol=1e-9)
        np.testing.assert_allclose(read[channel].values, expected[channel].values, atol=limit)


def test_the_links_true_motion_is_found_again_on_the_load_side(folder: Path) -> None:
    run = simulated(1, 0, "none", 1)
    read = cdtool.read(folder / "free" / "01.mcap", folder / "machine.toml")
    # Motor minus link is the drive's wind-up, some 10 mrad; the sensors' low-passes lag behind.
    np.testing.assert_allclose(read["position"].values, run.joint_position, atol=0.02)
    cruise = run.time > 0.7
    np.testing.assert_allclose(
        read["speed"].values[cruise].mean(axis=0), run.joint_speed[cruise].mean(axis=0), atol=2e-3
    )
    for joint in (0, 1):
        truth, felt = run.joint_acceleration[:-3, joint], read["acceleration"].values[3:, joint]
        assert np.corrcoef(truth, felt)[0, 1] > 0.8
        assert np.polyfit(truth, felt, 1)[0] == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(("trial", "watched"), [(1, "arm"), (2, "forearm")])
def test_the_benchmark_file_watches_the_link_that_is_hit(tmp_path: Path, trial: Trial, watched: str) -> None:
    simulate_arm(tmp_path / "logs", {"free": 2, "soft": 1}, seed=6, trial=trial)
    values = tomllib.loads((tmp_path / "logs" / "benchmark.toml").read_text())
    assert values["joints"] == [watched]
    assert values["learn"]["logs"] == ["free/*.csv"]
    assert list(values["impacts"]) == ["soft"]
    assert values["signature"] == {"force": True, "position_step": 2e-3, "position_window": 22e-3, "sides": "one"}
    assert values["activation"] == {"debounce": 7}
    assert values["onset"] == {"above_n": 0.5, "back_to_n": 0.5, "hold_s": 0.003}


def test_what_cannot_be_written_is_refused_before_anything_is(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no recording is requested"):
        simulate_arm(tmp_path / "none", {}, seed=1)
    with pytest.raises(UsageError, match="not an empty folder"):
        simulate_arm(folder, COUNTS, seed=1)
    with pytest.raises(UsageError, match="encoder_counts is 0"):
        simulate_arm(tmp_path / "ideal", COUNTS, seed=1, parameters=replace(ARM, encoder_counts=0))
    with pytest.raises(UsageError, match="unknown trial 3"):
        simulate_arm(tmp_path / "third", COUNTS, seed=1, trial=3)  # type: ignore[arg-type]
    assert command("simulate", "arm", "--trial", 3, "-o", tmp_path / "third").status == 2
    assert command("simulate", "gate", "--trial", 2, "-o", tmp_path / "third").status == 2
    assert command("simulate", "arm", "--set", "format=cvs", "-o", tmp_path / "third").status == 2
    assert not any(tmp_path.iterdir())
