"""The sweep of all factors in one pass gives the bits of one activation and one matching for each factor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.alarms.activation import Activation, begins_at, crossings_of
from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Band, Signal, Status, Verdict
from cdtool.recordings.recording import Contact
from cdtool.results.curves.sweep import MULTIPLES, Swept, sweep, sweep_operation
from cdtool.truth.matching import belongs, one_an_event, windows
from tests.results.detections import OPERATION, detection

FACTORS = np.array([0.5, 1.0, 1.0, 1.5, 2.0, 4.0])


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


def _factor_by_factor(
    detection: Detection, contacts: Sequence[Contact], activation: Activation, window: float, factors: FloatArray
) -> Swept:
    statistic, met_at = detection.statistic, detection.exceedance()
    spans = windows(contacts, window)
    order = np.argsort([contact.start for contact in contacts], kind="stable")
    alone: list[list[float]] = [[] for _ in factors]
    latency = np.full((len(factors), len(contacts)), np.nan)
    needed = activation.needed(statistic.time)
    fresh = begins_at(statistic.time, detection.begins)
    for joint in range(met_at.shape[1]):
        met = np.ascontiguousarray(met_at[:, joint])
        status = np.ascontiguousarray(statistic.status[:, joint])
        judged = met[status == Status.VALID]
        highest = float(judged.max()) if len(judged) else -np.inf
        for i in np.flatnonzero(factors < highest):
            calm = met <= (1.0 - activation.hysteresis) * factors[i]
            at, armed = crossings_of(statistic.time, met > factors[i], calm, status, needed, activation.wait, fresh)
            times = statistic.time[at]
            alone[i] += [float(time) for time in times[armed] if not belongs(time, spans)]
            for column, (contact, opens, closes) in zip(order, spans, strict=True):
                inside = times[(times >= opens) & (times <= closes)]
                if len(inside) and not contact.in_progress:
                    late = max(float(inside[0]) - contact.start, 0.0)
                    latency[i, column] = np.fmin(latency[i, column], late)
    counts = [len(one_an_event(times, activation.wait)) for times in alone]
    return Swept(np.array(counts, dtype=np.int64), latency)


def _same(made: Swept, expected: Swept) -> None:
    assert made.false_alarms.tolist() == expected.false_alarms.tolist()
    assert made.latency.tobytes() == expected.latency.tobytes()


VALUES = st.sampled_from([0.0, 0.4, 0.5, 0.7, 1.0, 1.2, 1.5, 1.9, 2.0, 3.0, 5.0, -1.0, np.inf, -np.inf])
STATES = st.sampled_from([Status.VALID] * 6 + [Status.GAP, Status.NOT_APPLICABLE, Status.START_UP])
CONTACTS = st.lists(
    st.builds(
        Contact,
        start=st.sampled_from([0.0, 0.125, 0.25, 0.3, 0.3125, 0.5]),
        end=st.sampled_from([0.25, 0.3, 0.4375, 0.625]),
        uncertainty=st.sampled_from([0.0, 0.004, 0.0625]),
        in_progress=st.booleans(),
    ),
    max_size=4,
)
ACTIVATIONS = st.builds(
    Activation,
    debounce=st.sampled_from([None, 1, 2, 3]),
    rearm=st.sampled_from([0.0, 0.015625, 0.046875, 10.0]),
    hysteresis=st.sampled_from([0.0, 0.3, 0.9]),
    latch=st.booleans(),
)


@st.composite
def _detections(draw: st.DrawFn) -> _Given:
    count, joints = draw(st.integers(0, 60)), draw(st.integers(1, 3))
    # Times are exact, so that samples lie exactly at the ends of windows and waits.
    steps = draw(st.lists(st.sampled_from([0.0078125, 0.015625, 0.0625]), min_size=count, max_size=count))
    time = np.cumsum(np.array(steps, dtype=np.float64))
    # Runs of equal samples, as a signal has them: single ones never fill a debounce.
    lengths = draw(st.lists(st.integers(1, 6), min_size=count, max_size=count))

    def column(items: st.SearchStrategy[float]) -> list[float]:
        drawn = draw(st.lists(items, min_size=count, max_size=count))
        return [value for value, length in zip(drawn, lengths, strict=True) for _ in range(length)][:count]

    met = np.array([column(VALUES) for _ in range(joints)], dtype=np.float64).reshape(joints, count).T
    status = np.array([column(STATES) for _ in range(joints)], dtype=np.uint8).reshape(joints, count).T
    if count and draw(st.integers(0, 9)) == 0:
        met = met.copy()
        met[draw(st.integers(0, count - 1)), 0] = np.nan
    signal = Signal(time, met, status, "N", joints=tuple("abc"[:joints]))
    starts = tuple(draw(st.lists(st.sampled_from([0.0625, 0.125, 0.25, 0.3, 0.9]), max_size=2, unique=True)))
    return _Given(OPERATION, "d", signal, Band(met, met), Verdict("no alarm"), met_at=met, starts=starts)


@settings(max_examples=300, deadline=None)
@given(_detections(), CONTACTS, ACTIVATIONS, st.sampled_from([0.015625, 0.125, 1.0]))
def test_all_factors_at_once_are_the_bits_of_each_alone(detection, contacts, activation, window):
    expected = _factor_by_factor(detection, contacts, activation, window, FACTORS)
    _same(sweep(detection, contacts, activation, window, FACTORS), expected)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("hysteresis", [0.0, 0.2])
def test_a_long_noisy_log_of_two_joints_gives_the_same_bits(seed, hysteresis):
    activation = Activation(hysteresis=hysteresis, rearm=0.05)
    contacts = [Contact(6.0, 6.1, 0.005), Contact(3.0, 3.2, 0.005), Contact(0.0, 0.3, 0.0, in_progress=True)]
    made = detection(seed, activation=activation)
    factors = 3.0 * MULTIPLES[::-1]
    expected = _factor_by_factor(made, contacts, activation, 0.5, factors)
    _same(sweep(made, contacts, activation, 0.5, factors), expected)
    assert expected.false_alarms.max() > 3 and np.isfinite(expected.latency).any()


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
    _same(swept, _factor_by_factor(made, contacts, activation, 0.015625, np.ones(1)))
    assert swept.false_alarms.tolist() == [count]


def test_no_factors_are_no_rows():
    swept = sweep(detection(0), [Contact(3.0, 3.2, 0.005)], Activation(), 1.0, np.empty(0))
    assert swept.false_alarms.shape == (0,) and swept.latency.shape == (0, 1)


def test_detections_of_one_operation_are_swept_each_with_its_own_clock_and_factors():
    made = [detection(seed) for seed in range(3)]
    slow = made[1].statistic.part(slice(0, None, 3))
    slow = _Given(
        OPERATION, "slow", slow, made[1].band, made[1].verdict, met_at=np.ascontiguousarray(made[1].exceedance()[::3])
    )
    contacts, factors = [Contact(3.0, 3.2, 0.005)], {"d": 3.0 * MULTIPLES, "slow": 2.0 * MULTIPLES}
    blind = _Given(OPERATION, "alarms of a file", made[0].statistic, made[0].band, made[0].verdict)
    first, of_slow, none, last = sweep_operation([made[0], slow, blind, made[2]], contacts, Activation(), 1.0, factors)
    assert none is None and first is not None and of_slow is not None and last is not None
    _same(first, _factor_by_factor(made[0], contacts, Activation(), 1.0, 3.0 * MULTIPLES))
    _same(of_slow, _factor_by_factor(slow, contacts, Activation(), 1.0, 2.0 * MULTIPLES))
    _same(last, _factor_by_factor(made[2], contacts, Activation(), 1.0, 3.0 * MULTIPLES))
