"""What holds for every registered threshold, those of installed plug-ins included."""

from __future__ import annotations

import json
from dataclasses import is_dataclass, replace

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.base.errors import SignatureError, UsageError
from cdtool.base.settings import keys_of
from cdtool.detectors.momentum import Momentum
from cdtool.formats.signature_file import FactorOrigin, SignatureFile
from cdtool.formats.signature_store import read_signature, write_signature
from cdtool.recordings.recording import CHANNELS, GROUND_TRUTH
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.base import exceedance, is_per_run

NAMES = THRESHOLDS.names(plugins=True)


@pytest.fixture(scope="module")
def pairs(gate, simulated):
    recordings = [simulated("none", seed) for seed in range(10, 22)]
    return [(recording.without_ground_truth(), Momentum().signal(recording, gate)) for recording in recordings]


@pytest.mark.parametrize("name", NAMES)
def test_it_is_a_frozen_dataclass_that_says_when_it_fails(name):
    threshold = THRESHOLDS.load(name)
    assert is_dataclass(threshold) and threshold.__dataclass_params__.frozen
    assert threshold.name == name
    assert "Fails" in threshold.__doc__
    assert set(threshold.needs) <= set(CHANNELS) - set(GROUND_TRUTH)


@pytest.mark.parametrize("name", NAMES)
def test_a_setting_without_meaning_is_refused_by_name(name):
    rule = THRESHOLDS.load(name)
    for key in keys_of(rule).values():
        default = getattr(rule(), key.attribute)
        for wrong in (np.nan, -1.0) if isinstance(default, float) and default > 0.0 else (np.nan,):
            with pytest.raises(UsageError, match=key.attribute):
                rule(**{key.attribute: wrong})


@pytest.mark.parametrize("name", NAMES)
def test_a_fitted_threshold_survives_saving_and_loading(name, pairs, gate, simulated):
    fitted = THRESHOLDS.load(name)().fit(pairs)
    loaded = type(fitted).from_dict(json.loads(json.dumps(fitted.to_dict(), allow_nan=False)))
    recording = simulated("stiff", 1)
    signal = Momentum().signal(recording, gate)
    for ours, theirs in zip(fitted.evaluate(recording, signal), loaded.evaluate(recording, signal), strict=True):
        for attribute in ("values", "status", "lower", "upper"):
            if hasattr(ours, attribute):
                np.testing.assert_array_equal(getattr(ours, attribute), getattr(theirs, attribute))


@pytest.mark.parametrize("name", NAMES)
def test_it_survives_a_signature_file_with_its_rule(name, pairs, gate, tmp_path):
    rule = THRESHOLDS.load(name)()
    fitted = rule.fit(pairs)
    assert type(fitted) in rule.fitted
    stored = SignatureFile(
        machine="gate",
        machine_fingerprint="x",
        detector="momentum",
        gains={},
        unit="N",
        joints=pairs[0][1].joints,
        rule=rule,
        origin=FactorOrigin("budget", "1/300op", 300, 0),
        activation=Activation(),
        current=(fitted,),
        first=(fitted,),
        runs=(),
    )
    write_signature(tmp_path / "s.json", stored)
    loaded = read_signature(tmp_path / "s.json")
    assert (loaded.rule, loaded.origin, loaded.threshold) == (rule, stored.origin, name)
    assert loaded.current[0].to_dict() == fitted.to_dict() and loaded.first[0].to_dict() == fitted.to_dict()


@pytest.mark.parametrize("name", NAMES)
def test_its_limits_are_causal(name, pairs, gate, simulated):
    fitted = THRESHOLDS.load(name)().fit(pairs)
    recording = simulated("soft", 1).without_ground_truth()
    statistic, band = fitted.evaluate(recording, Momentum().signal(recording, gate))
    for end in (0.2, 0.75, 1.31, 4.0, 6.05):
        part = recording.between(-np.inf, end)
        cut_statistic, cut_band = fitted.evaluate(part, Momentum().signal(part, gate))
        n = len(cut_statistic.time)
        np.testing.assert_array_equal(cut_band.upper, band.upper[:n])
        np.testing.assert_array_equal(cut_band.lower, band.lower[:n])
        np.testing.assert_array_equal(cut_statistic.values, statistic.values[:n])
        np.testing.assert_array_equal(cut_statistic.status, statistic.status[:n])


@pytest.mark.parametrize("name", NAMES)
def test_shapes_fit_and_a_missing_value_is_never_valid(name, pairs, gate, simulated):
    fitted = THRESHOLDS.load(name)().fit(pairs)
    recording = simulated("none", 3)
    signal = Momentum().signal(recording, gate)
    values, status = signal.values.copy(), signal.status.copy()
    values[3000:3100], status[3000:3100] = np.nan, 3
    holed = replace(signal, values=values, status=status)
    statistic, band = fitted.evaluate(recording, holed)
    assert statistic.values.shape == statistic.status.shape == band.lower.shape == band.upper.shape
    assert not statistic.valid[3000:3100].any()
    assert not np.isnan(band.upper[statistic.valid]).any() and not np.isnan(band.lower[statistic.valid]).any()
    assert statistic.valid[4000:5000].all()


@pytest.mark.parametrize("name", NAMES)
def test_a_flaky_signal_is_judged_where_it_is_there_and_only_there(name, pairs, gate, simulated):
    fitted = THRESHOLDS.load(name)().fit(pairs)
    fitted = fitted.with_safety_factor(2.0 * fitted.safety_factor)  # so wide that no chance leads out of it
    recording = simulated("none", 4)
    signal = Momentum().signal(recording, gate)
    whole, _ = fitted.evaluate(recording, signal)
    lost = np.random.default_rng(0).random(signal.values.shape) < 0.2
    values, status = np.where(lost, np.nan, signal.values), np.where(lost, 3, signal.status).astype(np.uint8)
    status[4000:4200] = 2
    statistic, band = fitted.evaluate(recording, replace(signal, values=values, status=status))
    assert not statistic.valid[lost].any() and not statistic.valid[4000:4200].any()
    assert np.isfinite(statistic.values[statistic.valid]).all()
    assert statistic.valid[4700:5500][~lost[4700:5500] & whole.valid[4700:5500]].all()
    assert not (statistic.valid & ((statistic.values > band.upper) | (statistic.values < band.lower))).any()


@pytest.mark.parametrize("name", [name for name in NAMES if hasattr(THRESHOLDS.load(name), "sides")])
def test_with_one_side_watched_only_the_limit_that_an_obstacle_would_break_is_there(name, pairs, simulated):
    rule = replace(THRESHOLDS.load(name)(), sides="one")
    recording, signal = pairs[0]
    statistic, band = rule.fit(pairs).evaluate(recording, signal)
    running = statistic.valid & (statistic.time > 2.0)[:, np.newaxis]
    assert running.any() and np.isneginf(band.lower[running]).all() and np.isfinite(band.upper[running]).all()


@pytest.mark.parametrize("name", NAMES)
def test_its_limits_are_linear_in_the_safety_factor_and_decide_which_samples_are_outside(name, pairs, gate, simulated):
    fitted = THRESHOLDS.load(name)().fit(pairs)
    recording = simulated("stiff", 1).without_ground_truth()
    signal = Momentum().signal(recording, gate)
    statistic, met_at = exceedance(fitted, recording, signal)
    for factor in (0.3, 1.0, fitted.safety_factor, 17.0):
        moved = fitted.with_safety_factor(factor)
        again, band = moved.evaluate(recording, signal)
        assert moved.safety_factor == factor
        np.testing.assert_array_equal(again.values, statistic.values)
        np.testing.assert_array_equal(again.status, statistic.status)
        outside = ((again.values > band.upper) | (again.values < band.lower)) & again.valid
        clear = np.abs(met_at - factor) > 1e-6 * factor
        np.testing.assert_array_equal(outside[clear], ((met_at > factor) & again.valid)[clear])


@pytest.mark.parametrize("name", [name for name in NAMES if not is_per_run(THRESHOLDS.load(name))])
def test_too_few_runs_are_refused(name, pairs):
    with pytest.raises(SignatureError, match="1"):
        THRESHOLDS.load(name)().fit(pairs[:1])


@pytest.mark.parametrize("name", [name for name in NAMES if is_per_run(THRESHOLDS.load(name))])
def test_a_threshold_from_each_run_itself_needs_no_runs_and_learns_nothing_from_them(name, pairs):
    rule = THRESHOLDS.load(name)()
    assert rule.fit([]) == rule.fit(pairs) and is_per_run(rule.fit([]))
