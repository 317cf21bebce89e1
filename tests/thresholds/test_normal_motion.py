"""What every channel normally looks like along a stroke: against figures that can be worked out by hand."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.normal_motion import Absence, NormalMotion, NormalMotions, learn_normal_motion

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


OFFSETS = 4.0 * np.random.default_rng(5).normal(size=40)


def runs(count: int) -> list[Recording]:
    return [run(k, offset) for k, offset in enumerate(OFFSETS[:count])]


@pytest.fixture(scope="module")
def normal() -> NormalMotion:
    found = learn_normal_motion(runs(40), MOTION)
    assert found is not None
    return found


def test_mean_and_spread_of_a_channel_are_those_of_the_runs_at_the_same_place(normal):
    level, mean, spread = normal.compare(run(99), "torque")
    at = np.searchsorted(TIME, (1.6, 3.0, 5.0))
    travel = 0.1 + 0.2 * (TIME[at] - 1.3)
    assert mean[at, 0] == pytest.approx(100.0 + 50.0 * travel + OFFSETS.mean(), abs=1.0)
    # The offsets from run to run, and hardly any of the noise of 3 N within a run.
    assert spread[at, 0] == pytest.approx(OFFSETS.std(ddof=1), rel=0.15)
    assert level[at, 0] == pytest.approx(100.0 + 50.0 * travel, abs=2.0)


def test_a_place_is_known_by_travel_so_that_a_stop_is_compared_with_where_it_happened(normal):
    log = run(1)
    stopped = np.where(TIME < 3.0, log["position"].values[:, 0], log["position"].values[3000, 0])
    _, mean, _ = normal.compare(run(1, position=stopped), "speed")
    assert mean[3000:, 0] == pytest.approx(0.2, abs=2e-3)


def test_positions_count_from_the_start_of_the_motion_whatever_the_encoder_says(normal):
    log = run(3)
    moved = replace(log["position"], values=log["position"].values + 55.0)
    shifted = replace(log, channels={**log.channels, "position": moved})
    one, other = (normal.compare(item, "position") for item in (log, shifted))
    for i in range(2):
        assert one[i] == pytest.approx(other[i], abs=1e-9, nan_ok=True)


def test_a_class_serves_a_recording_of_its_speed_joints_and_channels_only(normal):
    log, known = run(99), NormalMotions((normal,))
    assert known.of(log, MOTION) is normal
    assert known.of(log, replace(MOTION, nominal_speed=0.3)) is Absence.NO_CLASS
    assert known.of(log, replace(MOTION, direction=-1)) is Absence.NO_CLASS
    assert known.of(replace(log, channels={"torque": log["torque"]}), MOTION) is Absence.NO_CHANNELS
    assert NormalMotions((), Absence.FEW_RUNS).of(log, MOTION) is Absence.FEW_RUNS


def test_it_survives_json(normal):
    text = json.dumps(normal.to_dict(), allow_nan=False)
    loaded = NormalMotion.from_dict(json.loads(text))
    assert json.dumps(loaded.to_dict()) == text
    one, other = (item.compare(run(99), "torque") for item in (normal, loaded))
    assert np.array_equal(one[2], other[2], equal_nan=True)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joints": ["axis", "more"]}, "for another motion, or for other joints"),
        ({"nominal_speed": 0.4}, "for another motion, or for other joints"),
        ({"rule": "no rule"}, "unknown rule"),
    ],
)
def test_a_damaged_band_or_one_of_other_joints_is_refused(normal, change, message):
    values = normal.to_dict()
    with pytest.raises((ValueError, UsageError), match=message):
        NormalMotion.from_dict({**values, "torque": {**values["torque"], **change}})


def test_a_run_more_moves_the_mean_as_learning_from_all_of_them_does():
    everything = runs(20)
    few, all_of_them = learn_normal_motion(everything[:-1], MOTION), learn_normal_motion(everything, MOTION)
    assert few is not None and all_of_them is not None
    updated = few.with_run(everything[-1], cap=100.0)
    assert updated.runs == 20
    one, other = (item.compare(run(99), "torque") for item in (updated, all_of_them))
    known = np.isfinite(one[1]) & np.isfinite(other[1])
    assert one[1][known] == pytest.approx(other[1][known], rel=1e-3)
    assert one[2][known] == pytest.approx(other[2][known], rel=1e-2)


def test_neither_load_cell_nor_label_is_learned():
    force = 100.0 * np.sin(TIME)
    found = learn_normal_motion([run(k, force=force) for k in range(4)], MOTION)
    assert found is not None and set(found.channels) == {"speed", "position", "torque"}


def test_too_few_runs_and_a_motion_at_rest_have_no_normal_curve():
    assert learn_normal_motion(runs(2), MOTION) is None
    assert learn_normal_motion(runs(5), MotionClass(0, 0.0)) is None
    blind = [replace(item, channels={"torque": item["torque"]}) for item in runs(5)]
    assert learn_normal_motion(blind, MOTION) is None
