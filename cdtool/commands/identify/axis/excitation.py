"""What the motion of impact-free runs excites, what is missing for each parameter, and the motion that would add it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.filtered_regression import FilteredRun
from cdtool.commands.identify.axis.start_ensemble import AFTER, BEFORE
from cdtool.commands.identify.estimate import Missing, NotIdentifiable

# A speed is held if this share of the moving time is spent within this relative distance of it.
_HELD_SHARE, SAME_SPEED = 0.05, 0.1
# Two held speeds are distinct if they differ by this factor.
_DISTINCT = 1.25
# With one or two speeds, the viscous friction of a real axis came out 20-60 % wrong.
SPEEDS_NEEDED = 3
# A direction counts if this share of the moving time is spent in it.
_DIRECTION_SHARE = 0.05
# The root mean square of the acceleration, noise included, must be this many times that of the noise.
_ABOVE_NOISE = 1.1
# Runs of a plan per speed and direction: with fewer than 3 strokes a direction has no spread between strokes.
_RUNS = 4
# Speeds of a plan are between these shares of the highest logged speed: below them the friction may rise (Stribeck).
_LOWEST_SPEED, _SPEED_STEPS = 0.3, 15
# Logged speeds count for a plan if they differ by this factor.
_APART = 1.5
# A plan asks for so many times the acceleration of the logs, and of its noise.
_MORE_ACCELERATION, _TIMES_NOISE = 2.0, 5.0
# The relative standard error that more runs have to reach, and the most runs that a plan asks for.
_WANTED_ERROR, _MOST_RUNS = 0.3, 100
# A higher sampling rate of a plan is this multiple of the logged one.
_MORE_RATE = 4.0


@dataclass(frozen=True)
class Excitation:
    """What the motion of the runs excites; linear axes in m, rotary ones in rad.

    `speeds`: distinct speeds at which at least 5 % of the moving time is spent, in ascending order, without sign
    [m/s]. `forward_share`: of the moving time [-]. `highest_speed` [m/s]: the 99 % quantile of |speed|.
    `acceleration` [m/s2]: the root mean square while moving, and `acceleration_noise` that of the noise in it;
    `highest_acceleration` [m/s2]: the 99 % quantile of its magnitude.
    `travel` [m], `moving_time` [s]: of all runs. `strokes`: motions between rests and reversals; `reversals`: changes
    of direction within a run.
    """

    speeds: tuple[float, ...]
    forward_share: float
    highest_speed: float
    acceleration: float
    acceleration_noise: float
    travel: float
    moving_time: float
    strokes: int
    reversals: int
    highest_acceleration: float = math.nan

    @property
    def is_one_way(self) -> bool:
        """Whether less than 5 % of the moving time is spent in one of the directions."""
        return min(self.forward_share, 1.0 - self.forward_share) < _DIRECTION_SHARE

    @property
    def is_accelerated(self) -> bool:
        """Whether the acceleration is more than its noise."""
        return self.acceleration > _ABOVE_NOISE * self.acceleration_noise


def measure_excitation(runs: Sequence[FilteredRun]) -> Excitation:
    """Return what the motion of the runs excites; without any motion, speeds is empty and every number is 0.

    A sample moves where the regression can use it: the sign of the speed is known within reach of the low-pass.
    """
    columns = [np.zeros((4, 0))]
    strokes = reversals = 0
    for run in runs:
        moving = run.usable
        count = int(np.count_nonzero(moving))
        duration, noise = np.full(count, run.run.period), np.full(count, run.acceleration_noise)
        columns.append(np.vstack((run.speed[moving], run.acceleration[moving], duration, noise)))
        strokes += len(np.unique(run.stroke[moving]))
        reversals += _reversals(run)
    speed, acceleration, duration, noise = np.concatenate(columns, axis=1)
    return excitation_of(speed, acceleration, duration, noise, strokes, reversals)


def excitation_of(
    speed: FloatArray,
    acceleration: FloatArray,
    duration: FloatArray,
    noise: FloatArray,
    strokes: int,
    reversals: int,
) -> Excitation:
    """Return what samples of motion excite (n,): speed, acceleration, time that each lasts [s], its noise or NaN."""
    total = float(np.sum(duration))
    if total <= 0.0:
        return Excitation((), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0)
    size, share = np.abs(speed), duration / total
    highest = float(np.quantile(size, 0.99))
    return Excitation(
        distinct_speeds(size, share),
        float(np.sum(share[speed > 0.0])),
        highest,
        math.sqrt(float(share @ acceleration**2)),
        math.sqrt(float(share @ noise**2)),
        float(size @ duration),
        total,
        strokes,
        reversals,
        float(np.quantile(np.abs(acceleration), 0.99)),
    )


def _reversals(run: FilteredRun) -> int:
    stroke = run.stroke
    direction = np.sign(run.inner_speed[stroke >= 0])
    return int(np.count_nonzero(np.diff(direction)))


def distinct_speeds(speed: FloatArray, share: FloatArray) -> tuple[float, ...]:
    """Return the distinct speeds that are held, ascending, from |speed| (n,) and the share of time (n,) of each sample.

    The speed with the most time within +-10 % comes first; what is within a factor 1.25 of it is taken out.

    Examples
    --------
    >>> import numpy as np
    >>> distinct_speeds(np.array([0.1, 0.1, 0.2, 0.2]), np.full(4, 0.25))
    (0.1, 0.2)
    """
    order = np.argsort(speed)
    speed, share = speed[order], share[order]
    held: list[float] = []
    while len(speed):
        cumulated = np.concatenate(([0.0], np.cumsum(share)))
        first = np.searchsorted(speed, speed * (1.0 - SAME_SPEED), side="left")
        last = np.searchsorted(speed, speed * (1.0 + SAME_SPEED), side="right")
        weight = cumulated[last] - cumulated[first]
        best = int(np.argmax(weight))
        if weight[best] < _HELD_SHARE:
            break
        near = slice(first[best], last[best])
        centre = float(np.average(speed[near], weights=share[near]))
        held.append(centre)
        kept = (speed < centre / _DISTINCT) | (speed > centre * _DISTINCT)
        speed, share = speed[kept], share[kept]
    return tuple(sorted(held))


@dataclass(frozen=True)
class PlannedMotion:
    """A motion that would make parameters identifiable, within the limits of what was logged.

    `keys`: the parameters, as "machine.viscous_friction". `speeds` [m/s, rad/s] at which to move; `logged_speeds`: what
    the logs have. `directions`: 1, -1. `acceleration` [m/s2, rad/s2] is the least that is needed, and
    `logged_acceleration` the highest in the logs. `runs` per speed and direction; 0 if no motion but other knowledge or
    another channel is missing. `rest`, `motion` [s]: before and after each start. `rate` [Hz]: of the log. A number
    that does not matter, or for which the logs have no basis, is NaN.
    """

    missing: Missing
    keys: tuple[str, ...]
    runs: int = 0
    speeds: tuple[float, ...] = ()
    logged_speeds: tuple[float, ...] = ()
    directions: tuple[int, ...] = ()
    acceleration: float = math.nan
    logged_acceleration: float = math.nan
    travel: float = math.nan
    rest: float = math.nan
    motion: float = math.nan
    rate: float = math.nan


def plan_motions(
    items: Sequence[NotIdentifiable], excitation: Excitation | None = None, rate: float = math.nan
) -> tuple[PlannedMotion, ...]:
    """Return the motions that would make parameters identifiable, one for each kind that is missing.

    Parameters
    ----------
    items : sequence of NotIdentifiable
        What could not be identified of one joint.
    excitation : Excitation, optional
        The motion of the logs; without it the plan has no speeds and accelerations.
    rate : float
        The sampling rate of the logs [Hz].

    Returns
    -------
    tuple of PlannedMotion
        In the order in which the kinds are missing. New speeds are as far from the logged ones and from each other as
        possible (in ratio), between 30 % and 100 % of the highest logged speed that is held.
        They are in both directions if a direction is missing too, so that one series of runs serves all parameters.

    Notes
    -----
    More runs lower a standard error with the square root of their number. That holds for the scatter between runs, not
    for friction that is the same in each run: a plan of more runs can fail.
    """
    by_kind: dict[Missing, list[NotIdentifiable]] = {}
    for item in items:
        for kind in item.missing:
            by_kind.setdefault(kind, []).append(item)
    plans = []
    for kind, needing in by_kind.items():
        keys = tuple(dict.fromkeys(f"{item.section}.{item.key}" for item in needing))
        plan = PlannedMotion(kind, keys)
        if kind is Missing.HIGHER_RATE:
            plan = replace(plan, rate=_MORE_RATE * rate)
        if excitation is not None and excitation.moving_time > 0.0 and kind in _MOTIONS:
            plan = _MOTIONS[kind](_along_travel(plan, excitation, by_kind), excitation, needing)
        plans.append(plan)
    return tuple(plans)


def _along_travel(
    plan: PlannedMotion, excitation: Excitation, missing: Mapping[Missing, Sequence[NotIdentifiable]]
) -> PlannedMotion:
    """Return the plan with runs along the usual travel, in the logged direction or in both."""
    main = 1 if excitation.forward_share >= 0.5 else -1
    one_way = excitation.is_one_way and Missing.REVERSALS not in missing
    return replace(
        plan,
        runs=_RUNS,
        directions=(main,) if one_way else (1, -1),
        logged_speeds=excitation.speeds or (excitation.highest_speed,),
        travel=excitation.travel / max(excitation.strokes, 1),
    )


def _more_speeds(plan: PlannedMotion, excitation: Excitation, _: Sequence[NotIdentifiable]) -> PlannedMotion:
    """Return the plan with new speeds; with logged ones too if there are several: longer runs would lower their share.

    A logged speed that is close to a faster one does not count: it would not tell the two frictions apart.
    """
    highest = max(excitation.speeds, default=excitation.highest_speed)
    kept: list[float] = []
    for speed in sorted(excitation.speeds, reverse=True):
        if all(other > _APART * speed for other in kept):
            kept.append(speed)
    candidates = highest * np.linspace(_LOWEST_SPEED, 1.0, _SPEED_STEPS)
    added: list[float] = []
    while len(kept) + len(added) < SPEEDS_NEEDED:
        chosen = kept + added or [_LOWEST_SPEED**2 * highest]
        ratio = np.min(np.abs(np.log(candidates[:, np.newaxis] / np.array(chosen))), axis=1)
        added.append(float(f"{candidates[int(np.argmax(ratio))]:.2g}"))
    repeated = [float(f"{speed:.3g}") for speed in kept] if len(kept) > 1 else []
    return replace(plan, speeds=tuple(sorted(added + repeated)))


def _other_direction(plan: PlannedMotion, excitation: Excitation, _: Sequence[NotIdentifiable]) -> PlannedMotion:
    missing = -1 if excitation.forward_share >= 0.5 else 1
    return replace(plan, directions=(missing,), speeds=plan.logged_speeds)


def _more_acceleration(plan: PlannedMotion, excitation: Excitation, _: Sequence[NotIdentifiable]) -> PlannedMotion:
    wanted = max(
        _MORE_ACCELERATION * excitation.highest_acceleration, _TIMES_NOISE * excitation.acceleration_noise, 0.0
    )
    if not wanted > 0.0:
        return replace(plan, speeds=plan.logged_speeds)
    return replace(
        plan,
        speeds=plan.logged_speeds,
        acceleration=float(f"{wanted:.2g}"),
        logged_acceleration=excitation.highest_acceleration,
    )


def _from_rest(plan: PlannedMotion, _: Excitation, __: Sequence[NotIdentifiable]) -> PlannedMotion:
    return replace(plan, speeds=plan.logged_speeds, rest=BEFORE, motion=AFTER)


def _more_runs(plan: PlannedMotion, excitation: Excitation, items: Sequence[NotIdentifiable]) -> PlannedMotion:
    """Return the plan with as many runs as bring the largest relative standard error down to what is wanted."""
    relative = max((relative_error(item) for item in items), default=math.nan)
    strokes = max(excitation.strokes, 1)
    factor = (relative / _WANTED_ERROR) ** 2 - 1.0 if math.isfinite(relative) else 1.0
    runs = max(math.ceil(strokes * factor / len(plan.directions)), _RUNS)
    return replace(plan, speeds=plan.logged_speeds, runs=min(runs, _MOST_RUNS))


def relative_error(item: NotIdentifiable) -> float:
    """Return the relative standard error of a parameter that is too uncertain; NaN where it is not known."""
    numbers = item.numbers
    if "relative_standard_error" in numbers:
        return numbers["relative_standard_error"]
    value = abs(numbers.get("value", 0.0))
    return numbers.get("standard_error", math.nan) / value if value > 0.0 else math.nan


_Planner = Callable[[PlannedMotion, Excitation, Sequence[NotIdentifiable]], PlannedMotion]
_MOTIONS: Mapping[Missing, _Planner] = {
    Missing.SECOND_SPEED: _more_speeds,
    Missing.REVERSALS: _other_direction,
    Missing.ACCELERATION: _more_acceleration,
    Missing.SATURATION: _more_acceleration,
    Missing.START_UP: _from_rest,
    Missing.MORE_RECORDINGS: _more_runs,
}
