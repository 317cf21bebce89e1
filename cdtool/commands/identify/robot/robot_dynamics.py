"""Friction, drive inertias and base parameters of a robot or planar arm by weighted least squares.

The equation of motion M a + C v + g + friction = tau (contact-free) is linear in its parameters. It is used in its
filtered, weak form: multiplied by a smooth window w(t) and integrated by parts,

    -int w' p dt + int w (g - C'v + friction) dt = int w tau dt,      p = M v

so that no acceleration is needed (Shinbrot, 1957; modulating functions). A window that meets a gap is no equation. Each
joint's equations are weighted by its residual. Residuals are coloured: the standard errors come from leaving out blocks
of the log, longer than the residuals are correlated (jackknife; MacKinnon and White, 1985).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import UsageError
from cdtool.commands.identify.estimate import (
    Estimate,
    IdentificationError,
    Identified,
    Method,
    Missing,
    NotIdentifiable,
)
from cdtool.commands.identify.robot.base_parameters import (
    BaseParameterSet,
    Grouping,
    column_scale,
    condition_number,
    group_columns,
    independent_norms,
    random_rows,
)
from cdtool.commands.identify.robot.robot_regressor import (
    ColumnGroup,
    Regressor,
    RegressorColumn,
    regressor_of,
)
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.urdf_robot import UrdfRobot

Index = npt.NDArray[np.int64]

# A window reaches this far to either side of its centre [s]: it passes the motion of robots, up to about 5 Hz.
HALF_WIDTH = 0.1
# Directions of the parameters that are excited less than this, relative to the most, keep the machine's values.
_UNSEEN = 1e-9
# A column of a joint that is independent of the others to less than this share of what it is in random motion is not
# excited.
_EXCITED = 0.1
# The standard error of an inertial parameter, or of all together, may make this share of a joint's torque in random
# motion.
_UNCERTAIN_TORQUE = 0.1
# Fewer blocks are no sample.
_FEWEST_BLOCKS = 8
# From this number on, the spread between runs is the error.
FEWEST_RUNS = 3
# Parts of a log of which each is predicted from the others: a fifth still holds some strokes.
_FOLDS = 5
_UNITS = {
    ColumnGroup.DRIVE_INERTIA: ("kg m2", "kg"),
    ColumnGroup.VISCOUS: ("N m s/rad", "N s/m"),
    ColumnGroup.COULOMB: ("N m", "N"),
    ColumnGroup.CONSTANT: ("N m", "N"),
}
_NOT_NEGATIVE = (ColumnGroup.DRIVE_INERTIA, ColumnGroup.VISCOUS, ColumnGroup.COULOMB)


# The groups of columns that are free unless stated otherwise.
FRICTION = frozenset((ColumnGroup.VISCOUS, ColumnGroup.COULOMB, ColumnGroup.CONSTANT))


@dataclass(frozen=True, eq=False)
class LeftOutTorque:
    """Torque (m,) [N m, N] that the model does not explain in parts of the log left out of the identification.

    `residual` with the parameters from the other parts, `previous` with the machine's own. `joints`, `blocks` (m,): the
    joint, and the block of the log, longer than the residual is correlated, of each window. Two fits of the same runs
    have the same windows.
    """

    residual: FloatArray
    previous: FloatArray
    joints: Index
    blocks: Index

    def error(self, joint: int, is_previous: bool = False) -> float:
        """Return the RMS of the residuals of a joint [N m, N]; NaN for one without motion."""
        own = (self.previous if is_previous else self.residual)[self.joints == joint]
        return _rms(own) if len(own) else math.nan

    def gain(self, joint: int, other: LeftOutTorque | None = None) -> float:
        """Return by how many standard errors a joint's squared residual is below another model's, or the machine's own.

        They are those between blocks; 0 with fewer than eight, which are no sample.
        """
        own = self.joints == joint
        than = self.previous[own] if other is None else other.residual[own]
        blocks = np.unique(self.blocks[own], return_inverse=True)[1].ravel()
        sums = np.bincount(blocks, weights=than**2 - self.residual[own] ** 2)
        if len(sums) < _FEWEST_BLOCKS:
            return 0.0
        return float(sums.mean()) / max(float(sums.std(ddof=1)) / math.sqrt(len(sums)), 1e-300)


@dataclass(frozen=True, eq=False)
class Equations:
    """Weighted equations of the runs: `rows` (m, B) of the base parameters, `torques` (m,), both times the weight.

    `joints`, `times` [s], `runs` (m,): the joint, the window's centre and the index of the run of each. `rigid` (m,):
    the torque of the links, of which the inertias are taken as known; 0 where they are free. `averages` (m, 4), without
    weight: torque, that of inertia and gravity by the machine's own parameters, speed, position.
    """

    rows: FloatArray
    torques: FloatArray
    joints: FloatArray
    times: FloatArray
    runs: FloatArray
    rigid: FloatArray
    averages: FloatArray

    def where(self, chosen: BoolArray) -> Equations:
        """Return the chosen (m,) equations."""
        return Equations(*(values[chosen] for values in vars(self).values()))


@dataclass(frozen=True, eq=False)
class RobotFit:
    """The identified model of a robot.

    `parameters` (P,): every column of the regressor, those not identified as in the machine; `base` and its `grouping`
    for all free columns; `condition_number` of the scaled equations; `equations`, times the `weights` (J,) of the
    joints, for what further restricts the parameters; `machine` as it was.
    """

    machine: CoupledMachine
    parameters: FloatArray
    columns: tuple[RegressorColumn, ...]
    grouping: Grouping
    base: BaseParameterSet
    identified: Identified
    left_out: LeftOutTorque
    condition_number: float
    equations: Equations
    weights: FloatArray


def identify_robot(
    runs: Sequence[RobotRun],
    machine: CoupledMachine,
    free_groups: frozenset[ColumnGroup] = FRICTION,
    half_width: float = HALF_WIDTH,
) -> RobotFit:
    """Return the free parameters of a robot from contact-free runs.

    `machine`: the robot with its own parameters, of which those that are not free are taken as known. `half_width` [s]:
    of the window, a zero-phase low-pass of about 0.5 / half_width Hz; at least ten samples. Coulomb friction
    has the machine's shape: tanh with its coulomb_slope, else a sign above its stick_speed. A parameter that these runs
    do not determine is a NotIdentifiable: its column is not independent of the others in this motion, or its standard
    error makes more than a tenth (of friction and drive: half) of a joint's torque in random motion. The full set of
    base parameters must also have a condition number of at most 100. Raises IdentificationError without any motion,
    UsageError for another machine.
    """
    regressor = regressor_of(machine)
    free = tuple(i for i, column in enumerate(regressor.columns) if column.group in free_groups)
    grouping = group_columns(regressor, free)
    known = regressor.values
    start = grouping.combination @ known[list(free)]
    bounded = _bounds(regressor.columns, grouping)
    solution = _Solution.of(
        windows_of(runs, regressor, grouping.base, free_groups, half_width), start, bounded, len(machine.joints)
    )
    equations = solution.equations
    parameters = known.copy()
    parameters[list(grouping.base)] += solution.values - start
    base = _base_set(runs, regressor, grouping, solution)
    condition = condition_number(equations.rows)
    judge = _Judge(runs, machine, regressor.columns, grouping, base, condition, solution)
    left_out = _left_out(solution, start, bounded)
    return RobotFit(
        machine=machine,
        parameters=parameters,
        columns=regressor.columns,
        grouping=grouping,
        base=base,
        identified=judge.outcome(),
        left_out=left_out,
        condition_number=condition,
        equations=equations,
        weights=solution.weights,
    )


def joint_estimates(fit: RobotFit, joint: int, method: Method) -> tuple[tuple[Estimate, ...], tuple[Estimate, ...]]:
    """Return friction and constant force of a joint as fitted: those that are identifiable, and the others.

    The others belong to the values of all joints: together they describe the runs. They have no standard error.
    """
    errors = {(item.key, item.joint): item.standard_error for item in fit.identified.estimates}
    known: list[Estimate] = []
    together: list[Estimate] = []
    for group in (ColumnGroup.VISCOUS, ColumnGroup.COULOMB, ColumnGroup.CONSTANT):
        columns = [i for i, column in enumerate(fit.columns) if column.group is group]
        value = float(fit.parameters[columns[joint]])
        error = errors.get((group.value, joint), math.nan)
        unit = _UNITS[group][is_prismatic(fit.machine, joint)]
        estimate = Estimate("machine", group.value, value, error, unit, method, joint)
        (known if math.isfinite(error) else together).append(estimate)
    return tuple(known), tuple(together)


@dataclass(frozen=True, eq=False)
class Window:
    """w, and its derivative [1/s], on the samples of a run; `step` between two windows [samples]."""

    weights: FloatArray
    slope: FloatArray
    step: int

    @classmethod
    def of(cls, half_width: float, period: float) -> Window:
        """(1 - x^2)^4: its first three derivatives are continuous, so that sums are integrals to rounding."""
        # With fewer samples on either side of its centre its sums are no integrals.
        half = max(10, round(half_width / period))
        x = np.arange(-half, half + 1) / half
        shape = (1.0 - x**2) ** 4
        slope = -8.0 * x * (1.0 - x**2) ** 3 / (half * period)
        total = float(shape.sum())
        return cls(shape / total, slope / total, max(1, half // 2))

    def average(self, values: FloatArray) -> FloatArray:
        """Return int w x dt (K, J)."""
        return self._sum(values, self.weights)

    def rate(self, values: FloatArray) -> FloatArray:
        """Return int w dx/dt dt = -int w' x dt (K, J)."""
        return self._sum(values, -self.slope)

    def _sum(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        if len(values) < len(weights):
            return np.empty((0, values.shape[1]))
        windows = np.lib.stride_tricks.sliding_window_view(values, len(weights), axis=0)[:: self.step]
        return np.asarray(windows @ weights)


def windows_of(
    runs: Sequence[RobotRun],
    regressor: Regressor,
    columns: Sequence[int],
    free: frozenset[ColumnGroup],
    half_width: float,
) -> Equations:
    """Return all equations, unweighted; what is not free is subtracted. Raises IdentificationError, UsageError."""
    machine, parts = regressor.machine, []
    for index, run in enumerate(runs):
        if run.joint_count != len(machine.joints):
            raise UsageError(f"{run.name}: {run.joint_count} joints", f"the machine has {len(machine.joints)}")
        window = Window.of(half_width, run.period)
        own = _rigid_torque(run, machine, window)
        rigid = own * (ColumnGroup.INERTIAL not in free)
        averages = window.average(run.torque), own, window.average(run.speed), window.average(run.position)
        torque = averages[0] - rigid - _known_torque(run, regressor, window, free)
        rows = np.stack([_window_of_column(run, regressor, window, column) for column in columns], axis=2)
        rests = window.average(run.slow(machine.stick_speed).astype(np.float64)) > 0.0
        valid = ~rests & np.isfinite(torque) & np.isfinite(rows).all(axis=2)
        place, joint = np.nonzero(valid)
        times = run.start + run.period * (place * window.step + len(window.weights) // 2)
        parts.append(
            (
                rows[valid],
                torque[valid],
                joint.astype(np.float64),
                times,
                np.full(len(place), 1.0 * index),
                rigid[valid],
                np.stack(averages, axis=2)[valid],
            )
        )
    if not any(len(part[1]) for part in parts):
        raise IdentificationError(
            "no joint moves in these runs for longer than a window", "use runs with motion, without contact"
        )
    return Equations(*(np.concatenate(item) for item in zip(*parts, strict=True)))


def _window_of_column(run: RobotRun, regressor: Regressor, window: Window, column: int) -> FloatArray:
    """Return the windows (K, J) of a column of the regressor: int -w' p + w h dt."""
    momentum, rest = regressor.momentum(column, run.position, run.speed)
    return window.rate(momentum) + window.average(rest)


def _rigid_torque(run: RobotRun, machine: CoupledMachine, window: Window) -> FloatArray:
    """Return the windows' torques (K, J) of inertia and gravity, drives included."""
    momentum, velocity_force, gravity = machine.momentum_terms(run.position, run.speed)
    return window.rate(momentum) + window.average(gravity - velocity_force)


def _known_torque(run: RobotRun, regressor: Regressor, window: Window, free: frozenset[ColumnGroup]) -> FloatArray:
    """Return the windows' torques (K, J) of friction and drives that are not free, beside those of _rigid_torque."""
    values = regressor.values
    total = np.zeros_like(window.average(run.position))
    for column, item in enumerate(regressor.columns):
        # The machine's momentum contains its drives.
        contained = item.group is ColumnGroup.DRIVE_INERTIA and ColumnGroup.INERTIAL not in free
        factor = (0.0 if item.group in free else 1.0) - (1.0 if contained else 0.0)
        if item.group is not ColumnGroup.INERTIAL and values[column] and factor:
            total += factor * values[column] * _window_of_column(run, regressor, window, column)
    return total


def _joint_weights(equations: Equations, start: FloatArray, count: int) -> FloatArray:
    """Return 1 / RMS residual of each joint (J,), of at least a thousandth of its torque: no sensor is better."""
    joints = equations.joints.astype(np.int64)
    weights = np.ones(count)
    for _ in range(3):  # passes of reweighting
        residual = equations.torques - equations.rows @ _solve(_weighted(equations, weights[joints]), start)
        for joint in np.unique(joints).tolist():
            own = joints == joint
            least = 1e-3 * _rms(equations.torques[own])  # no torque sensor is better
            weights[joint] = 1.0 / max(_rms(residual[own]), least, 1e-300)
    return weights


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _bounds(columns: tuple[RegressorColumn, ...], grouping: Grouping) -> BoolArray:
    """Return which base parameters cannot be negative (B,): those of drive and friction that stand alone."""
    alone = [columns[item].group in _NOT_NEGATIVE and grouping.is_alone(item) for item in grouping.base]
    return np.array(alone, dtype=np.bool_)


@dataclass(frozen=True, eq=False)
class _Solution:
    """Weighted least squares: `values` (B,), `unbounded` before negative ones became 0, `covariance` (B, B)."""

    equations: Equations
    weights: FloatArray
    values: FloatArray
    unbounded: FloatArray
    covariance: FloatArray
    blocks: Index

    @property
    def block_count(self) -> int:
        """Return the number of blocks."""
        return int(self.blocks.max()) + 1

    @classmethod
    def of(cls, plain: Equations, start: FloatArray, is_bounded: BoolArray, joint_count: int) -> _Solution:
        weights = _joint_weights(plain, start, joint_count)
        equations = _weighted(plain, weights[plain.joints.astype(np.int64)])
        unbounded = _solve(equations, start)
        values = _not_negative(equations, start, unbounded, is_bounded)
        blocks = jackknife_blocks(equations, equations.torques - equations.rows @ unbounded)
        covariance = jackknife_covariance(equations, unbounded, blocks)
        return cls(equations, weights, values, unbounded, covariance, blocks)


def _weighted(plain: Equations, weights: FloatArray) -> Equations:
    rows, torques, rigid = plain.rows * weights[:, np.newaxis], plain.torques * weights, plain.rigid * weights
    return replace(plain, rows=rows, torques=torques, rigid=rigid)


def _whitening(rows: FloatArray) -> FloatArray:
    """Return W (B, r) with W W' = (Y'Y)^-1, so that Y W is orthonormal; without directions that Y does not contain."""
    scale = column_scale(rows)
    upper = np.linalg.qr(rows * scale, mode="r")
    _, values, right = np.linalg.svd(upper, full_matrices=False)
    seen = values > _UNSEEN * max(float(values[0]), 1e-300)
    return np.asarray(scale[:, np.newaxis] * right[seen].T / values[seen])


def _solve(equations: Equations, start: FloatArray) -> FloatArray:
    """Return the parameters (B,); directions that the equations do not contain stay as at the start."""
    scale = column_scale(equations.rows)
    rest = equations.torques - equations.rows @ start
    # The triangle has the same solution, in a fraction of the time.
    upper: FloatArray = np.asarray(np.linalg.qr(np.column_stack((equations.rows * scale, rest)), mode="r"))
    change = np.linalg.lstsq(upper[:, :-1], upper[:, -1], rcond=_UNSEEN)[0]
    return np.asarray(start + scale * change)


def _not_negative(equations: Equations, start: FloatArray, unbounded: FloatArray, is_bounded: BoolArray) -> FloatArray:
    """Return the parameters with those that must not be negative at 0, one after another, the others fitted again."""
    values, fixed = unbounded, np.zeros(len(start), dtype=np.bool_)
    while True:
        below = is_bounded & ~fixed & (values < 0.0)
        if not below.any():
            return values
        fixed |= below
        reduced = replace(equations, rows=equations.rows[:, ~fixed])
        values = np.zeros(len(start))
        values[~fixed] = _solve(reduced, start[~fixed])


def jackknife_blocks(equations: Equations, residual: FloatArray) -> Index:
    """Return the number of the block of each equation (m,): a time of one run, longer than residuals are correlated."""
    length, duration = 0.0, 0.0
    for run in np.unique(equations.runs):
        own = equations.runs == run
        duration += float(np.ptp(equations.times[own]))
        for joint in np.unique(equations.joints[own]):
            chosen = own & (equations.joints == joint)
            length = max(length, 4.0 * _correlation_time(equations.times[chosen], residual[chosen]))
    # At least 0.5 s, and four correlation times of the residual.
    length = max(0.5, min(length, duration / _FEWEST_BLOCKS))
    runs = np.unique(equations.runs, return_inverse=True)[1].ravel()
    first = np.full(int(runs.max()) + 1, np.inf)
    np.minimum.at(first, runs, equations.times)
    labels = np.stack((equations.runs, np.floor((equations.times - first[runs]) / length)), axis=1)
    return np.asarray(np.unique(labels, axis=0, return_inverse=True)[1]).ravel()


def _correlation_time(times: FloatArray, residual: FloatArray) -> float:
    """Return the time [s] over which a residual is correlated: the sum of its autocorrelation up to its first zero."""
    count = len(residual)
    power = float(residual @ residual)
    if count < 4 or power <= 0.0:
        return 0.0
    step = float(np.median(np.diff(times)))
    total = 0.5
    for lag in range(1, count // 2):
        value = float(residual[:-lag] @ residual[lag:]) / power
        if value <= 0.0:
            break
        total += value
    return total * step


def jackknife_covariance(equations: Equations, values: FloatArray, blocks: Index) -> FloatArray:
    """Return the covariance (B, B) of the values, infinite below 3 blocks.

    It is that between blocks of time. With three runs or more no error is below that between runs: friction differs
    from day to day by more than within one. Inertias that are taken as known add theirs.
    """
    covariance = _jackknife(equations, values, blocks)
    runs = np.unique(equations.runs, return_inverse=True)[1].ravel()
    if np.isfinite(covariance).all() and runs.max() + 1 >= FEWEST_RUNS:
        own, between = np.diag(covariance), np.diag(_jackknife(equations, values, runs))
        wider = np.sqrt(np.maximum(between / np.maximum(own, 1e-300), 1.0))
        covariance = covariance * np.outer(wider, wider)
    # What the parameters take up of links that are heavier than they are said to be.
    whitening = _whitening(equations.rows)
    # The masses of a URDF are those of drawings, without cables and screws: they are wrong by about 2 %.
    heavier = 0.02 * whitening @ (whitening.T @ (equations.rows.T @ equations.rigid))
    return np.asarray(covariance + np.outer(heavier, heavier))


def _jackknife(equations: Equations, values: FloatArray, blocks: Index) -> FloatArray:
    """Return the covariance (B, B) from the fits without one block each; infinite below 3 blocks.

    beta without block b = beta - (Y'Y - Y_b'Y_b)^-1 Y_b' e_b with its residual e_b, in orthonormal coordinates. Few
    blocks know their own spread badly: 1.96 of these standard errors are as many as Student's t needs for 95 %.
    """
    from scipy.stats import t

    whitening = _whitening(equations.rows)
    residual = equations.torques - equations.rows @ values
    count = int(blocks.max()) + 1
    if count < FEWEST_RUNS:
        return np.full((len(values), len(values)), np.inf)
    changes = np.empty((count, len(values)))
    for block in range(count):
        own = blocks == block
        rows = equations.rows[own] @ whitening
        left = np.eye(whitening.shape[1]) - rows.T @ rows
        changes[block] = whitening @ np.linalg.lstsq(left, rows.T @ residual[own], rcond=1e-10)[0]
    changes -= changes.mean(axis=0)
    factor = float(t.ppf(0.975, count - 1) / t.ppf(0.975, np.inf)) ** 2 * (count - 1.0) / count
    return np.asarray(factor * changes.T @ changes)


def _percentile(values: FloatArray) -> FloatArray:
    """Return the 99th percentile of |values| of each joint (J,); 0 without values."""
    high = np.zeros(values.shape[1])
    present = np.isfinite(values).any(axis=0)
    if present.any():
        high[present] = np.nanpercentile(np.abs(values[:, present]), 99.0, axis=0)
    return high


def _base_set(
    runs: Sequence[RobotRun], regressor: Regressor, grouping: Grouping, solution: _Solution
) -> BaseParameterSet:
    """Return the base parameters, and what they are worth for other motion of the same speeds and accelerations."""
    stick = 10.0 * np.array(regressor.machine.stick_speed)
    speed = np.max([_percentile(run.speed) for run in runs], axis=0)
    acceleration = np.max([_percentile(run.acceleration()) for run in runs], axis=0)
    limits = np.maximum(speed, stick), np.maximum(acceleration, stick)
    random = random_rows(regressor, grouping.base, *limits).reshape(-1, len(stick), len(grouping.base))
    flat = (random * solution.weights[:, np.newaxis]).reshape(-1, len(grouping.base))
    equations = solution.equations
    windows = len(np.unique(np.stack((equations.runs, equations.times)), axis=1).T)
    wanted = independent_norms(flat) / math.sqrt(len(random))
    seen = independent_norms(equations.rows) / math.sqrt(windows)
    excitation = np.divide(seen, wanted, out=np.zeros_like(seen), where=wanted > 0.0)
    # The torque of a joint, as a scale: what the model says, and at least what the runs had.
    torque = np.sqrt(np.mean((random @ solution.values) ** 2, axis=0))
    logged = np.sqrt(np.nanmean(np.concatenate([run.torque for run in runs]) ** 2, axis=0))
    scale = np.maximum(torque, np.nan_to_num(logged)) + 1e-300
    covariance = np.nan_to_num(solution.covariance, posinf=1e300)
    single = np.sqrt(np.mean(random**2, axis=0)) * np.sqrt(np.diag(covariance)) / scale[:, np.newaxis]
    uncertainty = np.max(single, axis=0)
    variance = np.mean(np.einsum("njb,bc,njc->nj", random, covariance, random, optimize=True), axis=0)
    inertial = [regressor.columns[i].group is ColumnGroup.INERTIAL for i in grouping.base]
    # Inertial columns are excited by less; friction and drive may be less certain.
    excited = excitation >= np.where(inertial, 0.01, _EXCITED)
    certain = uncertainty <= np.where(inertial, _UNCERTAIN_TORQUE, 0.5)
    trusted = excited & certain & (solution.block_count >= _FEWEST_BLOCKS)
    return BaseParameterSet(
        names=tuple(grouping.name(row, regressor.columns) for row in range(len(grouping.base))),
        values=solution.values,
        covariance=solution.covariance,
        excitation=excitation,
        uncertainty=uncertainty,
        together=float(np.max(np.sqrt(np.maximum(variance, 0.0)) / scale)),
        identifiable=tuple(trusted.tolist()),
    )


@dataclass(frozen=True, eq=False)
class _Judge:
    """What of the free parameters the runs determine, and what would be needed for the rest."""

    runs: Sequence[RobotRun]
    machine: CoupledMachine
    columns: tuple[RegressorColumn, ...]
    grouping: Grouping
    base: BaseParameterSet
    condition: float
    solution: _Solution

    def outcome(self) -> Identified:
        """Return the estimates per joint, and one answer for the whole set of inertial parameters."""
        every = [(index, self.columns[index]) for index in self.grouping.columns]
        answers = [self._of_joint(*item) for item in every if item[1].group is not ColumnGroup.INERTIAL]
        return Identified.of([*answers, *self._of_set()])

    def _of_joint(self, index: int, column: RegressorColumn) -> Estimate | NotIdentifiable:
        if not self.grouping.is_alone(index):
            # A link's inertia takes the place of the rotor's in every motion.
            return self._refused(column, (Missing.MOTOR_INERTIA,), {})
        row = self.grouping.base.index(index)
        if not self.base.identifiable[row]:
            numbers = {
                "excitation": float(self.base.excitation[row]),
                "uncertain_torque_share": float(self.base.uncertainty[row]),
                "blocks": float(self.solution.block_count),
                "condition_number": self.condition,
            }
            return self._refused(column, self._needed(column, row), numbers)
        value, error = float(self.base.values[row]), float(self.base.standard_errors[row])
        unbounded = float(self.solution.unbounded[row])
        if unbounded < -2.0 * error and value == 0.0:
            # No noise explains this: the model, or the sign of a channel, is wrong.
            return self._refused(column, (Missing.OTHER_MOTION,), {"least_squares": unbounded, "standard_error": error})
        slides = is_prismatic(self.machine, column.joint)
        return Estimate(
            "machine",
            column.group.value,
            value,
            error,
            _UNITS[column.group][slides],
            Method.LEAST_SQUARES,
            column.joint,
        )

    def _refused(
        self, column: RegressorColumn, missing: tuple[Missing, ...], numbers: dict[str, float]
    ) -> NotIdentifiable:
        return NotIdentifiable("machine", column.group.value, missing, numbers, column.joint)

    def _needed(self, column: RegressorColumn, row: int) -> tuple[Missing, ...]:
        if self.base.excitation[row] >= _EXCITED:
            return (Missing.MORE_RECORDINGS,)
        speed = np.concatenate([run.speed[:, column.joint] for run in self.runs])
        moving = speed[np.abs(speed) > self.machine.stick_speed[column.joint]]
        if len(moving) < 10:  # no motion of it
            return (Missing.OTHER_MOTION,)
        forward = float(np.mean(moving > 0.0))
        if (
            column.group in (ColumnGroup.COULOMB, ColumnGroup.CONSTANT)
            # There is only one direction.
            and min(forward, 1.0 - forward) < 0.05
        ):
            return (Missing.REVERSALS,)
        if column.group is ColumnGroup.DRIVE_INERTIA:
            return (Missing.ACCELERATION,)
        return (Missing.SECOND_SPEED,) if column.group is not ColumnGroup.CONSTANT else (Missing.OTHER_MOTION,)

    def _of_set(self) -> list[NotIdentifiable]:
        """Return why the inertial base parameters are no complete set; empty if they are, or are not free."""
        inertial = [row for row, i in enumerate(self.grouping.base) if self.columns[i].group is ColumnGroup.INERTIAL]
        if not inertial:
            return []
        unexcited = [row for row in inertial if not self.base.identifiable[row]]
        is_certain = self.base.together <= _UNCERTAIN_TORQUE
        # Columns have the same length: above it noise passes into a set (Presse, Gautier, 1993).
        if not unexcited and is_certain and self.condition <= 100.0:
            return []
        few_blocks = self.solution.block_count < _FEWEST_BLOCKS
        numbers = {
            "condition_number": self.condition,
            "base_parameters": float(len(inertial)),
            "not_determined": float(len(unexcited)),
            "least_excitation": float(np.min(self.base.excitation[inertial])),
            "uncertain_torque_share": self.base.together,
            "blocks": float(self.solution.block_count),
        }
        needed = (Missing.OTHER_MOTION, Missing.MORE_RECORDINGS) if few_blocks else (Missing.OTHER_MOTION,)
        return [NotIdentifiable("machine", "base_parameters", needed, numbers)]


def is_prismatic(machine: CoupledMachine, joint: int) -> bool:
    """Return whether a joint is prismatic."""
    if not isinstance(machine, UrdfRobot):
        return False
    tree = machine.tree
    return next(item.prismatic for item in tree.joints if item.name == tree.order[joint])


def _left_out(solution: _Solution, start: FloatArray, is_bounded: BoolArray) -> LeftOutTorque:
    """Return the residuals of each fold by the fit without it, unweighted."""
    equations = solution.equations
    residual = np.empty(len(equations.torques))
    folds = folds_of(equations)
    for fold in np.unique(folds):
        own = folds == fold
        rest = equations.where(~own)
        values = _not_negative(rest, start, _solve(rest, start), is_bounded) if len(rest.torques) else start
        residual[own] = equations.torques[own] - equations.rows[own] @ values
    joints = equations.joints.astype(np.int64)
    scale = 1.0 / solution.weights[joints]
    previous = (equations.torques - equations.rows @ start) * scale
    return LeftOutTorque(residual * scale, previous, joints, solution.blocks)


def folds_of(equations: Equations) -> Index:
    """Return the fold of each equation (m,): its run, or its fifth of the only one."""
    if len(np.unique(equations.runs)) > 1:
        return equations.runs.astype(np.int64)
    start, length = float(equations.times.min()), float(np.ptp(equations.times))
    if length == 0.0:
        return np.zeros(len(equations.times), dtype=np.int64)
    parts = np.floor(_FOLDS * (equations.times - start) / length).astype(np.int64)
    return np.minimum(parts, _FOLDS - 1)
