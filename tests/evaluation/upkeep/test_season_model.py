"""The regression of a season: slopes, outliers, and the shares of noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.evaluation.upkeep.season_model import confounded, fit_season, outlying
from tests.evaluation.upkeep.forecasts import made_season

BOTH = ("temperature", "time")


def law(temperature: float, days: float) -> float:
    return -0.1 * temperature + 0.02 * days


def test_slopes_of_a_line_without_noise_are_exact():
    model = fit_season(made_season(law, 0.0), BOTH, 1, resamples=20)
    slopes = [effect.slope.value for effect in model.effects]
    np.testing.assert_allclose(slopes, [-0.1, 0.02], atol=1e-9)
    np.testing.assert_allclose(
        model.slopes[0, :2], np.array([[-0.1], [0.02]]) * np.ones(model.held.shape[1]), atol=1e-6
    )
    assert model.explained == pytest.approx(1.0) and np.abs(model.residuals).max() < 1e-9
    # Moved to other conditions, all runs demand the same.
    factors, _ = model.demanded(np.array([0.0, 100.0]))
    np.testing.assert_allclose(factors, 4.0, atol=1e-6)


def test_the_intervals_contain_the_slopes_and_both_are_shown():
    inside = 0
    for seed in range(20):
        model = fit_season(made_season(law, 0.5, seed=seed, places=3), BOTH, seed, resamples=200)
        for effect, true in zip(model.effects, (-0.1, 0.02), strict=True):
            inside += effect.slope.low <= true <= effect.slope.high
            assert effect.shown
    assert inside >= 35


def test_without_a_dependence_none_is_shown():
    shown = [
        effect.shown
        for seed in range(20)
        for effect in fit_season(made_season(lambda *_: 0.0, seed=seed, places=3), BOTH, 1, resamples=100).effects
    ]
    assert sum(shown) <= 2


def test_a_few_wild_runs_hardly_change_the_slope_and_are_found():
    runs = made_season(law, 0.3)
    wild = [3, 40]
    for i in wild:
        demand = runs[i].demand
        runs[i] = replace(runs[i], demand=replace(demand, held=demand.held + 30.0, mean=demand.mean + 30.0))
    model = fit_season(runs, BOTH, 1, resamples=20)
    assert model.effects[0].slope.value == pytest.approx(-0.1, abs=0.02)
    assert np.flatnonzero(outlying(model)).tolist() == wild
    assert not outlying(fit_season(made_season(law, 0.3), BOTH, 1, resamples=20)).any()


def scattering(growth: float, seed: int, count: int = 400):
    """Runs whose level falls with the temperature, and whose scatter about it grows with the level."""
    runs = made_season(law, 0.0, count=count, places=12, seed=seed)
    rng = np.random.default_rng(seed)
    for i, run in enumerate(runs):
        noise = 0.3 * np.exp(growth * law(run.temperature, run.time)) * rng.normal(size=run.demand.held.shape)
        runs[i] = replace(run, demand=replace(run.demand, held=run.demand.held + noise))
    return runs


@pytest.mark.parametrize("growth", [0.0, 0.2, 0.4])
def test_a_scatter_that_grows_with_the_level_is_found(growth):
    rates = []
    for seed in range(5):
        model = fit_season(scattering(growth, seed), BOTH, seed, resamples=50, relative_spread=[0.1])
        rates.append(model.growth[0, 0, 0] / model.slopes[0, 0, 0])
    # The prior, 0.1, counts as much as the runs at most.
    assert np.mean(rates) == pytest.approx(growth, abs=0.5 * abs(growth - 0.1) + 0.03)


@pytest.mark.parametrize("relative", [0.0, 0.05, 0.5])
def test_with_few_runs_the_scatter_is_proportional_to_the_signal(relative):
    rates = []
    for seed in range(10):
        model = fit_season(scattering(0.0, seed, 20), BOTH, seed, resamples=20, relative_spread=[relative])
        rates.append(model.growth[0, 0, 0] / model.slopes[0, 0, 0])
    # Without a limit, a signal that is about 0 would have a scatter that grows without one.
    assert np.mean(rates) == pytest.approx(min(relative, 0.1), abs=0.05)


def test_runs_moved_to_a_higher_level_scatter_more():
    model = fit_season(scattering(0.3, 1), BOTH, 1, resamples=20, relative_spread=[0.1])
    (mean_warm, mean_cold), (warm, cold) = (item[0] for item in model.moments(np.array([[20.0, 0.0], [0.0, 0.0]])))
    rate = model.growth[0, 0, 0] / model.slopes[0, 0, 0]
    assert mean_cold > mean_warm
    assert cold / warm == pytest.approx(np.exp(2.0 * rate), rel=0.02)


def test_places_that_no_run_reached_demand_nothing():
    runs = made_season(law, 0.1)
    for i, run in enumerate(runs):
        held, mean = run.demand.held.copy(), run.demand.mean.copy()
        held[:, 0], mean[0] = -np.inf, np.nan
        if i % 3 == 0:
            held[:, 5], mean[5] = -np.inf, np.nan
        runs[i] = replace(run, demand=replace(run.demand, held=held, mean=mean))
    model = fit_season(runs, BOTH, 1, resamples=20)
    factors, columns = model.demanded(np.array([20.0, 0.0]))
    assert np.isfinite(factors).all() and (columns != 0).all()


def test_with_two_sides_the_worst_one_changes():
    model = fit_season(made_season(lambda at, _: 0.2 * (at - 20.0), 0.1, sides=(1, -1)), BOTH, 1, resamples=20)
    places = model.held.shape[1] // 2
    cold, middle, warm = ((model.demanded(np.array([at, 0.0]))) for at in (5.0, 20.0, 35.0))
    assert (cold[1] >= places).all() and (warm[1] < places).all()
    assert np.median(cold[0]) == pytest.approx(5.0, abs=0.3) == np.median(warm[0])
    assert np.median(middle[0]) < 2.3


def test_temperature_that_falls_with_time_is_confounded_with_it():
    runs = [replace(run, temperature=30.0 - 0.2 * run.time) for run in made_season(law)]
    assert confounded(runs) == pytest.approx(-1.0)
    assert abs(confounded(made_season(law))) < 0.3
    assert confounded([replace(run, temperature=5.0) for run in runs]) == 0.0


def test_the_same_seed_gives_the_same_model():
    runs = made_season(law)
    one, same, other = (fit_season(runs, BOTH, seed, resamples=10) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.slopes, same.slopes)
    assert not np.array_equal(one.slopes, other.slopes)
