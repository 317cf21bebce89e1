"""The forecast of false alarms: known rates, the budget's temperatures and dates, coverage, and refusals."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from cdtool.errors import SignatureError
from cdtool.evaluation.statistics.prediction import tail
from cdtool.evaluation.upkeep import forecast as module
from cdtool.evaluation.upkeep.forecast import Coming, Forecast, forecast_season
from cdtool.evaluation.upkeep.forecast_words import forecast_lines, headlines
from cdtool.evaluation.upkeep.season_model import fit_season
from cdtool.thresholds.fitted_signature import FittedSignature
from tests.evaluation.upkeep.forecasts import ORIGIN, made_season, signature

FACTOR = 5.5


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    """Let the intervals be coarse, for the sake of time."""
    monkeypatch.setattr(module, "fit_season", partial(fit_season, resamples=60))


def law(temperature: float, days: float) -> float:
    """Return the level: at 10 °C runs demand 2 + 2."""
    return 2.0 - 0.1 * (temperature - 10.0) + 0.0 * days


def over(low: float, high: float, end: float = 80.0) -> Coming:
    return Coming.over_range((low, high), 59.5, end, 200)


def forecast(runs=None, coming: Coming | None = None, budget: float = 0.01, seed: int = 0) -> Forecast:
    runs = made_season(law, places=3) if runs is None else runs
    return forecast_season(signature(), runs, coming or over(0.0, 20.0), budget, seed=seed, origin=ORIGIN)


def test_a_known_line_with_normal_noise_gives_the_known_rate():
    found = forecast(made_season(law, 0.5, count=600, per_day=10, places=3), over(-5.0, 5.0))
    temperatures = np.linspace(-5.0, 5.0, 201)
    known = tail((FACTOR - 2.0 - np.array([law(at, 0.0) for at in temperatures])) / 0.5).mean()
    assert found.share.value == pytest.approx(known, abs=0.08)
    assert found.share.low <= known <= found.share.high
    # The tail is that of a sum of a normal and a Gumbel part: nearly the normal one where alarms are frequent.
    normal = np.mean([0.5 * math.erfc((FACTOR - 2.0 - law(at, 0.0)) / 0.5 / math.sqrt(2.0)) for at in temperatures])
    assert known == pytest.approx(normal, abs=0.02)


def test_the_budget_is_exceeded_below_the_known_temperature():
    found = forecast(made_season(law, 0.5, count=600, per_day=10, places=3), over(-5.0, 5.0), budget=0.2)
    grid = np.linspace(-5.0, 10.0, 1501)
    known = grid[tail((FACTOR - 2.0 - np.array([law(at, 0.0) for at in grid])) / 0.5) > 0.2].max()
    assert found.colder is not None and found.warmer is not None
    assert found.colder.low <= known <= found.colder.high
    assert found.colder.value == pytest.approx(known, abs=2.0) and found.warmer.value == math.inf
    assert "exceeded below" in headlines(found)[1]


def test_two_sides_exceed_the_budget_below_and_above():
    runs = made_season(lambda at, _: 0.2 * (at - 20.0), 0.5, sides=(1, -1), places=3)
    found = forecast(runs, over(-5.0, 45.0), 0.2)
    assert found.colder is not None and found.warmer is not None
    assert found.colder.value < 20.0 < found.warmer.value < 45.0
    words = headlines(found)[1]
    assert "below" in words and "above" in words


@pytest.mark.parametrize("seed", range(3))
def test_a_wider_range_never_has_a_smaller_worst_rate(seed):
    runs = made_season(law, 0.6, seed=seed, places=3)
    worst = [
        float(forecast(runs, over(*ends)).by_temperature.share[:, 0].max()) for ends in ((5, 15), (0, 20), (-8, 30))
    ]
    assert worst[0] <= worst[1] + 1e-3 and worst[1] <= worst[2] + 1e-3


def test_drift_is_forecast_without_temperatures():
    runs = [replace(run, temperature=math.nan) for run in made_season(lambda _, days: 0.04 * days, 0.3, places=3)]
    found = forecast(runs, Coming.over_range(None, 59.5, 110.0, 100), 0.1)
    # The level at which 1 in 10 exceeds the factor is reached after so many days.
    known = (FACTOR - 2.0 - 0.3 * 1.29) / 0.04
    assert found.relearn_by.value == pytest.approx(known, abs=8.0)
    assert found.relearn_by.low <= found.relearn_by.value <= found.relearn_by.high
    assert found.colder is None and found.by_temperature is None and found.regressors == ("time",)
    assert headlines(found)[2].startswith("relearn by 2025-09-")
    assert "temperature is not known" in "\n".join(forecast_lines(found))


def test_expected_temperatures_by_date_give_the_week_from_which_the_budget_is_exceeded():
    times = np.arange(60.0, 110.0)
    coming = Coming.by_time(20.0 - 0.5 * (times - 60.0), times, 7.0, 100)
    found = forecast(made_season(law, 0.4, places=3), coming, 0.3)
    assert (found.relearn_by.value - 60.0) % 7.0 == 0.0
    assert 81.0 <= found.relearn_by.value <= 102.0
    np.testing.assert_array_equal(found.by_time.at, 60.0 + 7.0 * np.arange(8))
    assert found.coming_temperatures == (-4.5, 20.0) and found.beyond > 0.5
    assert "extrapolated: up to" in "\n".join(forecast_lines(found)) and "colder than seen" in "\n".join(
        forecast_lines(found)
    )


def test_without_a_dependence_it_says_so_and_the_budget_is_met():
    found = forecast(made_season(lambda *_: 0.0, 0.4, places=3), over(0.0, 25.0))
    lines = "\n".join(forecast_lines(found))
    assert "no dependence on temperature shown" in lines and "no dependence on time shown" in lines
    assert found.share.value < 0.001 and not found.exceeds
    assert headlines(found)[1].startswith("the budget of 1 % is met from 0.0 to")
    assert headlines(found)[2].startswith("no need to relearn until 2025-09-1")


def test_a_run_that_nothing_explains_is_named_and_not_used():
    runs = made_season(law, 0.3, places=3)
    demand = runs[7].demand
    runs[7] = replace(runs[7], demand=replace(demand, held=demand.held + 40.0, alarm=True))
    found, without = forecast(runs), forecast([run for i, run in enumerate(runs) if i != 7])
    assert [run.demand.name for run in found.left_out] == ["008.csv"]
    assert found.share == without.share and found.so_far == (without.so_far[0] + 1, 120)
    assert "not used: 008.csv" in "\n".join(forecast_lines(found))


def test_confounded_temperature_and_time_count_as_temperature():
    runs = [replace(run, temperature=30.0 - 0.3 * run.time) for run in made_season(law, places=3)]
    found = forecast(runs)
    assert found.regressors == ("temperature",) and "are correlated by -1.00" in "\n".join(forecast_lines(found))


def test_the_interval_contains_what_follows_in_nearly_all_seasons():
    inside = 0
    for seed in range(20):
        runs = made_season(law, 0.5, seed=seed, places=3)
        later = made_season(law, 0.5, seed=100 + seed, temperatures=(0.0, 10.0), places=3)
        temperatures = np.array([run.temperature for run in later])
        coming = Coming.by_time(temperatures, np.full(len(later), 61.0), 7.0, len(later))
        alarms = forecast(runs, coming, seed=seed).alarms
        inside += alarms.low <= sum(run.demand.alarm for run in later) <= alarms.high
    assert inside >= 17


def of_two_joints(fitted: FittedSignature) -> FittedSignature:
    """Return the signature of two joints that are as the one of another."""
    curves = {}
    for name in ("by_time", "by_position"):
        curve = getattr(fitted, name)
        tables = {each: np.repeat(getattr(curve, each), 2, axis=1) for each in ("count", "mean", "squares")}
        curves[name] = replace(curve, **tables)
    return replace(fitted, joints=("knee", "hip"), **curves)


def test_of_two_joints_the_one_that_follows_the_temperature_is_named():
    still, moved = made_season(lambda *_: 0.0, 0.3, places=3), made_season(law, 0.3, places=3, seed=1)
    runs = []
    for one, two in zip(still, moved, strict=True):
        held, mean = (
            np.concatenate((getattr(one.demand, name), getattr(two.demand, name)), axis=-1) for name in ("held", "mean")
        )
        runs.append(replace(two, demand=replace(two.demand, held=held, mean=mean)))
    found = forecast_season(of_two_joints(signature()), runs, over(-5.0, 10.0), 0.1, origin=ORIGIN)
    assert found.place.joint == "hip" and found.effect("temperature").joint == 1
    lines = "\n".join(forecast_lines(found))
    assert "the level of hip changes with temperature by -0." in lines and "to the limit of hip" in lines


def test_a_band_that_follows_is_forecast_as_far_as_it_can_follow():
    runs = [
        replace(run, demand=replace(run.demand, shift=np.array([law(run.temperature, 0.0)])))
        for run in made_season(lambda *_: 0.0, 0.3, places=3)
    ]
    following = replace(signature(), adaptive_level=3.5)
    found = forecast_season(following, runs, over(0.0, 20.0), 0.01)
    assert found.share.value < 0.001
    with pytest.raises(SignatureError, match=r"shift the signal by 3\.9 spreads, the band follows it by at most 3\.5"):
        forecast_season(following, runs, over(-9.0, 20.0), 0.01)


def test_the_same_seed_gives_the_same_forecast():
    runs = made_season(law, places=3)
    assert forecast(runs, seed=4).share == forecast(runs, seed=4).share != forecast(runs, seed=5).share


def test_words_state_share_number_and_what_was_seen():
    found = forecast()
    words = headlines(found)[0]
    assert words.startswith("false alarms expected in ") and "from 0.0 to 20.0 °C" in words
    assert f"of 200 runs; so far {found.so_far[0]} of 120" in words


@pytest.mark.parametrize(
    ("runs", "coming", "said"),
    [
        ({"count": 29}, over(0.0, 20.0), "29 runs to forecast from"),
        ({"per_day": 20}, over(0.0, 20.0, 6.0), "runs of 6 days"),
        ({"temperatures": (10.0, 14.0)}, over(5.0, 15.0), "cover 4.0 K, from 10.0 to 14.0 °C"),
        ({}, over(-20.0, 5.0), "-20.0 to 5.0 °C is too far outside"),
        ({}, over(0.0, 20.0, 130.0), "the forecast ends"),
    ],
)
def test_what_the_season_does_not_support_is_refused(runs, coming, said):
    with pytest.raises(SignatureError) as fault:
        forecast(made_season(law, places=3, **runs), coming)
    assert said in str(fault.value) and fault.value.hint
