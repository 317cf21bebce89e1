"""Mass and friction of one rigid axis from impact-free runs, with what they cannot show.

The model is F = M a + d v + Fc sign(v) + F0: total mass, viscous and Coulomb friction and a constant force.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.plain_text import counted
from cdtool.commands.identify.axis.excitation import SAME_SPEED, SPEEDS_NEEDED, Excitation, measure_excitation
from cdtool.commands.identify.axis.filtered_regression import (
    FilteredRun,
    IntArray,
    LinearFit,
    block_covariance,
    filter_run,
    fit_linear,
)
from cdtool.commands.identify.axis.profile_covariance import profile_covariance
from cdtool.commands.identify.estimate import (
    Estimate,
    IdentificationError,
    Identified,
    Method,
    Missing,
    NotIdentifiable,
)
from cdtool.commands.identify.evidence import CrossValidation, ForceEvidence, UnseenRun
from cdtool.machines.axis_model.axis_run import AxisRun


@dataclass(frozen=True, kw_only=True)
class RigidAxisSettings:
    """How a rigid axis is identified.

    `low_pass_hz`: corner of the low-pass of every term. `units`: of inertia, force and travel. `torque_filter_time`
    [s]: of the low-pass through which the torque was logged, 0 for none; None if it is not known: where the runs show
    a lag, the mass is then not identifiable.
    """

    low_pass_hz: float = 20.0
    units: tuple[str, str, str] = ("kg", "N", "m")
    torque_filter_time: float | None = None
    #: Fewer equations identify nothing.
    fewest_equations: int = 50
    #: With this relative standard error or more a parameter is not identifiable: of the mass ...
    largest_mass_error: float = 0.5
    #: ... of viscous friction, which a small range of speeds makes up from anything ...
    largest_viscous_error: float = 0.3
    #: ... and of Coulomb friction.
    largest_coulomb_error: float = 0.5
    #: Acceleration with this share of noise is not fitted by least squares: it would lower the mass by its square.
    noisy: float = 0.2
    #: A lag of the torque is there if it is this many times its standard error ...
    certain_lag: float = 3.0
    #: ... and explains this share of the residual's variance.
    least_explained: float = 0.05
    #: This share of what a lag would change in the mass is an error, if it is not certain or left by a stated one.
    lag_left: float = 0.5
    #: The most folds of a cross-validation.
    folds: int = 8


# The forces of strokes that repeat each other are compared at so many times within this share of them, as their ends do
# not agree to a sample.
_TIMES, _INNER = 400, 0.98


@dataclass(frozen=True)
class FrictionLevel:
    """The mean force against the travel at the fastest speed that is held, per direction, the constant force included.

    It is that of the torque without the inertia's, and identifiable even if its parts are not. `speed` [m/s, rad/s];
    `force`, `standard_error` [N, N m].
    """

    direction: int
    speed: float
    force: float
    standard_error: float


@dataclass(frozen=True, eq=False)
class RigidAxisFit:
    """An identified rigid axis.

    `identified`: per parameter an estimate or what is missing. `total_mass` [kg, kg m2] with its standard error: motor
    and load. `levels`: per direction. All forces are without a stated lag.
    """

    identified: Identified
    total_mass: float
    total_mass_error: float
    levels: tuple[FrictionLevel, ...]
    condition_number: float
    excitation: Excitation
    evidence: ForceEvidence = field(repr=False)


def identify_rigid_axis(
    runs: Sequence[AxisRun], motor_mass: float, settings: RigidAxisSettings = RigidAxisSettings()
) -> RigidAxisFit:
    """Identify mass and friction of one rigid axis.

    Parameters
    ----------
    runs : sequence of AxisRun
        Impact-free; several, or a long one.
    motor_mass : float
        The motor's inertia on the load side [kg, kg m2]; 0 if the load includes it.
    settings : RigidAxisSettings

    Returns
    -------
    RigidAxisFit
        `identified` has in section "machine" `load_mass` (total minus motor), `viscous_friction`, `coulomb_friction`
        (mean of the directions) and `constant_force`, which includes half the difference of the directions; in section
        "model.friction" `coulomb_forward` and `coulomb_backward` with the whole difference, for an offset of 0.

    Raises
    ------
    IdentificationError
        No run, or hardly any motion.
    RecordingError
        A run has neither speed nor position.

    Notes
    -----
    Gautier, Janot and Vandanjon, "A new closed-loop output error method for parameter identification of robot
    dynamics", IEEE TCST 21, 2013 (filtered inverse dynamics); Janot, Vandanjon and Gautier, "A generic instrumental
    variable approach for industrial robot identification", IEEE TCST 22, 2014.

    * Forward and backward Coulomb friction and a constant force are three numbers for two levels: they differ by where
      the difference of the directions is counted.
    * The viscous friction needs three speeds. With fewer, neither it nor the Coulomb friction is identifiable; the
      mass is then the middle between no viscous friction and the best one, and half the difference is in its error.
    * Standard errors: jackknife over strokes plus random friction profiles of the residuals' spectrum.
    * To a first-order lag T the equation is F + T F' = M a + friction with the logged force F: T is one more
      coefficient. A mass from a torque that lags is too small: it is refused, with T, until the lag is stated.
    * Fails: a drive that winds up while it accelerates (its mass is some percent wrong).
    """
    if not runs:
        raise IdentificationError("no runs", "give at least one impact-free recording")
    filtered = [filter_run(run, settings.low_pass_hz, settings.torque_filter_time or 0.0) for run in runs]
    excitation = measure_excitation(filtered)
    equations = _equations(filtered, excitation, settings)
    if len(equations.force) < settings.fewest_equations:
        raise _too_few(filtered, excitation, len(equations.force), settings)
    lag = _torque_lag(equations, excitation, settings)
    solution = _with_noise_error(_solve(equations, excitation), excitation)
    levels = _levels(equations, solution.mass, excitation)
    mass_error = math.hypot(solution.mass_error, settings.lag_left * abs(lag.mass_change))
    solution = replace(solution, mass_error=mass_error, levels=levels)
    return RigidAxisFit(
        Identified.of(
            [
                _load_mass(solution, excitation, motor_mass, settings, lag),
                *_frictions(solution, excitation, settings),
            ]
        ),
        solution.mass,
        solution.mass_error,
        solution.levels,
        solution.fit.condition_number,
        excitation,
        ForceEvidence.of(
            (equations.regressors[:, 1], equations.position),
            equations.force - solution.mass * equations.regressors[:, 0],
            solution.fit.residuals,
            equations.stroke,
            _cross_validate(equations, settings.folds),
        ),
    )


def _too_few(
    filtered: Sequence[FilteredRun], excitation: Excitation, count: int, settings: RigidAxisSettings
) -> IdentificationError:
    hidden = [run for run in filtered if run.is_hidden]
    name = filtered[0].run.name
    if len(hidden) == len(filtered):
        return IdentificationError(
            f"{name}: noise or steps of speed or position hide speeds below {hidden[0].unknown_speed:.3g} "
            f"{settings.units[2]}/s, and the axis is never faster",
            "map a finer channel, or log faster motion",
        )
    return IdentificationError(
        f"{name}: hardly any motion ({count} usable equations, "
        f"{excitation.moving_time:.3g} s in {counted(len(filtered), 'recording')})",
        f"identification needs at least {settings.fewest_equations}: recordings in which the axis moves",
    )


@dataclass(frozen=True, eq=False)
class _Equations:
    """The equations of all runs, one per average of the low-pass; arrays (m,), columns (m, 4).

    `regressors` are the `columns` of the runs; `instruments` has the same of the reference, or is None.
    `force_slope`: the force's derivative [N/s, N m/s].
    """

    regressors: FloatArray
    instruments: FloatArray | None
    force: FloatArray
    force_slope: FloatArray
    position: FloatArray
    run: IntArray
    time: FloatArray
    stroke: IntArray
    direction: FloatArray
    filtered: Sequence[FilteredRun]

    @property
    def block(self) -> IntArray:
        """Return the strokes as blocks (m,); they are cut where a direction has fewer than 3."""
        block = np.zeros(len(self.stroke), dtype=np.int64)
        total = 0
        for sign in (1.0, -1.0):
            strokes = np.unique(self.stroke[self.direction == sign])
            # Strokes are the blocks of the standard errors; with fewer than three they are cut into six pieces.
            pieces = 1 if len(strokes) >= 3 else math.ceil(6 / max(len(strokes), 1))
            for stroke in strokes:
                inside = np.flatnonzero((self.stroke == stroke) & (self.direction == sign))
                block[inside] = total + np.arange(len(inside)) * pieces // len(inside)
                total += pieces
        return block


def _is_noisy(excitation: Excitation, settings: RigidAxisSettings) -> bool:
    return excitation.acceleration_noise > settings.noisy * excitation.acceleration


def _instruments(
    filtered: Sequence[FilteredRun], excitation: Excitation, settings: RigidAxisSettings
) -> list[FloatArray] | None:
    """Return the instruments of each run (n, 4): of its reference, if every run has one, else none for least squares.

    A noisy acceleration needs some: then they are the measured signals, delayed.
    """
    given = [run.instruments for run in filtered if run.instruments is not None]
    if len(given) == len(filtered):
        return given
    return [_delayed(run) for run in filtered] if _is_noisy(excitation, settings) else None


def _delayed(run: FilteredRun) -> FloatArray:
    """Return the columns of a run (n, 4) so much later that they share no sample with those in time."""
    delay = 2 * run.low_pass.reach + 1
    delayed = np.full_like(run.columns, np.nan)
    delayed[delay:] = np.where(run.usable[:, None], run.columns, np.nan)[:-delay]
    return delayed


def _equations(filtered: Sequence[FilteredRun], excitation: Excitation, settings: RigidAxisSettings) -> _Equations:
    instruments = _instruments(filtered, excitation, settings)
    main = 1.0 if excitation.forward_share >= 0.5 else -1.0
    rows = []
    for number, run in enumerate(filtered):
        usable = run.usable.copy()
        if instruments is not None:
            usable &= np.isfinite(instruments[number]).all(axis=1)
        if excitation.is_one_way:
            usable &= np.sign(run.inner_speed) == main
        usable[np.arange(len(usable)) % run.low_pass.steps != 0] = False
        rows.append(np.flatnonzero(usable))
    offsets = np.cumsum([0] + [int(run.stroke.max(initial=-1)) + 1 for run in filtered])

    def gather(values: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([item[chosen] for item, chosen in zip(values, rows, strict=True)])

    return _Equations(
        gather([run.columns for run in filtered]),
        None if instruments is None else gather(instruments),
        gather([run.force for run in filtered]),
        gather([run.force_slope for run in filtered]),
        gather([run.position for run in filtered]),
        np.repeat(np.arange(len(rows)), [len(item) for item in rows]),
        gather([run.run.time for run in filtered]),
        np.concatenate([run.stroke[item] + first for run, item, first in zip(filtered, rows, offsets, strict=False)]),
        np.sign(gather([run.inner_speed for run in filtered])),
        filtered,
    )


@dataclass(frozen=True)
class _TorqueLag:
    """The lag of the torque behind the motion [s], as one more coefficient, and what it adds to the mass."""

    time: float = 0.0
    mass_change: float = 0.0
    is_certain: bool = False


def _torque_lag(equations: _Equations, excitation: Excitation, settings: RigidAxisSettings) -> _TorqueLag:
    """Return the lag that the stated one leaves; none where the acceleration is too noisy to show it."""
    if _is_noisy(excitation, settings) or not excitation.is_accelerated:
        return _TorqueLag()
    regressors = equations.regressors[:, _chosen_columns(excitation)]
    try:
        without = fit_linear(regressors, equations.force)
        lagged = fit_linear(np.column_stack((regressors, -equations.force_slope)), equations.force)
    except IdentificationError:
        return _TorqueLag()
    time, variance = float(lagged.coefficients[-1]), block_covariance(lagged, equations.block)[-1, -1]
    error = math.sqrt(variance) if variance >= 0.0 else math.inf
    before, left = float(np.mean(without.residuals**2)), float(np.mean(lagged.residuals**2))
    explains = before > 0.0 and 1.0 - left / before >= settings.least_explained
    change = float(lagged.coefficients[0] - without.coefficients[0])
    return _TorqueLag(time, change, explains and time > settings.certain_lag * error)


@dataclass(frozen=True, eq=False)
class _AxisSolution:
    """The fit whose coefficients are reported: mass, viscous if there are speeds, Coulomb, and constant if two-way."""

    fit: LinearFit
    covariance: FloatArray
    mass: float
    mass_error: float
    names: tuple[str, ...]
    method: Method
    levels: tuple[FrictionLevel, ...] = ()

    def value(self, **shares: float) -> tuple[float, float]:
        """Return a combination of named coefficients with its standard error."""
        vector = np.array([shares.get(name, 0.0) for name in self.names])
        used = vector != 0.0
        variance = vector[used] @ self.covariance[np.ix_(used, used)] @ vector[used]
        return float(vector @ self.fit.coefficients), math.sqrt(variance) if variance >= 0.0 else math.inf


_NAMES = ("mass", "viscous", "coulomb", "constant")


def _chosen_columns(excitation: Excitation) -> list[int]:
    """Return which of the columns `_NAMES` describe the motion and do not depend on each other."""
    chosen = [0, 1, 2] if len(excitation.speeds) >= SPEEDS_NEEDED else [0, 2]
    return chosen if excitation.is_one_way else [*chosen, 3]


def _solve(equations: _Equations, excitation: Excitation) -> _AxisSolution:
    chosen = _chosen_columns(excitation)
    without = _solution(equations, chosen)
    if 1 in chosen:
        return without
    try:
        whole = _solution(equations, sorted([*chosen, 1]))
    except IdentificationError:
        return without
    viscous, _ = whole.value(viscous=1.0)
    if viscous <= 0.0:
        return without
    # The viscous share of the friction lies between nothing and all of it.
    levels = _levels(equations, without.mass, excitation)
    most = min((level.force / level.speed for level in levels), default=0.0)
    half = 0.5 * (whole.mass - without.mass) * float(np.clip(most / viscous, 0.0, 1.0))
    return replace(without, mass=without.mass + half, mass_error=math.hypot(without.mass_error, half))


def _with_noise_error(solution: _AxisSolution, excitation: Excitation) -> _AxisSolution:
    """Add to the mass's error what noise in the acceleration takes from it by least squares: the share of its power."""
    if solution.method is not Method.LEAST_SQUARES or not excitation.acceleration > 0.0:
        return solution
    share = (excitation.acceleration_noise / excitation.acceleration) ** 2
    lost = abs(solution.mass) * share / (1.0 - share) if share < 1.0 else math.inf
    return replace(solution, mass_error=math.hypot(solution.mass_error, lost))


def _solution(equations: _Equations, chosen: Sequence[int]) -> _AxisSolution:
    """Fit by instrumental variables; if the references do not move as the axis does, by least squares."""
    columns, fit = list(chosen), None
    if equations.instruments is not None:
        with suppress(IdentificationError):
            fit = fit_linear(equations.regressors[:, columns], equations.force, equations.instruments[:, columns])
    method = Method.LEAST_SQUARES if fit is None else Method.INSTRUMENTAL_VARIABLES
    fit = fit or fit_linear(equations.regressors[:, columns], equations.force)
    everything = np.ones(len(equations.force), dtype=np.bool_)
    covariance = _covariance(fit, equations, everything)
    plain = _AxisSolution(fit, covariance, math.nan, math.nan, tuple(_NAMES[item] for item in columns), method)
    mass, mass_error = plain.value(mass=1.0)
    return replace(plain, mass=mass, mass_error=mass_error)


def _covariance(fit: LinearFit, equations: _Equations, chosen: BoolArray) -> FloatArray:
    """Return the covariance (p, p) of a fit to the chosen equations: between strokes, and along the travel."""
    position, direction = equations.position[chosen], equations.direction[chosen]
    along = profile_covariance(fit.influence, fit.residuals, position, direction)
    return block_covariance(fit, equations.block[chosen]) + along


def _levels(equations: _Equations, mass: float, excitation: Excitation) -> tuple[FrictionLevel, ...]:
    speed, friction = np.abs(equations.regressors[:, 1]), equations.force - mass * equations.regressors[:, 0]
    nominal = excitation.speeds[-1] if excitation.speeds else excitation.highest_speed
    levels = []
    for direction in (1, -1):
        inside = (equations.direction == direction) & (np.abs(speed - nominal) <= SAME_SPEED * nominal)
        if not np.any(inside):
            continue
        fit = fit_linear(np.full((np.count_nonzero(inside), 1), float(direction)), friction[inside])
        variance = _covariance(fit, equations, inside)[0, 0]
        error = math.sqrt(variance) if variance >= 0.0 else math.nan
        levels.append(FrictionLevel(direction, float(np.mean(speed[inside])), float(fit.coefficients[0]), error))
    return tuple(levels)


def _is_certain(value: float, error: float, most: float) -> bool:
    """Whether a value is above 0 with at most that relative standard error."""
    return value > 0.0 and error <= most * value


def _load_mass(
    solution: _AxisSolution, excitation: Excitation, motor_mass: float, settings: RigidAxisSettings, lag: _TorqueLag
) -> Estimate | NotIdentifiable:
    load, error, most = solution.mass - motor_mass, solution.mass_error, settings.largest_mass_error
    has_lag = lag.is_certain and settings.torque_filter_time is None
    if excitation.is_accelerated and _is_certain(load, error, most) and not has_lag:
        return Estimate("machine", "load_mass", load, error, settings.units[0], solution.method)
    numbers = {
        "total_mass": solution.mass,
        "standard_error": error,
        "motor_mass": motor_mass,
        "acceleration": excitation.acceleration,
        "acceleration_noise": excitation.acceleration_noise,
    }
    if has_lag:
        return NotIdentifiable("machine", "load_mass", (Missing.TORQUE_FILTER,), {**numbers, "lag_s": lag.time})
    missing = [Missing.ACCELERATION]
    if _is_noisy(excitation, settings):
        missing.append(Missing.FINER_MOTION)
    if excitation.is_accelerated and load < error and _is_certain(solution.mass, error, 0.5 * most):
        # The total is known; that the motor alone has as much is a question of the motor's inertia.
        missing = [Missing.MOTOR_INERTIA]
    elif math.isinf(error):
        missing.append(Missing.MORE_RECORDINGS)
    return NotIdentifiable("machine", "load_mass", tuple(missing), numbers)


def _frictions(
    solution: _AxisSolution, excitation: Excitation, settings: RigidAxisSettings
) -> list[Estimate | NotIdentifiable]:
    numbers = {"speeds": float(len(excitation.speeds)), "forward_share": excitation.forward_share}
    speeds = () if "viscous" in solution.names else (Missing.SECOND_SPEED,)
    reversals = (Missing.REVERSALS,) if excitation.is_one_way else ()
    force, unit = settings.units[1], f"{settings.units[1]} s/{settings.units[2]}"
    answers: list[Estimate | NotIdentifiable] = []
    for section, key, shares in _FRICTIONS:
        value, error = solution.value(**shares)
        if key == "viscous_friction":
            missing, most, is_possible = speeds, settings.largest_viscous_error, value > 0.0
        elif key == "constant_force":
            missing, most, is_possible = reversals, math.inf, math.isfinite(error)
        else:
            missing, most, is_possible = (*speeds, *reversals), settings.largest_coulomb_error, value > 0.0
        if not missing and is_possible and error <= most * abs(value):
            answers.append(
                Estimate(section, key, value, error, unit if key == "viscous_friction" else force, solution.method)
            )
            continue
        uncertain = {} if missing else {"value": value, "standard_error": error}
        answers.append(NotIdentifiable(section, key, missing or (Missing.MORE_RECORDINGS,), numbers | uncertain))
    return answers


_FRICTIONS = (
    ("machine", "viscous_friction", {"viscous": 1.0}),
    ("machine", "coulomb_friction", {"coulomb": 1.0}),
    ("model.friction", "coulomb_forward", {"coulomb": 1.0, "constant": 1.0}),
    ("model.friction", "coulomb_backward", {"coulomb": 1.0, "constant": -1.0}),
    ("machine", "constant_force", {"constant": 1.0}),
)


def _cross_validate(equations: _Equations, most: int) -> CrossValidation | None:
    """Return how well runs, or strokes of a single one, are predicted by the others; None with a single stroke."""
    several = len(equations.filtered) > 1
    fold = (equations.run if several else equations.stroke) % most
    folds = np.unique(fold)
    if len(folds) < 2:
        return None
    predicted = np.empty(len(fold))
    for number in folds:
        left_out = fold == number
        # Columns that depend on each other predict as well together.
        regressors, force = equations.regressors[~left_out], equations.force[~left_out]
        coefficients = np.linalg.lstsq(regressors, force, rcond=None)[0]
        predicted[left_out] = equations.regressors[left_out] @ coefficients
    squares = (equations.force - predicted) ** 2
    counts = np.bincount(equations.run)
    worst = int(np.argmax(np.bincount(equations.run, weights=squares) / np.maximum(counts, 1)))
    own, run = equations.run == worst, equations.filtered[worst].run
    shown = UnseenRun(
        run.name, equations.time[own] - run.start, equations.force[own], predicted[own], len(equations.filtered)
    )
    floor = _repeat_floor(equations.filtered)
    return CrossValidation(float(np.sqrt(np.mean(squares))), len(folds), *floor, shown)


def _repeat_floor(filtered: Sequence[FilteredRun]) -> tuple[float, int]:
    """Return the standard deviation of the force between strokes that repeat each other, and their number.

    Strokes repeat each other if travel and duration agree; they are compared by the time from the middle of the samples
    above half of their highest speed, which a start or an end that is missing does not shift.
    """
    groups: list[list[tuple[FloatArray, FloatArray, FloatArray]]] = []
    for run in filtered:
        for number in range(int(run.stroke.max(initial=-1)) + 1):
            inside = np.flatnonzero((run.stroke == number) & np.isfinite(run.force + run.speed))
            if len(inside) <= 8 * run.low_pass.reach or inside[-1] - inside[0] >= len(inside):
                continue
            period, index = run.run.period, np.arange(len(inside), dtype=np.float64)
            speed = run.speed[inside]
            fast = np.flatnonzero(np.abs(speed) > 0.5 * np.max(np.abs(speed)))
            kind = np.array([np.sum(speed) * period, period * len(inside)])
            stroke = kind, period * (index - 0.5 * (fast[0] + fast[-1])), run.force[inside]
            for group in groups:
                # Strokes repeat each other within 2 % of duration and travel.
                if (np.abs(kind - group[0][0]) <= 0.02 * np.abs(group[0][0])).all():
                    group.append(stroke)
                    break
            else:
                groups.append([stroke])
    squares, degrees, members = 0.0, 0, 0
    for group in groups:
        if len(group) > 1:
            first, last = max(time[0] for _, time, _ in group), min(time[-1] for _, time, _ in group)
            at = np.linspace(_INNER * first, _INNER * last, _TIMES)
            forces = np.array([np.interp(at, time, force) for _, time, force in group])
            squares += float(np.sum((forces - forces.mean(axis=0)) ** 2))
            degrees += (len(group) - 1) * _TIMES
            members += len(group)
    return (math.sqrt(squares / degrees), members) if degrees else (math.nan, 0)
