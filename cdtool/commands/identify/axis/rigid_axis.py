"""Mass and friction of one rigid axis from impact-free runs, with what they cannot show.

The model is F = M a + d v + Fc sign(v) + F0: total mass, viscous and Coulomb friction and a constant force.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.plain_text import counted
from cdtool.commands.identify.axis.excitation import SAME_SPEED, SPEEDS_NEEDED, Excitation, measure_excitation
from cdtool.commands.identify.axis.filtered_regression import (
    NO_LAG,
    FilteredRun,
    IntArray,
    LinearFit,
    ResidualLoss,
    TorqueLag,
    block_covariance,
    filter_run,
    fit_linear,
)
from cdtool.commands.identify.axis.friction_curve import (
    FrictionCurve,
    FrictionForm,
    FrictionShape,
    friction_curve,
    profile_covariance,
    speed_edges,
)
from cdtool.commands.identify.axis.torque_lag import MotionColumns, apparent_lag, best_lag
from cdtool.commands.identify.estimate import (
    Estimate,
    IdentificationError,
    Identified,
    Method,
    Missing,
    NotIdentifiable,
)
from cdtool.machines.axis_model.axis_run import AxisRun

# Fewer equations than this identify nothing.
_FEWEST_EQUATIONS = 50
# With this relative standard error or more a parameter is not identifiable [-].
_MASS_ERROR, _VISCOUS_ERROR, _COULOMB_ERROR = 0.5, 0.3, 0.5
# Strokes are the blocks of the standard errors; with fewer per direction they are cut into this many pieces.
_ENOUGH_STROKES, _PIECES = 3, 6
# Acceleration with this share of noise [-] is not fitted by least squares, which would lower the mass by its square.
_NOISY = 0.2
# Stribeck speeds that are tried, as shares of the highest speed.
_STRIBECK_SHARES = (0.02, 0.04, 0.08, 0.15, 0.25, 0.4)
# The weight of the difference of two neighbouring knots per equation: it only matters where no equation is.
_KNOT_WEIGHT = 1e-4
# The form of an identified lag of the torque is a guess: this share of what it changes in the mass [-] is an error, and
# this share of what a lag that is not certain would change.
_LAG_FORM, _LAG_LEFT = 0.25, 0.5
# The most folds of a cross-validation.
_MOST_FOLDS = 8
# A sample moves for the cross-validation above this share of the usual highest speed.
_MOVING_SHARE = 0.05
# A direction that was not learned may have this share of the weight of a prediction.
_UNLEARNED_WEIGHT = 0.05
# Strokes repeat each other within this relative difference of duration and travel [-]; they are shifted by at least
# this many samples to align them.
_SAME_STROKE, _ALIGNED_WITHIN = 0.02, 10


@dataclass(frozen=True)
class RigidAxisSettings:
    """How a rigid axis is identified.

    `low_pass_hz`: corner of the low-pass of every term. `unknown_speed` [m/s, rad/s]: see `filter_run`. `method`:
    LEAST_SQUARES or INSTRUMENTAL_VARIABLES; None is the latter if every run has a reference, or if the acceleration is
    noisy. Without references the instruments are the measured signals, delayed. `prediction`: the friction of
    `predict_force`; None is the one with the smallest error in cross-validation, or COULOMB_VISCOUS without it.
    `rotary`: the units of the estimates. `seed`: of the random friction profiles of the standard errors.
    `torque_filter_time` [s]: of the low-pass through which the torque was logged, 0 for none; None if it is not known:
    a lag that the runs show is then undone.
    """

    low_pass_hz: float = 20.0
    unknown_speed: float | None = None
    method: Method | None = None
    loss: ResidualLoss = ResidualLoss.SQUARES
    prediction: FrictionForm | None = None
    cross_validate: bool = True
    rotary: bool = False
    joint: int = 0
    seed: int = 0
    torque_filter_time: float | None = None


@dataclass(frozen=True, eq=False)
class Residuals:
    """The equations of the fit: all arrays (m,), moving samples only.

    `run`: index of the run. `force`: low-passed [N, N m]; `residual`: force minus the model; `friction`: force minus
    the inertia's.
    """

    run: IntArray
    time: FloatArray
    position: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    force: FloatArray
    friction: FloatArray
    residual: FloatArray


@dataclass(frozen=True)
class ForceError:
    """Root mean square error of a predicted force [N, N m]: of all samples, and of the `moving_count` moving ones."""

    all: float
    moving: float
    count: int
    moving_count: int


@dataclass(frozen=True)
class CrossValidation:
    """The error of the predicted force in runs, or strokes of a single run, that were left out of the fit.

    `errors`: per form of the friction. `folds`: how often something was left out. `floor` [N, N m]: standard deviation
    of the force between strokes that repeat each other, over `repeats` strokes; NaN without repeats.
    """

    errors: dict[FrictionForm, ForceError]
    folds: int
    floor: float
    repeats: int

    @property
    def best(self) -> FrictionForm:
        """Return the form with the smallest error while moving."""
        return min(self.errors, key=lambda form: (math.isnan(self.errors[form].moving), self.errors[form].moving))

    @property
    def left_over(self) -> float:
        """Return the smallest error while moving over the floor; NaN without a floor."""
        return self.errors[self.best].moving / self.floor if self.floor > 0.0 else math.nan


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
class PredictionModel:
    """Mass [kg, kg m2] and friction coefficients (c,) for the columns of `shape`."""

    shape: FrictionShape
    mass: float
    coefficients: FloatArray

    def force(self, run: FilteredRun) -> FloatArray:
        """Return the low-passed force (n,); NaN where the run is incomplete or moves in a direction not learned."""
        force: FloatArray = self.mass * run.acceleration + self.shape.columns(run) @ self.coefficients
        force[~run.complete] = np.nan
        for direction in {1, -1} - set(self.shape.directions):
            weight = run.low_pass.value(np.maximum(direction * run.sign, 0.0))
            force[np.nan_to_num(weight) > _UNLEARNED_WEIGHT] = np.nan
        return force


@dataclass(frozen=True, eq=False)
class RigidAxisFit:
    """An identified rigid axis.

    `identified`: per parameter an estimate or what is missing. `total_mass` [kg, kg m2] with its standard error: motor
    and load. `levels`: per direction. `friction_curve`: the whole friction over signed speed; `position_curves`: the
    residual over position, per direction (1, -1). `cross_validation` is None with a single stroke, or if not wanted.
    `torque_lag`: behind the motion, stated or found; the force of residuals and predictions is
    without it.
    """

    identified: Identified
    total_mass: float
    total_mass_error: float
    levels: tuple[FrictionLevel, ...]
    condition_number: float
    excitation: Excitation
    residuals: Residuals = field(repr=False)
    friction_curve: FrictionCurve = field(repr=False)
    position_curves: dict[int, FrictionCurve] = field(repr=False)
    cross_validation: CrossValidation | None
    prediction: PredictionModel = field(repr=False)
    settings: RigidAxisSettings
    torque_lag: TorqueLag = NO_LAG


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
        "model.friction" `coulomb_forward` and `coulomb_backward` with the whole difference, for an offset of 0; in
        section "model.sensors" `torque_filter_time`, if it is not stated and the torque lags the motion.

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
    * A torque that lags the motion is found by `torque_lag.apparent_lag` and undone, unless the acceleration is too
      noisy to show it; a quarter of what this changes in the mass is in its error.
    * Fails: a drive that winds up while it accelerates (its mass is some percent wrong).
    """
    if not runs:
        raise IdentificationError("no runs", "give at least one impact-free recording")
    filtered = _filtered(runs, settings, TorqueLag(settings.torque_filter_time or 0.0))
    excitation = measure_excitation(filtered)
    equations = _equations(filtered, excitation, settings)
    if len(equations.force) < _FEWEST_EQUATIONS:
        hidden = [run for run in filtered if run.is_hidden]
        if len(hidden) == len(filtered):
            raise IdentificationError(
                f"{runs[0].name}: noise or steps of speed or position hide speeds below {hidden[0].unknown_speed:.3g} "
                f"{_units(settings).speed}, and the axis is never faster",
                "map a finer channel, or log faster motion",
            )
        raise IdentificationError(
            f"{runs[0].name}: hardly any motion ({len(equations.force)} usable equations, "
            f"{excitation.moving_time:.3g} s in {counted(len(runs), 'recording')})",
            f"identification needs at least {_FEWEST_EQUATIONS}: recordings in which the axis moves",
        )
    lag = _torque_lag(equations, excitation, settings)
    if lag.is_found:
        filtered = _filtered(runs, settings, lag.lag)
        equations = _equations(filtered, excitation, settings)
    solution = _with_noise_error(_solve(equations, excitation, settings), excitation)
    levels = _levels(equations, solution.mass, excitation, settings)
    solution = replace(solution, mass_error=math.hypot(solution.mass_error, lag.mass_error), levels=levels)
    validation, prediction = _predict(filtered, excitation, settings)
    residuals = _residuals(equations, solution)
    return RigidAxisFit(
        Identified(*_answers(solution, excitation, motor_mass, settings, lag)),
        solution.mass,
        solution.mass_error,
        solution.levels,
        solution.fit.condition_number,
        excitation,
        residuals,
        friction_curve(residuals.speed, residuals.friction, equations.stroke, speed_edges(residuals.speed)),
        _position_curves(residuals, equations.stroke),
        validation,
        prediction,
        settings,
        lag.lag,
    )


def predict_force(fit: RigidAxisFit, run: AxisRun) -> FloatArray:
    """Return the force (n,) [N, N m] that the fit predicts for a run, through the fit's low-pass.

    NaN at both ends and within reach of missing samples, and in a direction that the fit did not see. Compare it with
    `low_passed_force`. Raises RecordingError without speed and position.
    """
    return fit.prediction.force(_as_fitted(fit, run))


def low_passed_force(fit: RigidAxisFit, run: AxisRun) -> FloatArray:
    """Return a run's measured force (n,) [N, N m] through the fit's low-pass; NaN as in `predict_force`."""
    return _as_fitted(fit, run).force


def _as_fitted(fit: RigidAxisFit, run: AxisRun) -> FilteredRun:
    (filtered,) = _filtered([run], fit.settings, fit.torque_lag)
    return filtered


def _filtered(runs: Sequence[AxisRun], settings: RigidAxisSettings, torque_lag: TorqueLag) -> list[FilteredRun]:
    return [filter_run(run, settings.low_pass_hz, settings.unknown_speed, torque_lag) for run in runs]


def _is_fast(run: FilteredRun) -> BoolArray:
    speed = np.abs(run.speed)
    known = speed[np.isfinite(speed)]
    fast: BoolArray = speed >= _MOVING_SHARE * float(np.quantile(known, 0.95)) if len(known) else speed > 0.0
    return fast


def _force_error(error: FloatArray, is_fast: BoolArray) -> ForceError:
    known = np.isfinite(error)
    moving = known & is_fast
    return ForceError(
        _root_mean_square(error[known]),
        _root_mean_square(error[moving]),
        int(np.count_nonzero(known)),
        int(np.count_nonzero(moving)),
    )


def _root_mean_square(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan


@dataclass(frozen=True, eq=False)
class _Equations:
    """The equations of all runs, one per average of the low-pass; arrays (m,), columns (m, 4).

    Columns: acceleration, speed, low-passed sign, 1. `instruments` has the same of the reference, or is None.
    """

    regressors: FloatArray
    instruments: FloatArray | None
    force: FloatArray
    position: FloatArray
    run: IntArray
    time: FloatArray
    stroke: IntArray
    direction: FloatArray
    filtered: Sequence[FilteredRun]
    rows: Sequence[IntArray]
    is_delayed: bool

    @property
    def block(self) -> IntArray:
        """Return the strokes as blocks (m,); they are cut where a direction has fewer than 3."""
        block = np.zeros(len(self.stroke), dtype=np.int64)
        total = 0
        for sign in (1.0, -1.0):
            strokes = np.unique(self.stroke[self.direction == sign])
            pieces = 1 if len(strokes) >= _ENOUGH_STROKES else math.ceil(_PIECES / max(len(strokes), 1))
            for stroke in strokes:
                inside = np.flatnonzero((self.stroke == stroke) & (self.direction == sign))
                block[inside] = total + np.arange(len(inside)) * pieces // len(inside)
                total += pieces
        return block


def _delay(run: FilteredRun) -> int:
    """Return the delay [samples] after which two outputs of the low-pass share no sample."""
    return 2 * run.low_pass.reach + 1


def _columns(acceleration: FloatArray, speed: FloatArray, sign: FloatArray) -> FloatArray:
    return np.column_stack((acceleration, speed, sign, np.ones(len(speed))))


def _instruments(run: FilteredRun, columns: FloatArray, method: Method | None) -> FloatArray | None:
    """Return the instruments (n, 4): from the reference, or from the delayed columns (n, 4); None for least squares."""
    if method is Method.LEAST_SQUARES:
        return None
    if run.reference_speed is not None and run.reference_acceleration is not None and run.reference_sign is not None:
        return _columns(run.reference_acceleration, run.reference_speed, run.low_pass.value(run.reference_sign))
    if method is Method.INSTRUMENTAL_VARIABLES:
        delayed = np.full_like(columns, np.nan)
        delay = _delay(run)
        if delay < len(columns):
            usable = np.where(run.usable[:, None], columns, np.nan)
            delayed[delay:] = usable[:-delay]
        return delayed
    return None


def _is_noisy(excitation: Excitation) -> bool:
    return excitation.acceleration_noise > _NOISY * excitation.acceleration


def _equations(filtered: Sequence[FilteredRun], excitation: Excitation, settings: RigidAxisSettings) -> _Equations:
    columns = [_columns(run.acceleration, run.speed, run.low_pass.value(run.sign)) for run in filtered]
    have_reference = all(run.reference_speed is not None for run in filtered)
    preferred = Method.LEAST_SQUARES
    if have_reference or _is_noisy(excitation):
        preferred = Method.INSTRUMENTAL_VARIABLES
    method = settings.method or preferred
    if method is Method.INSTRUMENTAL_VARIABLES and not have_reference:
        filtered = [replace(run, reference_speed=None, inner_reference_speed=None) for run in filtered]
    instruments = [_instruments(run, column, method) for run, column in zip(filtered, columns, strict=True)]
    main = 1.0 if excitation.forward_share >= 0.5 else -1.0
    rows = []
    for run, given in zip(filtered, instruments, strict=True):
        usable = run.usable.copy()
        if given is not None:
            usable &= np.isfinite(given).all(axis=1)
        if excitation.is_one_way:
            usable &= np.sign(run.inner_speed) == main
        usable[np.arange(len(usable)) % run.low_pass.steps != 0] = False
        rows.append(np.flatnonzero(usable))
    offsets = np.cumsum([0] + [int(run.stroke.max(initial=-1)) + 1 for run in filtered])

    def gather(values: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([item[chosen] for item, chosen in zip(values, rows, strict=True)])

    given_rows = [item for item in instruments if item is not None]
    return _Equations(
        gather(columns),
        gather(given_rows) if len(given_rows) == len(filtered) else None,
        gather([run.force for run in filtered]),
        gather([run.position for run in filtered]),
        np.repeat(np.arange(len(rows)), [len(item) for item in rows]),
        gather([run.run.time for run in filtered]),
        np.concatenate([run.stroke[item] + first for run, item, first in zip(filtered, rows, offsets, strict=False)]),
        np.sign(gather([run.inner_speed for run in filtered])),
        filtered,
        rows,
        method is Method.INSTRUMENTAL_VARIABLES and not have_reference,
    )


@dataclass(frozen=True)
class _LagAnswer:
    """The lag of the torque, stated or found, and the standard error of the mass that comes from it."""

    lag: TorqueLag
    mass_error: float = 0.0
    is_found: bool = False


def _torque_lag(equations: _Equations, excitation: Excitation, settings: RigidAxisSettings) -> _LagAnswer:
    stated = _LagAnswer(TorqueLag(settings.torque_filter_time or 0.0))
    if _is_noisy(excitation) or Missing.ACCELERATION in excitation.missing:
        return stated
    chosen = _chosen_columns(excitation)
    motions = [
        MotionColumns(run, _columns(run.acceleration, run.speed, run.low_pass.value(run.sign))[:, chosen], rows)
        for run, rows in zip(equations.filtered, equations.rows, strict=True)
    ]
    try:
        apparent = apparent_lag(motions, equations.block)
        if settings.torque_filter_time is not None or not apparent.is_certain:
            return replace(stated, mass_error=_LAG_LEFT * abs(apparent.mass_change))
        lag = best_lag(motions)
    except IdentificationError:
        return stated
    # The mass is changed by the lag that was found, in proportion to the part of it that the least squares see.
    change = apparent.mass_change * max(lag.time / apparent.time, 1.0)
    return _LagAnswer(lag, _LAG_FORM * abs(change), is_found=True)


@dataclass(frozen=True, eq=False)
class _AxisSolution:
    """The fit whose coefficients are reported: mass, viscous if `has_viscous`, Coulomb, and constant if two-way."""

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


def _solve(equations: _Equations, excitation: Excitation, settings: RigidAxisSettings) -> _AxisSolution:
    base = (0, 1, 2) if excitation.is_one_way else (0, 1, 2, 3)
    if len(excitation.speeds) >= SPEEDS_NEEDED:
        return _solution(equations, base, settings)
    without = _solution(equations, _chosen_columns(excitation), settings)
    try:
        whole = _solution(equations, base, settings)
    except IdentificationError:
        return without
    viscous, _ = whole.value(viscous=1.0)
    if viscous <= 0.0:
        return without
    # The viscous share of the friction lies between nothing and all of it.
    levels = _levels(equations, without.mass, excitation, settings)
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


def _regress(
    equations: _Equations, regressors: FloatArray, instruments: FloatArray | None, settings: RigidAxisSettings
) -> tuple[LinearFit, Method]:
    """Fit by instrumental variables; if the references do not move as the axis does, by least squares."""
    if instruments is not None:
        try:
            fit = fit_linear(regressors, equations.force, instruments, settings.loss)
            return fit, Method.INSTRUMENTAL_VARIABLES
        except IdentificationError:
            if settings.method is Method.INSTRUMENTAL_VARIABLES:
                raise
    return fit_linear(regressors, equations.force, None, settings.loss), Method.LEAST_SQUARES


def _covariance(equations: _Equations, fit: LinearFit, settings: RigidAxisSettings) -> FloatArray:
    along = profile_covariance(
        fit.influence, fit.residuals, equations.position, equations.direction, seed=settings.seed
    )
    return block_covariance(fit, equations.block) + along


def _solution(equations: _Equations, chosen: Sequence[int], settings: RigidAxisSettings) -> _AxisSolution:
    columns = list(chosen)
    instruments = None if equations.instruments is None else equations.instruments[:, columns]
    fit, method = _regress(equations, equations.regressors[:, columns], instruments, settings)
    covariance = _covariance(equations, fit, settings)
    plain = _AxisSolution(fit, covariance, math.nan, math.nan, tuple(_NAMES[item] for item in columns), method)
    mass, mass_error = plain.value(mass=1.0)
    return replace(plain, mass=mass, mass_error=mass_error)


def _levels(
    equations: _Equations, mass: float, excitation: Excitation, settings: RigidAxisSettings
) -> tuple[FrictionLevel, ...]:
    speed, friction = np.abs(equations.regressors[:, 1]), equations.force - mass * equations.regressors[:, 0]
    nominal = excitation.speeds[-1] if excitation.speeds else excitation.highest_speed
    levels = []
    for direction in (1, -1):
        inside = (equations.direction == direction) & (np.abs(speed - nominal) <= SAME_SPEED * nominal)
        if not np.any(inside):
            continue
        fit = fit_linear(np.full((np.count_nonzero(inside), 1), float(direction)), friction[inside])
        along = equations.position[inside], equations.direction[inside]
        variance = block_covariance(fit, equations.block[inside])
        variance += profile_covariance(fit.influence, fit.residuals, *along, seed=settings.seed)
        error = math.sqrt(variance[0, 0]) if variance[0, 0] >= 0.0 else math.nan
        levels.append(FrictionLevel(direction, float(np.mean(speed[inside])), float(fit.coefficients[0]), error))
    return tuple(levels)


def _is_certain(value: float, error: float, most: float) -> bool:
    """Whether a value is above 0 with at most that relative standard error."""
    return value > 0.0 and error <= most * value


@dataclass(frozen=True)
class _Units:
    mass: str
    viscous: str
    force: str
    speed: str


_LINEAR = _Units("kg", "N s/m", "N", "m/s")
_ROTARY = _Units("kg m2", "N m s/rad", "N m", "rad/s")


def _units(settings: RigidAxisSettings) -> _Units:
    return _ROTARY if settings.rotary else _LINEAR


def _answers(
    solution: _AxisSolution, excitation: Excitation, motor_mass: float, settings: RigidAxisSettings, lag: _LagAnswer
) -> tuple[tuple[Estimate, ...], tuple[NotIdentifiable, ...]]:
    units = _units(settings)
    answers = [
        _load_mass(solution, excitation, motor_mass, units),
        _viscous(solution, excitation, units),
        *_coulomb(solution, excitation, units),
        *((_torque_filter(lag, solution.method),) if lag.is_found else ()),
    ]
    estimates = tuple(replace(item, joint=settings.joint) for item in answers if isinstance(item, Estimate))
    others = tuple(replace(item, joint=settings.joint) for item in answers if isinstance(item, NotIdentifiable))
    return estimates, others


def _torque_filter(lag: _LagAnswer, method: Method) -> Estimate:
    return Estimate("model.sensors", "torque_filter_time", lag.lag.time, _LAG_FORM * lag.lag.time, "s", method)


def _load_mass(
    solution: _AxisSolution, excitation: Excitation, motor_mass: float, units: _Units
) -> Estimate | NotIdentifiable:
    load, error = solution.mass - motor_mass, solution.mass_error
    is_accelerated = Missing.ACCELERATION not in excitation.missing
    if is_accelerated and _is_certain(load, error, _MASS_ERROR):
        return Estimate("machine", "load_mass", load, error, units.mass, solution.method)
    numbers = {
        "total_mass": solution.mass,
        "standard_error": error,
        "motor_mass": motor_mass,
        "acceleration": excitation.acceleration,
        "acceleration_noise": excitation.acceleration_noise,
    }
    missing = [Missing.ACCELERATION]
    if _is_noisy(excitation):
        missing.append(Missing.FINER_MOTION)
    if is_accelerated and load < error and _is_certain(solution.mass, error, 0.5 * _MASS_ERROR):
        # The total is known; that the motor alone has as much is a question of the motor's inertia.
        missing = [Missing.MOTOR_INERTIA]
    elif math.isinf(error):
        missing.append(Missing.MORE_RECORDINGS)
    return NotIdentifiable("machine", "load_mass", tuple(missing), numbers)


def _speed_numbers(solution: _AxisSolution, excitation: Excitation) -> dict[str, float]:
    numbers = {
        "speeds": float(len(excitation.speeds)),
        "speeds_needed": float(SPEEDS_NEEDED),
        "condition_number": solution.fit.condition_number,
    }
    for level in solution.levels:
        side = "forward" if level.direction > 0 else "backward"
        numbers |= {f"{side}_speed": level.speed, f"{side}_friction": level.force}
    return numbers


def _viscous(solution: _AxisSolution, excitation: Excitation, units: _Units) -> Estimate | NotIdentifiable:
    numbers = _speed_numbers(solution, excitation)
    if "viscous" in solution.names:
        value, error = solution.value(viscous=1.0)
        if _is_certain(value, error, _VISCOUS_ERROR):
            return Estimate("machine", "viscous_friction", value, error, units.viscous, solution.method)
        numbers |= {"value": value, "standard_error": error}
        return NotIdentifiable("machine", "viscous_friction", (Missing.MORE_RECORDINGS,), numbers)
    return NotIdentifiable("machine", "viscous_friction", (Missing.SECOND_SPEED,), numbers)


_COULOMB_KEYS = (
    ("machine", "coulomb_friction", {"coulomb": 1.0}),
    ("model.friction", "coulomb_forward", {"coulomb": 1.0, "constant": 1.0}),
    ("model.friction", "coulomb_backward", {"coulomb": 1.0, "constant": -1.0}),
)


def _coulomb(solution: _AxisSolution, excitation: Excitation, units: _Units) -> list[Estimate | NotIdentifiable]:
    missing = [Missing.SECOND_SPEED] if "viscous" not in solution.names else []
    missing += [Missing.REVERSALS] if excitation.is_one_way else []
    numbers = {**_speed_numbers(solution, excitation), "forward_share": excitation.forward_share}
    answers: list[Estimate | NotIdentifiable] = []
    for section, key, shares in _COULOMB_KEYS:
        value, error = solution.value(**shares)
        if not missing and _is_certain(value, error, _COULOMB_ERROR):
            answers.append(Estimate(section, key, value, error, units.force, solution.method))
            continue
        uncertain = {} if missing else {"value": value, "standard_error": error}
        needed = tuple(missing) or (Missing.MORE_RECORDINGS,)
        answers.append(NotIdentifiable(section, key, needed, numbers | uncertain))
    value, error = solution.value(constant=1.0)
    if excitation.is_one_way or not math.isfinite(error):
        needed = (Missing.REVERSALS,) if excitation.is_one_way else (Missing.MORE_RECORDINGS,)
        answers.append(NotIdentifiable("machine", "constant_force", needed, numbers))
    else:
        answers.append(Estimate("machine", "constant_force", value, error, units.force, solution.method))
    return answers


def _residuals(equations: _Equations, solution: _AxisSolution) -> Residuals:
    acceleration = equations.regressors[:, 0]
    return Residuals(
        equations.run,
        equations.time,
        equations.position,
        equations.regressors[:, 1],
        acceleration,
        equations.force,
        equations.force - solution.mass * acceleration,
        solution.fit.residuals,
    )


def _position_curves(residuals: Residuals, stroke: IntArray) -> dict[int, FrictionCurve]:
    edges = np.linspace(residuals.position.min(), residuals.position.max(), 51)
    curves = {}
    for direction in (1, -1):
        inside = np.sign(residuals.speed) == direction
        if np.any(inside) and edges[-1] > edges[0]:
            curves[direction] = friction_curve(
                residuals.position[inside], residuals.residual[inside], stroke[inside], edges
            )
    return curves


@dataclass(frozen=True, eq=False)
class _Samples:
    """What a prediction is fitted to and checked on: rows (m,) of all runs, near zero speed included."""

    force: FloatArray
    acceleration: FloatArray
    is_moving: BoolArray
    is_fast: BoolArray
    fold: IntArray
    columns: dict[FrictionShape, FloatArray]

    def fitted(self, form: FrictionForm, chosen: BoolArray, loss: ResidualLoss) -> PredictionModel | None:
        """Return the model of a form with the smallest residual in the chosen rows; None with too few of them."""
        best, smallest = None, math.inf
        rows = chosen & self.is_moving
        for shape, columns in self.columns.items():
            if shape.form is not form:
                continue
            regressors = np.column_stack((self.acceleration, columns))[rows]
            try:
                fit = fit_linear(*_with_knot_weights(regressors, self.force[rows], shape), loss=loss)
            except IdentificationError:
                continue
            cost = float(np.sum(fit.weights * fit.residuals**2))
            if cost < smallest:
                smallest = cost
                best = PredictionModel(shape, float(fit.coefficients[0]), fit.coefficients[1:])
        return best

    def error(self, model: PredictionModel) -> FloatArray:
        """Return the error of the predicted force (m,)."""
        error: FloatArray = model.mass * self.acceleration + self.columns[model.shape] @ model.coefficients - self.force
        return error


def _with_knot_weights(
    regressors: FloatArray, force: FloatArray, shape: FrictionShape
) -> tuple[FloatArray, FloatArray]:
    """Add an equation per pair of neighbouring knots, so that knots without data follow the others."""
    if shape.form is not FrictionForm.SPLINE:
        return regressors, force
    knots = (regressors.shape[1] - 1) // len(shape.directions)
    weight = math.sqrt(_KNOT_WEIGHT * max(len(force), 1))
    pairs = np.kron(np.eye(len(shape.directions)), weight * np.diff(np.eye(knots), axis=0))
    pairs = np.column_stack((np.zeros(len(pairs)), pairs))
    return np.vstack((regressors, pairs)), np.concatenate((force, np.zeros(len(pairs))))


def _predict(
    filtered: Sequence[FilteredRun], excitation: Excitation, settings: RigidAxisSettings
) -> tuple[CrossValidation | None, PredictionModel]:
    samples = _samples(filtered, excitation)
    validation = _cross_validate(samples, filtered, settings) if settings.cross_validate else None
    form = settings.prediction or (validation.best if validation else FrictionForm.COULOMB_VISCOUS)
    # One speed and no reversal leave a viscous share that is not defined: the spline is constant there.
    everything = np.ones(len(samples.force), dtype=np.bool_)
    model = samples.fitted(form, everything, settings.loss)
    model = model or samples.fitted(FrictionForm.SPLINE, everything, settings.loss)
    if model is None:
        raise IdentificationError(
            f"{filtered[0].run.name}: the force cannot be described by the motion",
            "the recordings need more varied motion",
        )
    return validation, model


def _cross_validate(
    samples: _Samples, filtered: Sequence[FilteredRun], settings: RigidAxisSettings
) -> CrossValidation | None:
    """Return the errors of the forms that every fold can be predicted with; None with a single fold."""
    folds = np.unique(samples.fold)
    errors: dict[FrictionForm, ForceError] = {}
    for form in FrictionForm if len(folds) > 1 else ():
        error = np.full(len(samples.force), np.nan)
        for fold in folds:
            model = samples.fitted(form, samples.fold != fold, settings.loss)
            if model is None:
                break
            error[samples.fold == fold] = samples.error(model)[samples.fold == fold]
        else:
            errors[form] = _force_error(error, samples.is_fast)
    return CrossValidation(errors, len(folds), *_repeat_floor(filtered)) if errors else None


def _samples(filtered: Sequence[FilteredRun], excitation: Excitation) -> _Samples:
    main = 1 if excitation.forward_share >= 0.5 else -1
    directions = (main,) if excitation.is_one_way else (1, -1)
    highest = excitation.highest_speed
    shapes = [FrictionShape(form, highest, directions=directions) for form in FrictionForm]
    shapes = [item for item in shapes if item.form is not FrictionForm.STRIBECK]
    shapes += [FrictionShape(FrictionForm.STRIBECK, highest, share * highest, directions) for share in _STRIBECK_SHARES]
    rows = []
    for run in filtered:
        chosen = run.complete.copy()
        if excitation.is_one_way:
            weight = run.low_pass.value(np.maximum(-main * run.sign, 0.0))
            chosen &= np.nan_to_num(weight) <= _UNLEARNED_WEIGHT
        chosen[np.arange(len(chosen)) % run.low_pass.steps != 0] = False
        rows.append(np.flatnonzero(chosen))

    def gather(values: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([item[chosen] for item, chosen in zip(values, rows, strict=True)])

    if len(filtered) > 1:
        folds = np.concatenate([np.full(len(item), run % _MOST_FOLDS) for run, item in enumerate(rows)])
    else:
        stroke = np.maximum.accumulate(filtered[0].stroke)[rows[0]]
        folds = np.maximum(stroke, 0) % _MOST_FOLDS
    return _Samples(
        gather([run.force for run in filtered]),
        gather([run.acceleration for run in filtered]),
        gather([run.moving.astype(np.float64) for run in filtered]) > 0.0,
        gather([_is_fast(run).astype(np.float64) for run in filtered]) > 0.0,
        folds,
        {shape: gather([shape.columns(run) for run in filtered]) for shape in shapes},
    )


def _repeat_floor(filtered: Sequence[FilteredRun]) -> tuple[float, int]:
    """Return the standard deviation of the force between strokes that repeat each other, and their number.

    Strokes repeat each other if direction, duration and travel agree; they are aligned by their speeds.
    """
    groups: list[list[tuple[float, FloatArray, FloatArray]]] = []
    for run in filtered:
        for number in range(int(run.stroke.max(initial=-1)) + 1):
            inside = np.flatnonzero((run.stroke == number) & np.isfinite(run.force + run.speed))
            if not len(inside):
                continue
            span = slice(inside[0], inside[-1] + 1)
            force, speed = run.force[span], run.speed[span]
            if np.isfinite(force + speed).all() and len(force) > 8 * run.low_pass.reach:
                _join(groups, (run.run.period, force, speed))
    squares, degrees, members = 0.0, 0, 0
    for group in groups:
        if len(group) < 2:
            continue
        aligned = _aligned(group)
        squares += float(np.sum((aligned - aligned.mean(axis=0)) ** 2))
        degrees += (len(aligned) - 1) * aligned.shape[1]
        members += len(aligned)
    return (math.sqrt(squares / degrees), members) if degrees else (math.nan, 0)


def _join(
    groups: list[list[tuple[float, FloatArray, FloatArray]]], stroke: tuple[float, FloatArray, FloatArray]
) -> None:
    """Add a stroke to the first group that it repeats, or to a new one."""
    period, _, speed = stroke
    for group in groups:
        other_period, _, other = group[0]
        same_length = abs(len(speed) - len(other)) <= _SAME_STROKE * len(other)
        travel, other_travel = float(np.sum(speed)), float(np.sum(other))
        if period == other_period and same_length and abs(travel - other_travel) <= _SAME_STROKE * abs(other_travel):
            group.append(stroke)
            return
    groups.append([stroke])


def _aligned(group: Sequence[tuple[float, FloatArray, FloatArray]]) -> FloatArray:
    """Return the forces (strokes, n) of a group, shifted so that the speeds fit those of the first."""
    lengths = [len(speed) for _, _, speed in group]
    margin = max(lengths) - min(lengths) + _ALIGNED_WITHIN
    first = group[0][2][margin : min(lengths) - margin]
    rows = []
    for _, force, speed in group:
        shifts = range(2 * margin + 1 + len(speed) - min(lengths))
        shifts = range(min(len(shifts), len(speed) - len(first) + 1))
        best = min(shifts, key=lambda shift: float(np.sum((speed[shift : shift + len(first)] - first) ** 2)))
        rows.append(force[best : best + len(first)])
    return np.vstack(rows)
