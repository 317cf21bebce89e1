"""A clock without faults is cleaned without the search for faults, with the same result; so is the rest of its use."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.recordings.clock import THREE_YEARS, clean_time, previous_value, stamps
from cdtool.recordings.clock.coarse_clock import recent_medians
from cdtool.recordings.clock.held_samples import hold_last
from cdtool.recordings.recording import Series

STEP = st.sampled_from(
    [1e-3, 1e-3, 1e-3, 0.02, 1.0, 0.0, -1e-3, -5.0, 2e8, THREE_YEARS, 1e9, math.nan, math.inf, -math.inf]
)
USUAL = st.sampled_from([1e-3, 2e-3, 0.5, 2e8, THREE_YEARS])


@st.composite
def clocks(draw):
    steps = draw(st.lists(draw(st.sampled_from([STEP, USUAL])), max_size=30))
    times = draw(st.sampled_from([0.0, -3.0, 1.6e9])) + np.cumsum([0.0, *np.nan_to_num(steps, posinf=0, neginf=0)])
    odd = ~np.isfinite([0.0, *steps])
    times[odd] = np.array([0.0, *steps])[odd]
    return times[: draw(st.sampled_from([len(times), 1, 0]))]


def outcome(times):
    try:
        clean = clean_time(times, 2, counted=times)
    except RecordingError as fault:
        return str(fault)
    return clean.time.tobytes(), clean.keep.tolist(), repr(clean.findings)


@settings(max_examples=400)
@given(clocks())
def test_a_clock_without_faults_is_cleaned_as_by_the_search_for_faults(times):
    quick, is_clean = outcome(times), stamps._is_clean
    stamps._is_clean = lambda _: False
    try:
        assert outcome(times) == quick
    finally:
        stamps._is_clean = is_clean


@st.composite
def series_and_times(draw):
    steps = draw(st.lists(st.floats(0.01, 2.0), min_size=1, max_size=25))
    values = draw(
        st.lists(st.sampled_from([0.0, -0.0, 1.5, math.nan, math.inf]), min_size=len(steps), max_size=len(steps))
    )
    clock = np.cumsum(draw(st.lists(st.floats(0.01, 3.0), max_size=20))) - draw(st.floats(0.0, 3.0))
    return Series(np.cumsum(steps), values, "m/s"), clock


@given(series_and_times())
def test_the_value_held_depends_on_no_later_time(drawn):
    series, clock = drawn
    period = np.full(len(series), np.inf)
    if len(series) > 1:
        steps = np.diff(series.time)
        period[1:] = recent_medians(steps, float(steps[0]))
    at = np.searchsorted(series.time, clock, side="right") - 1
    newest = np.maximum(at, 0)
    is_missing = (at < 0) | (clock - series.time[newest] > 5.0 * period[newest])
    expected = np.where(is_missing[:, np.newaxis], np.nan, series.values[newest])
    assert previous_value(series, clock).tobytes() == expected.tobytes()


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=12))
def test_what_is_missing_is_held(marks):
    missing = np.array(marks, dtype=bool).reshape(-1, 2)
    values = np.arange(1.0, 2.0 * len(missing) + 1.0).reshape(-1, 2)
    last = np.zeros(2)
    for k, held in enumerate(hold_last(values, missing)):
        last = np.where(missing[k], last, values[k])
        assert held.tolist() == last.tolist()
