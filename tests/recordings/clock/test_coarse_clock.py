"""The times of samples whose clock is coarser than the sample period: those of the line through the stamps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.recordings.clock import clean_time
from cdtool.recordings.clock.stamps import gaps_in
from cdtool.recordings.recording import Series
from tests.base.findings.facts import fact_of


def floor_to_step(true, step):
    return np.floor(true / step + 1e-9) * step


def gap_facts(clean):
    period = Series(clean.time, np.zeros(len(clean.time)), "s").period
    return [fact_of(item) for item in gaps_in([clean.time], period, "time")]


def loss_facts(clean):
    return [fact_of(item) for item in clean.findings if item.severity == "loss"]


@pytest.mark.parametrize(
    ("samples", "step"), [(10000, 0.01), (10000, 0.016), (3000, 0.1), (2000, 1.0)], ids=["10ms", "16ms", "100ms", "1s"]
)
def test_every_sample_is_kept_at_its_true_time(samples, step):
    true = np.arange(samples) * 1e-3
    clean = clean_time(floor_to_step(true, step))
    assert clean.findings[0].kind == "coarse_clock" and not loss_facts(clean)
    assert clean.keep.all()
    np.testing.assert_allclose(clean.time, true, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.floats(2e-4, 3.9e-3), st.floats(0.0, 10.0), st.integers(40, 1500))
def test_a_regular_sample_is_within_two_periods_of_the_truth_and_a_stamp_step_of_its_stamp(period, start, samples):
    true = start + np.arange(samples) * period
    stamps = floor_to_step(true, 5e-3)
    if len(np.unique(stamps)) < 4 or np.mean(np.diff(stamps) == 0.0) < 0.21:
        return
    clean = clean_time(stamps)
    assert clean.keep.all()
    assert np.abs(clean.time - true).max() < 2.2 * period
    assert np.abs(clean.time - stamps).max() < 5e-3 + period


def test_samples_after_a_pause_are_shifted_and_the_pause_is_reported_as_one_gap():
    i = np.arange(4000)
    true = i * 1e-3 + np.where(i > 2000, 2.0, 0.0)
    clean = clean_time(floor_to_step(true, 0.01))
    assert clean.keep.all() and not loss_facts(clean)
    assert np.abs(clean.time - true).max() < 1e-3
    assert np.median(np.diff(clean.time[2100:])) == pytest.approx(1e-3, rel=1e-3)
    assert gap_facts(clean) == [
        (
            "sample_gaps",
            {"count": 1, "first": ({"time": pytest.approx(2.0, abs=5e-4), "length": pytest.approx(2.001, abs=5e-4)},)},
        )
    ]


def test_no_time_depends_on_stamps_beyond_the_next_changes():
    """The start of the log depends on two changes of the stamp, samples after a pause on one, all others on none."""
    i = np.arange(3000)
    true = i * 1.3e-3 + np.where(i > 1700, 2.0, 0.0)
    stamps = floor_to_step(true, 0.01)
    whole = clean_time(stamps).time
    changes = np.flatnonzero(np.diff(stamps) > 0.0) + 1
    after_pause = changes[changes > 1701][0]
    for end in (changes[1] + 1, 700, 1650, after_pause + 1, 2900):
        np.testing.assert_array_equal(clean_time(stamps[:end]).time, whole[:end])


def test_samples_of_a_stopped_clock_are_dropped_and_reported_as_a_loss():
    stamps = np.minimum(floor_to_step(np.arange(4000) * 1e-3, 0.01), 2.0)
    clean = clean_time(stamps, first_row=2)
    assert clean.keep.sum() == 2020
    assert loss_facts(clean) == [
        ("stuck_stamps", {"count": 1980, "rows": 4000, "first": (2022, 2023, 2024), "row_name": "line"})
    ]
    assert clean.time[-1] < 2.02


@settings(max_examples=100, deadline=None)
@given(st.lists(st.integers(0, 40), min_size=2, max_size=200).filter(lambda steps: any(steps[1:])))
def test_times_always_increase_near_their_stamps_and_dropped_samples_are_counted(steps):
    stamps = np.cumsum(np.maximum(np.array(steps, float) - 30.0, 0.0))
    if stamps[0] == stamps[-1]:
        return
    clean = clean_time(stamps)
    assert np.all(np.diff(clean.time) > 0.0)
    dropped = sum(
        finding.numbers["count"]
        for finding in clean.findings
        if finding.kind in ("repeated_stamps", "unknown_stamps", "stray_stamps", "stuck_stamps", "backward_stamps")
    )
    assert dropped == len(stamps) - clean.keep.sum()
    widest = np.diff(np.unique(stamps)).max()
    assert np.abs(clean.time - stamps[clean.keep]).max() <= 2.0 * widest + 1e-9
