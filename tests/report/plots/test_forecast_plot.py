"""The figure of a forecast: runs, bands, the budget, where it is exceeded, over temperature and over date or runs."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from cdtool.evaluation.upkeep import forecast as module
from cdtool.evaluation.upkeep.forecast import Coming, Forecast, forecast_season
from cdtool.evaluation.upkeep.season_model import fit_season
from cdtool.report.plots import forecast_plot
from cdtool.report.plots.figures import drawing
from cdtool.report.plots.forecast_plot import plot_forecast
from tests.evaluation.upkeep.forecasts import ORIGIN, made_season, signature
from tests.report.plots.svg import texts


@pytest.fixture(scope="module")
def found() -> Forecast:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "fit_season", partial(fit_season, resamples=40))
        runs = made_season(lambda at, _: 3.2 - 0.15 * (at - 10.0), 0.5, places=3)
        coming = Coming.over_range((0.0, 15.0), 59.5, 80.0, 40)
        return forecast_season(signature(), runs, coming, 0.05, origin=ORIGIN)


def drawn(forecast: Forecast):
    with drawing():
        return forecast_plot._figure(forecast)


def marks(axes, marker: str) -> int:
    return sum(len(line.get_xdata()) for line in axes.lines if line.get_marker() == marker)


def test_both_columns_show_every_run_and_the_expectation(found):
    over_temperature, over_date, *_ = drawn(found).axes
    alarms = found.so_far[0]
    assert alarms > 0
    for axes in (over_temperature, over_date):
        assert marks(axes, "^") == alarms and marks(axes, "o") == 120 - alarms
        assert any(set(line.get_ydata()) == {100.0} for line in axes.lines)
    curve = next(line for line in over_temperature.lines if len(line.get_xdata()) == len(found.by_temperature.at))
    np.testing.assert_allclose(curve.get_ydata(), 100.0 * found.by_temperature.middle / 5.5)


def test_the_temperature_from_which_the_budget_is_exceeded_is_marked(found):
    _, _, share, _ = drawn(found).axes
    assert found.colder is not None and math.isfinite(found.colder.value)
    vertical = [line.get_xdata()[0] for line in share.lines if len(set(line.get_xdata())) == 1]
    assert found.colder.value in vertical
    assert any(set(line.get_ydata()) == {5.0} for line in share.lines)  # the budget


def test_without_temperatures_only_the_runs_are_drawn(found):
    figure = drawn(replace(found, by_temperature=None, colder=None, warmer=None, seen_temperatures=None, origin=None))
    assert len(figure.axes) == 2 and figure.axes[1].get_xlabel() == "run"


def test_the_file_states_the_forecast_in_words(found, tmp_path):
    plot_forecast(found, tmp_path / "forecast.svg")
    words = " ".join(texts(tmp_path / "forecast.svg"))
    for part in ("false alarms expected in", "the budget of 5 % is exceeded below", "relearn", "coming temperatures"):
        assert part in words, words
    again = tmp_path / "again.svg"
    plot_forecast(found, again)
    assert again.read_bytes() == (tmp_path / "forecast.svg").read_bytes()
