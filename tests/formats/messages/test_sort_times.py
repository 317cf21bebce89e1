"""The times of messages have the bits of the same calculation in numpy."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.formats.messages.topic import sort_times

SIGNED = st.one_of(st.integers(-(2**63), 2**63 - 1), st.integers(-(10**10), 10**10))
UNSIGNED = st.one_of(st.integers(0, 2**64 - 1), st.integers(0, 10**10))


def in_numpy(stamps, origin):
    later = stamps.view(np.uint64) - np.uint64(origin % 2**64)
    time = later / 1e9
    if len(stamps) and (before := stamps < origin).any():
        time[before] = -((~later[before] + np.uint64(1)) / 1e9)
    return time


@settings(max_examples=300, deadline=None)
@given(
    st.one_of(
        st.tuples(st.lists(SIGNED, max_size=20), SIGNED, st.just(np.int64)),
        st.tuples(st.lists(UNSIGNED, max_size=20), UNSIGNED, st.just(np.uint64)),
        st.tuples(st.lists(UNSIGNED, max_size=20).map(sorted), st.integers(-5, 5), st.just(np.uint64)),
    )
)
def test_times_and_order_are_those_of_numpy(case):
    values, origin, dtype = case
    stamps = np.array(values, dtype)
    expected = in_numpy(stamps, origin)
    time, order = sort_times(stamps, origin)
    if order is None:
        assert (expected[1:] >= expected[:-1]).all()
        assert time.tobytes() == expected.tobytes()
    else:
        assert (expected[1:] < expected[:-1]).any()
        assert order.tolist() == np.argsort(expected, kind="stable").tolist()
        assert time.tobytes() == expected[order].tobytes()
