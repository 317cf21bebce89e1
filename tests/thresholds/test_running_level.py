"""A signature whose band follows the slow change of a run: how far, how soon, and never into a contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.detectors.detection import Band, Status
from cdtool.detectors.friction_ekf import FrictionEkf
from cdtool.detectors.momentum import Momentum
from cdtool.recordings.motion.speed_range import GUARD, MEMORY
from cdtool.thresholds.base import exceedance
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.running_level_kernel import CLIP, FREEZE, START, WIDER
from cdtool.thresholds.signature import Signature
from tests.synthetic.gate_as_recording import as_recording
from tests.thresholds.strokes import TIME, N, noise_runs, signal, stroke

REACH = 6.0
GATE = GateParameters()


@pytest.fixture(scope="module")
def still() -> FittedSignature:
    return Signature(sides="two").fit(noise_runs(14))


@pytest.fixture(scope="module")
def following(still: FittedSignature) -> FittedSignature:
    return replace(still, adaptive_level=REACH)


def band_of(signature: FittedSignature, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    _, band = signature.evaluate(stroke(), signal(values))
    return band.lower[:, 0], band.upper[:, 0]


def by_the_book(
    values: FloatArray, band: Band, status: FloatArray, factor: float, reach: float
) -> tuple[FloatArray, FloatArray]:
    """The rule of the docstring, sample by sample."""
    lower, upper = band.lower[:, 0].copy(), band.upper[:, 0].copy()
    mean, spread = 0.5 * (upper + lower), (upper - lower) / (2.0 * factor)
    level = learned = 0.0
    queue, frozen = list(range(len(values))), -np.inf
    for k, now in enumerate(TIME):
        wider = 1.0 + (WIDER - 1.0) * max(0.0, 1.0 - learned / START)
        valid = status[k] == Status.VALID
        if valid and learned >= GUARD and abs(values[k] - mean[k] - level) > FREEZE * wider * spread[k]:
            frozen = now + GUARD
        while queue and queue[0] < k and TIME[queue[0]] <= now - GUARD:
            old = queue.pop(0)
            deviation = values[old] - mean[old] - level
            if status[old] == Status.VALID and now > frozen and np.isfinite(deviation):
                step = TIME[old + 1] - TIME[old]
                learned += step
                if learned > GUARD:
                    deviation = np.clip(deviation, -CLIP * spread[old], CLIP * spread[old])
                level += step / min(learned, MEMORY) * deviation
        shift = np.clip(level, -reach * spread[k], reach * spread[k])
        lower[k] = mean[k] + shift - wider * factor * spread[k]
        upper[k] = mean[k] + shift + wider * factor * spread[k]
    return lower, upper


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-12.0, 12.0), st.floats(0.0, 40.0), st.floats(0.5, 3.5))
def test_limits_are_those_of_the_rule(still, following, seed, offset, contact, at):
    values = 100.0 + offset + np.random.default_rng(seed).normal(size=N) + contact * (at < TIME)
    given_signal = signal(values)
    statistic, band = still.evaluate(stroke(), given_signal)
    lower, upper = by_the_book(values, band, statistic.status[:, 0], still.safety_factor, REACH)
    found = band_of(following, values)
    np.testing.assert_allclose(found[0], lower, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found[1], upper, rtol=1e-9, atol=1e-9)


def test_a_contact_is_not_followed_while_it_lasts(still, following):
    values = 100.0 + np.random.default_rng(2).normal(size=N)
    values[2500:] += 20.0
    free, struck = band_of(following, values - 20.0 * (TIME >= 2.5))[1], band_of(following, values)[1]
    assert np.array_equal(struck[:2500], free[:2500], equal_nan=True)
    moved = (struck - band_of(still, values)[1])[2500:]
    assert moved[np.isfinite(moved)] == pytest.approx(moved[0], abs=1e-9)
    known = np.isfinite(struck) & (TIME > 2.6)
    assert known.sum() > 1000 and np.all(values[known] > struck[known])


def test_the_factor_that_a_sample_meets_does_not_depend_on_the_factor_that_is_set(following):
    values = 102.0 + np.random.default_rng(4).normal(size=N)
    _, met = exceedance(following, stroke(), signal(values))
    _, other = exceedance(following.with_safety_factor(2.0), stroke(), signal(values))
    np.testing.assert_allclose(other[np.isfinite(other)], met[np.isfinite(met)], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("detector", [Momentum(), FrictionEkf()])
def test_friction_that_rose_by_a_fifth_raises_no_alarm_and_a_contact_does(detector, gate):
    def pair(seed, impact, changed):
        run = simulate_gate_run(changed.gate(GATE), np.random.default_rng(seed), impact)
        recording = as_recording(run, str(seed), GATE).without_ground_truth()
        return run.contact_start, recording, detector.signal(recording, gate)

    learned = [pair([5, n], "none", ChangedMachine())[1:] for n in range(12)]
    older = ChangedMachine(friction=1.2)
    alarming = {0.0: 0, REACH: 0}
    for reach in alarming:
        fitted = Signature(sides="one", adaptive_level=reach).fit(learned)
        for n in range(6):
            _, recording, found = pair([6, n], "none", older)
            alarming[reach] += first_alarm(fitted, recording, found) is not None
        if reach:
            start, recording, found = pair([7, 1], "soft", older)
            alarm = first_alarm(fitted, recording, found)
            assert start is not None and alarm is not None and 0.0 < alarm - start < 0.2
    assert alarming[REACH] == 0
    assert alarming[0.0] == 6 or isinstance(detector, FrictionEkf)


def first_alarm(fitted, recording, found):
    statistic, band = fitted.evaluate(recording, found)
    outside = (statistic.values > band.upper)[:, 0] & statistic.valid[:, 0]
    held = np.convolve(outside, np.ones(9))[: len(outside)] >= 9
    return float(statistic.time[np.argmax(held)]) if held.any() else None
