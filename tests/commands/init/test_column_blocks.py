"""`cdtool init` on tables without names: blocks of one column per joint, in any order."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.commands.init.channel_guess import guess_channels
from cdtool.commands.init.stream import Stream
from tests.commands.init.layouts.motion import arm_motion

QUANTITIES = {
    "q": "position", "qd": "speed", "i": "torque", "q_des": "reference_position", "qd_des": "reference_speed",
}  # fmt: skip


def blocks_of(order, at_rest=(), joints=3, seed=4):
    """Return the channels found in blocks of this order, each by the name of its block."""
    generator = np.random.default_rng(seed)
    m = arm_motion(generator, joints, rate=60.0, duration=15.0, at_rest=at_rest)
    values = {
        "q": m.position, "qd": m.noisy(m.speed, generator), "qdd": m.noisy(m.acceleration, generator), "i": m.effort,
        "q_des": m.reference_position, "qd_des": m.reference_speed,
        "T": 30.0 + generator.normal(0.0, 0.1, m.effort.shape), "f": generator.normal(0.0, 2.0, m.effort.shape),
    }  # fmt: skip
    columns = np.hstack([values[name] for name in order])
    streams = [Stream(str(k), (str(k),), None, m.time, columns[:, k : k + 1]) for k in range(columns.shape[1])]
    found = guess_channels(streams, topics=False)
    assert found.joints == joints
    firsts = {channel: int(item.stream.columns[0]) for channel, item in found.found.items()}
    assert all(first % joints == 0 for first in firsts.values())
    return {channel: order[first // joints] for channel, first in firsts.items()}


@pytest.mark.parametrize(
    "order",
    [
        ("q", "qd", "i"),
        ("q", "qd", "f", "i", "T"),
        ("q", "i", "qd"),
        ("q", "qd", "qdd", "i"),
        ("T", "f", "qd", "q", "i"),
    ],
    ids=" ".join,
)
def test_measured_blocks_are_found_in_any_order(order):
    found = blocks_of(order)
    assert {channel: QUANTITIES[name] for channel, name in found.items()} == {
        "position": "position", "speed": "speed", "torque": "torque",
    }  # fmt: skip


@pytest.mark.parametrize(
    "order", [("q_des", "qd_des", "q", "qd", "i"), ("q", "qd", "q_des", "qd_des", "i")], ids=" ".join
)
def test_the_block_that_is_ahead_is_the_set_value(order):
    found = blocks_of(order)
    assert {channel: QUANTITIES[name] for channel, name in found.items() if name != "qd_des"} == {
        "position": "position", "speed": "speed", "torque": "torque", "reference_position": "reference_position",
    }  # fmt: skip


def test_noise_has_no_blocks():
    generator, time = np.random.default_rng(3), np.arange(1000) * 1e-2
    streams = [Stream(str(k), (str(k),), None, time, generator.normal(0.0, 1.0, (1000, 1))) for k in range(12)]
    assert not guess_channels(streams, topics=False).found
