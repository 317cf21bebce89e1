"""A season of impact-free gate runs over which a signature ages.

Friction drifts and follows the weather, an obstruction grows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import date, datetime, time, timedelta
from functools import lru_cache
from pathlib import Path

import numpy as np

from cdtool.errors import UsageError
from cdtool.recording import FloatArray
from cdtool.simulation.changed_machine import ChangedMachine
from cdtool.simulation.gate_model import GateParameters, GateRun, simulate_gate_run
from cdtool.simulation.gate_recordings import gate_bench
from cdtool.simulation.recording_folder import GROUPS, write_folder
from cdtool.simulation.weather import Weather

# A season's runs have other random numbers than those of `cdtool simulate gate`.
_STREAM = len(GROUPS)
# The runs of a day are spread evenly over these hours.
_FIRST_HOUR, _LAST_HOUR = 6.0, 22.0
_MOST_RUNS_PER_DAY = 960


@dataclass(frozen=True)
class Season:
    """The changes from the first run to the last, both linear, and the weather.

    `friction_change`: by which share the leaf's friction grows (0.3: by 30 %) or falls (below 0) over the season.
    `obstruction_growth` [N per run]: how much more a section of 0.1 m about `obstruction_at` [m] resists in each run.
    `friction_per_kelvin`: by which share it changes with each kelvin above the mean of the `weather`'s year (-0.01: 1 %
    less), compounding, so that it stays positive. There are `runs_per_day` from the day `start` on.
    """

    runs: int
    friction_change: float = 0.0
    obstruction_growth: float = 0.0
    obstruction_at: float = 0.9
    friction_per_kelvin: float = 0.0
    runs_per_day: int = 4
    start: date = date(2025, 7, 1)
    weather: Weather = field(default_factory=Weather)

    def __post_init__(self) -> None:
        if self.runs < 1:
            raise UsageError(f"a season of {self.runs} runs", "at least 1")
        if not -1.0 < self.friction_change < math.inf:
            raise UsageError(f"friction change is {self.friction_change:g}", "a share above -1; 0.3: 30 % more")
        if not 0.0 <= self.obstruction_growth < math.inf:
            raise UsageError(f"obstruction growth is {self.obstruction_growth:g}", "N per run, at least 0")
        if not math.isfinite(self.obstruction_at):
            raise UsageError(f"obstruction at {self.obstruction_at:g}", "a location along the travel in m")
        if not -0.5 <= self.friction_per_kelvin <= 0.5:
            raise UsageError(
                f"friction per kelvin is {self.friction_per_kelvin:g}", "a share from -0.5 to 0.5; -0.01: 1 % less"
            )
        if not 1 <= self.runs_per_day <= _MOST_RUNS_PER_DAY:
            raise UsageError(f"{self.runs_per_day} runs per day", f"give 1 to {_MOST_RUNS_PER_DAY}")
        try:
            self.time(self.runs)
        except OverflowError as fault:
            raise UsageError(f"a season from {self.start} ends after the year 9999", "give an earlier start") from fault

    def time(self, number: int) -> datetime:
        """Return when the run `number` (from 1) takes place."""
        day, of_day = divmod(number - 1, self.runs_per_day)
        hour = _FIRST_HOUR + (_LAST_HOUR - _FIRST_HOUR) * (of_day + 0.5) / self.runs_per_day
        return datetime.combine(self.start + timedelta(days=day), time()) + timedelta(minutes=round(60.0 * hour))

    def temperature(self, number: int, seed: int) -> float:
        """Return the temperature in the run `number` (from 1) [°C]."""
        return float(_temperatures(self, seed)[number - 1])

    def gate(self, number: int, new: GateParameters, warmer: float = 0.0) -> GateParameters:
        """Return the gate in the run `number` (from 1), of one that is `new` in the first, at the mean of the year.

        `warmer` [K]: than that mean.
        """
        share = (number - 1) / max(self.runs - 1, 1)
        by_weather = (1.0 + self.friction_per_kelvin) ** warmer
        return replace(
            ChangedMachine(friction=(1.0 + share * self.friction_change) * by_weather).gate(new),
            obstruction_force=new.obstruction_force + (number - 1) * self.obstruction_growth,
            obstruction_position=self.obstruction_at,
        )

    def run(self, number: int, seed: int, new: GateParameters) -> GateRun:
        """Return the impact-free run `number`; without change it is the same whatever the season's length is."""
        rng = np.random.default_rng([seed, _STREAM, number])
        warmer = self.temperature(number, seed) - self.weather.mean
        return simulate_gate_run(self.gate(number, new, warmer), rng, "none")


@lru_cache(maxsize=4)
def _temperatures(season: Season, seed: int) -> FloatArray:
    """Return the temperature in every run of a season (runs,) [°C]."""
    return season.weather.temperatures([season.time(number) for number in range(1, season.runs + 1)], seed)


def write_gate_season(
    folder: Path,
    season: Season,
    seed: int,
    file_format: str = "csv",
    progress: Callable[[int, int], None] | None = None,
    parameters: GateParameters | None = None,
) -> int:
    """Write a season's recordings, free/001 and so on in their order, as `write_gate_recordings` does; how many.

    ambient.csv has the date and temperature of each run. Same seed, same bytes. The machine file is that of the gate
    as it is in the first run. Raises UsageError where the folder is not empty.
    """
    new = parameters or GateParameters()
    bench = replace(
        gate_bench(new, lambda _, number: season.run(number, seed, new)),
        ambient=lambda number: (season.time(number).isoformat("T", "minutes"), season.temperature(number, seed)),
    )
    return write_folder(folder, {"free": season.runs}, file_format, bench, progress)
