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
from cdtool.results.curves.sweep import sweep
from tests.results.detections import OPERATION


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
