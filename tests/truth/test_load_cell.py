"""Contacts on load cells with drift, jumps, coarse steps, slow sampling or jitter, and logs that begin in a contact."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.onset import OnsetRule, find_contacts
from cdtool.truth.rest_level import RunningRest

GATE = OnsetRule(above=20.0, back_to=8.0)
SPEED, STIFFNESS = 0.2, 22e3  # a soft impact of the gate: 4.4 N in the first millisecond
END = 8.0


def clock(rate: float, jitter: float = 0.0, seed: int = 0) -> FloatArray:
    """Times of a cell at that sample rate, each delayed by up to a share of its period."""
    rng = np.random.default_rng(seed)
    return (np.arange(int(END * rate)) + jitter * rng.uniform(0.0, 1.0, int(END * rate))) / rate


def pulse(time: FloatArray, onset: float, length: float = 0.3, peak: float = 1000.0) -> FloatArray:
    inside = (time >= onset) & (time < onset + length)
    return np.where(inside, peak * np.sin(np.pi * (time - onset) / length), 0.0)


def noise(time: FloatArray, sigma: float = 3.0, seed: int = 1) -> FloatArray:
    return np.random.default_rng(seed).normal(0.0, sigma, len(time))


def contacts(time: FloatArray, force: FloatArray, rule: OnsetRule = GATE) -> list[Contact]:
    return find_contacts(Recording("r", "r", ("axis",), {"force": Series(time, force, "N")}), rule)


T = clock(1000.0)
DRIFTS = {
    "none": 0.0 * T,
    "rising, 30 N over 7 s": 30.0 * T / 7.0,
    "falling, 30 N over 7 s": -30.0 * T / 7.0,
    "slow sine": 15.0 * np.sin(2.0 * np.pi * 0.15 * T),
    "step at rest": 12.0 * (T > 3.0),
}


@pytest.mark.parametrize("rule", [GATE, OnsetRule()], ids=["levels by hand", "levels from the noise"])
@pytest.mark.parametrize("drift", DRIFTS)
def test_no_drift_moves_the_onset_by_more_than_three_samples(drift, rule):
    cell = noise(T, 2.0 if rule.above else 3.0)
    clean = contacts(T, pulse(T, 6.0) + cell, rule)
    found = contacts(T, pulse(T, 6.0) + cell + DRIFTS[drift], rule)
    assert [item.start for item in found] == pytest.approx([clean[0].start], abs=3.01e-3)
    assert found[0].peak_force == pytest.approx(clean[0].peak_force, abs=5.0)
    assert found[0].rest == pytest.approx(DRIFTS[drift][6000], abs=2.5)
    assert found[0].shift == pytest.approx(DRIFTS[drift][6000] - DRIFTS[drift][0], abs=5.0)


@pytest.mark.parametrize("seed", [140, 1307])
def test_the_few_readings_of_a_slow_cell_are_no_slope_that_makes_noise_a_contact(seed):
    """Two of 2,000 logs of noise at 40 Hz, in which the level extended from the first readings is far off."""
    time = clock(40.0)
    force = np.random.Generator(np.random.PCG64(seed)).normal(0.0, 3.0, len(time))
    assert contacts(time, force) == []


@pytest.mark.parametrize("drift", DRIFTS)
@pytest.mark.parametrize("sigma", [0.3, 3.0])
def test_a_drifting_cell_without_a_contact_shows_none(drift, sigma):
    for seed in range(5):
        assert contacts(T, noise(T, sigma, seed) + DRIFTS[drift]) == []
    if sigma == 3.0:  # levels of eight deviations of a noise of 0.3 N are below what the drift adds while at rest
        assert contacts(T, noise(T, sigma) + DRIFTS[drift], OnsetRule()) == []


@pytest.mark.parametrize("length", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("offset", [0.0, 4.0])
def test_a_log_that_begins_in_contact_has_it_in_progress_and_its_release_is_no_contact(length, sign, offset):
    force = offset + sign * 500.0 * (length > T) + noise(T)
    (begun,) = contacts(T, force)
    assert begun.in_progress
    assert (begun.start, begun.end) == (T[0], pytest.approx(length, abs=2e-3))
    begun, later = contacts(T, force + sign * pulse(T, 6.0))
    assert begun.in_progress and not later.in_progress
    assert later.start == pytest.approx(6.001, abs=1.1e-3)
    assert later.rest == pytest.approx(offset, abs=1.0)


@pytest.mark.parametrize(
    "course",
    [
        lambda t: 800.0 * np.exp(-t / 0.15) * (t < 0.6),  # falling from the peak
        lambda t: np.where(t < 0.5, 100.0 + 1200.0 * t, 0.0),  # still rising
        lambda t: np.where(t < 0.4, 500.0, np.where(t < 2.0, 150.0, 0.0)),  # an impact, then a steady push
    ],
    ids=["falling", "rising", "in two levels"],
)
def test_whatever_the_force_does_at_the_start_its_release_is_never_an_onset(course):
    found = contacts(T, course(T) + noise(T) + pulse(T, 6.0))
    assert [item.in_progress for item in found] == [True, False]
    assert found[1].start == pytest.approx(6.001, abs=1.1e-3)


def test_contacts_0_3_s_apart_are_each_found_over_the_rest_before_them():
    onsets = (4.0, 4.5, 5.0, 5.5)
    force = sum(pulse(T, onset, 0.2) for onset in onsets) + noise(T) + DRIFTS["rising, 30 N over 7 s"]
    found = contacts(T, force, OnsetRule(20.0, 8.0, separation=0.1))
    assert [item.start for item in found] == pytest.approx([onset + 0.001 for onset in onsets], abs=1.1e-3)


@pytest.mark.parametrize("rule", [GATE, OnsetRule()], ids=["levels by hand", "levels from the noise"])
@pytest.mark.parametrize(("rate", "jitter"), [(1000, 0.0), (1000, 0.9), (100, 0.0), (100, 0.9), (62.5, 0.0), (60, 0.9)])
def test_the_onset_is_within_its_uncertainty_of_the_truth_at_every_rate(rate, jitter, rule):
    for seed in range(10):
        time = clock(rate, jitter, seed)
        true = 5.9 + 0.03 * seed
        force = STIFFNESS * SPEED * np.clip(time - true, 0.0, 0.5) + noise(time, seed=seed)
        found, *_ = contacts(time, force, rule)
        back = (rule.back_to or 24.0) / (STIFFNESS * SPEED)  # from touch until the lower level
        assert true - 2.0 / rate <= found.start <= true + back + 4.0 / rate  # noise may pass the lower level before
        assert found.start < time[np.argmax(force)]
        assert found.resolution >= 1.0 / rate - 1e-9


@pytest.mark.parametrize(("rate", "jitter"), [(62.5, 0.0), (60, 0.9), (100, 0.0)])
@pytest.mark.parametrize("rule", [GATE, OnsetRule()], ids=["levels by hand", "levels from the noise"])
def test_one_sample_of_157_newtons_of_a_slow_cell_is_a_contact(rate, jitter, rule):
    time = clock(rate, jitter)
    force = noise(time)
    hit = int(5.0 * rate)
    force[hit] = 157.0
    (found,) = contacts(time, force, rule)
    assert (found.start, found.peak_force) == (time[hit], pytest.approx(157.0, abs=3.0))


def test_three_samples_at_1_khz_are_a_contact_and_one_is_not():
    for samples, count in ((1, 0), (2, 0), (3, 1)):
        force = noise(T)
        force[5000 : 5000 + samples] = 157.0
        assert len(contacts(T, force)) == count


def test_missing_samples_and_gaps_are_skipped_and_a_hole_before_the_onset_is_in_the_uncertainty():
    force = pulse(T, 6.0) + noise(T, 1.0)
    force[np.random.default_rng(3).random(len(T)) < 0.1] = np.nan
    force[(T > 2.0) & (T < 3.5)] = np.nan
    (found,) = contacts(T, force)
    assert found.start == pytest.approx(6.001, abs=4e-3)
    force[(T > 5.95) & (T < 6.02)] = np.nan
    (found,) = contacts(T, force)
    assert found.start - found.uncertainty <= 6.0 < found.start
    assert found.resolution > 0.06
    kept = (T < 2.0) | (T > 3.5)  # rows that do not exist
    assert contacts(T[kept], (pulse(T, 6.0) + noise(T))[kept])[0].start == pytest.approx(6.001, abs=1.1e-3)


def test_hours_of_a_drifting_cell_are_searched_in_seconds():
    time = np.arange(600_000) * 1e-3
    force = noise(time) + 40.0 * np.sin(2.0 * np.pi * time / 300.0)
    onsets = np.arange(30.0, 590.0, 40.0)
    force += sum(pulse(time, onset) for onset in onsets)
    found = contacts(time, force)
    assert [item.start for item in found] == pytest.approx(list(onsets + 0.001), abs=1.1e-3)


def test_a_rebound_within_the_separation_is_the_same_contact_whatever_the_cell_reads_between():
    force = noise(T) + pulse(T, 3.0, 0.1) + pulse(T, 3.6, 0.1, 400.0) + 20.5 * ((T > 3.1) & (T < 3.6))
    (found,) = contacts(T, force)
    assert (found.start, found.end) == (pytest.approx(3.001, abs=1.1e-3), pytest.approx(3.7, abs=3e-3))
    (begun,) = contacts(T, 500.0 * (T < 0.5) + pulse(T, 1.0) + noise(T))  # a rebound from a contact that began before
    assert begun.in_progress and begun.end == pytest.approx(1.3, abs=3e-3)


def test_a_shift_of_rest_during_a_contact_is_not_a_contact_in_progress():
    """The pushes of the UR10e: friction keeps part of the measured force."""
    for before, after in ((-29.0, -25.0), (30.0, 20.0)):
        (found,) = contacts(T, noise(T, 0.1) + np.where(T > 3.3, after, before) + pulse(T, 3.0, peak=40.0), OnsetRule())
        assert not found.in_progress and found.start == pytest.approx(3.003, abs=5e-3)


def test_a_burst_of_noise_hides_no_contact_and_hardly_ever_is_one():
    others = 0
    for seed in range(20):
        burst = np.where((T > 3.0) & (T < 3.03), noise(T, 60.0, 100 + seed), 0.0)
        *early, last = contacts(T, pulse(T, 6.0) + noise(T, seed=seed) + burst)
        assert last.start == pytest.approx(6.001, abs=3e-3)
        others += len(early)
    assert others <= 5  # one in fifty is usual


@pytest.mark.parametrize("rest", [0.0, 3.0, -200.0], ids=["at exactly 0", "at one reading", "not tared"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("rate", "reading"),
    [(62.5, [157.0]), (62.5, [157.0, 157.0]), (62.5, [157.0, 310.0]), (1000.0, [157.0] * 5), (1000.0, [157.0] * 3)],
    ids=["one slow sample", "two slow samples", "two that differ", "5 ms at 1 kHz", "3 ms at 1 kHz"],
)
def test_a_short_contact_is_found_where_the_cell_rests_at_one_constant_reading(rate, reading, sign, rest):
    time = clock(rate)
    force = np.full(len(time), rest)
    hit = int(5.0 * rate)
    force[hit : hit + len(reading)] += sign * np.array(reading)
    for rule in (OnsetRule(), GATE):
        (found,) = contacts(time, force, rule)
        assert (found.start, found.peak_force, found.in_progress) == (time[hit], pytest.approx(max(reading)), False)


@pytest.mark.parametrize("step", [0.05, 1.0, 20.0, 50.0])
def test_flicker_of_a_coarse_cell_is_not_a_contact_next_to_a_real_one(step):
    time = clock(62.5)
    force = step * np.round(pulse(time, 6.0, peak=60.0 * step) / step)
    force[[100, 200, 201, 300]] += step * np.array([1.0, 1.0, 1.0, -1.0])
    (found,) = contacts(time, force, OnsetRule())
    assert found.start == pytest.approx(6.02, abs=0.02)


@pytest.mark.parametrize("rule", [GATE, OnsetRule()], ids=["levels by hand", "levels from the noise"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("offset", [60.0, 200.0, 700.0])
@pytest.mark.parametrize("left", [0.45, -0.2])
def test_a_cell_that_is_not_tared_is_at_rest_where_the_log_ends_in_a_contact_against_its_offset(
    left, offset, sign, rule
):
    felt = np.interp(T, [6.0, 6.5, 7.2], [0.0, 2466.0, (1.0 + left) * offset])
    kept = T < 7.2
    (found,) = contacts(T[kept], (sign * (offset - felt) + noise(T))[kept], rule)
    assert not found.in_progress
    assert found.start == pytest.approx(6.003, abs=6e-3)
    assert found.peak_force == pytest.approx(2466.0, abs=15.0)
    assert found.rest == pytest.approx(sign * offset, abs=2.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("offset", [200.0, 291.0, 400.0])
def test_a_touch_held_before_the_impact_is_not_a_release(offset, sign):
    """The soft impacts of the gate: the guard is pressed to its stop at 290 N, then hit."""
    felt = np.interp(T, [6.0, 6.1, 6.35, 6.7, 7.2], [0.0, 290.0, 290.0, 2466.0, 600.0])
    kept = T < 7.2
    for rule in (OnsetRule(), GATE):
        (found,) = contacts(T[kept], (sign * (offset - felt) + noise(T))[kept], rule)
        assert not found.in_progress
        assert found.start == pytest.approx(6.003, abs=6e-3)


def test_a_drift_is_not_continued_for_longer_than_a_second_without_rest():
    time = np.arange(8000) * 1e-3
    rest = RunningRest(time, 5.0 * time)
    rest.exclude(2.0, 8.0)
    assert rest.line(2.9).value(2.9) == pytest.approx(5.0 * 2.9, abs=0.1)
    for later in (4.0, 7.9):
        assert rest.line(later).value(later) == pytest.approx(5.0 * 2.0, abs=0.3)
