"""Torque constants of a robot's joints from runs with and without a known payload.

A log with motor currents i has torques only up to a factor per joint, k i. Free motion alone leaves it open: twice the
masses and twice the factor look alike. A known payload does not (Gautier, Briot, 2014):

    i_j = (1 / k_j) [Y_j beta_j + payload torque_j]

with an unknown beta_j of the unloaded robot and its friction. Each joint is fitted on its own, with the noisy current
on the left: as a regressor, its noise would make the constant too small. The payload's inertia is free, and so is its
centre of mass unless it is given. So is the friction with the payload: it may grow with the load, and from day to day.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import ConfigurationError, nearest
from cdtool.commands.identify.estimate import (
    Estimate,
    Identified,
    Method,
    Missing,
    NotIdentifiable,
)
from cdtool.commands.identify.robot.robot_dynamics import (
    HALF_WIDTH,
    Equations,
    jackknife_blocks,
    jackknife_covariance,
    windows_of,
)
from cdtool.commands.identify.robot.robot_regressor import ColumnGroup, Regressor, TreeRegressor, regressor_of
from cdtool.commands.identify.robot.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.planar_arm import PlanarArm

# Of these a joint has its own with the payload.
_FRICTION = (ColumnGroup.VISCOUS, ColumnGroup.COULOMB)


@dataclass(frozen=True)
class LoadedRuns:
    """Logs of motion with a known payload: `mass` [kg], fixed to a link, its `centre` of mass in the link's frame [m].

    `centre` None: not known, then it is free. `link`: of the URDF, or "arm" or "forearm", x along it; empty: the link
    that the last joint moves. Raises ConfigurationError for a mass that is not above 0.
    """

    logs: tuple[str | Path, ...]
    mass: float
    link: str = ""
    centre: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.mass < math.inf:
            raise ConfigurationError(f"payload: mass is {self.mass} kg", "weigh it; it must be above 0")


def drive_gains(
    unloaded: Sequence[RobotRun],
    loaded: Sequence[RobotRun],
    payload: LoadedRuns,
    machine: CoupledMachine,
    scale: Sequence[float],
) -> Identified:
    """Return the torque constant of each joint: section "channels.torque", key "scale".

    `unloaded`, `loaded`: contact-free runs without and with the payload. `scale`: the present scale of the torque
    channel, one per joint. NotIdentifiable for a joint that
    the payload does not load, or not independently of its other torques, as with an unknown centre of mass. Raises
    IdentificationError without motion, ConfigurationError for an unknown link.
    """
    regressor = regressor_of(machine)
    columns = _payload_columns(machine, regressor, payload)
    every = range(len(regressor.columns))
    equations = windows_of((*unloaded, *loaded), regressor, every, frozenset(ColumnGroup), HALF_WIDTH)
    is_loaded = equations.runs >= len(unloaded)
    joints = [_JointWindows.of(joint, equations, is_loaded, regressor, columns) for joint in range(len(machine.joints))]
    most = max(float(np.linalg.norm(joint.load)) for joint in joints)
    has_centre = payload.centre is not None
    return Identified.of(
        [item.constant(float(value), most, has_centre) for item, value in zip(joints, scale, strict=True)]
    )


@dataclass(frozen=True, eq=False)
class _PayloadColumns:
    """The regressor's columns, as weights (k, P), of a payload's `mass` (1) where it is said to be.

    `shifts`: of a mass that is off by one standard error of its centre; `free`: of what of the payload is not known.
    """

    mass: FloatArray
    shifts: FloatArray
    free: FloatArray


@dataclass(frozen=True, eq=False)
class _JointWindows:
    """A joint's windows: what they contain beside the payload, its `load` (m,), that of its `shifts` (m, k)."""

    joint: int
    rows: FloatArray
    load: FloatArray
    shifts: FloatArray
    equations: Equations

    @classmethod
    def of(
        cls, joint: int, every: Equations, is_loaded: BoolArray, regressor: Regressor, columns: _PayloadColumns
    ) -> _JointWindows:
        # Friction of its own for the runs with the payload.
        own = [column.joint == joint and column.group in _FRICTION for column in regressor.columns]
        free = np.concatenate((columns.free, np.eye(len(own))[own]))
        chosen = every.joints == joint
        equations = every.where(chosen)
        loaded = equations.rows * is_loaded[chosen][:, np.newaxis]
        everything = np.column_stack((equations.rows, loaded @ free.T))
        return cls(joint, everything, loaded @ columns.mass, loaded @ columns.shifts.T, equations)

    def constant(self, present: float, most: float, has_centre: bool) -> Estimate | NotIdentifiable:
        """Return the torque constant; `most`: the norm of the load of the joint with the largest."""
        load, torques = self.load, self.equations.torques
        size = float(np.linalg.norm(load))
        # Less than 1e-6 of the most loaded joint's load is rounding.
        if size <= 1e-6 * most:
            return self._refused(Missing.PAYLOAD, {"equations": float(len(load))})
        basis = _basis(self.rows)
        rest = load - basis @ (basis.T @ load)
        share = float(np.linalg.norm(rest)) / size
        # The payload's torque must have a part of 5 % that nothing else explains.
        if share < 0.05:
            missing = Missing.OTHER_MOTION if has_centre else Missing.PAYLOAD_CENTRE
            return self._refused(missing, {"independent_share": share})
        # With the part of the load that nothing else explains, 1 / k does not depend on the basis.
        inverse = float(rest @ torques / (rest @ rest))
        values = np.append(basis.T @ (torques - inverse * load), inverse)
        whole = replace(self.equations, rows=np.column_stack((basis, load)))
        blocks = jackknife_blocks(whole, torques - whole.rows @ values)
        spread = math.sqrt(float(jackknife_covariance(whole, values, blocks)[-1, -1]))
        error = math.hypot(spread, inverse * float(np.linalg.norm(rest @ self.shifts / (rest @ rest))))
        if not error < 0.2 * inverse:  # a constant with a larger relative standard error says nothing
            return self._refused(Missing.PAYLOAD, {"inverse": inverse, "standard_error_of_inverse": error})
        value = present / inverse
        error *= abs(value) / inverse
        return Estimate("channels.torque", "scale", value, error, "N m/A", Method.LOADED_RUNS, self.joint)

    def _refused(self, missing: Missing, numbers: dict[str, float]) -> NotIdentifiable:
        return NotIdentifiable("channels.torque", "scale", (missing,), numbers, self.joint)


def _basis(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis (m, r) of the columns."""
    norms = np.linalg.norm(rows, axis=0)
    seen = norms > 1e-12 * max(float(norms.max(initial=0.0)), 1e-300)
    left, values, _ = np.linalg.svd(rows[:, seen] / norms[seen], full_matrices=False)
    # Directions of the unloaded robot's parameters that are excited less, relative to the most, are not fitted.
    return np.asarray(left[:, values > 1e-7 * values[0]])


def _payload_columns(machine: CoupledMachine, regressor: Regressor, payload: LoadedRuns) -> _PayloadColumns:
    """Return what a payload adds to the regressor: its mass, first moments and inertias are columns of its link."""
    unit = np.eye(len(regressor.columns))
    if isinstance(regressor, TreeRegressor):
        moving = {item.name: item for item in regressor.tree.links if item.joint >= 0}
        last = next(item for item in moving.values() if item.joint == len(regressor.tree.joints) - 1)
        link = moving.get(payload.link) if payload.link else last
        if link is None:
            raise ConfigurationError(f"payload: no moving link '{payload.link}'", nearest(payload.link, moving))
        own = unit[10 * link.joint : 10 * (link.joint + 1)]
        mass, moments, inertias = own[0], own[1:4], own[4:]
        turn, shift = np.reshape(link.rotation, (3, 3)), np.array(link.translation)
        centre = None if payload.centre is None else turn @ np.array(payload.centre) + shift
    else:
        assert isinstance(machine, PlanarArm)
        name = payload.link or machine.joints[-1]
        if name not in machine.joints:
            raise ConfigurationError(f"payload: unknown link '{payload.link}'", nearest(payload.link, machine.joints))
        if payload.centre is not None and any(payload.centre[1:]):
            raise ConfigurationError("payload: its centre is off the link's axis", "give y = z = 0")
        place, length, gravity = machine.joints.index(name), machine.link_length, machine.gravity_acceleration
        # On the forearm its mass moves with the end of the arm, and couples both links.
        mass = place * (length**2 * unit[0] + length * gravity * unit[3])
        moments = (place * length * unit[2] + gravity * unit[3 + place])[np.newaxis]
        inertias = unit[place : place + 1]
        centre = None if payload.centre is None else np.array(payload.centre[:1])
    if centre is None:
        return _PayloadColumns(payload.mass * mass, np.zeros((0, len(unit))), np.concatenate((moments, inertias)))
    # A centre of mass from a drawing, or found by balancing, is uncertain by 5 mm along each axis.
    shifts = payload.mass * 5e-3 * moments
    return _PayloadColumns(payload.mass * (mass + centre @ moments), shifts, inertias)
