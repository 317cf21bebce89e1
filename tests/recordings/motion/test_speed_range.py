"""Which of the speeds between learned ones a log runs: from its measured speed so far, and not from a contact."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.speed_course import TOLERANCE
from cdtool.recordings.motion.speed_range import FORGET, GUARD, KNOWN, SpeedRange
from cdtool.recordings.recording import Recording
from cdtool.thresholds.common_class import common_class
from tests.recordings.motion.speed_logs import log
from tests.synthetic.gate_as_recording import as_recording


def learned(speed: float, direction: int = 1) -> MotionClass:
    parts = ((direction * speed, 0.9 / speed), (0.0, 1.0))
    return common_class([log(*parts, seed=100 + i) for i in range(12)])


SLOW, FAST = learned(0.2), learned(0.3)
RANGE = SpeedRange((SLOW, FAST))
BACK = SpeedRange((learned(0.2, -1), learned(0.3, -1)))


def found_in(recording: Recording, among: SpeedRange = RANGE) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The time, where the speed fits, and the speed that it runs at."""
    time = recording["speed"].time
    return time, among.fitting(recording)[1], among.speed_so_far(recording, time)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.2, 0.3), st.integers(0, 2**31), st.sampled_from([1, -1]))
def test_a_speed_in_the_range_fits_from_end_to_end_and_is_found(speed, seed, direction):
    recording = log((direction * speed, 0.9 / speed), (0.0, 1.0), seed=seed)
    time, fits, found = found_in(recording, RANGE if direction > 0 else BACK)
    known = np.isfinite(found)
    assert np.count_nonzero(~fits) <= 10
    # The ramp of the fastest class ends 1.25 s after the log's start.
    assert time[known][0] < 1.25 + GUARD + KNOWN + 0.2
    assert known[(time > 1.9) & (time < 0.4 + 0.8 / speed)].all()
    # At first from where the fastest class is within 10 % of its speed.
    assert found[known] == pytest.approx(speed, rel=0.05)
    assert found[known & (time > 2.5)] == pytest.approx(speed, rel=0.02)


def gate_run(share: float, number: int) -> Recording:
    """An impact-free stroke of the simulated gate, at a share of its nominal speed."""
    changed = ChangedMachine(speed=share)
    run = simulate_gate_run(changed.gate(GateParameters()), np.random.default_rng([int(1e3 * share), number]), "none")
    return as_recording(changed.logged_gate(run, 0.56), f"run {number}", GateParameters()).without_ground_truth()


@pytest.mark.parametrize("slow", [0.9, 0.95])
def test_close_speeds_are_told_apart_where_they_differ_by_more_than_their_noise(slow):
    # Early in the acceleration both are equally fast: what is found there says nothing.
    among = SpeedRange(tuple(common_class([gate_run(share, 100 + i) for i in range(14)]) for share in (slow, 1.0)))
    for share in (slow, 0.5 * (slow + 1.0), 1.0):
        for number in range(4):
            time, fits, found = found_in(gate_run(share, number), among)
            nominal = share * among.classes[1].nominal_speed
            known = np.flatnonzero(np.isfinite(found))
            assert time[known[0]] < 2.5
            assert found[known] == pytest.approx(nominal, rel=0.05), (share, number)
            assert found[known[200:]] == pytest.approx(nominal, rel=0.02), (share, number)
            assert fits.mean() > 0.995


@pytest.mark.parametrize("slowed", [0.28, 0.25, 0.2, 0.1, 0.0])
def test_a_contact_that_slows_the_axis_changes_nothing_before_it_is_as_old_as_the_guard(slowed):
    usual, struck = log((0.3, 4.0)), log((0.3, 2.0), (slowed, 2.0))
    time, _, found = found_in(struck)
    free = found_in(usual)[2]
    assert np.array_equal(found[time < 2.5], free[time < 2.5], equal_nan=True)
    # From there on it stays, or follows what is older than the contact.
    assert found[time < 2.5 + GUARD] == pytest.approx(free[time < 2.5 + GUARD], abs=2e-4, nan_ok=True)
    if slowed < (1.0 - 2.0 * TOLERANCE) * 0.3:
        # Nor later: it is another speed, which does not fit before it has lasted.
        departed = (time > 2.7) & (time < 2.5 + FORGET)
        _, fits, _ = found_in(struck)
        assert not fits[departed].any()
        assert np.nanmin(found[departed]) > 0.295
