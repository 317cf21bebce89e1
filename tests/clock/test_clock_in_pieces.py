"""A clock that comes piece by piece: what cdtool.clock says of it as a whole."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.clock import clean_time, gap_findings
from cdtool.clock.stamps import CleanPieces, gaps_in
from cdtool.findings import Finding
from cdtool.recording import Series


def _shown(findings: Iterable[Finding]) -> list[tuple[str, str, str]]:
    """Kind, severity and sentence: a number that is a sum in another order is alike to the digits that are shown."""
    return [(finding.kind, finding.severity, str(finding)) for finding in findings]


@st.composite
def clocks(draw: st.DrawFn) -> np.ndarray:
    """Stamps of a clock with gaps, a few of them missing, repeated or running backward: less than a fifth.

    Some are counters that wrap, some start again.
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
def test_a_clock_in_pieces_is_cleaned_as_the_whole_one_is(stamps, parts, first_row):
    pieces = np.array_split(stamps, parts)
    clean = CleanPieces()
    times = [clean.times(piece, piece) for piece in pieces]
    times.append(clean.times(np.empty(0), np.empty(0), final=True))
    whole = clean_time(stamps, first_row, "line" if first_row else "sample")
    assert np.array_equal(np.concatenate(times), whole.time)
    assert _shown(clean.findings(first_row)) == _shown(whole.findings)
    series = Series(whole.time, np.zeros(len(whole.time)), "s")
    assert _shown(gaps_in(times, series.period, "time")) == _shown(gap_findings(series, "time"))
