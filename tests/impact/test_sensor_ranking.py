"""Which sensor sees an impact first: closed forms of a sensor, and what a better one may never make worse."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import UsageError
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.examples import chapter_4 as example
from cdtool.impact.sensor_ranking import Ranking, deviations, rank_sensors
from cdtool.impact.sensors import Sensor

TIME = np.linspace(0.0, 0.2, 4001)


def sensor(**changed: object) -> Sensor:
    plain = Sensor("force", "here", "contact_force", "N", 1.0, 0.0, math.inf, 1000.0)
    return replace(plain, **changed)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def ranking() -> Ranking:
    return rank_sensors(example.RANKED, example.SENSORS)


def test_the_threshold_is_k_sigma_and_a_whole_step():
    assert sensor(noise=2.0, resolution=0.5).threshold(4.0) == pytest.approx(8.5)


def test_a_low_pass_sees_a_step_by_its_time_constant_later():
    corner = 10.0
    seen = sensor(bandwidth=corner, noise=1.0, sample_rate=1e4).time_to_see(TIME, np.full(TIME.size, 10.0), 5.0)
    assert seen == pytest.approx(math.log(2.0) / (2.0 * math.pi * corner), abs=2e-4)


@settings(max_examples=60, deadline=None)
@given(
    noise=st.floats(0.01, 10.0),
    less=st.floats(0.1, 1.0),
    resolution=st.floats(0.0, 5.0),
    bandwidth=st.sampled_from([5.0, 50.0, 500.0, math.inf]),
    rate=st.sampled_from([200.0, 1000.0, 4000.0]),
    swing=st.floats(1.0, 60.0),
)
def test_less_noise_or_finer_counts_never_see_later(noise, less, resolution, bandwidth, rate, swing):
    deviation = 20.0 * np.sin(swing * TIME)
    plain = sensor(noise=noise, resolution=resolution, bandwidth=bandwidth, sample_rate=rate)
    limit = plain.time_to_see(TIME, deviation, 5.0)
    for better in (replace(plain, noise=less * noise), replace(plain, resolution=less * resolution)):
        seen = better.time_to_see(TIME, deviation, 5.0)
        assert limit is None or (seen is not None and seen <= limit)


def test_the_order_is_that_of_figure_4_10(ranking):
    order = [item.sensor.name for item in ranking.responses]
    assert order[0] == "load_cell" and order[-1] == "motor_torque"
    assert set(order[1:3]) == {"accelerometer", "torque_sensor"}
    times = [item.time for item in ranking.responses]
    assert times == sorted(times)


@pytest.mark.parametrize("index", [3, 4], ids=["motor_position", "motor_speed"])
@pytest.mark.parametrize("counts", [1024, 4096])
def test_a_log_in_whole_counts_is_quiet_before_the_touch_and_sees_it_within_a_count(index, counts):
    # Sample by sample, as an encoder does it: round down to a count, take the difference, low-pass it.
    plain = replace(example.SENSORS[index], resolution=2.0 * math.pi * 0.015 / counts)
    motion = example.RANKED.simulate()
    touch, speed = motion.motor_position[0], example.RANKED.speed
    promised = rank_sensors(example.RANKED, [plain]).responses[0].time
    assert promised is not None
    keep = math.exp(-2.0 * math.pi * plain.bandwidth / plain.sample_rate)
    seen = []
    for offset, phase in np.random.default_rng(3).random((40, 2)):
        time = (np.arange(-300, 90) + phase) / plain.sample_rate
        moved = 0.015 * (np.interp(time, motion.time, motion.motor_position) - touch)
        position = np.where(time < 0.0, speed * time, moved) + offset * plain.resolution
        logged = np.floor(position / plain.resolution) * plain.resolution
        steady = speed * time + offset * plain.resolution
        if plain.differentiated:
            rate, logged = np.diff(logged, prepend=logged[0]) * plain.sample_rate, np.full(time.size, speed)
            for i in range(1, time.size):
                logged[i] = keep * logged[i - 1] + (1.0 - keep) * rate[i]
            steady = np.full(time.size, speed)
        beyond = np.abs(logged - steady) >= plain.threshold(5.0)
        assert not np.any(beyond[time < 0.0])
        seen.append(time[np.argmax(beyond)])
    # A count may hide as much of the deviation as the limit has for it.
    hidden = replace(plain, noise=plain.step).time_to_see(*deviations(example.RANKED, motion)[plain.quantity], 1.0)
    assert hidden is not None and 0.4 * promised < max(seen) <= hidden < 1.5 * promised


def test_what_limits_names_the_improvement_that_saves_most():
    noisy = replace(example.SENSORS[2], noise=5.0, resolution=0.0)
    (found,) = rank_sensors(example.RANKED, [noisy]).responses
    assert (found.limited_by, found.remedy) == ("noise", "half the noise")
    (better,) = rank_sensors(example.RANKED, [noisy.half_the_noise()]).responses
    assert found.saving == pytest.approx(found.time - better.time)
    slow = replace(example.SENSORS[0], sample_rate=100.0)
    (found,) = rank_sensors(example.RANKED, [slow]).responses
    assert found.limited_by == "sampling"


def test_values_without_meaning_are_named():
    with pytest.raises(UsageError, match="a sensor of 'force'"):
        rank_sensors(example.RANKED, [sensor(quantity="force")])
    with pytest.raises(UsageError, match="k is 0"):
        rank_sensors(example.RANKED, [sensor()], 0.0)
    with pytest.raises(UsageError, match=r"exponent is 1\.5"):
        replace(example.RANKED, obstacle=HuntCrossley(1e8, 0.0, 1.5))
    for name, value in (("noise", -1.0), ("sample_rate", 0.0), ("bandwidth", 0.0), ("resolution", math.nan)):
        with pytest.raises(UsageError, match=name.replace("_", " ")):
            sensor(**{name: value})
