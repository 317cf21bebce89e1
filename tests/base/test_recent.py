"""What was learned from the same runs is learned once, and no run is kept in memory for it."""

from __future__ import annotations

import gc
from weakref import ref

import numpy as np

from cdtool.base.derived import Recent
from cdtool.detectors.detection import Signal


def signals(count: int) -> list[Signal]:
    return [Signal(np.zeros(2), np.zeros((2, 1)), np.zeros((2, 1), dtype=np.uint8), "N") for _ in range(count)]


def test_another_key_other_runs_or_another_order_are_learned_again():
    recent, runs = Recent(9), signals(3)
    made = iter(range(9))

    def learn():
        return next(made)

    asked = [("a", runs), ("b", runs), ("a", runs[:2]), ("a", runs[::-1]), ("a", signals(3)), ("a", runs)]
    assert [recent.value(key, items, learn) for key, items in asked] == [0, 1, 2, 3, 4, 0]


def test_no_run_is_kept():
    recent, runs = Recent(2), signals(1)
    weak = ref(runs[0])
    recent.value("a", runs, lambda: 1)
    del runs
    gc.collect()
    assert weak() is None


def test_the_values_used_last_are_kept():
    recent, runs = Recent(2), signals(1)
    for key in ("a", "b", "a", "c"):
        recent.value(key, runs, lambda: key)  # noqa: B023  called at once
    assert [recent.value(key, runs, lambda: "other") for key in ("a", "c", "b")] == ["a", "c", "other"]
