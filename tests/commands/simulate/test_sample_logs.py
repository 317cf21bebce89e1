"""The simulated sample logs are what the commands beside them in sample_logs/README.md give."""

from __future__ import annotations

import csv
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.commands.simulate.recording_folder import GROUPS
from tests.command import cdtool as command

SAMPLES = Path(__file__).parents[3] / "sample_logs"
# The gate's long logs take a second each to write and read: one group of them stands for the others.
FOLDERS = {"gate": ("stiff",), "arm/trial_1": GROUPS, "arm/trial_2": GROUPS}
# Another processor may round otherwise, and an encoder that counts one step earlier or later shows in speed and torque.
ROUNDING = {
    "m": {"torque": 20.0, "speed": 2e-3, "position": 1e-5, "acceleration": 2e-2, "force": 1.0},
    "rad": {"torque": 0.05, "speed": 2e-3, "position": 1e-4, "acceleration": 0.1, "force": 0.05},
}


def words_of_the_command_for(folder: str) -> list[str]:
    """The words behind `cdtool` that write a folder, without the output's name and the groups left out."""
    lines = re.findall(r"^cdtool (simulate .*)$", (SAMPLES / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    (line,) = [line for line in lines if line.endswith(f" -o sample_logs/{folder}")]
    words = shlex.split(line)[:-1]
    for group in set(GROUPS) - set(FOLDERS[folder]):
        words = [f"{group}=0" if word.startswith(f"{group}=") else word for word in words]
    return words


@pytest.mark.parametrize("folder", FOLDERS)
def test_the_sample_logs_are_what_their_command_gives(folder: str, tmp_path: Path) -> None:
    made, kept = tmp_path / "made", SAMPLES / folder
    done = command(*words_of_the_command_for(folder), made)
    assert done.status == 0, done.err
    for group in FOLDERS[folder]:
        names = sorted(path.name for path in (made / group).iterdir())
        assert names == sorted(path.name for path in (kept / group).iterdir())
        for name in names:
            assert_same_recording(made / group / name, kept / group / name, kept / "machine.toml")
    whole = ("benchmark.toml",) if FOLDERS[folder] == GROUPS else ()
    for name in ("machine.toml", *whole):
        assert (made / name).read_text(encoding="utf-8") == (kept / name).read_text(encoding="utf-8")
    # Without runs to learn from there is no benchmark file.
    lines = (made / "benchmark.toml").read_text(encoding="utf-8").splitlines() if "free" in FOLDERS[folder] else []
    assert set(lines) <= set((kept / "benchmark.toml").read_text(encoding="utf-8").splitlines())
    new, old = contacts_of(made), contacts_of(kept)
    assert list(new) == [name for name in old if name.split("/")[0] in FOLDERS[folder]]
    for name, instant in new.items():
        assert instant == pytest.approx(old[name], abs=1e-4)


def contacts_of(folder: Path) -> dict[str, float]:
    with (folder / "contacts.csv").open(encoding="utf-8", newline="") as stream:
        return {row["recording"]: float(row["true_contact_s"]) for row in csv.DictReader(stream)}


def assert_same_recording(made: Path, kept: Path, machine: Path) -> None:
    one, other = (cdtool.read(path, machine) for path in (made, kept))
    assert set(one.channels) == set(other.channels)
    rounding = ROUNDING[one["position"].unit]
    for channel, series in one.channels.items():
        np.testing.assert_allclose(series.time, other[channel].time, atol=1e-9)
        limit = rounding[channel.removeprefix("reference_")]
        np.testing.assert_allclose(series.values, other[channel].values, atol=limit, err_msg=f"{kept}: {channel}")


def test_the_limits_added_by_hand_hold_with_room() -> None:
    limits = cdtool.benchmark(SAMPLES / "gate" / "benchmark.toml", jobs=2).results.limits
    assert len(limits) > 40 and {item.outcome for item in limits} == {"met"}
    for item in limits:
        if item.figure in ("p95_ms", "force_at_alarm_max_n"):
            assert item.value is not None and item.largest is not None
            assert 1.2 * item.value < item.largest
