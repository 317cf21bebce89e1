"""The simulated weather: yearly and daily course, persistence, and the same days whatever follows."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from cdtool.errors import UsageError
from cdtool.simulation.weather import Weather

BEGIN = datetime(2025, 1, 1)


def at_noon(days: int) -> list[datetime]:
    return [BEGIN + timedelta(days=day, hours=12) for day in range(days)]


def test_without_weather_the_year_is_a_cosine_about_its_mean():
    still = Weather(mean=8.0, swing=11.0, daily_swing=0.0, scatter=0.0)
    year = still.temperatures(at_noon(365), seed=1)
    assert year.mean() == pytest.approx(8.0, abs=0.05)
    assert year.max() == pytest.approx(19.0, abs=0.01) and year.min() == pytest.approx(-3.0, abs=0.01)
    assert (BEGIN + timedelta(days=int(year.argmax()))).strftime("%d %B") == "20 July"


def test_a_day_is_warmest_in_the_afternoon():
    hours = [BEGIN + timedelta(hours=hour) for hour in range(24)]
    day = Weather(swing=0.0, daily_swing=4.0, scatter=0.0).temperatures(hours, seed=1)
    assert day.argmax() == 15 and np.ptp(day) == pytest.approx(8.0)


def test_the_weather_scatters_and_persists_as_stated():
    weather = Weather(swing=0.0, daily_swing=0.0, scatter=3.0, persistence=0.7)
    days = weather.temperatures(at_noon(3000), seed=2) - weather.mean
    assert days.std() == pytest.approx(3.0, rel=0.08)
    assert np.corrcoef(days[1:], days[:-1])[0, 1] == pytest.approx(0.7, abs=0.05)


def test_the_first_days_do_not_depend_on_how_many_follow():
    np.testing.assert_array_equal(Weather().temperatures(at_noon(5), 3), Weather().temperatures(at_noon(50), 3)[:5])
    assert Weather().temperatures([], 3).shape == (0,)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"mean": float("nan")}, "temperature is nan"),
        ({"mean": 300.0}, "temperature is 300"),
        ({"swing": -1.0}, "temperature swing is -1"),
        ({"scatter": float("inf")}, "temperature scatter is inf"),
        ({"persistence": 1.0}, "persistence is 1"),
    ],
)
def test_a_climate_that_makes_no_sense_is_refused(wrong, said):
    with pytest.raises(UsageError, match=said):
        Weather(**wrong)
