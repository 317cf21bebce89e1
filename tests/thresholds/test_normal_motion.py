"""What every channel normally looks like along a stroke: against figures that can be worked out by hand."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from cdtool.recordings.motion import MotionClass
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.normal_motion import LEVEL_SECONDS, NormalMotion, learn_normal_motion, levels

TIME = np.arange(6000) * 1e-3
MOTION = MotionClass(1, 0.2)
SPEED = np.clip(0.2 * (TIME - 0.3), 0.0, 0.2)


def run(seed: int, offset: float = 0.0, **changed: np.ndarray) -> Recording:
    """A stroke to 0.2 m/s; its torque is 100 N + 50 N/m of travel + noise of 3 N + an offset of the run."""
    rng = np.random.default_rng(seed)
    position = np.concatenate(([0.0], np.cumsum(SPEED[:-1]))) * 1e-3
    torque = 100.0 + 50.0 * position + 3.0 * rng.normal(size=len(TIME)) + offset
    speed = SPEED + 1e-3 * rng.normal(size=len(TIME))
    channels = {"speed": speed, "position": position + 7.0, "torque": torque, **changed}
    units = {"speed": "m/s", "position": "m", "torque": "N"}
    series = {name: Series(TIME, values, units.get(name, "N")) for name, values in channels.items()}
    return Recording(f"run {seed}", "log", ("axis",), series)


def runs(count: int) -> list[Recording]:
    offsets = np.random.default_rng(5).normal(size=count)
    return [run(k, 4.0 * offset) for k, offset in enumerate(offsets)]


@pytest.fixture(scope="module")
def normal() -> NormalMotion:
    found = learn_normal_motion(runs(40), MOTION)
    assert found is not None
    return found


def test_mean_and_spread_of_a_channel_are_those_of_the_runs_at_the_same_place(normal):
    compared = normal.compare(run(99), "torque")
    at = np.searchsorted(TIME, (1.6, 3.0, 5.0))
    travel = 0.1 + 0.2 * (TIME[at] - 1.3)
    assert compared.mean[at, 0] == pytest.approx(100.0 + 50.0 * travel, abs=1.5)
    # Noise within a run and offsets from run to run: 3 and 4 N.
    assert compared.spread[at, 0] == pytest.approx(5.0, rel=0.15)


def test_a_level_has_the_spread_of_the_offsets_and_hardly_any_of_the_noise(normal):
    compared = normal.compare(run(99), "torque")
    assert compared.level_spread[3000, 0] == pytest.approx(4.0, rel=0.2)


def test_a_place_is_known_by_travel_so_that_a_stop_is_compared_with_where_it_happened(normal):
    log = run(1)
    stopped = np.where(TIME < 3.0, log["position"].values[:, 0], log["position"].values[3000, 0])
    compared = normal.compare(run(1, position=stopped), "speed")
    assert compared.mean[3000:, 0] == pytest.approx(0.2, abs=2e-3)


def test_before_the_motion_begins_nothing_is_known(normal):
    compared = normal.compare(run(99), "torque")
    assert np.isnan(compared.mean[:300]).all() and np.isfinite(compared.mean[500:5900]).all()


def test_positions_count_from_the_start_of_the_motion_whatever_the_encoder_says(normal):
    log = run(3)
    moved = replace(log["position"], values=log["position"].values + 55.0)
    shifted = replace(log, channels={**log.channels, "position": moved})
    one, other = (normal.compare(item, "position") for item in (log, shifted))
    assert one.value == pytest.approx(other.value, abs=1e-9, nan_ok=True)
    assert one.mean == pytest.approx(other.mean, nan_ok=True)


def test_a_section_is_compared_as_the_whole_channel_is(normal):
    whole, part = normal.compare(run(99), "torque"), normal.compare(run(99), "torque", 1.5, 3.25)
    rows = slice(1500, 3251)
    for name in ("time", "value", "mean", "spread", "level", "level_mean", "level_spread", "running"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[rows])
    np.testing.assert_array_equal(part.distance, whole.distance[rows])


def test_it_survives_json(normal):
    text = json.dumps(normal.to_dict(), allow_nan=False)
    loaded = NormalMotion.from_dict(json.loads(text))
    assert json.dumps(loaded.to_dict()) == text
    one, other = (item.compare(run(99), "torque") for item in (normal, loaded))
    assert np.array_equal(one.spread, other.spread, equal_nan=True)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joints": ["axis", "more"]}, "of 1 joints, not of 2"),
        ({"direction": 0}, "class of motion"),
        ({"leading_joint": 4}, "class of motion"),
        ({"nominal_speed": -1.0}, "class of motion"),
        ({"channels": {"force": {}}}, "'force'"),
    ],
)
def test_a_damaged_normal_motion_or_one_of_other_joints_is_refused(normal, change, message):
    with pytest.raises(ValueError, match=message):
        NormalMotion.from_dict({**normal.to_dict(), **change})


def test_a_run_more_moves_the_mean_as_learning_from_all_of_them_does():
    everything = runs(20)
    few, all_of_them = learn_normal_motion(everything[:-1], MOTION), learn_normal_motion(everything, MOTION)
    assert few is not None and all_of_them is not None
    updated = few.with_run(everything[-1], cap=100.0)
    assert updated.runs == 20
    one, other = (item.compare(run(99), "torque") for item in (updated, all_of_them))
    known = np.isfinite(one.mean) & np.isfinite(other.mean)
    assert one.mean[known] == pytest.approx(other.mean[known], rel=1e-3)
    assert one.spread[known] == pytest.approx(other.spread[known], rel=1e-2)


def test_an_odd_run_moves_the_mean_by_no_more_than_the_cap_allows(normal):
    updated = normal.with_run(run(50, offset=4000.0), cap=3.0)
    before, after = (item.compare(run(99), "torque").mean[3000, 0] for item in (normal, updated))
    assert 0.0 < after - before < 3.0 * 5.0 / 40.0 * 1.5


def test_neither_load_cell_nor_label_is_learned():
    force = 100.0 * np.sin(TIME)
    found = learn_normal_motion([run(k, force=force) for k in range(4)], MOTION)
    assert found is not None and set(found.channels) == {"speed", "position", "torque"}


def test_too_few_runs_and_a_motion_at_rest_have_no_normal_curve():
    assert learn_normal_motion(runs(2), MOTION) is None
    assert learn_normal_motion(runs(5), MotionClass(0, 0.0)) is None
    blind = [replace(item, channels={"torque": item["torque"]}) for item in runs(5)]
    assert learn_normal_motion(blind, MOTION) is None


def test_a_level_is_the_mean_of_the_last_fifty_milliseconds_and_unknown_after_a_gap():
    values = np.arange(1000.0)[:, np.newaxis]
    time = np.arange(1000) * 1e-3
    width = round(LEVEL_SECONDS * 1e3)
    assert levels(time, values)[500, 0] == pytest.approx(np.mean(values[500 - width + 1 : 501]))
    kept = np.concatenate((time[:400], time[430:]))
    found = levels(kept, np.concatenate((values[:400], values[430:])))
    assert np.isnan(found[400, 0]) and np.isfinite(found[450, 0])
