"""Invalid times change neither the other times nor their order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.formats.mcap import Mcap
from cdtool.formats.messages.topic import sort_times
from tests.formats.mcap_files import by_hand, wanted  # noqa: F401

_LATEST = 2**64 - 1


@given(st.lists(st.integers(0, _LATEST), max_size=6), st.integers(0, _LATEST))
def test_times_are_differences_of_any_integers(stamps, origin):
    time, _ = sort_times(np.array(stamps, dtype=np.uint64), origin)
    assert time.tolist() == sorted((stamp - origin) / 1e9 for stamp in stamps)


@given(st.lists(st.integers(-(2**63) + 1, 2**63 - 1), min_size=1, max_size=6))
def test_times_of_headers_may_be_before_1970(stamps):
    time, _ = sort_times(np.array(stamps, dtype=np.int64), stamps[0])
    assert time.tolist() == sorted((stamp - stamps[0]) / 1e9 for stamp in stamps)


@pytest.mark.parametrize("channels", [None, wanted(("/a", "v"))])
def test_the_log_starts_with_its_first_message_with_a_valid_time(by_hand, channels):  # noqa: F811
    path = by_hand([(at, at, {"v": float(i)}) for i, at in enumerate([_LATEST, 10**9 + 1, 10**9 + 3])])
    source = Mcap().columns(path, channels)
    column = source.columns["/a v"]
    assert source.origin == 1.000000001
    assert column.time[:2].tolist() == [0.0, 2e-9]
    assert column.values.tolist() == [1.0, 2.0, 0.0]


def test_a_header_before_1970_is_earlier_than_one_after_it(by_hand):  # noqa: F811
    stamps = [(-1, 0), (0, 0), (1, 0)]
    path = by_hand([(1, 1, {"header": {"stamp": {"sec": sec, "nanosec": ns}}, "v": float(sec)}) for sec, ns in stamps])
    column = Mcap().columns(path, wanted(("/a", "v"), clock="header")).columns["/a v"]
    assert column.time.tolist() == [0.0, 1.0, 2.0]
    assert column.values.tolist() == [-1.0, 0.0, 1.0]
