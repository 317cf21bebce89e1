"""Autoregressive models, the innovation, and the sequential tests on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from cdtool.base.errors import NothingValidError
from cdtool.detectors.detection import Status
from cdtool.thresholds.innovation import Innovation
from cdtool.thresholds.whitening import burg
from tests.thresholds.strokes import TIME, N, signal, stroke

# Behind the ramp, before the end of the travel that enough runs have reached.
RUNNING = slice(1500, 3900)
MODEL = (1.5, -0.7)  # e_k = 1.5 e_{k-1} - 0.7 e_{k-2} + nu_k


def coloured(rng, count=N):
    return lfilter([1.0], [1.0, -MODEL[0], -MODEL[1]], rng.normal(size=count))


def runs(count=30, direction=1, seed=0):
    rng = np.random.default_rng(seed)
    return [(stroke(direction), signal(100.0 + coloured(rng))) for _ in range(count)]


@pytest.fixture(scope="module")
def fitted():
    return Innovation(order=2).fit(runs())


def test_burg_finds_the_model_from_many_short_sections():
    rng = np.random.default_rng(1)
    coefficients, spread = burg([3.0 * coloured(rng, 700)[200:] for _ in range(100)], 4)
    assert coefficients == pytest.approx((*MODEL, 0.0, 0.0), abs=0.03)
    assert spread == pytest.approx(3.0, rel=0.03)


def test_burg_finds_a_pure_tone_exactly():
    coefficients, spread = burg([np.cos(0.1 * np.arange(5000))], 2)
    assert coefficients == pytest.approx((2.0 * np.cos(0.1), -1.0), abs=1e-3)
    assert spread < 1e-3


def test_innovations_of_normal_runs_are_white_and_of_unit_spread(fitted):
    recording, normal = runs(1, seed=9)[0]
    statistic, _ = fitted.evaluate(recording, normal)
    nu = statistic.values[RUNNING, 0]
    assert np.std(nu) == pytest.approx(1.0, abs=0.06)
    for lag in (1, 2, 3, 10):
        assert abs(np.mean(nu[lag:] * nu[:-lag])) < 0.11
    assert statistic.unit == "1"


def test_a_jump_shows_at_once_and_a_slow_ramp_hardly_at_all(fitted):
    recording, normal = runs(1, seed=9)[0]
    quiet = fitted.evaluate(recording, normal)[0].values
    jump = fitted.evaluate(recording, replace(normal, values=normal.values + 20.0 * (TIME >= 3.0)[:, None]))[0].values
    ramp = np.maximum(TIME - 3.0, 0.0)[:, None] * 20.0
    slow = fitted.evaluate(recording, replace(normal, values=normal.values + ramp))[0].values
    assert jump[3000] - quiet[3000] == pytest.approx(20.0, rel=0.1)
    # 18 N after 0.9 s: (1 - sum a) of it are left.
    assert slow[3900] - quiet[3900] == pytest.approx(18.0 * (1.0 - sum(MODEL)), rel=0.15)


@pytest.mark.parametrize("missing", [1, 5, 20, 21, 300])
def test_every_sample_behind_a_gap_is_judged_and_as_normal_as_any(fitted, missing):
    scores = []
    for seed in range(60):
        recording, normal = runs(1, seed=100 + seed)[0]
        status = normal.status.copy()
        status[3000 : 3000 + missing] = Status.GAP
        statistic, _ = fitted.evaluate(recording, replace(normal, status=status))
        assert statistic.valid[3000 + missing : 3900].all()
        scores.append(statistic.values[3000 + missing : 3000 + missing + 3, 0])
    # Scaled by the normal spread before any sample is known, by what is known from then on.
    assert np.std(scores, axis=0) == pytest.approx([1.0, 1.0, 1.0], abs=0.45)


@pytest.mark.parametrize("missing", [1, 5, 20])
def test_a_filter_that_missed_a_sample_and_jumps_is_not_mistaken_for_a_contact(fitted, missing):
    # A detector's filter that lost a sample does not go on as the model says: its value jumps by less than normal runs
    # differ, yet by many times what the model leaves unexplained.
    recording, normal = runs(1, seed=9)[0]
    smooth = lfilter([0.05], [1.0, -0.95], normal.values - 100.0, axis=0) + 100.0
    pairs = [(r, replace(s, values=lfilter([0.05], [1.0, -0.95], s.values - 100.0, axis=0) + 100.0)) for r, s in runs()]
    learned = Innovation(order=4).fit(pairs)
    status, values = normal.status.copy(), smooth.copy()
    status[3000 : 3000 + missing] = Status.GAP
    jump = np.exp(-np.arange(len(values) - 3000 - missing) / 50.0)[:, None] * np.std(smooth[1500:3900])
    values[3000 + missing :] += jump
    statistic, _ = learned.evaluate(recording, replace(normal, values=values, status=status))
    assert np.abs(statistic.values[3000 + missing : 3200]).max() < 5.0


def test_a_level_that_a_contact_has_reached_in_a_gap_is_seen_behind_it(fitted):
    for missing in (5, 50):
        recording, normal = runs(1, seed=9)[0]
        status = normal.status.copy()
        status[3000 : 3000 + missing] = Status.GAP
        spread = np.std(normal.values[1500:3900])
        values = normal.values + 12.0 * spread * (TIME >= 3.0)[:, None]
        statistic, _ = fitted.evaluate(recording, replace(normal, values=values, status=status))
        assert statistic.values[3000 + missing, 0] > 5.5


def test_the_change_from_time_to_position_is_no_innovation():
    rng = np.random.default_rng(6)
    # A mean that changes steeply where acceleration ends: in time and in position its curves do not meet.
    bend = 100.0 + 400.0 * (TIME > 1.25)
    pairs = [(stroke(), signal(bend + 0.01 * coloured(rng))) for _ in range(30)]
    fitted = Innovation(order=2).fit(pairs[1:])
    statistic, _ = fitted.evaluate(*pairs[0])
    change = int(np.flatnonzero(stroke()["speed"].values[:, 0] >= 0.95 * fitted.motion.nominal_speed)[0])
    assert (statistic.status[change : change + 3] == Status.START_UP).all() and statistic.valid[change + 3]
    assert np.max(np.abs(statistic.values[statistic.valid])) < 20.0


def test_a_signal_that_does_not_vary_is_refused():
    with pytest.raises(NothingValidError, match="variation"):
        Innovation().fit([(stroke(), signal(np.full(N, 3.0)))] * 12)
