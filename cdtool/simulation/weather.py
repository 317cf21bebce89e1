"""An outdoor temperature over the year: yearly and daily course, and weather that persists from day to day."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from cdtool.errors import UsageError
from cdtool.recording import FloatArray

# Random numbers of the weather are others than those of the runs.
_STREAM = 1000
_DAYS = 365.25
# The warmest day of the year (20 July), and the warmest hour of a day.
_WARMEST_DAY, _WARMEST_HOUR = 201.0, 15.0


@dataclass(frozen=True)
class Weather:
    """A climate: the defaults are roughly those of central Europe.

    `mean` of the year [°C]; `swing`: amplitude of the yearly course [K], warmest on 20 July; `daily_swing`: that of the
    day [K], warmest at 15:00. `scatter`: standard deviation of the weather about both [K]; it is the same over a day,
    and the next day's has the correlation `persistence` with it.
    """

    mean: float = 10.0
    swing: float = 10.0
    daily_swing: float = 4.0
    scatter: float = 3.0
    persistence: float = 0.7

    def __post_init__(self) -> None:
        if not math.isfinite(self.mean) or not -100.0 <= self.mean <= 100.0:
            raise UsageError(f"temperature is {self.mean:g}", "give the mean of the year in °C, from -100 to 100")
        for name in ("swing", "daily_swing", "scatter"):
            if not 0.0 <= getattr(self, name) <= 100.0:
                raise UsageError(f"temperature {name} is {getattr(self, name):g}", "give kelvins from 0 to 100")
        if not 0.0 <= self.persistence < 1.0:
            raise UsageError(f"persistence is {self.persistence:g}", "give a correlation from 0 to below 1")

    def temperatures(self, times: Sequence[datetime], seed: int) -> FloatArray:
        """Return the temperature at each time (n,) [°C]; the times are in order, and the weather begins with the first.

        The weather of a day does not depend on how many days follow.
        """
        if not times:
            return np.empty(0)
        days = np.array([(time.date() - times[0].date()).days for time in times])
        noise = np.random.default_rng([seed, _STREAM]).standard_normal(int(days[-1]) + 1)
        weather = np.empty(len(noise))
        level = noise[0]
        for day, fresh in enumerate(noise):
            level = self.persistence * level + math.sqrt(1.0 - self.persistence**2) * fresh if day else fresh
            weather[day] = self.scatter * level
        of_year = np.array([time.timetuple().tm_yday for time in times], dtype=np.float64)
        hour = np.array([time.hour + time.minute / 60.0 for time in times])
        yearly = self.swing * np.cos(2.0 * np.pi * (of_year - _WARMEST_DAY) / _DAYS)
        daily = self.daily_swing * np.cos(2.0 * np.pi * (hour - _WARMEST_HOUR) / 24.0)
        temperatures: FloatArray = self.mean + yearly + daily + weather[days]
        return temperatures
