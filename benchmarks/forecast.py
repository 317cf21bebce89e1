"""Is the share of false alarms that `cdtool signature forecast` expects of the next quarter the one that follows?

    python benchmarks/forecast.py                  # seeds 801 to 824, five machines, about half an hour
    python benchmarks/forecast.py --seasons 6 --first-seed 1001   # the table of docs/signature.md, eight minutes

Each season: a simulated gate from 1 July, two runs a day. The signature is learned from the first 30 runs, the next 166
are the season seen, until early October; the forecast is of the next 164 runs, until the end of the year, at their own
temperatures (a few colder ones, further outside than a forecast is made for, do not count). Then these runs are
compared with the signature. Friction changes by a share per kelvin, or drifts over the half year, or neither. The naive
forecast is the share of alarms in the season seen.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from accuracy import written_setup
from timing import environment, table

from cdtool.errors import SignatureError
from cdtool.evaluation.statistics.rates import binomial_share
from cdtool.evaluation.upkeep.demand import Demand, demand_of
from cdtool.evaluation.upkeep.forecast import MOST_BEYOND, Coming, Forecast, forecast_season
from cdtool.evaluation.upkeep.season_model import SeasonRun
from cdtool.operations import operations_of
from cdtool.pipeline import judge, run_detector
from cdtool.simulation.gate_model import GateParameters
from cdtool.simulation.gate_recordings import as_recording, write_gate_recordings
from cdtool.simulation.season import Season
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.workflows.signature.fitting import Pair

FIRST_SEED = 801
LEARNED, SEEN, COMING, PER_DAY = 30, 166, 164, 2
BUDGET = 1 / 100
NEW = GateParameters()
HALF_YEAR = Season(LEARNED + SEEN + COMING, runs_per_day=PER_DAY)
MACHINES = {
    "steady": ("gm", HALF_YEAR),
    "-0.5 %/K": ("gm", replace(HALF_YEAR, friction_per_kelvin=-0.005)),
    "-1 %/K": ("gm", replace(HALF_YEAR, friction_per_kelvin=-0.01)),
    "-0.3 %/K, +10 %": ("gm", replace(HALF_YEAR, friction_per_kelvin=-0.003, friction_change=0.1)),
    "EKF, -1.5 %/K": ("feekf", replace(HALF_YEAR, friction_per_kelvin=-0.015)),
}
# Over all seasons together: the share of them whose interval must contain what follows, and by how much the mean
# forecast may differ from the mean that follows, relatively and absolutely. It is too low: the friction is exponential
# in the temperature, and drift and temperature are hardly told apart.
LEAST_COVERED, BIAS, SMALL = 0.88, 0.3, 0.01


@dataclass(frozen=True)
class Compared:
    """One season: the forecast, and alarms in the runs that follow."""

    forecast: Forecast
    alarms: int

    @property
    def followed(self) -> float:
        """Return the share of the runs that follow with an alarm."""
        return self.alarms / self.forecast.coming_runs

    @property
    def naive(self) -> float:
        """Return the share of the runs seen with an alarm."""
        return self.forecast.so_far[0] / self.forecast.so_far[1]

    @property
    def covered(self) -> bool:
        """Return whether the interval of the number of alarming runs contains the number that follows."""
        return self.forecast.alarms.low <= self.alarms <= self.forecast.alarms.high


def demands(season: Season, detector: str, seed: int) -> tuple[FittedSignature, list[Demand]]:
    """Learn from the first runs of a season, and return what the others demand."""
    setup = written_setup(partial(write_gate_recordings, seed=0))
    machine, method = setup.machine_file.machine, setup.machine_file.detector(detector)

    def run(number: int) -> Pair:
        recording = machine.referred_to_load(as_recording(season.run(number, seed, NEW), f"{number}", NEW))
        (operation,) = operations_of(recording)
        return operation, run_detector(operation, machine, method, setup.watched)

    learned = [run(number) for number in range(1, LEARNED + 1)]
    fitted = setup.signature.fit([(item.recording.without_ground_truth(), signal) for item, signal in learned])
    found = []
    for number in range(LEARNED + 1, season.runs + 1):
        operation, signal = run(number)
        detection = judge(operation, "", signal, (fitted,), setup.activation)
        found.append(demand_of(fitted, detection, setup.activation))
    return fitted, found


def compared(season: Season, detector: str, seed: int) -> Compared:
    """Return one season's forecast, and what follows."""
    fitted, found = demands(season, detector, seed)
    begin = season.time(LEARNED + 1)
    runs = []
    for number, demand in enumerate(found, LEARNED + 1):
        when = season.time(number)
        days = (when - begin).total_seconds() / 86400.0
        runs.append(SeasonRun(demand, days, season.temperature(number, seed), when.date()))
    return forecast_of(fitted, runs, seed)


def forecast_of(fitted: FittedSignature, runs: Sequence[SeasonRun], seed: int) -> Compared:
    """Return the forecast from the first runs, and what the others do at temperatures for which there is a forecast."""
    seen = runs[:SEEN]
    low, high = (function(item.temperature for item in seen) for function in (min, max))
    reach = MOST_BEYOND * (high - low)
    later = [item for item in runs[SEEN:] if low - reach <= item.temperature <= high + reach]
    temperatures, times = np.array([(item.temperature, item.time) for item in later]).T
    coming = Coming.by_time(temperatures, times, 7.0, len(later))
    forecast = forecast_season(fitted, seen, coming, BUDGET, seed=seed)
    return Compared(forecast, sum(item.demand.alarm for item in later))


def row_of(name: str, seasons: Sequence[Compared]) -> tuple[str, ...]:
    """Return the cells of a machine."""
    share, followed, naive = np.array([(s.forecast.share.value, s.followed, s.naive) for s in seasons]).T
    return (
        name,
        f"{len(seasons)}",
        f"{sum(s.covered for s in seasons)}",
        f"{100.0 * followed.mean():.1f}",
        f"{100.0 * share.mean():.1f}",
        f"{100.0 * naive.mean():.1f}",
        f"{100.0 * np.abs(share - followed).mean():.1f}",
        f"{100.0 * np.abs(naive - followed).mean():.1f}",
    )


def main(arguments: list[str]) -> int:
    """Print a row per machine; return 0 if the intervals cover and the mean forecast is not biased."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seasons", type=int, default=24)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--machines", nargs="+", choices=list(MACHINES), default=list(MACHINES))
    options = parser.parse_args(arguments)
    print(environment(), flush=True)
    rows, every = [], []
    for name in options.machines:
        detector, season = MACHINES[name]
        found = []
        for seed in range(options.first_seed, options.first_seed + options.seasons):
            try:
                found.append(compared(season, detector, seed))
            except SignatureError as fault:
                print(f"{name}, seed {seed}: refused: {fault}", flush=True)
        rows.append(row_of(name, found))
        print(*rows[-1], sep=" | ", flush=True)
        every += found
    head = ("friction", "seasons", "covered", "followed %", "forecast %", "so far %", "error", "naive")
    table(head, rows)
    covered = sum(item.covered for item in every)
    followed = float(np.mean([item.followed for item in every]))
    bias = float(np.mean([item.forecast.share.value for item in every])) - followed
    interval = binomial_share(covered, len(every))
    print(
        f"covered {covered} of {len(every)} (95 %: {interval.low:.2f} to {interval.high:.2f}), bias {100 * bias:+.1f} %"
    )
    good = covered >= LEAST_COVERED * len(every) and abs(bias) <= max(BIAS * followed, SMALL)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
