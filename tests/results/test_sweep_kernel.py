"""The sweep at the ends of waits and contacts, without factors, and of several detections of one operation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Band, Signal, Verdict
from cdtool.recordings.recording import Contact
from cdtool.results.curves.sweep import MULTIPLES, sweep, sweep_operation
from tests.results.detections import OPERATION, detection


@dataclass(frozen=True)
class _Given(Detection):
    """A detection whose exceedance and starts of operations are set by the test."""

    met_at: FloatArray = field(default_factory=lambda: np.empty((0, 1)))
    starts: tuple[float, ...] = ()

    def exceedance(self) -> FloatArray:
        return self.met_at

    @property
    def begins(self) -> tuple[float, ...]:
        return self.starts


@pytest.mark.parametrize(
    ("met", "starts", "contacts", "count"),
    [
        # Inside from the 2nd to the 3rd sample: exactly the wait.
        ([5.0, 0.0, 0.0, 5.0], (), [], 2),
        ([5.0, 0.0, 5.0, 5.0], (), [], 1),
        # An operation begins exactly at the second alarm, or right after it.
        ([5.0, 0.0, 5.0, 5.0], (0.03125,), [], 2),
        ([5.0, 0.0, 5.0, 5.0], (0.046875,), [], 1),
        # The contact is released exactly at the alarm, or right before it.
        ([0.0, 0.0, 0.0, 5.0], (), [Contact(0.0, 0.046875, 0.0)], 0),
        ([0.0, 0.0, 0.0, 5.0], (), [Contact(0.0, 0.03125, 0.0)], 1),
    ],
)
def test_the_ends_of_waits_and_contacts_count_as_in_the_activation(met, starts, contacts, count):
    values = np.array(met)[:, np.newaxis]
    signal = Signal(np.arange(4) / 64.0, values, np.zeros((4, 1), dtype=np.uint8), "N", joints=("a",))
    made = _Given(OPERATION, "d", signal, Band(values, values), Verdict("no alarm"), met_at=values, starts=starts)
    activation = Activation(debounce=1, rearm=0.015625)
    swept = sweep(made, contacts, activation, 0.015625, np.ones(1))
    assert swept.false_alarms.tolist() == [count]


def test_detections_of_one_operation_are_swept_each_with_its_own_clock_and_factors():
    made = [detection(seed) for seed in range(3)]
    slow = made[1].statistic.part(slice(0, None, 3))
    slow = _Given(
        OPERATION, "slow", slow, made[1].band, made[1].verdict, met_at=np.ascontiguousarray(made[1].exceedance()[::3])
    )
    contacts, factors = [Contact(3.0, 3.2, 0.005)], {"d": 3.0 * MULTIPLES, "slow": 2.0 * MULTIPLES}
    blind = _Given(OPERATION, "alarms of a file", made[0].statistic, made[0].band, made[0].verdict)
    together = sweep_operation([made[0], slow, blind, made[2]], contacts, Activation(), 1.0, factors)
    assert together[2] is None
    for found, one in zip((together[0], together[1], together[3]), (made[0], slow, made[2]), strict=True):
        alone = sweep(one, contacts, Activation(), 1.0, factors[one.detector])
        assert found.false_alarms.tolist() == alone.false_alarms.tolist() and alone.false_alarms.max() > 0
        np.testing.assert_array_equal(found.latency, alone.latency)
