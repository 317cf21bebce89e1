"""Matched banks: whitening and templates against closed forms, the settled phase, evidence, statuses, storage."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from cdtool.detection import WHOLE_MACHINE, Signal, Status
from cdtool.errors import NothingValidError, SignatureError, UsageError
from cdtool.recording import Recording, Series
from cdtool.thresholds.matched_banks import FittedMatchedBanks, MatchedBanks
from cdtool.thresholds.matched_banks_kernel import _non_negative, _non_negative_pair, innovations_of, settled_from
from cdtool.thresholds.matched_model import fit_autoregression
from cdtool.thresholds.matched_templates import Bank, Component, Template, banks_of, designed, whitened_template
from tests.thresholds.strokes import TIME, N, noise_runs, signal, stroke

MODEL = np.array([[[0.6, 0.2], [0.0, 0.5]], [[-0.2, 0.0], [0.1, 0.1]]])
MIXING = np.array([[2.0, 0.0], [1.0, 0.5]])
KNOWN = np.ones(N, dtype=np.uint8)


def autoregressive(samples: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Values (2, n) of the model, and the white noise (2, n) behind them."""
    noise = np.random.default_rng(seed).normal(size=(2, samples))
    values = np.zeros((2, samples))
    for k in range(samples):
        values[:, k] = MIXING @ noise[:, k]
        for i in range(min(k, 2)):
            values[:, k] += MODEL[i] @ values[:, k - 1 - i]
    return values, noise


@pytest.fixture(scope="module")
def runs():
    return noise_runs(30)


@pytest.fixture(scope="module")
def fitted(runs) -> FittedMatchedBanks:
    return MatchedBanks(sides="one").fit(runs)


def test_a_known_autoregression_is_found_and_whitened():
    values, noise = autoregressive(60_000)
    model, root = fit_autoregression([values], 2)
    np.testing.assert_allclose(model, MODEL, atol=0.02)
    np.testing.assert_allclose(root @ (MIXING @ MIXING.T) @ root.T, np.eye(2), atol=0.03)
    innovations = np.empty(values.shape)
    innovations_of(values, np.ones(60_000, dtype=np.uint8), MODEL, np.linalg.inv(MIXING), 0, innovations)
    assert not innovations[:, :2].any()
    np.testing.assert_allclose(innovations[:, 2:], noise[:, 2:], atol=1e-10)


def test_a_missing_sample_silences_as_many_innovations_as_the_order_and_no_more():
    values, noise = autoregressive(1000)
    known = np.ones(1000, dtype=np.uint8)
    known[500] = 0
    known[700] = 2
    innovations = np.empty(values.shape)
    innovations_of(values, known, MODEL, np.linalg.inv(MIXING), 0, innovations)
    silent = np.flatnonzero(~innovations.any(axis=0))
    assert silent.tolist() == [0, 1, 500, 501, 502, 700, 701]
    np.testing.assert_allclose(innovations[:, 520:690], noise[:, 520:690], atol=1e-10)


def test_a_template_is_whitened_as_a_signal_of_its_shape_is():
    ramp = np.zeros((2, 60))
    ramp[1, 20:] = (np.arange(1, 41) / 40.0) ** 2.0
    root = np.linalg.inv(MIXING)
    response = np.empty(ramp.shape)
    innovations_of(ramp, np.ones(60, dtype=np.uint8), MODEL, root, 0, response)
    expected = response[:, 20:] / np.linalg.norm(response[:, 20:])
    np.testing.assert_allclose(whitened_template(Component(1, 2.0), 40, MODEL, root), expected.T, atol=1e-12)


def test_steps_keep_95_percent_of_the_energy_of_every_template():
    bank = Bank((0, 1), 2, tuple(Template(1e-3 * length, (Component(1, 2.0),), 1.0) for length in (1, 10, 100)), 1.0)
    design = designed([bank], [(MODEL, np.linalg.inv(MIXING))], 1e-3, 2)
    assert ((design.gram[:, 0] > 0.93) & (design.gram[:, 0] < 1.0 + 1e-12)).all()


def test_the_evidence_of_a_template_in_white_noise_is_its_inner_product(fitted):
    """A plain sum of 4 samples: Z = sum / sqrt(4), in spreads, before it is standardised."""
    model = fitted.model
    white = replace(model, models=tuple((np.zeros((1, 1, 1)), np.eye(1)) for _ in model.banks))
    white = replace(white, design=designed(white.banks, white.models, 1e-3, 1))
    run, own = stroke(), signal(100.0 + 2.0 * (TIME >= 3.0))
    deviation = white.deviation(run, own)
    sizes = white.sizes(deviation)
    at = 3010
    before = deviation.values[0]
    np.testing.assert_allclose(sizes[0, at], before[at - 3 : at + 1].sum() / 2.0, rtol=1e-9)


@pytest.mark.parametrize("free", [(0, 0), (0, 1), (1, 1)])
def test_the_largest_fit_of_two_components_is_that_of_scipy(free):
    from scipy.optimize import minimize

    rng = np.random.default_rng(1)
    bounds = [(None, None) if item else (0.0, None) for item in free]
    for _ in range(20):
        root, b = rng.normal(size=(2, 2)), rng.normal(size=2)
        gram = root @ root.T + 0.1 * np.eye(2)
        best = -minimize(lambda x, b=b, g=gram: x @ g @ x - 2.0 * b @ x, [0.1, 0.1], bounds=bounds, tol=1e-12).fun
        marks = np.array(free, dtype=np.uint8)
        assert _non_negative_pair(b, gram, marks, 0) == pytest.approx(best, abs=1e-6)
        assert _non_negative(b, gram, marks, 0, 2, np.zeros(2)) == pytest.approx(best, rel=0.02, abs=1e-3)


@pytest.mark.parametrize("share", [0.9, 1.0])
def test_a_ramp_is_settled_once_it_has_been_flat_for_a_while(share):
    speed = np.minimum(0.2, 0.2 * np.maximum(TIME - 0.3, 0.0))
    start = settled_from(np.ascontiguousarray(share * speed), 50, 100, 0.15, 0.08)
    assert 1.3 < TIME[start] < 1.55
    assert settled_from(np.ascontiguousarray(0.3 * speed), 50, 100, 0.15, 0.08) == N


def test_a_step_is_seen_within_milliseconds_and_only_after_it(fitted, runs):
    run, quiet = runs[0]
    hit = quiet.changed(values=quiet.values + 6.0 * (TIME[:, np.newaxis] >= 3.0))
    statistic, band = fitted.evaluate(run, hit)
    outside = TIME[statistic.values[:, 0] > band.upper[:, 0]]
    assert 3.0 <= outside[0] < 3.01
    assert statistic.joints == WHOLE_MACHINE and statistic.unit == "1"


def test_one_sided_it_ignores_what_helps_the_motion(runs):
    run, quiet = runs[0]
    helped = quiet.changed(values=quiet.values - 6.0 * (TIME[:, np.newaxis] >= 3.0))
    alarms = {}
    for sides in ("one", "two"):
        statistic, band = MatchedBanks(sides=sides).fit(runs).evaluate(run, helped)
        alarms[sides] = bool((statistic.values > band.upper)[: np.searchsorted(TIME, 3.1)].any())
    assert alarms == {"one": False, "two": True}


def test_backward_motion_is_judged_as_its_mirror_image():
    forward, backward = noise_runs(12), noise_runs(12, direction=-1)
    mirrored = [(run, own.changed(values=-own.values)) for run, own in backward]
    there = MatchedBanks(sides="one").fit(forward).evaluate(*forward[0])[0]
    back = MatchedBanks(sides="one").fit(mirrored).evaluate(*mirrored[0])[0]
    np.testing.assert_array_equal(there.status, back.status)
    np.testing.assert_allclose(there.values, back.values, rtol=1e-6, atol=1e-6)


def test_free_runs_that_were_not_learned_from_stay_below_the_limit(fitted):
    for run, own in noise_runs(20, seed=5):
        statistic, band = fitted.evaluate(run, own)
        assert not (statistic.values > band.upper).any()


def test_the_statistic_does_not_depend_on_the_factor_and_the_limit_is_the_factor(fitted, runs):
    statistic, _ = fitted.evaluate(*runs[1])
    again, band = fitted.with_safety_factor(3.0).evaluate(*runs[1])
    np.testing.assert_array_equal(statistic.values, again.values)
    assert (band.upper == 3.0).all() and (band.lower == -np.inf).all()


def test_what_comes_later_changes_nothing_before(fitted, runs):
    run, own = runs[2]
    rng = np.random.default_rng(3)
    whole, _ = fitted.evaluate(run, own)
    for end in (500, 1400, 1777, 2500, 3999):
        channels = {}
        for name, series in run.channels.items():
            values = series.values.copy()
            values[end:] += rng.normal(size=values[end:].shape)
            channels[name] = Series(series.time, values, series.unit)
        values = own.values.copy()
        values[end:] += 50.0 * rng.normal(size=values[end:].shape)
        changed, _ = fitted.evaluate(replace(run, channels=channels), own.changed(values=values))
        np.testing.assert_array_equal(changed.values[:end], whole.values[:end])
        np.testing.assert_array_equal(changed.status[:end], whole.status[:end])


def test_a_settled_motion_at_another_speed_is_not_assessable(fitted, runs):
    for speed, is_known in ((0.2, True), (0.17, False), (0.24, False)):
        statistic, _ = fitted.evaluate(stroke(speed=speed), runs[3][1])
        late = statistic.status[2200:2400, 0]
        assert (late == (Status.VALID if is_known else Status.OTHER_SPEED)).all()


def test_another_sample_rate_is_not_assessable(fitted):
    time = np.arange(2000) * 2e-3
    values = 100.0 + np.random.default_rng(0).normal(size=2000)
    statistic, _ = fitted.evaluate(stroke(time=time), signal(values, time))
    assert (statistic.status[1200:1800] == Status.OTHER_RATE).all()


def test_lost_rows_are_no_evidence(fitted, runs):
    run, own = runs[4]
    kept = np.ones(N, dtype=bool)
    kept[2000:2040] = kept[2500:2503] = False
    drifting = own.values + 30.0 * np.sin(2.0 * np.pi * 0.2 * TIME[:, np.newaxis])
    channels = {name: Series(item.time[kept], item.values[kept], item.unit) for name, item in run.channels.items()}
    learned = MatchedBanks(sides="one").fit(
        [
            (item, each.changed(values=each.values + 30.0 * np.sin(2.0 * np.pi * 0.2 * TIME[:, np.newaxis])))
            for item, each in noise_runs(12)
        ]
    )
    part = Signal(TIME[kept], drifting[kept], own.status[kept], "N", True, ("axis",))
    statistic, band = learned.evaluate(replace(run, channels=channels), part)
    assert not (statistic.values > band.upper).any() and statistic.valid[2100:3500].all()


def test_a_missing_column_silences_its_bank_and_the_sample_is_a_gap(fitted, runs):
    run, own = runs[5]
    values, status = own.values.copy(), own.status.copy()
    values[3000:3020], status[3000:3020] = np.nan, Status.GAP
    statistic, _ = fitted.evaluate(run, own.changed(values=values, status=status))
    assert (statistic.status[3000:3020] == Status.GAP).all() and statistic.valid[3020:3500].all()


def test_it_survives_json_bit_by_bit(fitted, runs):
    text = json.dumps(fitted.to_dict(), allow_nan=False)
    loaded = FittedMatchedBanks.from_dict(json.loads(text))
    for run, own in runs[:3]:
        np.testing.assert_array_equal(loaded.evaluate(run, own)[0].values, fitted.evaluate(run, own)[0].values)
    assert loaded.motion == fitted.motion and json.dumps(loaded.to_dict(), allow_nan=False) == text


def test_other_columns_than_those_learned_are_refused(fitted, runs):
    run, own = runs[0]
    two = own.changed(
        values=np.hstack((own.values, own.values)),
        status=np.hstack((own.status, own.status)),
        joints=("axis acceleration", "axis force"),
    )
    with pytest.raises(SignatureError, match="learned for"):
        fitted.evaluate(run, two)


def test_a_run_with_other_columns_is_named(runs):
    (run, values), *others = runs
    odd = replace(run, name="odd.csv"), replace(values, joints=("other",))
    with pytest.raises(SignatureError, match=r"odd\.csv has the columns other, .* axis"):
        MatchedBanks().fit([*others, odd])


def test_it_says_which_template_and_column_decided(fitted, runs):
    run, quiet = runs[0]
    hit = quiet.changed(values=quiet.values + 6.0 * (TIME[:, np.newaxis] >= 3.0))
    evidence = fitted.explained(run, hit, 3.005)
    assert evidence is not None and evidence.columns == ("axis",)
    assert evidence.length <= 0.016 and evidence.moved[0] > 3.0
    assert fitted.explained(run, quiet, 0.1) is None
    early = fitted.explained(run, quiet, 0.8)
    assert early is not None and not early.columns


def test_the_banks_of_an_axis_are_separate_and_those_of_joints_are_one():
    axis = banks_of(("acceleration", "force"), ("x", "x"), False, None)
    assert [(bank.columns, bank.order) for bank in axis] == [((0,), 4), ((1,), 4)]
    # Two axes with all channels: the speed decides slowly, and not before the motion is settled.
    kinds = ("acceleration", "acceleration", "force", "force", "torque", "torque", "speed", "speed")
    banks = banks_of(kinds, ("x", "y") * 4, False, None)
    assert [bank.columns for bank in banks] == [(0,), (2,), (4, 6), (1,), (3,), (5, 7)]
    assert [bank.at_start for bank in banks] == [True, True, False] * 2
    assert {part.column for item in banks[-1].templates for part in item.components} == {1}
    assert min(item.length for item in banks[-1].templates) > 0.05
    kinds = ("torque", "torque", "speed", "speed", "acceleration", "acceleration")
    (arm,) = banks_of(kinds, ("a", "b") * 3, False, None)
    assert arm.columns == tuple(range(6)) and arm.order == 20
    used = {part.column for item in arm.templates for part in item.components}
    assert used == {2, 3, 4, 5}
    (blind,) = banks_of(kinds[:4], ("a", "b") * 2, False, None)
    assert {part.column for item in blind.templates for part in item.components} == {2, 3}


def test_runs_that_are_never_settled_are_refused():
    time = np.arange(1200) * 1e-3
    rng = np.random.default_rng(0)
    runs = [(stroke(time=time), signal(rng.normal(size=1200), time)) for _ in range(12)]
    with pytest.raises(NothingValidError, match="settled"):
        MatchedBanks().fit(runs)


@pytest.mark.parametrize("settings", [{"order": 0}, {"order": 61}, {"safety_factor": 0.0}, {"sides": "three"}])
def test_wrong_settings_are_refused(settings):
    with pytest.raises(UsageError):
        MatchedBanks(**settings)


def test_a_recording_without_motion_has_no_limit(fitted, runs):
    _, own = runs[0]
    still = Series(TIME, np.zeros(N), "m/s")
    at_rest = Recording("rest", "rest", ("axis",), {"speed": still, "position": Series(TIME, np.zeros(N), "m")})
    statistic, _ = fitted.evaluate(at_rest, own)
    assert (statistic.status == Status.NO_LIMIT).all()


@pytest.mark.parametrize(("columns", "order", "lengths"), [(2, 3, (50, 7, 3, 40)), (3, 1, (20, 5)), (1, 4, (30,))])
def test_an_autoregression_is_the_least_squares_fit_to_all_sections(columns, order, lengths):
    rng = np.random.default_rng(columns)
    sections = [rng.normal(size=(columns, length)) for length in lengths]
    rows, now = [], []
    for section in sections:
        for k in range(order, section.shape[1]):
            rows.append(np.concatenate([section[:, k - i] for i in range(1, order + 1)]))
            now.append(section[:, k])
    expected = np.linalg.lstsq(np.array(rows), np.array(now), rcond=None)[0]
    model, _ = fit_autoregression(sections, order)
    np.testing.assert_allclose(model, expected.reshape(order, columns, columns).transpose(0, 2, 1), atol=1e-5)
