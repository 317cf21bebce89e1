"""Debounce, re-arming and the handling of samples that are not assessable."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge_alone
from cdtool.base.errors import UsageError
from cdtool.detectors.detection import Band, Signal
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.limit import Limit


def alarms(values, status=None, debounce=3, rearm=0.5, period=1e-3):
    values = np.asarray(values, dtype=float).reshape(-1, 1)
    codes = np.zeros(values.shape, dtype=np.uint8) if status is None else np.asarray(status, np.uint8).reshape(-1, 1)
    time = np.arange(len(values)) * period
    band = Band(np.full(values.shape, -1.0), np.full(values.shape, 1.0))
    return Activation(debounce, rearm).alarms(Signal(time, values, codes, "N"), band)[0]


def test_every_debounced_exit_is_a_crossing_and_only_the_armed_ones_are_alarms():
    values = np.array([2.0] * 5 + [0.0] * 10 + [2.0] * 5).reshape(-1, 1)
    signal = Signal(np.arange(20) * 1e-3, values, np.zeros((20, 1), dtype=np.uint8), "N")
    band = Band(np.full((20, 1), -1.0), np.full((20, 1), 1.0))
    armed, crossings = Activation(3).alarms(signal, band)
    assert [round(1e3 * alarm.time) for alarm in armed] == [2]
    assert [round(1e3 * alarm.time) for alarm in crossings] == [2, 17]


def test_the_default_debounce_is_nine_milliseconds_of_samples():
    assert Activation().samples(1e-3) == 9
    assert Activation().samples(5e-3) == 2
    assert Activation().samples(0.04) == 1
    assert Activation(4).samples(1e-3) == 4


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"debounce": 0}, "debounce is 0"),
        ({"rearm": -1.0}, "rearm is -1"),
        ({"rearm": np.inf}, "rearm is inf.*latch"),
        ({"hysteresis": 1.0}, "hysteresis is 1"),
        ({"hysteresis": -0.1}, "hysteresis is -0.1"),
        ({"hysteresis": np.nan}, "hysteresis is nan"),
    ],
)
def test_a_wrong_setting_is_refused_by_its_name(settings, said):
    with pytest.raises(UsageError, match=said):
        Activation(**settings)


def judged(values, activation):
    """Return alarms and crossings [samples] of values with limits -1 and 1, through a threshold as in the pipeline."""
    values = np.asarray(values, dtype=float).reshape(-1, 1)
    time = np.arange(len(values)) * 1e-3
    recording = Recording("r", "r", ("a",), {"speed": Series(time, np.ones(values.shape), "m/s")})
    signal = Signal(time, values, np.zeros(values.shape, dtype=np.uint8), "N", joints=("a",))
    found = judge_alone(
        Operation(recording, MotionClass(1, 1.0)), "d", signal, (Limit.given([1.0]),), activation
    ).verdict
    return tuple([round(1e3 * alarm.time) for alarm in items] for items in (found.alarms, found.crossings))


@given(
    st.lists(st.sampled_from([0.0, 0.4, 0.9, 2.0, -0.9, -2.0]), max_size=80),
    st.floats(0.0, 0.99),
    st.integers(1, 4),
)
def test_more_hysteresis_never_causes_more_alarms_or_other_crossings(values, hysteresis, debounce):
    if not values:
        return
    plain, crossings = judged(values, Activation(debounce, 0.005))
    calmer, same = judged(values, Activation(debounce, 0.005, hysteresis))
    latched, _ = judged(values, Activation(debounce, 0.005, latch=True))
    assert same == crossings and set(calmer) <= set(crossings)
    assert len(calmer) <= len(plain) and latched == crossings[:1]


@given(st.lists(st.sampled_from([0.0, 2.0, -2.0]), max_size=60), st.integers(1, 5))
def test_the_alarms_agree_with_a_plain_implementation(values, debounce):
    expected, count, armed, inside_since = [], 0, True, None
    for k, value in enumerate(values):
        if abs(value) > 1.0:
            inside_since = None
            count += 1
            if count == debounce:
                expected += [k] if armed else []
                armed = False
            continue
        count = 0
        inside_since = k if inside_since is None else inside_since
        armed = armed or k - inside_since >= 10
    found = alarms(values, debounce=debounce, rearm=10.0, period=1.0)
    assert [round(alarm.time) for alarm in found] == expected


def rearmed(values, status=None, debounce=3, rearm=0.5, period=1e-3):
    values = np.asarray(values, dtype=float).reshape(-1, 1)
    codes = np.zeros(values.shape, dtype=np.uint8) if status is None else np.asarray(status, np.uint8).reshape(-1, 1)
    band = Band(np.full(values.shape, -1.0), np.full(values.shape, 1.0))
    signal, activation = Signal(np.arange(len(values)) * period, values, codes, "N"), Activation(debounce, rearm)
    raised, _ = activation.alarms(signal, band)
    return raised, activation.rearmed(signal, band, raised)


@given(
    st.lists(st.tuples(st.sampled_from([0.0, 2.0]), st.sampled_from([0, 0, 0, 2, 3])), min_size=1, max_size=60),
    st.integers(1, 3),
)
def test_no_alarm_comes_before_the_one_before_it_is_armed_again(samples, debounce):
    values, status = [value for value, _ in samples], [code for _, code in samples]
    raised, again = rearmed(values, status, debounce, rearm=4e-3)
    for i, alarm in enumerate(raised):
        assert alarm.time < again[i]
        assert i + 1 == len(raised) or again[i] < raised[i + 1].time
    # Cut at the last re-arming, only that sample is missing for it.
    if raised and np.isfinite(again[-1]):
        k = round(again[-1] / 1e-3)
        assert rearmed(values[:k], status[:k], debounce, rearm=4e-3)[1][-1:] in ((np.inf,), again[-2:-1])
        more = [0.0] * 10 + [2.0] * debounce
        whole = rearmed([*values[: k + 1], *more[10:]], [*status[: k + 1], *([0] * debounce)], debounce, rearm=4e-3)[0]
        assert len(whole) == len(raised) + 1
