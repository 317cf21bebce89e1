"""How the demand of a season's runs depends on temperature and time: a robust regression.

Conventions: n runs, J joints, c columns (sides, places and joints of a demand, one after the other), k regressors
(temperature [°C], time [days or runs], those that are known), 1 + b fits: the first is the estimate, the others are
fits of resampled days. Slopes are in spreads per kelvin, day or run.

The level of a joint, its shift over the whole stroke, is a line over the regressors, with a curvature over the
temperature; what a place demands follows the level in its own proportion. So a run is moved to other conditions x by
the slopes of its columns, and its demand is the largest of them::

    c_i(x) = max over columns q of   held_iq + (x - x_i) . slope_q

which is not linear in x: the worst place changes, and with two sides the worst side. The distribution at x is that of
all runs moved there.

The temperatures seen hardly show the curvature, and beyond them it decides. It has a prior: over the span of the
temperatures seen the slope changes by nothing, with a standard deviation of 30 % of it. So the interval grows with the
square of the distance.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.evaluation.statistics.interval import Interval
from cdtool.evaluation.statistics.trends import SIGNIFICANT
from cdtool.evaluation.upkeep.demand import Demand
from cdtool.recording import BoolArray, FloatArray
from cdtool.short_repr import short_repr

Regressor = Literal["temperature", "time"]

RESAMPLES = 400
# Huber's constant, in standard deviations, and the number of steps in which the weights are found.
_HUBER, _STEPS = 1.345, 12
# Median absolute deviation of a normal distribution, in standard deviations.
_MAD = 0.6745
# Standard deviation of the change of a slope over the span of the temperatures seen, as a share of the slope.
_CURVATURE = 0.3
# A run is no run like the others from so many robust standard deviations on.
_OUTLYING = 8.0


@dataclass(frozen=True)
class SeasonRun:
    """A run of a season: what it demands, when, at which temperature [°C], and its day: runs of one are correlated.

    `time`: days since the first run, or the number of the run. `temperature` is NaN if unknown.
    """

    demand: Demand
    time: float
    temperature: float
    day: Hashable


@dataclass(frozen=True)
class Effect:
    """How the level of a joint depends on one regressor: slope [spreads per unit], p, and whether that is shown."""

    regressor: Regressor
    joint: int
    slope: Interval
    p: float
    shown: bool


@dataclass(frozen=True)
class SeasonModel:
    """Regression of a season: see the module.

    `design` (n, k) is that of the runs; `slopes` (1 + b, k', c) are those of its features, see `features`; `weights`
    (1 + b, n) are the numbers of times that each run's day was drawn; `held` (n, c) is what they demand in
    the `columns` (c,) of the demands in which any run was assessable. `levels` (n, J) are the shifts of the whole
    stroke, `residuals` (n, J) what a line leaves of them. `bend` is middle and span of the temperatures.
    """

    regressors: tuple[Regressor, ...]
    design: FloatArray
    bend: tuple[float, float] | None
    slopes: FloatArray
    weights: FloatArray
    held: FloatArray
    columns: npt.NDArray[np.intp]
    levels: FloatArray
    residuals: FloatArray
    effects: tuple[Effect, ...]

    __repr__ = short_repr

    @property
    def explained(self) -> float:
        """Return the share of the variance of the levels that temperature and time explain, over all joints."""
        total = float(np.square(self.levels - self.levels.mean(axis=0)).sum())
        return max(1.0 - float(np.square(self.residuals).sum()) / total, 0.0) if total > 0.0 else 0.0

    def demanded(self, conditions: FloatArray) -> tuple[FloatArray, npt.NDArray[np.intp]]:
        """Return what each run demands at conditions (k,), and in which column of a demand: each (n,)."""
        base, moves = self._moved(conditions[np.newaxis], 0)
        moved = base + moves[0]
        columns = moved.argmax(axis=1)
        return moved[np.arange(len(moved)), columns], self.columns[columns]

    def moments(self, conditions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return mean and standard deviation (1 + b, m) of what runs demand at conditions (m, k), by all fits."""
        mean, std = np.empty((2, len(self.slopes), len(conditions)))
        for fit, weights in enumerate(self.weights):
            drawn = np.flatnonzero(weights)
            base, moves = self._moved(conditions, fit, drawn)
            factors = np.stack([(base + move).max(axis=1) for move in moves])
            times = weights[drawn]
            total = times.sum()
            mean[fit] = factors @ times / total
            squares = np.square(factors - mean[fit][:, np.newaxis]) @ times
            std[fit] = np.sqrt(squares / max(total - 1.0 - len(self.regressors), 1.0))
        return mean, std

    def _moved(
        self, conditions: FloatArray, fit: int, runs: npt.NDArray[np.intp] | slice = slice(None)
    ) -> tuple[FloatArray, FloatArray]:
        """Return what the runs demand where all features are 0 (n, c), and what is added at conditions (m, c)."""
        slopes = self.slopes[fit]
        base = self.held[runs] - features(self.design[runs], self.bend) @ slopes
        return base, features(conditions, self.bend) @ slopes


def features(conditions: FloatArray, bend: tuple[float, float] | None) -> FloatArray:
    """Return the regressors (m, k) and, with temperature as the first one, its bend (m, 1): (T - middle)^2 / span.

    Parameters
    ----------
    conditions : ndarray of float, shape (m, k)
        The regressors.
    bend : tuple of float or None
        Middle and span of the temperatures seen [°C]; None without temperature.

    Returns
    -------
    ndarray of float, shape (m, k + 1) or (m, k)
        The features of the regression.

    Examples
    --------
    >>> features(np.array([[10.0, 0.0], [20.0, 5.0]]), (15.0, 10.0)).tolist()
    [[10.0, 0.0, 2.5], [20.0, 5.0, 2.5]]
    """
    if bend is None:
        return conditions
    middle, span = bend
    return np.column_stack((conditions, np.square(conditions[:, 0] - middle) / span))


def fit_season(
    runs: Sequence[SeasonRun], regressors: tuple[Regressor, ...], seed: int, resamples: int = RESAMPLES
) -> SeasonModel:
    """Fit the dependence of a season's runs on temperature and time.

    Parameters
    ----------
    runs : sequence of SeasonRun
        Runs with finite regressors, of several days.
    regressors : tuple of {"temperature", "time"}
        What the demand may depend on; temperature first.
    seed : int
        Seed of the resampled days.
    resamples : int
        Number of resamples.

    Returns
    -------
    SeasonModel
        The fit and those of resampled days.

    Notes
    -----
    Huber's M-estimate of the level gives each run a weight; with it all slopes are least squares. A column's proportion
    is its slope over the level; what its slope over a regressor has beyond that is added. Both are shrunk towards their
    mean over the stroke by the share of their variance that is noise (empirical Bayes): the largest of many noisy
    slopes would be too large. Resamples draw days, and a curvature from its prior. p: the slope over its standard
    deviation in the resamples, by Student's t of days minus parameters.
    """
    demands = np.array([item.demand.held.ravel() for item in runs])
    used = np.flatnonzero(np.isfinite(demands).any(axis=0))
    demands = demands[:, used]
    held, levels = _filled(demands), _levels(runs)
    design = np.array([[float(getattr(item, name)) for name in regressors] for item in runs]).reshape(len(runs), -1)
    bend = None
    if "temperature" in regressors:
        bend = float(np.median(design[:, 0])), float(np.ptp(design[:, 0])) or 1.0
    rng = np.random.default_rng(seed)
    days = {day: number for number, day in enumerate(dict.fromkeys(item.day for item in runs))}
    of_run = np.array([days[item.day] for item in runs])
    drawn = rng.multinomial(len(days), np.full(len(days), 1.0 / len(days)), size=resamples)
    weights = np.concatenate((np.ones((1, len(runs))), drawn[:, of_run].astype(np.float64)))
    robust = weights * _robust_weights(design, levels, weights)
    project = _projections(design, robust)
    lines = project @ levels  # (1 + b, k, J)
    rest = levels - design @ lines[0]
    rest = rest - np.median(rest, axis=0)
    joints = levels.shape[1]
    slopes = np.empty((len(weights), len(regressors) + (bend is not None), held.shape[1]))
    side_of, joint_of = used // math.prod(runs[0].demand.held.shape[1:]), used % joints
    for j in range(joints):
        level, on_level = lines[:, :, j], _projections_on(levels[:, j], robust)
        if bend is not None:
            level = _bent(features(design, bend), levels[:, j], robust, lines[0, 0, j], rng)
        for side in range(len(runs[0].demand.sides)):
            columns = np.flatnonzero((joint_of == j) & (side_of == side))
            if not len(columns):
                continue
            proportion = _shrunk((on_level @ held[:, columns])[:, np.newaxis])[:, 0]
            own = _shrunk(project @ held[:, columns] - lines[:, :, j, np.newaxis] * proportion[:, np.newaxis])
            slopes[:, :, columns] = level[:, :, np.newaxis] * proportion[:, np.newaxis]
            slopes[:, : len(regressors), columns] += own
    effects = _effects(regressors, lines, len(days))
    return SeasonModel(regressors, design, bend, slopes, weights, demands, used, levels, rest, effects)


def _effects(regressors: tuple[Regressor, ...], lines: FloatArray, days: int) -> tuple[Effect, ...]:
    """Return the effect of each regressor on each joint, from the slopes of the levels (1 + b, k, J)."""
    from scipy import stats

    found = []
    joints = lines.shape[2]
    for k, name in enumerate(regressors):
        for j in range(joints):
            value, others = float(lines[0, k, j]), lines[1:, k, j]
            error = float(others.std(ddof=1))
            freedom = max(days - 1 - len(regressors), 1)
            p = float(2.0 * stats.t.sf(abs(value) / error, freedom)) if error > 0.0 else float(value == 0.0)
            low, high = np.quantile(others, (0.025, 0.975)).tolist()
            found.append(Effect(name, j, Interval(value, low, high), p, p <= SIGNIFICANT / joints))
    return tuple(found)


def outlying(model: SeasonModel) -> BoolArray:
    """Return which runs (n,) deviate from the others by far more than their conditions and chance explain.

    Parameters
    ----------
    model : SeasonModel
        The model of all runs.

    Returns
    -------
    ndarray of bool, shape (n,)
        True for a run that demands more than 8 robust standard deviations above the median at equal conditions.
    """
    factors, _ = model.demanded(np.median(model.design, axis=0))
    return np.asarray(factors - np.median(factors) > _OUTLYING * _scale(factors - np.median(factors)))


def _levels(runs: Sequence[SeasonRun]) -> FloatArray:
    """Return the shift (n, J) of each run over the whole stroke; 0 of a joint that was nowhere assessable."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "All-NaN slice", RuntimeWarning)
        levels: FloatArray = np.nan_to_num(np.array([np.nanmedian(item.demand.mean, axis=0) for item in runs]))
    return levels


def _filled(demands: FloatArray) -> FloatArray:
    """Return the demands (n, c) with the median of the others where a run has none."""
    held = np.where(np.isfinite(demands), demands, np.nan)
    return np.where(np.isfinite(held), held, np.nanmedian(held, axis=0))


def _bent(
    columns: FloatArray, level: FloatArray, weights: FloatArray, slope: float, rng: np.random.Generator
) -> FloatArray:
    """Return the coefficients (f, k + 1) of a level (n,) over features (n, k + 1), the last being the bend.

    The prior of the bend is normal about 0; every resample draws from it, so that the resamples vary as the posterior.
    """
    deviation = 0.5 * _CURVATURE * abs(slope)
    if deviation == 0.0:
        line = _projections(columns[:, :-1], weights) @ level
        return np.concatenate((line, np.zeros_like(line[:, :1])), axis=1)
    rest = level - columns[:, :-1] @ (_projections(columns[:, :-1], weights[:1])[0] @ level)
    noise = float(np.var(rest, ddof=columns.shape[1]))
    centred, squares = _normal_equations(columns, weights)
    squares[:, -1, -1] += noise / deviation**2
    right = centred @ level
    right[1:, -1] += noise / deviation**2 * deviation * rng.standard_normal(len(weights) - 1)
    found: FloatArray = (np.linalg.pinv(squares, hermitian=True) @ right[:, :, np.newaxis])[:, :, 0]
    return found


def _robust_weights(design: FloatArray, levels: FloatArray, drawn: FloatArray) -> FloatArray:
    """Return Huber's weight (f, n) of each run in each fit: the smallest of its joints.

    `drawn` (f, n): how often a run counts. The weights are found for each resample again: with those of the estimate
    the resamples would vary too little.
    """
    weights = np.ones(drawn.shape)
    for column in levels.T:
        own = np.ones(drawn.shape)
        for _ in range(_STEPS):
            both = drawn * own
            rest = column - _projections(design, both) @ column @ design.T
            rest -= (both * rest).sum(axis=1, keepdims=True) / both.sum(axis=1, keepdims=True)
            scale = _weighted_median(np.abs(rest), drawn)[:, np.newaxis] / _MAD
            own = np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(rest), 1e-300))
            own = np.where(scale > 0.0, own, 1.0)
        weights = np.minimum(weights, own)
    return weights


def _weighted_median(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the median (f,) of values (f, n), each as often as its weight says."""
    order = np.argsort(values, axis=1)
    up_to = np.cumsum(np.take_along_axis(weights, order, axis=1), axis=1)
    middle = np.argmax(up_to >= 0.5 * up_to[:, -1:], axis=1)
    return np.take_along_axis(values, np.take_along_axis(order, middle[:, np.newaxis], axis=1), axis=1)[:, 0]


def _scale(rest: FloatArray) -> float:
    return float(np.median(np.abs(rest))) / _MAD


def _normal_equations(design: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return weighted and centred regressors (f, k, n), and their sums of squares (f, k, k)."""
    centre = weights @ design / weights.sum(axis=1, keepdims=True)  # (f, k)
    about = design[np.newaxis] - centre[:, np.newaxis, :]  # (f, n, k)
    weighted = about * weights[:, :, np.newaxis]
    return weighted.transpose(0, 2, 1), weighted.transpose(0, 2, 1) @ about


def _projections(design: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the matrices (f, k, n) that turn values (n,) into slopes, by weighted least squares with an intercept."""
    weighted, squares = _normal_equations(design, weights)
    # A resample of equal conditions has no slope: the pseudo-inverse then gives 0.
    found: FloatArray = np.linalg.pinv(squares, hermitian=True) @ weighted
    return found


def _projections_on(level: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the matrix (f, n) that turns values (n,) into their slope over a level (n,)."""
    found: FloatArray = _projections(level[:, np.newaxis], weights)[:, 0]
    return found


def _shrunk(slopes: FloatArray) -> FloatArray:
    """Return slopes (1 + b, k, c) shrunk towards their mean over the columns by the share of them that is noise."""
    middle = slopes.mean(axis=2, keepdims=True)
    own = slopes - middle
    between = np.square(own[0]).mean(axis=1)
    noise = own[1:].var(axis=0, ddof=1).mean(axis=1)
    share = np.clip(1.0 - np.divide(noise, between, out=np.ones_like(noise), where=between > 0.0), 0.0, 1.0)
    found: FloatArray = middle + share[:, np.newaxis] * own
    return found


def confounded(runs: Sequence[SeasonRun]) -> float:
    """Return the correlation of temperature and time over the runs; 0 where one of them does not vary.

    Parameters
    ----------
    runs : sequence of SeasonRun
        Runs with a temperature.

    Returns
    -------
    float
        From -1 to 1.
    """
    both = np.array([(item.temperature, item.time) for item in runs])
    spread = both.std(axis=0)
    if len(both) < 2 or not (spread > 0.0).all():
        return 0.0
    correlation = float(np.corrcoef(both.T)[0, 1])
    return 0.0 if math.isnan(correlation) else correlation
