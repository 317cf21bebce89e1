"""The limits of a signature at each sample, compared with numpy's interpolation of its curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import SignatureError
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.progress import Progress
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.base import exceedance
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature_curve import Curve
from tests.bits import COUNTS, VALUES, assert_same_bits, clocks, samples


def curves_of(signature: FittedSignature, where: Progress) -> list[tuple[Curve, FloatArray, BoolArray]]:
    started = np.isfinite(where.elapsed)
    if signature.alignment == "time":
        return [(signature.by_time, where.elapsed, started)]
    if signature.alignment == "position":
        return [(signature.by_position, where.travel, started)]
    time = np.minimum(where.elapsed, signature.by_time.end)
    travels = started & where.running
    return [(signature.by_time, time, started & ~where.running), (signature.by_position, where.travel, travels)]


def limits_by_numpy(
    signature: FittedSignature, recording: Recording, signal: Signal
) -> tuple[FloatArray, FloatArray, FloatArray]:
    where = signature.progress(recording, signal.time)
    lower, upper = np.full(signal.values.shape, np.nan), np.full(signal.values.shape, np.nan)
    for curve, axis, use in curves_of(signature, where):
        for limit, values in zip((lower, upper), signature.limits(curve), strict=True):
            for j in range(limit.shape[1]):
                limit[use, j] = at(curve, values[:, j], axis[use])
    status = signal.status.copy()
    status[(np.isnan(lower) | np.isnan(upper)) & (status == Status.VALID)] = Status.NO_LIMIT
    return lower, upper, status


def at(curve: Curve, values: FloatArray, axis: FloatArray) -> FloatArray:
    grid = np.arange(len(values), dtype=np.float64) * curve.step
    line = np.interp(axis, grid, values, left=np.nan, right=np.nan)
    nearest = np.clip(np.rint(np.nan_to_num(axis) / curve.step).astype(int), 0, len(values) - 1)
    return np.where(np.isinf(values[nearest]), values[nearest], line)


def met_at_by_numpy(value: FloatArray, limit: FloatArray, wider: FloatArray, factor: float) -> FloatArray:
    with np.errstate(all="ignore"):
        met = factor + factor * (value - limit) / (wider - limit)
    met = np.where(wider == limit, np.where(value > limit, np.inf, -np.inf), met)
    return np.where(np.isnan(limit) | np.isposinf(limit), -np.inf, met)


@st.composite
def signatures(draw: st.DrawFn, joints: int) -> FittedSignature:
    def curve(step: float) -> Curve:
        shape = (draw(st.sampled_from([1, 2, 7, 40])), joints)
        counts = st.sampled_from([10.0, 10.0, 10.0, 3.0, 0.0])
        squares = st.one_of(st.just(1.0), st.floats(0.0, 4.0), st.just(1e308))
        count = draw(samples(shape[0], joints, counts))
        return Curve(step, 3 * step, count, draw(samples(*shape, st.floats(-9.0, 9.0))), draw(samples(*shape, squares)))

    return FittedSignature(
        motion=MotionClass(draw(st.sampled_from([1, -1])), 1.0),
        alignment=draw(st.sampled_from(["time_then_position", "time", "position"])),
        rule=draw(st.sampled_from(["pooled", "thesis"])),
        sides=draw(st.sampled_from(["one", "two"])),
        safety_factor=draw(st.sampled_from([5.5, 1.0])),
        signed=True,
        joints=tuple("ab"[:joints]),
        by_time=curve(draw(st.sampled_from([1e-3, 0.7e-3]))),
        by_position=curve(draw(st.sampled_from([0.25, 0.1]))),
    )


@st.composite
def cases(draw: st.DrawFn) -> tuple[FittedSignature, Recording, Signal]:
    count, joints = draw(COUNTS), draw(st.sampled_from([1, 2]))
    time = draw(clocks(count))
    speed = draw(samples(count, joints, st.one_of(st.just(1.0), st.just(0.5), VALUES)))
    position = np.cumsum(draw(samples(count, joints, st.sampled_from([0.1, 0.25, -0.25, 0.0]))), axis=0)
    gaps = draw(samples(count, joints, st.sampled_from([0.0, 0.0, 0.0, np.nan])))
    channels = {"speed": Series(time, speed, "m/s"), "position": Series(time, position + gaps, "m")}
    recording = Recording("made up", "", tuple("ab"[:joints]), channels)
    clock = time + draw(st.sampled_from([0.0, 0.3e-3]))
    values = draw(samples(count, joints))
    status = draw(samples(count, joints, st.sampled_from([0.0, 0.0, 0.0, 1.0, 3.0]))).astype(np.uint8)
    return draw(signatures(joints)), recording, Signal(clock, values, status, "N", joints=recording.joints)


@settings(deadline=None, max_examples=30)
@given(cases())
def test_limits_and_exceedance_have_the_bits_of_numpy(case):
    signature, recording, signal = case
    with np.errstate(all="ignore"):
        lower, upper, status = limits_by_numpy(signature, recording, signal)
        statistic, band = signature.evaluate(recording, signal)
        assert_same_bits(band.lower, lower)
        assert_same_bits(band.upper, upper)
        assert_same_bits(statistic.status, status)
        assert statistic.values is signal.values
        doubled = replace(signature, safety_factor=2.0 * signature.safety_factor)
        wider_lower, wider_upper, _ = limits_by_numpy(doubled, recording, signal)
        factor, values = signature.safety_factor, signal.values
        above = met_at_by_numpy(values, upper, wider_upper, factor)
        below = met_at_by_numpy(-values, -lower, -wider_lower, factor)
        for evaluated in (None, (statistic, band)):
            _, met_at = exceedance(signature, recording, signal, evaluated)
            assert_same_bits(met_at, np.fmax(above, below))


def test_signatures_with_other_grids_on_the_same_motion_have_their_own_limits():
    time = np.arange(2000) * 1e-3
    channels = {"speed": Series(time, np.ones(2000), "m/s"), "position": Series(time, time, "m")}
    recording = Recording("run", "", ("x",), channels)
    signal = Signal(time, np.zeros((2000, 1)), np.zeros((2000, 1), dtype=np.uint8), "N", joints=("x",))
    mean = np.linspace(0.0, 9.0, 21)[:, np.newaxis]
    curve = Curve(0.1, 0.1, np.full((21, 1), 10.0), mean, np.ones((21, 1)))
    first = FittedSignature(MotionClass(1, 1.0), "position", "thesis", "two", 1.0, True, ("x",), curve, curve)
    for signature in (first, replace(first, by_position=replace(curve, step=0.2)), replace(first, alignment="time")):
        lower, upper, _ = limits_by_numpy(signature, recording, signal)
        _, band = signature.evaluate(recording, signal)
        assert_same_bits(band.lower, lower)
        assert_same_bits(band.upper, upper)


def test_a_signal_with_more_columns_than_were_learned_is_refused():
    curve = Curve(0.1, 0.1, np.full((9, 1), 10.0), np.zeros((9, 1)), np.ones((9, 1)))
    signature = FittedSignature(MotionClass(1, 1.0), "time", "thesis", "two", 1.0, True, (), curve, curve)
    signal = Signal(np.arange(3.0), np.zeros((3, 2)), np.zeros((3, 2), dtype=np.uint8), "N")
    with pytest.raises(SignatureError, match="learned for 1 joints, not for 2"):
        signature.evaluate(Recording("run", "", ("x",), {}), signal)
