"""Physically consistent inertial parameters of a robot's links, by linear matrix inequalities.

Mass m, first moment h and inertia I about a point belong to a body of positive density exactly if its pseudo-inertia

    P = [[tr(I)/2 E - I, h], [h', m]]

is positive definite (Wensing, Kim, Slotine, 2018). P is linear in the parameters. Of all consistent parameters those
are chosen that raise the weighted residual of the least squares least, and of these the nearest to the machine's own:
torques do not determine the parameters of single links. Needs the extra cdtool[identify] (cvxpy, clarabel).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, UsageError, installing
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.commands.identify.robot.robot_dynamics import RobotFit, fitted_robot
from cdtool.commands.identify.robot.robot_regressor import BODY_PARAMETERS, ColumnGroup, RegressorColumn, regressor_of
from cdtool.machines.urdf_robot import UrdfRobot

_PER_BODY = len(BODY_PARAMETERS)
# The least eigenvalue of a scaled pseudo-inertia, as a share of the robot's mass: the solver ends within 1e-8.
_MARGIN = 1e-7
# A body is flat below this eigenvalue of its pseudo-inertia, scaled to a diagonal of 1.
_FLAT = 1e-12
# How much the distance to the machine's parameters counts beside the residual.
_NEARNESS = 1e-8
_NOT_NEGATIVE = (ColumnGroup.DRIVE_INERTIA, ColumnGroup.VISCOUS, ColumnGroup.COULOMB)
# Relative to the torques: a rise of the residual below it is the solver's.
_ROUNDING = 1e-7
_TOLERANCES = {"tol_gap_abs": 1e-12, "tol_gap_rel": 1e-12, "tol_feas": 1e-12}


@dataclass(frozen=True, eq=False)
class ConsistentFit:
    """A fit whose links are physical.

    `fit` with the consistent `parameters`; `robot` with them. `residual_rise`: relative rise of the RMS of the weighted
    residual, about 0 if the parameters of least squares are consistent.
    """

    fit: RobotFit
    robot: UrdfRobot
    residual_rise: float


def pseudo_inertia(parameters: FloatArray) -> FloatArray:
    """Return P (4, 4) of ten parameters (mass, mx, my, mz, ixx, ixy, iyy, ixz, iyz, izz) about any point."""
    mass, mx, my, mz, ixx, ixy, iyy, ixz, iyz, izz = (float(value) for value in parameters)
    inertia = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    matrix = np.empty((4, 4))
    matrix[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    matrix[:3, 3] = matrix[3, :3] = mx, my, mz
    matrix[3, 3] = mass
    return matrix


def body_of(matrix: FloatArray) -> FloatArray:
    """Return the ten parameters of a pseudo-inertia (4, 4), the inverse of `pseudo_inertia`."""
    second = matrix[:3, :3]
    inertia = np.trace(second) * np.eye(3) - second
    values = (matrix[3, 3], *matrix[:3, 3], inertia[0, 0], inertia[0, 1], inertia[1, 1], inertia[0, 2], inertia[1, 2])
    return np.array([*values, inertia[2, 2]])


def is_consistent(parameters: FloatArray) -> bool:
    """Return whether ten parameters belong to a body of positive density: P is positive definite."""
    matrix = pseudo_inertia(parameters)
    diagonal = np.diag(matrix)
    if not (diagonal > 0.0).all():
        return False
    # Scaled to a diagonal of 1: the eigenvalues of P have different units.
    scale = 1.0 / np.sqrt(diagonal)
    return bool(np.linalg.eigvalsh(matrix * np.outer(scale, scale))[0] > _FLAT)


def consistent_fit(fit: RobotFit) -> ConsistentFit:
    """Return the fit with consistent parameters for every link, its residual raised as little as possible.

    `fit`: of a UrdfRobot, with free inertial parameters. Friction and drive inertia are fitted again where they were
    free, not below 0. Raises ConfigurationError if cvxpy or clarabel is not installed, UsageError for another machine
    or without inertial parameters, IdentificationError if the solver fails.
    """
    if not isinstance(fit.machine, UrdfRobot):
        raise UsageError(f"machine '{fit.machine.name}': has no URDF", "consistent_fit is for type = 'urdf_robot'")
    if not any(fit.columns[i].group is ColumnGroup.INERTIAL for i in fit.grouping.columns):
        raise UsageError("the inertial parameters were not free", "identify with free INERTIAL columns")
    solver = _solver()
    problem = _InertiaProblem(fit, solver)
    values = problem.least_rise()
    parameters = fit.parameters.copy()
    parameters[list(fit.grouping.columns)] = values
    repaired = replace(fit, parameters=parameters)
    return ConsistentFit(repaired, fitted_robot(repaired), problem.rise(values))


def _solver() -> Any:
    """Return cvxpy; raises ConfigurationError that names the extra."""
    try:
        import_module("clarabel")
        return import_module("cvxpy")
    except ImportError as fault:
        raise ConfigurationError(
            f"consistent inertias need {fault.name or 'cvxpy'}, which is not installed",
            installing("identify"),
        ) from fault


class _InertiaProblem:
    """The semidefinite problem, in units in which the numbers of the robot are about 1.

    Lengths are divided by `reach`, masses by the robot's `mass`; base parameters and residual by their own size.
    """

    def __init__(self, fit: RobotFit, cvxpy: Any) -> None:
        self._cvxpy = cvxpy
        self._fit = fit
        columns = fit.grouping.columns
        self._columns = [fit.columns[i] for i in columns]
        machine = fit.machine
        assert isinstance(machine, UrdfRobot)
        self._bodies = len(machine.tree.joints)
        prior = regressor_of(machine).values[list(columns)]
        self._scale = _scales(machine, prior, self._columns)
        self._prior = prior / self._scale
        rows, torques = fit.equations.rows, fit.equations.torques
        upper: FloatArray = np.asarray(np.linalg.qr(np.column_stack((rows, torques)), mode="r"))
        self._upper, self._target = upper[:, :-1], upper[:, -1]
        # K pi, with pi in these units.
        self._combination = fit.grouping.combination * self._scale
        self._size = max(float(np.linalg.norm(self._target)), 1e-300)

    def least_rise(self) -> FloatArray:
        """Return the consistent parameters of the least residual; raises IdentificationError if the solver fails."""
        pi, constraints = self._variables()
        rest = (self._upper @ self._combination / self._size) @ pi - self._target / self._size
        nearness = _NEARNESS * self._cvxpy.sum_squares(pi - self._prior)
        found = self._solved(self._cvxpy.Minimize(self._cvxpy.sum_squares(rest) + nearness), constraints, pi)
        if found is None:
            raise IdentificationError(
                "no consistent inertial parameters were found", "check the signs of torque and gravity, or the URDF"
            )
        return found

    def rise(self, values: FloatArray) -> float:
        """Return the relative rise of the RMS of the weighted residual."""
        base = self._fit.grouping.combination @ values
        least = float(np.linalg.norm(self._target - self._upper @ self._fit.base.values))
        now = float(np.linalg.norm(self._target - self._upper @ base))
        return max(0.0, now / max(least, _ROUNDING * self._size) - 1.0)

    def _variables(self) -> tuple[Any, list[Any]]:
        pi = self._cvxpy.Variable(len(self._columns))
        constraints = []
        order = [place for place, column in enumerate(self._columns) if column.group is ColumnGroup.INERTIAL]
        for body in range(self._bodies):
            first = order[body * _PER_BODY]
            constraints.append(_matrix(self._cvxpy, pi[first : first + _PER_BODY]) >> _MARGIN * np.eye(4))
        positive = [place for place, column in enumerate(self._columns) if column.group in _NOT_NEGATIVE]
        if positive:
            constraints.append(pi[positive] >= 0.0)
        return pi, constraints

    def _solved(self, objective: Any, constraints: list[Any], pi: Any) -> FloatArray | None:
        """Return the parameters in SI units; None if the problem has no solution."""
        problem = self._cvxpy.Problem(objective, constraints)
        with warnings.catch_warnings():
            # That a solution may be inaccurate: whether it is consistent is checked.
            warnings.simplefilter("ignore", UserWarning)
            try:
                problem.solve(solver=self._cvxpy.CLARABEL, **_TOLERANCES)
            except self._cvxpy.SolverError:
                return None
        if problem.status not in ("optimal", "optimal_inaccurate") or pi.value is None:
            return None
        values = np.asarray(pi.value, dtype=np.float64)
        return self._checked(values * self._scale)

    def _checked(self, values: FloatArray) -> FloatArray | None:
        """Return the parameters if every link is consistent; those that must not be negative are not."""
        order = [place for place, column in enumerate(self._columns) if column.group is ColumnGroup.INERTIAL]
        bodies = values[order].reshape(self._bodies, _PER_BODY)
        if not all(is_consistent(body) for body in bodies):
            return None
        positive = [place for place, column in enumerate(self._columns) if column.group in _NOT_NEGATIVE]
        values[positive] = np.maximum(values[positive], 0.0)
        return values


def _matrix(cvxpy: Any, pi: Any) -> Any:
    """Return the pseudo-inertia of ten variables."""
    basis = [pseudo_inertia(row).ravel() for row in np.eye(_PER_BODY)]
    return cvxpy.reshape(np.array(basis).T @ pi, (4, 4), order="C")


def _scales(machine: UrdfRobot, prior: FloatArray, columns: list[RegressorColumn]) -> FloatArray:
    """Return the unit of each column: the robot's mass times a power of its reach, or the size of a friction."""
    reach = max(sum(float(np.linalg.norm(joint.translation)) for joint in machine.tree.joints), 1e-3)
    mass = max(sum(joint.mass for joint in machine.tree.joints), 1e-3)
    inertial = np.array([1.0] + [reach] * 3 + [reach**2] * 6) * mass
    scales, seen = [], 0
    for column, value in zip(columns, prior.tolist(), strict=True):
        if column.group is ColumnGroup.INERTIAL:
            scales.append(float(inertial[seen % _PER_BODY]))
            seen += 1
        else:
            scales.append(max(abs(value), 1.0))
    return np.array(scales)
