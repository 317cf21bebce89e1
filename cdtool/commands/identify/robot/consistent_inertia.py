"""Physically consistent inertial parameters of a robot's links, by linear matrix inequalities.

Mass m, first moment h and inertia I about a point belong to a body of positive density exactly if its pseudo-inertia

    P = [[tr(I)/2 E - I, h], [h', m]]

is positive definite (Wensing, Kim, Slotine, 2018). P is linear in the parameters. Of all consistent parameters those
are chosen that raise the weighted residual of the least squares least, and of these the nearest to the machine's own:
torques do not determine the parameters of single links. Needs the extra cdtool[identify] (cvxpy, clarabel).
"""

from __future__ import annotations

import warnings
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import ConfigurationError, installing
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.commands.identify.robot.robot_dynamics import RobotFit
from cdtool.commands.identify.robot.robot_regressor import BODY_PARAMETERS, ColumnGroup, regressor_of, with_bodies
from cdtool.machines.kinematic_tree import KinematicTree
from cdtool.machines.urdf_robot import UrdfRobot

_PER_BODY = len(BODY_PARAMETERS)
_TOLERANCES = {"tol_gap_abs": 1e-12, "tol_gap_rel": 1e-12, "tol_feas": 1e-12}


@dataclass(frozen=True, eq=False)
class ConsistentFit:
    """A fit whose links are physical: `fit` with the consistent `parameters`, `tree` with their links.

    `residual_rise`: relative rise of the RMS of the weighted residual, about 0 if the parameters of least squares are
    consistent.
    """

    fit: RobotFit
    tree: KinematicTree
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
    # Scaled to a diagonal of 1, below it the body is flat.
    return bool(np.linalg.eigvalsh(matrix * np.outer(scale, scale))[0] > 1e-12)


def consistent_fit(fit: RobotFit) -> ConsistentFit:
    """Return the fit with consistent parameters for every link, its residual raised as little as possible.

    `fit`: of a UrdfRobot, with free inertial parameters; its friction is fitted again, not below 0. Raises
    ConfigurationError if cvxpy or clarabel is not installed, IdentificationError if the solver fails.
    """
    cvxpy, machine, free = _solver(), fit.machine, list(fit.grouping.columns)
    assert isinstance(machine, UrdfRobot)
    groups = [fit.columns[i].group for i in free]
    is_inertial = np.array([group is ColumnGroup.INERTIAL for group in groups])
    bodies = np.flatnonzero(is_inertial).reshape(-1, _PER_BODY)
    prior = regressor_of(machine).values[free]
    scale = _scales(machine, prior, is_inertial)
    upper: FloatArray = np.asarray(np.linalg.qr(np.column_stack((fit.equations.rows, fit.equations.torques)), mode="r"))
    rows, target = upper[:, :-1], upper[:, -1]
    size = max(float(np.linalg.norm(target)), 1e-300)
    # In units in which the numbers of the robot are about 1.
    pi = cvxpy.Variable(len(free))
    rest = (rows @ (fit.grouping.combination * scale) / size) @ pi - target / size
    basis = np.array([pseudo_inertia(row).ravel() for row in np.eye(_PER_BODY)]).T
    # The least eigenvalue, as a share of the robot's mass: the solver ends within 1e-8.
    constraints = [cvxpy.reshape(basis @ pi[own], (4, 4), order="C") >> 1e-7 * np.eye(4) for own in bodies]
    bounded = [i for i, group in enumerate(groups) if group in (ColumnGroup.VISCOUS, ColumnGroup.COULOMB)]
    constraints.append(pi[bounded] >= 0.0)
    # The distance to the machine's parameters only decides what the residual leaves open.
    objective = cvxpy.sum_squares(rest) + 1e-8 * cvxpy.sum_squares(pi - prior / scale)
    values = _solved(cvxpy, cvxpy.Problem(cvxpy.Minimize(objective), constraints), pi, scale)
    values[bounded] = np.maximum(values[bounded], 0.0)
    if not all(is_consistent(values[own]) for own in bodies):
        raise IdentificationError(
            "no consistent inertial parameters were found", "check the signs of torque and gravity, or the URDF"
        )
    least = float(np.linalg.norm(target - rows @ fit.base.values))
    now = float(np.linalg.norm(target - rows @ (fit.grouping.combination @ values)))
    # A rise below 1e-7 of the torques is the solver's.
    rise = max(0.0, now / max(least, 1e-7 * size) - 1.0)
    parameters = fit.parameters.copy()
    parameters[free] = values
    return ConsistentFit(replace(fit, parameters=parameters), with_bodies(machine.tree, values[bodies]), rise)


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


def _solved(cvxpy: Any, problem: Any, pi: Any, scale: FloatArray) -> FloatArray:
    """Return the parameters in SI units; zeros, which are no body, if the problem has no solution."""
    with warnings.catch_warnings(), suppress(cvxpy.SolverError):
        # That a solution may be inaccurate: whether it is consistent is checked.
        warnings.simplefilter("ignore", UserWarning)
        problem.solve(solver=cvxpy.CLARABEL, **_TOLERANCES)
    return np.zeros(len(scale)) if pi.value is None else np.asarray(pi.value * scale, dtype=np.float64)


def _scales(machine: UrdfRobot, prior: FloatArray, is_inertial: BoolArray) -> FloatArray:
    """Return the unit of each column: the robot's mass times a power of its reach, or the size of a friction."""
    reach = max(sum(float(np.linalg.norm(joint.translation)) for joint in machine.tree.joints), 1e-3)
    mass = max(sum(joint.mass for joint in machine.tree.joints), 1e-3)
    scales = np.maximum(np.abs(prior), 1.0)
    scales[is_inertial] = mass * np.tile([1.0] + [reach] * 3 + [reach**2] * 6, len(machine.tree.joints))
    return scales
