"""Signatures between two learned speeds: exact where a closed form is known, causal, each class's own at its speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.alarms.judgement import judgement_of
from cdtool.base.arrays import FloatArray
from cdtool.base.errors import SignatureError, UsageError
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion.speed_range import GUARD
from cdtool.recordings.recording import Recording
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.signature import Signature
from cdtool.thresholds.signature_curve import Curve
from cdtool.thresholds.speed_range import CURVATURE, RELEASE, SignatureOverSpeeds, interpolate, over_speeds
from tests.recordings.motion.speed_logs import log

SPEEDS = (0.2, 0.3)
MEANS, SPREADS = (100.0, 110.0), (1.0, 2.0)
RATES = {speed: (mean, spread) for speed, mean, spread in zip(SPEEDS, MEANS, SPREADS, strict=True)}


def stroke(speed: float, seed: int = 0) -> Recording:
    return log((speed, 0.9 / abs(speed)), (0.0, 1.0), seed=seed)


def force(recording: Recording, value: float, noise: float = 0.0, seed: int = 0) -> Signal:
    """A force that is the same along the stroke."""
    time = recording["speed"].time
    values = value + noise * np.random.default_rng([9, seed]).standard_normal((len(time), 1))
    return Signal(time, values, np.zeros(values.shape, dtype=np.uint8), "N", True, ("axis",))


def constant(curve: Curve, mean: float, spread: float) -> Curve:
    count = np.full(curve.count.shape, 12.0)
    return replace(curve, count=count, mean=np.full(count.shape, mean), squares=11.0 * spread**2 * np.ones(count.shape))


def learned(speed: float, direction: int = 1, **changed) -> FittedSignature:
    """A signature of that speed with the same mean and spread everywhere."""
    strokes = [stroke(direction * speed, seed=50 + i) for i in range(12)]
    rule = Signature(**{"sides": "two", "speed_range": True, **changed})
    fitted = rule.fit([(item, force(item, 100.0, 1.0, i)) for i, item in enumerate(strokes)])
    mean, spread = RATES.get(speed, (105.0, 1.5))
    parts = {name: constant(getattr(fitted, name), mean, spread) for name in ("by_time", "by_travel")}
    return replace(fitted, **parts)


@pytest.fixture(scope="module")
def slow() -> FittedSignature:
    return learned(SPEEDS[0])


@pytest.fixture(scope="module")
def fast() -> FittedSignature:
    return learned(SPEEDS[1])


@pytest.fixture(scope="module")
def between(slow, fast) -> SignatureOverSpeeds:
    (made,) = over_speeds([fast, slow])
    assert isinstance(made, SignatureOverSpeeds)
    return made


def band_of(signature, recording: Recording, value: float = 105.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    statistic, band = signature.evaluate(recording, force(recording, value))
    return band.lower[:, 0], band.upper[:, 0], statistic.status[:, 0]


@settings(max_examples=15, deadline=None)
@given(st.floats(*SPEEDS), st.integers(0, 2**31))
def test_two_constant_bands_are_interpolated_exactly(between, speed, seed):
    recording = stroke(speed, seed)
    found = between.motion.speed_so_far(recording, recording["speed"].time)
    known = np.isfinite(found)
    slowest, fastest = (item.nominal_speed for item in between.motion.classes)
    weight = (found[known] - slowest) / (fastest - slowest)
    mean = (1.0 - weight) * MEANS[0] + weight * MEANS[1]
    even = (1.0 - weight) * SPREADS[0] + weight * SPREADS[1]
    spread = np.hypot(even, CURVATURE * weight * (1.0 - weight) * (MEANS[1] - MEANS[0]))
    lower, upper, status = band_of(between, recording)
    np.testing.assert_allclose(upper[known], mean + 5.5 * spread, rtol=1e-12)
    np.testing.assert_allclose(lower[known], mean - 5.5 * spread, rtol=1e-12)
    assert known.sum() > 1000 and (status[known] == Status.VALID).all()


@pytest.mark.parametrize(("speed", "assessed"), [(0.25, True), (0.21, True), (0.13, False), (0.37, False)])
def test_speeds_between_are_assessed_and_others_are_not(slow, fast, speed, assessed):
    recording = stroke(speed)
    statistic, _ = judgement_of(recording, force(recording, 105.0), [slow, fast]).evaluated
    time, status = statistic.time, statistic.status[:, 0]
    running = (time > 2.5) & (time < 0.4 + 0.8 / speed)
    assert running.any() and (status[running] == (Status.VALID if assessed else Status.OTHER_SPEED)).all()
    without = [replace(item, speed_range=False) for item in (slow, fast)]
    plain, _ = judgement_of(recording, force(recording, 105.0), without).evaluated
    assert (plain.status[running, 0] == Status.OTHER_SPEED).all() or assessed


def test_each_direction_and_joint_has_its_own_range_and_other_thresholds_stay(slow, fast):
    back = [learned(speed, -1) for speed in SPEEDS]
    other = learned(0.25, -1, speed_range=False)
    limit = Limit.given([400.0])
    found = over_speeds([slow, back[0], other, fast, limit, back[1]])
    assert [type(item).__name__ for item in found] == [
        "SignatureOverSpeeds",
        "SignatureOverSpeeds",
        "FittedSignature",
        "FittedLimit",
    ]
    assert [item.motion.direction for item in found[:2]] == [1, -1]
    assert over_speeds([slow, other]) == (slow, other)
    assert len(over_speeds([slow, replace(slow)])) == 2
    assert over_speeds([slow, replace(fast, speed_range=False)])[0] is slow


def test_a_stroke_backward_is_assessed_by_the_classes_backward(slow, fast):
    recording = stroke(-0.25)
    thresholds = [slow, fast, *(learned(speed, -1, sides="one") for speed in SPEEDS)]
    statistic, band = judgement_of(recording, force(recording, 105.0), thresholds).evaluated
    running = (statistic.time > 2.5) & (statistic.time < 3.5)
    assert (statistic.status[running] == Status.VALID).all()
    # An obstacle opposes the motion: the limit is below.
    assert np.isposinf(band.upper[running]).all() and np.isfinite(band.lower[running]).all()


def test_a_contact_that_slows_the_axis_does_not_move_the_band_before_the_guard(between):
    free, struck = log((0.3, 3.0)), log((0.3, 2.0), (0.27, 1.0))
    time = free["speed"].time
    before = (time >= 2.3) & (time < 2.5 + GUARD)
    upper = [band_of(between, item)[1] for item in (free, struck)]
    assert upper[1][before] == pytest.approx(upper[0][before], abs=0.05)


def test_a_location_that_one_class_does_not_know_has_no_limit(between, slow, fast):
    shorter = replace(fast, by_travel=replace(fast.by_travel, count=_until(fast.by_travel, 0.5)))
    (made,) = over_speeds([slow, shorter])
    recording = stroke(0.25)
    _, _, status = band_of(made, recording)
    travel = recording["position"].values[:, 0]
    assert (status[(travel > 0.35) & (travel < 0.49)] == Status.VALID).all()
    assert (status[travel > 0.51] == Status.NO_LIMIT).all()


def _until(curve: Curve, end: float) -> FloatArray:
    return np.where(curve.grid[:, np.newaxis] <= end, curve.count, 0.0)


def test_several_joints_have_a_band_each():
    def joints(recording: Recording, noise: float, seed: int) -> Signal:
        one = force(recording, 100.0, noise, seed)
        return one.changed(
            values=np.column_stack((one.values, 2.0 * one.values)),
            status=np.zeros((len(one.time), 2), dtype=np.uint8),
            joints=("first", "second"),
        )

    signatures = []
    for speed in SPEEDS:
        strokes = [stroke(speed, seed=50 + i) for i in range(12)]
        rule = Signature(sides="two", speed_range=True)
        signatures.append(rule.fit([(item, joints(item, 1.0, i)) for i, item in enumerate(strokes)]))
    recording = stroke(0.25)
    statistic, band = over_speeds(signatures)[0].evaluate(recording, joints(recording, 0.0, 0))
    there = slice(2300, 3000)
    assert statistic.valid[there].all()
    width = (band.upper - band.lower)[there]
    assert width[:, 1] == pytest.approx(2.0 * width[:, 0], rel=1e-6)
    with pytest.raises(SignatureError, match="learned for the joints first, second"):
        over_speeds(signatures)[0].evaluate(recording, force(recording, 100.0))


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 4), st.integers(0, 2**31))
def test_the_kernel_follows_the_rule_of_the_docstring(count, seed):
    rng = np.random.default_rng(seed)
    nominal = 0.1 + np.cumsum(rng.uniform(0.05, 0.2, count))
    n = 40
    means, spreads = rng.normal(100.0, 5.0, (count, n, 1)), rng.uniform(0.5, 2.0, (count, n, 1))
    means[0, 5], spreads[0, 5] = np.nan, np.nan
    speed = np.where(rng.random(n) < 0.4, np.nan, rng.uniform(nominal[0], nominal[-1], n))
    runs = np.arange(n) > 10
    low, high, wide = (np.empty((n, 1)) for _ in range(3))
    time = np.cumsum(rng.uniform(0.0, 0.1, n))
    interpolate(time, speed, runs, nominal, means, spreads, low, high, wide)
    held: tuple[float, float, float] | None = None
    for k in range(n):
        now = means[:, k].min(), means[:, k].max(), spreads[:, k].max()
        if np.isfinite(speed[k]):
            held = None
            above = max(1, min(int(np.searchsorted(nominal, speed[k])), count - 1))
            w = (speed[k] - nominal[above - 1]) / (nominal[above] - nominal[above - 1])
            m, s = (item[above - 1 : above + 1, k, 0] for item in (means, spreads))
            mean = (1.0 - w) * m[0] + w * m[1]
            now = mean, mean, np.hypot((1.0 - w) * s[0] + w * s[1], CURVATURE * w * (1.0 - w) * (m[1] - m[0]))
        elif np.isfinite(now).all() and runs[k]:
            rest = np.exp(-(time[k] - time[k - 1]) / RELEASE)
            lag = [item + rest * (was - item) for item, was in zip(now, held or now, strict=True)]
            now = held = min(now[0], lag[0]), max(now[1], lag[1]), max(now[2], lag[2])
        found = low[k, 0], high[k, 0], wide[k, 0]
        assert found == pytest.approx(now, rel=1e-9, nan_ok=True)


def test_a_signature_by_position_is_interpolated_from_the_first_travel():
    (made,) = over_speeds([learned(speed, alignment="position") for speed in SPEEDS])
    recording = stroke(0.25)
    lower, upper, status = band_of(made, recording)
    known = np.isfinite(made.motion.speed_so_far(recording, recording["speed"].time))
    assert known.sum() > 1000
    assert 0.5 * (lower + upper)[known] == pytest.approx(105.0, abs=2.0)
    started = (recording["position"].values[:, 0] > 0.01) & ~known
    assert (status[started] == Status.VALID).any()


def test_it_survives_the_file_and_older_files_have_none(slow):
    assert FittedSignature.from_dict(slow.to_dict()).speed_range
    older = {key: value for key, value in slow.to_dict().items() if key != "speed_range"}
    assert not FittedSignature.from_dict(older).speed_range


def test_an_alignment_by_time_is_refused():
    with pytest.raises(UsageError, match="speed_range cannot be combined with alignment 'time'"):
        Signature(alignment="time", speed_range=True)
