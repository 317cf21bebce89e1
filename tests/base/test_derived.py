"""What is derived from a recording is computed once and is released with it."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.recordings.recording import Recording, Series

TIME = np.arange(10) * 1e-3


def series(shift: float = 0.0) -> Series:
    return Series(TIME + shift, np.ones(10), "m/s")


def recording(**channels: Series) -> Recording:
    return Recording("run", "", ("x",), channels)


def test_it_is_computed_once_for_each_key_and_each_input():
    owner, first, second = series(), object(), object()
    calls: list[str] = []

    def derive(key: str, *inputs: object) -> str:
        def compute() -> str:
            calls.append(key)
            return key

        return owner.derived(key, compute, *inputs)

    assert [derive("a"), derive("a"), derive("b"), derive("a", first), derive("a", first), derive("a", second)] == [
        *"aabaaa"
    ]
    assert calls == [*"abaa"]


def test_a_failure_is_not_stored():
    owner = series()
    with pytest.raises(ZeroDivisionError):
        owner.derived("a", lambda: 1 // 0)
    assert owner.derived("a", lambda: 2) == 2


def test_ground_truth_is_removed_once_and_a_recording_without_it_stays_itself():
    whole = recording(speed=series(), force=series())
    bare = whole.without_ground_truth()
    assert tuple(bare.channels) == ("speed",)
    assert whole.without_ground_truth() is bare and bare.without_ground_truth() is bare
    assert whole.section(0.0, 5e-3) is whole.section(0.0, 5e-3) is not whole.section(0.0, 4e-3)
