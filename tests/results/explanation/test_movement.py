"""What left its own past first, on channels with known steps and on the simulated gate."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.recordings.recording import Recording, Series
from cdtool.results.explanation.departure import COMMANDS, STAYED, Departure, departures
from cdtool.truth.onset import OnsetRule, find_contacts

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"
TIME = np.arange(5000) * 1e-3
ONSET = 3.0


def kink(at: float, slope: float, noise: float, seed: int) -> np.ndarray:
    """Noise on a slow ramp whose slope changes at a known time."""
    rng = np.random.default_rng(seed)
    return 0.3 * TIME + slope * np.clip(TIME - at, 0.0, None) + noise * rng.normal(size=len(TIME))


def step(at: float, height: float, noise: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 2.0 + height * (at <= TIME) + noise * rng.normal(size=len(TIME))


def recording(**channels: np.ndarray) -> Recording:
    return Recording("r", "r", ("axis",), {name: Series(TIME, values, "1") for name, values in channels.items()})


def which_moved_first(
    log: Recording, joint: str, around: float, lead: float = 0.05, after: float = 0.5
) -> tuple[Departure, ...]:
    return departures(log, None, joint, joint, around - lead, around + after)


def moved(found: tuple[Departure, ...]) -> dict[str, float]:
    return {item.channel: item.time for item in found if not math.isnan(item.time)}


THREE = recording(
    torque=step(3.12, 5.0, 0.1, 1),
    speed=kink(3.05, -40.0, 0.02, 2),
    acceleration=step(3.01, -3.0, 0.05, 3),
    reference_speed=np.full(len(TIME), 0.2),
)


def test_channels_come_in_the_order_of_their_known_changes_with_time_and_direction():
    found = which_moved_first(THREE, "axis", ONSET)
    assert [item.channel for item in found] == ["acceleration", "speed", "torque", "reference_speed"]
    assert [item.direction for item in found] == ["down", "down", "up", ""]
    assert [item.time for item in found[:3]] == pytest.approx([3.01, 3.05, 3.12], abs=0.018)
    assert (found[3].reason, math.isnan(found[3].time)) == (STAYED, True)


def test_missing_samples_and_a_lone_spike_neither_move_a_channel_nor_hide_its_movement():
    values = step(3.01, -3.0, 0.05, 3)
    values[1000:5000:3] = np.nan
    found = moved(which_moved_first(recording(acceleration=values), "axis", ONSET))
    assert found["acceleration"] == pytest.approx(3.01, abs=0.018)
    values = step(3.01, -3.0, 0.05, 3)
    values[2970] = 90.0
    found = moved(which_moved_first(recording(acceleration=values), "axis", ONSET))
    assert found["acceleration"] == pytest.approx(3.01, abs=0.018)


@pytest.mark.parametrize("name", ["01.mcap", "02.mcap", "03.csv", "04.csv"])
def test_a_stiff_impact_of_the_gate_moves_acceleration_then_speed_then_torque(name):
    log = cdtool.read(GATE / "stiff" / name, GATE / "machine.toml")
    (contact,) = find_contacts(log, OnsetRule(above=20.0, back_to=8.0))
    found = moved(which_moved_first(log, "gate", contact.start))
    order = [channel for channel in found if channel in ("acceleration", "speed", "torque")]
    assert order[:2] == ["acceleration", "speed"] and order[2:] in ([], ["torque"])
    assert 0.0 < found["acceleration"] - contact.start < 0.025
    assert not set(found) & set(COMMANDS)


def test_in_runs_without_contact_hardly_a_channel_moves():
    looks, seen = 0, 0
    for path in sorted((GATE / "holdout").iterdir()):
        log = cdtool.read(path, GATE / "machine.toml")
        for around in np.arange(3.0, 7.4, 0.4):
            found = which_moved_first(log, "gate", float(around))
            looks, seen = looks + len(found), seen + len(moved(found))
    assert looks > 250 and seen <= 0.03 * looks
