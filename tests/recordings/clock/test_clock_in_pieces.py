"""A clock cleaned piece by piece: the same times and findings as for the whole clock."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.findings import Finding
from cdtool.recordings.clock import clean_time
from cdtool.recordings.clock.stamps import ClockCleaner, gaps_in
from cdtool.recordings.recording import Series


def as_shown(findings: Iterable[Finding]) -> list[tuple[str, str, str]]:
    """Return kind, severity and sentence: a number summed in another order is equal only to the digits shown."""
    return [(finding.kind, finding.severity, str(finding)) for finding in findings]


@st.composite
def clocks(draw: st.DrawFn) -> np.ndarray:
    """Draw time stamps with gaps, less than a fifth of which are missing, repeated or run backward.

    Some clocks are counters that wrap, some restart.
    """
    count = draw(st.integers(20, 120))
    time = np.cumsum(draw(st.lists(st.sampled_from([0.01, 0.01, 0.012, 0.5]), min_size=count, max_size=count)))
    for row in draw(st.lists(st.integers(1, count - 1), max_size=count // 10)):
        time[row] = draw(st.sampled_from([np.nan, time[row - 1], 0.0]))
    wrap = draw(st.integers(1, count - 1))
    kind = draw(st.sampled_from(["", "restarts", "wraps"]))
    if kind == "restarts":
        time[wrap:] -= time[wrap] if np.isfinite(time[wrap]) else 0.0
    return (np.arange(count) + 2.0**16 - wrap) % 2**16 if kind == "wraps" else time


@given(clocks(), st.integers(1, 9), st.sampled_from([0, 2]))
def test_a_clock_in_pieces_is_cleaned_as_a_whole_clock(stamps, parts, first_row):
    pieces = np.array_split(stamps, parts)
    cleaner = ClockCleaner()
    times = [cleaner.times(piece, piece) for piece in pieces]
    times.append(cleaner.times(np.empty(0), np.empty(0), final=True))
    whole = clean_time(stamps, first_row)
    assert np.array_equal(np.concatenate(times), whole.time)
    assert as_shown(cleaner.findings(first_row)) == as_shown(whole.findings)
    series = Series(whole.time, np.zeros(len(whole.time)), "s")
    assert as_shown(gaps_in(times, series.period, "time")) == as_shown(gaps_in([whole.time], series.period, "time"))
