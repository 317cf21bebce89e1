"""The guarded update: what one run and all runs together may move, and a fault that grows slowly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge_alone, run_detector
from cdtool.base.errors import SignatureError, UsageError
from cdtool.detectors.detection import Status
from cdtool.detectors.momentum import Momentum
from cdtool.recordings.operations import operations_of
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.guarded_update import CAP, check_complete, guarded, largest_move
from cdtool.thresholds.signature import Signature
from tests.synthetic.ageing import GATE, ageing_run
from tests.synthetic.gate_as_recording import as_recording
from tests.thresholds.strokes import TIME, N, noise_runs, signal, stroke

CLEAN = stroke()
TRAVEL = CLEAN["position"].values[:, 0]
FIRST = Signature(safety_factor=5.0, sides="two").fit(noise_runs(14))


def moved(old: FittedSignature, new: FittedSignature, curve: str = "by_travel") -> np.ndarray:
    """How far both limits moved (2, g) in the signal's unit, where both are known."""
    pairs = zip(old.limits(getattr(old, curve)), new.limits(getattr(new, curve)), strict=True)
    return np.array([np.nan_to_num(after - before)[:, 0] for before, after in pairs])


def odd_run(offset: float, bump: float, place: float, seed: int):
    """White noise that is `offset` N off all along and `bump` N more within 2 cm of a place."""
    noise = np.random.default_rng(seed).normal(size=N)
    return signal(100.0 + noise + offset + bump * (np.abs(TRAVEL - place) < 0.02))


ODD_RUNS = st.builds(odd_run, st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(0.0, 0.6), st.integers(0, 1000))


@settings(max_examples=40, deadline=None)
@given(ODD_RUNS, st.sampled_from([None, 3.0, 20.0]), st.floats(0.5, 6.0))
def test_one_run_moves_no_limit_further_than_is_stated(odd, forget, cap):
    updated = FIRST.with_run(CLEAN, odd, forget, cap)
    weight = 1.0 / forget if forget else 1.0 / 15.0
    for curve in ("by_travel", "by_time"):
        spread = np.nanmax(getattr(FIRST, curve).band(True)[1])
        assert np.abs(moved(FIRST, updated, curve)).max() <= largest_move(5.0, weight, cap) * spread * (1.0 + 1e-9)


@settings(max_examples=10, deadline=None)
@given(st.lists(ODD_RUNS, min_size=10, max_size=25), st.sampled_from([None, 3.0, 20.0]), st.floats(0.5, 4.0))
def test_all_runs_together_move_no_limit_further_than_the_reserve(odd_runs, forget, reserve):
    current = FIRST
    for odd in odd_runs:
        try:
            current = guarded(FIRST, current, CLEAN, odd, forget, CAP, reserve)
        except SignatureError as fault:
            assert "the limit would be" in fault.message
    spread = FIRST.by_travel.band(True)[1][:, 0]
    running = FIRST.by_travel.grid > 0.11  # before, time counts
    assert (np.abs(moved(FIRST, current)) <= reserve * spread * (1.0 + 1e-9))[:, running].all()


def test_a_run_off_by_the_cap_all_along_moves_an_even_limit_by_the_closed_form():
    weight, factor = 1.0 / 20.0, 5.0
    spread = FIRST.by_travel.band(True)[1][:, 0]
    updated = FIRST.with_run(CLEAN, signal(np.full(N, 1e6)), 20.0, CAP)
    grown = np.sqrt((1.0 - weight) * (1.0 + weight * CAP**2)) - 1.0
    expected = (weight * CAP + factor * grown) * spread
    middle = slice(100, 250)
    assert np.median(moved(FIRST, updated)[1][middle] / expected[middle]) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("forget", [None, 20.0])
def test_a_run_within_the_cap_changes_what_a_plain_update_changes(forget):
    calm = signal(100.0 + 0.5 * np.sin(40.0 * TIME))
    plain, held = FIRST.with_run(CLEAN, calm, forget), guarded(FIRST, FIRST, CLEAN, calm, forget)
    for name in ("count", "mean", "squares"):
        np.testing.assert_array_equal(getattr(held.by_travel, name), getattr(plain.by_travel, name))
        np.testing.assert_array_equal(getattr(held.by_time, name), getattr(plain.by_time, name))


def test_without_drift_the_cap_costs_half_a_per_cent_of_the_spread():
    plain = held = FIRST
    for recording, item in noise_runs(150, seed=5):
        plain, held = plain.with_run(recording, item), guarded(FIRST, held, recording, item)
    spreads = [item.by_travel.band(True)[1][60:300, 0] for item in (plain, held)]
    lost = 1.0 - np.median(spreads[1] / spreads[0])
    assert 0.001 < lost < 0.005


def test_a_run_that_ends_early_is_refused_with_the_share_it_covered():
    short = stroke(time=TIME[:2600])
    item = signal(np.full(2600, 100.0), TIME[:2600])
    with pytest.raises(SignatureError, match=r"covers 5[0-9] % of the learned stroke: not completed"):
        guarded(FIRST, FIRST, short, item)
    check_complete(FIRST, CLEAN, signal(np.full(N, 100.0)))
    by_time = Signature(alignment="time").fit(noise_runs(12))
    with pytest.raises(SignatureError, match="not completed"):
        check_complete(by_time, short, item)


def test_a_limit_that_would_be_lost_amid_the_stroke_is_refused():
    current = FIRST
    with pytest.raises(SignatureError, match=r"at 0\.\d\d m no limit would be left"):
        for seed in range(12):
            item = odd_run(0.0, 0.0, 0.0, seed)
            item.status[2400:2600] = Status.GAP
            current = guarded(FIRST, current, CLEAN, item)


@pytest.mark.parametrize("wrong", [{"cap": 0.0}, {"reserve": -1.0}, {"cap": float("nan")}])
def test_a_cap_or_reserve_that_is_not_above_0_is_refused(wrong):
    with pytest.raises(UsageError, match="a number of spreads above 0"):
        guarded(FIRST, FIRST, CLEAN, signal(np.full(N, 100.0)), **wrong)


def test_a_slowly_growing_obstruction_is_not_learned_while_a_plain_update_learns_it(gate):
    """Each run resists a little more at 0.9 m; no run but an alarmed one is kept from either update."""
    detector, activation = Momentum(), Activation()

    def operation(run, name):
        (cut,) = operations_of(gate.referred_to_load(as_recording(run, name, GATE)))
        return cut, run_detector(cut, gate, detector)

    pairs = [operation(ageing_run(number, 3), f"free{number}") for number in range(1, 21)]
    first = Signature(sides="one").fit([(cut.recording.without_ground_truth(), item) for cut, item in pairs])
    plain = held = first
    alarms = {"plain": [], "guarded": []}
    refused = 0
    for number in range(1, 81):
        cut, item = operation(ageing_run(number, 7, obstruction=number - 1.0), f"season{number}")
        bare = cut.recording.without_ground_truth()
        if judge_alone(cut, "", item, (plain,), activation).verdict.outcome == "alarm":
            alarms["plain"].append(number)
        else:
            plain = plain.with_run(bare, item, 20.0)
        if judge_alone(cut, "", item, (held,), activation).verdict.outcome == "alarm":
            alarms["guarded"].append(number)
            continue
        try:
            held = guarded(first, held, bare, item, 20.0)
        except SignatureError as fault:
            refused += 1
            assert "at 0.9" in fault.message or "at 0.8" in fault.message
    assert alarms["plain"] == []
    assert refused > 10
    assert alarms["guarded"][0] < 60
    assert len([number for number in alarms["guarded"] if number > 60]) > 10
