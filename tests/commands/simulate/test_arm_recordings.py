"""Arm recordings on disk: what is read back is what was simulated, and the folder stands on its own."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.commands.simulate.arm_model import ArmRun, Impact, simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.recording import Recording
from tests.command import cdtool as command
from tests.command import keys
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


def _simulated(folder, free, holdout, stiff, machine="gate"):
    counts = keys(free=free, holdout=holdout, stiff=stiff, soft=0)
    done = command("simulate", machine, *counts, "--seed", 5, "-o", folder)
    assert done.status == 0, done.err
    return done.out


@pytest.mark.parametrize("counts", [(2, 0, 1), (2, 1, 0), (10, 0, 1), (2, 0, 1, "arm")])
def test_the_written_benchmark_runs(tmp_path, counts):
    assert "benchmark.toml" in _simulated(tmp_path / "gate", *counts).splitlines()[0]
    done = command("benchmark", tmp_path / "gate" / "benchmark.toml", "--detectors", "pt")
    assert done.status == 0, done.err
    forced = "force = true" in (tmp_path / "gate" / "benchmark.toml").read_text(encoding="utf-8")
    assert forced == (counts[0] < 10)


@pytest.mark.parametrize(
    ("counts", "why"),
    [((0, 1, 1), "--set free=10"), ((1, 0, 1), "--set free=10"), ((2, 0, 0), "set holdout, stiff or soft")],
)
def test_an_unusable_benchmark_is_not_written_and_the_reason_is_shown(tmp_path, counts, why):
    shown = _simulated(tmp_path / "gate", *counts).splitlines()
    assert not (tmp_path / "gate" / "benchmark.toml").exists()
    assert len(shown) == 2 and shown[1].startswith("no benchmark.toml: ") and shown[1].endswith(why)
    assert "recordings" in shown[0] or counts == (0, 0, 1)
