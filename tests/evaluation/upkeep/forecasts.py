"""Made-up seasons of demands with a known law, shared by the tests of the forecast."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date, datetime, timedelta
from functools import cache

import numpy as np

from cdtool.evaluation.upkeep.demand import Demand, Places
from cdtool.evaluation.upkeep.season_model import SeasonRun
from cdtool.thresholds.fitted_signature import FittedSignature
from tests.evaluation.upkeep.seasons import learned, season

BEGIN = date(2025, 7, 1)
ORIGIN = datetime(2025, 7, 1)
Law = Callable[[float, float], float]


@cache
def signature() -> FittedSignature:
    """Return a signature with the safety factor 5.5."""
    return learned(season(20, seed=100))


def made_season(
    law: Law,
    noise: float = 0.5,
    *,
    count: int = 120,
    per_day: int = 2,
    temperatures: tuple[float, float] = (10.0, 30.0),
    sides: tuple[int, ...] = (1,),
    seed: int = 0,
    places: int | None = None,
) -> list[SeasonRun]:
    """Return runs at random temperatures whose level is law(temperature, days) plus normal noise, alike at all places.

    Each side demands 2 more than the level towards it, and what places differ by.
    """
    rng = np.random.default_rng(seed)
    places = len(Places.of(signature()).at) if places is None else places
    runs = []
    for number in range(count):
        days = number / per_day
        temperature = float(rng.uniform(*temperatures))
        level = law(temperature, days) + noise * rng.standard_normal()
        mean = level + np.zeros((places, 1))
        held = np.stack([2.0 + side * mean for side in sides])
        held += np.linspace(-0.01, 0.0, places)[:, np.newaxis]
        name = f"{number + 1:03d}.csv"
        demand = Demand(name, sides, held, mean, mean[0], bool(held.max() > 5.5))
        runs.append(SeasonRun(demand, days, temperature, BEGIN + timedelta(days=int(days))))
    return runs
