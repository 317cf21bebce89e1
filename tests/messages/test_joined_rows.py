"""Rows that the fast path wrote chunk by chunk are joined if they are adjacent."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.messages.fast_path import Destination, WrittenRows, joined_rows


def joined_one_by_one(parts):
    """Return (destination, first row, end, ascending) of each run of adjacent parts."""
    joined = []
    for part in parts:
        start, end = part.rows.start, part.rows.stop
        if joined and joined[-1][0] is part.destination and joined[-1][2] == start:
            destination, first, _, ascending = joined[-1]
            in_order = bool(destination.stamps[start - 1] <= destination.stamps[start])
            joined[-1] = (destination, first, end, ascending and part.ascending and in_order)
        else:
            joined.append((part.destination, start, end, part.ascending))
    return joined


@given(
    st.lists(st.integers(0, 3), min_size=60, max_size=60),
    st.lists(st.tuples(st.integers(1, 4), st.sampled_from([0, 0, 0, 1]), st.booleans(), st.booleans()), max_size=12),
)
def test_adjacent_parts_are_joined_and_in_order_if_the_times_at_their_borders_are(stamps, described):
    destinations = [Destination((), np.array(stamps, np.uint64), 0) for _ in range(2)]
    parts, row, number = [], 0, 0
    for length, gap, other, ascending in described:
        row, number = row + gap, number ^ (other and gap)
        parts.append(WrittenRows(destinations[number], slice(row, row + length), ascending))
        row += length
    joined = [(part.destination, part.rows.start, part.rows.stop, part.ascending) for part in joined_rows(parts)]
    assert joined == joined_one_by_one(parts)
    assert sum(part.count for part in joined_rows(parts)) == sum(part.count for part in parts)
