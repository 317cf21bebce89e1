"""The conversion to SI masks what no sensor delivers, and counts it; channels of a clock share its times."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdtool.formats.channels.channel_assembly import convert_to_si
from cdtool.formats.channels.channel_map import ChannelSource
from cdtool.recordings.plausible import IMPOSSIBLE
from cdtool.recordings.recording import UNITLESS

NUMBER = st.sampled_from(
    [0.0, -0.0, 1.0, -1.0, 5.0, math.nan, math.inf, -math.inf, 1e308, -1e308, IMPOSSIBLE, -IMPOSSIBLE]
) | st.floats(-10.0, 10.0)
LIMIT = st.sampled_from([-5.0, -1.0, 0.0, 1.0, 5.0])


def array_by_array(item, values):
    infinite = np.isinf(values)
    saturated = np.zeros_like(infinite)
    if item.valid_range is not None:
        low, high = item.valid_range
        saturated = ((values <= low) | (values >= high)) & ~infinite
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = values * np.array(item.factor)
    impossible = (values < item.least) | (values > item.most)
    if item.channel not in UNITLESS:
        impossible |= np.abs(scaled) >= IMPOSSIBLE
    impossible &= ~(infinite | saturated)
    scaled[infinite | saturated | impossible] = np.nan
    return scaled, np.array([np.count_nonzero(mask, axis=0) for mask in (infinite, saturated, impossible)])


@settings(max_examples=300)
@given(
    st.data(),
    st.integers(1, 3),
    st.sampled_from(["torque", "speed", "label"]),
    st.none() | st.tuples(LIMIT, LIMIT),
    LIMIT | st.just(-math.inf),
    LIMIT | st.just(math.inf),
)
def test_values_and_counts_are_those_of_whole_arrays(data, joints, channel, valid_range, least, most):
    values = data.draw(arrays(np.float64, st.tuples(st.integers(0, 12), st.just(joints)), elements=NUMBER))
    factor = tuple(data.draw(st.sampled_from([1.0, -1.0, 0.5, 0.10472, 1e10, 0.0])) for _ in range(joints))
    item = ChannelSource(channel, factor=factor, valid_range=valid_range, least=least, most=most)
    values.flags.writeable = data.draw(st.booleans())
    for table in (values, np.asfortranarray(values), np.repeat(values, 2, axis=0)[::2]):
        scaled, masked = convert_to_si(item, table)
        expected, counts = array_by_array(item, values)
        known = ~np.isnan(expected)
        assert np.array_equal(np.isnan(scaled), ~known)
        assert scaled[known].tobytes() == expected[known].tobytes()
        assert list(masked.values()) == (counts.tolist() if counts.any() else [])
