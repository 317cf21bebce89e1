"""What is derived from a recording is computed once and is released with it."""

from __future__ import annotations

import gc
import pickle
import weakref
from dataclasses import replace

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


@pytest.mark.parametrize("copied", [replace, lambda owner: pickle.loads(pickle.dumps(owner))])
def test_a_copy_starts_without_it(copied):
    owner = series()
    owner.derived("a", lambda: 1)
    other = copied(owner)
    assert other.derived("a", lambda: 2) == 2
    assert other.period == owner.period
    np.testing.assert_array_equal(other.values, owner.values)


def test_it_is_released_with_its_owner():
    owner = series()
    seen = weakref.ref(owner.derived("a", series))
    assert seen() is owner.derived("a", series)
    del owner
    gc.collect()
    assert seen() is None


def test_ground_truth_is_removed_once_and_a_recording_without_it_stays_itself():
    whole = recording(speed=series(), force=series())
    bare = whole.without_ground_truth()
    assert tuple(bare.channels) == ("speed",)
    assert whole.without_ground_truth() is bare and bare.without_ground_truth() is bare
    assert whole.section(0.0, 5e-3) is whole.section(0.0, 5e-3) is not whole.section(0.0, 4e-3)


def test_equal_clocks_are_one_object_that_of_the_speed_first():
    log = recording(torque=series(), position=series(1e-4), speed=series())
    own = log["speed"].time
    for clock in (log["torque"].time, log["speed"].time, TIME.copy()):
        assert log.own_clock(clock) is own
    assert log.own_clock(TIME + 1e-4) is log["position"].time
    assert log.own_clock(TIME + 2e-4) is None
    assert log.own_clock(TIME[:5]) is None


def test_a_clock_that_changes_is_compared_again():
    log, clock = recording(speed=series()), TIME.copy()
    assert log.own_clock(clock) is log["speed"].time
    clock[5] += 1e-4
    assert log.own_clock(clock) is None
