"""The share of runs with a false alarm under coming conditions, and when a signature has to be relearned.

Conventions: time in days since the first run, or in runs; temperature in °C; shares of runs from 0 to 1. Intervals are
percentiles of resampled days. The budget is a share of runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
import numpy.typing as npt

from cdtool.errors import SignatureError
from cdtool.evaluation.statistics.interval import Interval
from cdtool.evaluation.statistics.prediction import deviation_for, tail
from cdtool.evaluation.upkeep.demand import Places
from cdtool.evaluation.upkeep.deviation import Axis
from cdtool.evaluation.upkeep.season_model import (
    Effect,
    Regressor,
    SeasonModel,
    SeasonRun,
    confounded,
    fit_season,
    outlying,
)
from cdtool.motion import MotionClass
from cdtool.plain_text import counted
from cdtool.recording import BoolArray, FloatArray
from cdtool.short_repr import short_repr
from cdtool.thresholds.fitted_signature import FittedSignature

# Fewer runs or days, or temperatures over less [K], do not show how a machine depends on the weather.
LEAST_RUNS, LEAST_DAYS, LEAST_SPAN = 30, 10, 5.0
# No forecast further outside of the temperatures, or the time, that was seen than this multiple of their span.
MOST_BEYOND = 1.0
# Beyond this correlation temperature and time cannot be told apart.
CONFOUNDED = 0.95
LEVEL = 0.95

# Conditions at which the distribution of the runs is computed, along temperature and time; linear in between.
_NODES = {"temperature": 13, "time": 3}
_CURVE = 121
# Share of the runs that the band of a figure contains.
_BAND = 0.95


@dataclass(frozen=True)
class Coming:
    """Conditions to come: temperature (m,) [°C] (NaN without) and time (m,), each of the same weight.

    `step` (m,): the number of the part of the coming time, which begins at `starts` (steps,). `runs`: how many runs
    there will be.
    """

    temperatures: FloatArray
    times: FloatArray
    step: npt.NDArray[np.intp]
    starts: FloatArray
    runs: int

    __repr__ = short_repr

    @classmethod
    def over_range(cls, temperatures: tuple[float, float] | None, begin: float, end: float, runs: int) -> Coming:
        """Return all temperatures of a range alike, from one time to another; None: time alone."""
        low, high = temperatures or (math.nan, math.nan)
        within = np.linspace(low, high, 25) if temperatures else np.array([math.nan])
        edges = np.linspace(begin, end, 13)
        middles = 0.5 * (edges[1:] + edges[:-1])
        step = np.repeat(np.arange(12), len(within))
        return cls(np.tile(within, 12), middles[step], step, edges[:-1], runs)

    @classmethod
    def by_time(cls, temperatures: FloatArray, times: FloatArray, step_length: float, runs: int) -> Coming:
        """Return expected temperatures (m,) at their times (m,), in order, in parts of that length."""
        numbers, step = np.unique(np.floor((times - times[0]) / step_length), return_inverse=True)
        return cls(temperatures, times, step, times[0] + numbers * step_length, runs)


@dataclass(frozen=True)
class ForecastCurve:
    """Along temperature or time, at `at` (g,): the safety factor that runs demand, and the share that alarms.

    95 % of the runs demand between `low` and `high` (g,), the mean is `middle`; `share` (g, 3) has its interval: value,
    lower and upper bound. `beyond` (g,): outside of what was seen.
    """

    at: FloatArray
    middle: FloatArray
    low: FloatArray
    high: FloatArray
    share: FloatArray
    beyond: BoolArray

    __repr__ = short_repr


@dataclass(frozen=True)
class Place:
    """Where runs come nearest to their limit: joint, middle of the place along `axis`, and the share of the runs."""

    joint: str
    at: float
    axis: Axis
    share: float


@dataclass(frozen=True)
class Forecast:
    """What is to be expected of a signature of one class of motion under the coming conditions.

    `origin`: the date of time 0; None if times are numbers of runs. `unit` is that of travel. `share`: of runs with a
    false alarm; `alarms`: the number of runs with one among the `coming_runs`, whose interval includes chance;
    `so_far`: runs with an alarm and all runs seen. `colder`, `warmer`: the temperature from which a run exceeds the
    budget, seen from the middle of the temperatures so far; infinite if not within the range, None without temperature.
    `relearn_by`: the first coming time whose share exceeds the budget; infinite if none does, as far as the coming time
    `ends`. `beyond`: how far the coming temperatures are outside those seen, as a multiple of their span. `residual`:
    standard deviation of the levels that is not explained [spreads]. `correlation`: of temperature and time.
    `left_out`: runs that nothing explains.
    """

    motion: MotionClass
    joints: tuple[str, ...]
    safety_factor: float
    budget: float
    origin: datetime | None
    unit: str
    share: Interval
    alarms: Interval
    coming_runs: int
    so_far: tuple[int, int]
    colder: Interval | None
    warmer: Interval | None
    relearn_by: Interval
    ends: float
    place: Place
    seen_temperatures: tuple[float, float] | None
    coming_temperatures: tuple[float, float] | None
    beyond: float
    regressors: tuple[Regressor, ...]
    effects: tuple[Effect, ...]
    explained: float
    residual: float
    correlation: float
    days: int
    runs: tuple[SeasonRun, ...]
    left_out: tuple[SeasonRun, ...]
    by_temperature: ForecastCurve | None
    by_time: ForecastCurve

    @property
    def exceeds(self) -> bool:
        """Return whether the expected share exceeds the budget."""
        return self.share.value > self.budget

    def date(self, time: float) -> str | None:
        """Return a time in words: a day, or the number of a run; None if it is infinite."""
        if not math.isfinite(time):
            return None
        if self.origin is None:
            return f"run {math.ceil(time)}"
        return (self.origin + timedelta(days=time)).date().isoformat()

    def effect(self, regressor: Regressor) -> Effect | None:
        """Return the clearest effect of a regressor on a joint; None if it is not part of the model."""
        of_joints = [item for item in self.effects if item.regressor == regressor]
        return min(of_joints, key=lambda item: item.p, default=None)


def forecast_season(
    signature: FittedSignature,
    runs: Sequence[SeasonRun],
    coming: Coming,
    budget: float,
    *,
    seed: int = 0,
    origin: datetime | None = None,
    unit: str = "",
) -> Forecast:
    """Forecast the share of runs with a false alarm.

    Parameters
    ----------
    signature : FittedSignature
        The signature of the runs; its safety factor counts.
    runs : sequence of SeasonRun
        Impact-free runs that the signature was not learned from, in order of time.
    coming : Coming
        The conditions to come.
    budget : float
        The share of runs that may alarm.
    seed : int
        Seed of the resampled days.
    origin : datetime, optional
        The date of time 0, without a zone; None if times are numbers of runs.
    unit : str
        Unit of the travel.

    Returns
    -------
    Forecast
        The share with its interval, the temperatures and the time from which the budget is exceeded.

    Raises
    ------
    SignatureError
        There are too few runs or days, their temperatures cover too small a range, the coming conditions are too far
        outside, or they shift the signal further than `adaptive_level` follows.

    Notes
    -----
    Every run is moved to the coming conditions by the regression (see `season_model`). The demands then are modelled as
    the sum of a normal part and a Gumbel part of equal variance, as those of `cdtool signature check`, which gives the
    chance that a run exceeds the safety factor at each condition; the share is its mean over the coming conditions, and
    over all resamples.
    Fails if the machine changes for a reason that is neither temperature nor steady drift: a repair, rain, ice.

    Examples
    --------
    `cdtool.forecast_signature` returns the forecast of each class.
    """
    _check_counts(runs)
    regressors: tuple[Regressor, ...] = ("time",)
    seen = coming_range = None
    correlation = beyond = 0.0
    if np.isfinite(coming.temperatures).all():
        temperatures = np.array([item.temperature for item in runs])
        seen = (float(temperatures.min()), float(temperatures.max()))
        coming_range = (float(coming.temperatures.min()), float(coming.temperatures.max()))
        beyond = _beyond(seen, coming_range)
        correlation = confounded(runs)
        regressors = ("temperature",) if abs(correlation) > CONFOUNDED else ("temperature", "time")
    _check_time(runs, coming)
    model = fit_season(runs, regressors, seed)
    odd = outlying(model)
    kept = [item for item, out in zip(runs, odd, strict=True) if not out]
    if odd.any():
        _check_counts(kept)
        model = fit_season(kept, regressors, seed)
    ends = {
        "temperature": (*(seen or ()), *(coming_range or ())),
        "time": (runs[0].time, runs[-1].time, float(coming.times.max())),
    }
    surface = _Surface.of(model, {name: (min(ends[name]), max(ends[name])) for name in regressors})
    rows = np.stack([coming.temperatures if name == "temperature" else coming.times for name in regressors], axis=-1)
    _check_followed(signature, model, kept, rows)
    factor = signature.safety_factor
    chance = surface.chance(rows, factor)
    steps = np.stack([chance[:, coming.step == number].mean(axis=1) for number in range(len(coming.starts))], axis=-1)
    first = np.where((steps > budget).any(axis=1), coming.starts[np.argmax(steps > budget, axis=1)], math.inf)
    by_temperature = colder = warmer = None
    if seen is not None and coming_range is not None:
        by_temperature, colder, warmer = _along_temperature(surface, seen, runs, factor, budget)
    shares = chance.mean(axis=1)
    return Forecast(
        motion=signature.motion.without_course,
        joints=signature.joints,
        safety_factor=factor,
        budget=budget,
        origin=origin,
        unit=unit,
        share=_interval(shares),
        alarms=_interval(_counts(shares, coming.runs, seed)),
        coming_runs=coming.runs,
        so_far=(sum(item.demand.alarm for item in runs), len(runs)),
        colder=colder,
        warmer=warmer,
        relearn_by=_interval(first),
        ends=float(coming.times.max()),
        place=_place(signature, model, rows[int(np.argmax(chance[0]))]),
        seen_temperatures=seen,
        coming_temperatures=coming_range,
        beyond=beyond,
        regressors=regressors,
        effects=model.effects,
        explained=model.explained,
        residual=float(model.residuals.std(axis=0, ddof=1).max()),
        correlation=correlation,
        days=len({item.day for item in kept}),
        runs=tuple(kept),
        left_out=tuple(item for item, out in zip(runs, odd, strict=True) if out),
        by_temperature=by_temperature,
        by_time=_along_time(surface, coming, rows, factor),
    )


@dataclass(frozen=True)
class _Surface:
    """Mean and standard deviation (1 + b, nodes...) of what runs demand, on a grid of conditions."""

    axes: tuple[FloatArray, ...]
    mean: FloatArray
    std: FloatArray

    __repr__ = short_repr

    @classmethod
    def of(cls, model: SeasonModel, ranges: dict[Regressor, tuple[float, float]]) -> _Surface:
        axes = tuple(np.linspace(*ranges[name], _NODES[name]) for name in model.regressors)
        grid = np.stack([part.ravel() for part in np.meshgrid(*axes, indexing="ij")], axis=-1)
        shape = (len(model.slopes), *(len(axis) for axis in axes))
        mean, std = model.moments(grid)
        return cls(axes, mean.reshape(shape), std.reshape(shape))

    def at(self, conditions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return both (1 + b, m) at conditions (m, k)."""
        from scipy.interpolate import RegularGridInterpolator

        both = np.stack((self.mean, self.std), axis=-1)
        found = RegularGridInterpolator(self.axes, np.moveaxis(both, 0, -2))(conditions)  # (m, 1 + b, 2)
        return found[..., 0].T, found[..., 1].T

    def chance(self, conditions: FloatArray, factor: float) -> FloatArray:
        """Return the chance (1 + b, m) that a run exceeds a factor at conditions (m, k).

        The first row is the mean of the others: what is expected, since the chance is not linear in what is uncertain.
        """
        mean, std = self.at(conditions)
        chance = tail((factor - mean) / np.maximum(std, 1e-12))
        chance[0] = chance[1:].mean(axis=0)
        return chance

    def curve(self, at: FloatArray, conditions: FloatArray, factor: float, beyond: BoolArray) -> ForecastCurve:
        """Return the curve of runs at conditions (g, k)."""
        mean, std = self.at(conditions)
        above, below = deviation_for(0.5 - 0.5 * _BAND), deviation_for(0.5 + 0.5 * _BAND)
        share = _bounds(self.chance(conditions, factor))
        return ForecastCurve(at, mean[0], mean[0] + below * std[0], mean[0] + above * std[0], share, beyond)


def _check_counts(runs: Sequence[SeasonRun]) -> None:
    days = len({item.day for item in runs})
    if len(runs) < LEAST_RUNS:
        raise SignatureError(
            f"{counted(len(runs), 'run')} to forecast from", f"at least {LEAST_RUNS} are required that are not learned"
        )
    if days < LEAST_DAYS:
        raise SignatureError(
            f"runs of {counted(days, 'day')} to forecast from",
            f"at least {LEAST_DAYS} are required: runs of a day are alike",
        )


def _beyond(seen: tuple[float, float], coming: tuple[float, float]) -> float:
    """Return how far the coming temperatures are outside those seen, in spans; raises SignatureError if too far."""
    span = seen[1] - seen[0]
    if span < LEAST_SPAN:
        raise SignatureError(
            f"the temperatures of the runs cover {span:.1f} K, from {seen[0]:.1f} to {seen[1]:.1f} °C",
            f"at least {LEAST_SPAN:g} K are required",
        )
    beyond = max(seen[0] - coming[0], coming[1] - seen[1], 0.0) / span
    if beyond > MOST_BEYOND:
        low, high = seen[0] - MOST_BEYOND * span, seen[1] + MOST_BEYOND * span
        raise SignatureError(
            f"{coming[0]:.1f} to {coming[1]:.1f} °C is too far outside of the {seen[0]:.1f} to {seen[1]:.1f} °C seen",
            f"the runs support a forecast from {low:.1f} to {high:.1f} °C",
        )
    return beyond


def _check_time(runs: Sequence[SeasonRun], coming: Coming) -> None:
    duration = runs[-1].time - runs[0].time
    ahead = float(coming.times.max()) - runs[-1].time
    if ahead > MOST_BEYOND * duration * (1.0 + 1e-9):
        raise SignatureError(
            f"the forecast ends {ahead:.0f} after the last run, and the runs cover only {duration:.0f} (days or runs)",
            "choose an earlier end, at most as far ahead as the runs cover",
        )


def _check_followed(
    signature: FittedSignature, model: SeasonModel, runs: Sequence[SeasonRun], conditions: FloatArray
) -> None:
    """Raise SignatureError if a band that follows the runs would have to follow further than it can."""
    if signature.adaptive_level == 0.0:
        return
    shifts = np.nan_to_num(np.array([item.demand.shift for item in runs]))
    line = np.linalg.lstsq(np.column_stack((np.ones(len(runs)), model.design)), shifts)[0]
    most = float(np.abs(np.column_stack((np.ones(len(conditions)), conditions)) @ line).max())
    if most > signature.adaptive_level:
        raise SignatureError(
            f"the coming conditions shift the signal by {most:.1f} spreads, the band follows it by at most "
            f"{signature.adaptive_level:g} (adaptive_level)",
            "relearn before that, or forecast a smaller range",
        )


def _along_temperature(
    surface: _Surface, seen: tuple[float, float], runs: Sequence[SeasonRun], factor: float, budget: float
) -> tuple[ForecastCurve, Interval, Interval]:
    """Return the curve over the temperature at the time of the last run, and where it exceeds the budget."""
    at = np.linspace(surface.axes[0][0], surface.axes[0][-1], _CURVE)
    conditions = np.stack((at, np.full(len(at), runs[-1].time)), axis=-1)[:, : len(surface.axes)]
    curve = surface.curve(at, conditions, factor, (at < seen[0]) | (at > seen[1]))
    middle = int(np.argmin(np.abs(at - np.median([item.temperature for item in runs]))))
    exceeded = surface.chance(conditions, factor) > budget
    cold, warm = exceeded[:, middle::-1], exceeded[:, middle:]
    colder = np.where(cold.any(axis=1), at[middle - np.argmax(cold, axis=1)], -math.inf)
    warmer = np.where(warm.any(axis=1), at[middle + np.argmax(warm, axis=1)], math.inf)
    return curve, _interval(colder), _interval(warmer)


def _along_time(surface: _Surface, coming: Coming, rows: FloatArray, factor: float) -> ForecastCurve:
    """Return the curve over the parts of the coming time: the mean over the conditions of each."""
    mean, std = surface.at(rows)
    chance = surface.chance(rows, factor)
    above, below = deviation_for(0.5 - 0.5 * _BAND), deviation_for(0.5 + 0.5 * _BAND)
    columns = []
    for number in range(len(coming.starts)):
        part = coming.step == number
        low, high = (mean[0, part] + below * std[0, part]).min(), (mean[0, part] + above * std[0, part]).max()
        columns.append((mean[0, part].mean(), low, high, *_bounds(chance[:, part].mean(axis=1, keepdims=True))[0]))
    table = np.array(columns)
    beyond = np.ones(len(coming.starts), dtype=bool)
    return ForecastCurve(coming.starts, table[:, 0], table[:, 1], table[:, 2], table[:, 3:], beyond)


def _place(signature: FittedSignature, model: SeasonModel, conditions: FloatArray) -> Place:
    """Return the place where most runs come nearest to their limit at conditions (k,)."""
    _, columns = model.demanded(conditions)
    places, joints = Places.of(signature), len(signature.joints)
    counts = np.bincount(columns // joints % len(places.at) * joints + columns % joints)
    place, joint = divmod(int(np.argmax(counts)), joints)
    share = float(counts.max() / counts.sum())
    return Place(signature.joints[joint], float(places.at[place]), places.axis(place), share)


def _counts(shares: FloatArray, runs: int, seed: int) -> FloatArray:
    """Return the expected number of alarming runs, and numbers (b,) drawn with the resampled shares (1 + b,)."""
    drawn = np.random.default_rng(seed).binomial(runs, shares[1:])
    return np.concatenate(([shares[0] * runs], drawn.astype(np.float64)))


def _interval(values: FloatArray) -> Interval:
    """Return the first value with the percentiles of the others (b,), some of which may be infinite."""
    low, high = np.quantile(values[1:], (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL), method="inverted_cdf").tolist()
    return Interval(float(values[0]), min(low, float(values[0])), max(high, float(values[0])), LEVEL)


def _bounds(values: FloatArray) -> FloatArray:
    """Return value and bounds (m, 3) of the columns of values (1 + b, m)."""
    low, high = np.quantile(values[1:], (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL), axis=0)
    return np.stack((values[0], np.minimum(low, values[0]), np.maximum(high, values[0])), axis=-1)
