"""Torque constants of a robot's joints from runs with and without a known payload.

A log with motor currents i has torques only up to a factor per joint, k i. Free motion alone leaves it open: twice the
masses and twice the factor look alike. A known payload does not (Gautier, Briot, 2014):

    i_j = (1 / k_j) [Y_j beta_j + payload torque_j]

with an unknown beta_j of the unloaded robot and its friction. Each joint is fitted on its own, with the noisy current
on the left: as a regressor, its noise would make the constant too small. Friction that grows with the load of a joint
is mistaken for current of the payload.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.errors import ConfigurationError, UsageError, nearest
from cdtool.identification.consistent_inertia import body_of, pseudo_inertia
from cdtool.identification.estimate import Estimate, IdentificationError, Identified, Method, Missing, NotIdentifiable
from cdtool.identification.robot_dynamics import (
    Equations,
    Window,
    jackknife_blocks,
    jackknife_covariance,
    resting_windows,
    window_of_column,
)
from cdtool.identification.robot_regressor import Group, Regressor, TreeRegressor, regressor_of
from cdtool.identification.robot_run import RobotRun
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.kinematic_tree import KinematicTree
from cdtool.machines.planar_arm import PlanarArm
from cdtool.recording import BoolArray, FloatArray
from cdtool.short_repr import short_repr

# Directions of the unloaded robot's parameters that are excited less than this, relative to the most, are not fitted.
_UNSEEN = 1e-7
# The payload's torque must have a part of at least this share that the unloaded robot cannot explain.
_INDEPENDENT = 0.05
# A constant with a larger relative standard error says nothing.
_WORST_ERROR = 0.2
_FEWEST_EQUATIONS = 10


@dataclass(frozen=True, kw_only=True)
class Payload:
    """A known body fixed to a link: `mass` [kg], `centre` of mass (3) in the link's frame [m].

    `inertia` (6: xx, xy, xz, yy, yz, zz) about the centre, axes of the link [kg m2]. A planar arm's links are "arm" and
    "forearm", x along the link. Raises ConfigurationError for a mass that is not above 0.
    """

    link: str
    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float] = (0.0,) * 6

    def __post_init__(self) -> None:
        if not 0.0 < self.mass < math.inf:
            raise ConfigurationError(f"payload: mass is {self.mass} kg", "weigh it; it must be above 0")

    def parameters(self) -> FloatArray:
        """Return its ten parameters about the origin of the link's frame."""
        xx, xy, xz, yy, yz, zz = self.inertia
        shift = np.eye(4)
        shift[:3, 3] = self.centre
        at_centre = pseudo_inertia(np.array([self.mass, 0.0, 0.0, 0.0, xx, xy, yy, xz, yz, zz]))
        return body_of(shift @ at_centre @ shift.T)


def drive_gains(
    unloaded: Sequence[RobotRun],
    loaded: Sequence[RobotRun],
    payload: Payload,
    machine: CoupledMachine,
    scale: Sequence[float] | None = None,
) -> Identified:
    """Return the torque constant of each joint: section "channels.torque", key "scale".

    `unloaded`, `loaded`: contact-free runs without and with the payload. `scale`: the present scale of the torque
    channel, one per joint; without it the estimates are factors of the logged torque. NotIdentifiable for a joint that
    the payload does not load, or not independently of its other torques. Raises IdentificationError without runs of
    both kinds, ConfigurationError for an unknown link.
    """
    if not unloaded or not loaded:
        raise IdentificationError("torque constants need runs with and without the payload", "give both")
    present = np.ones(len(machine.joints)) if scale is None else np.array(scale, dtype=np.float64)
    if present.shape != (len(machine.joints),):
        raise UsageError(f"{len(present)} values of scale", f"the machine has {len(machine.joints)} joints")
    regressor = regressor_of(machine)
    weights = _payload_columns(machine, regressor, payload)
    parts = [_run_part(run, index, regressor, None) for index, run in enumerate(unloaded)]
    parts += [_run_part(run, index, regressor, weights) for index, run in enumerate(loaded, len(unloaded))]
    estimates: list[Estimate] = []
    missing: list[NotIdentifiable] = []
    for joint in range(len(machine.joints)):
        found = _of_joint(joint, parts, float(present[joint]), "N m/A" if scale is not None else "1")
        if isinstance(found, Estimate):
            estimates.append(found)
        else:
            missing.append(found)
    return Identified(tuple(estimates), tuple(missing))


@dataclass(frozen=True, eq=False)
class _Part:
    """The windows of a run: `rows` (K, J, P), `torques`, `load` of the payload, `moves` (K, J), `times` (K,)."""

    index: int
    rows: FloatArray
    torques: FloatArray
    load: FloatArray
    moves: BoolArray
    times: FloatArray

    __repr__ = short_repr


def _run_part(run: RobotRun, index: int, regressor: Regressor, weights: FloatArray | None) -> _Part:
    if run.joint_count != len(regressor.machine.joints):
        raise UsageError(f"{run.name}: {run.joint_count} joints", f"the machine has {len(regressor.machine.joints)}")
    window = Window.of(0.1, run.period)
    chosen = [i for i, column in enumerate(regressor.columns) if column.group is not Group.LOAD]
    rows = np.stack([window_of_column(run, regressor, window, i) for i in chosen], axis=2)
    torques = window.average(run.torque)
    load = np.zeros_like(torques)
    if weights is not None:
        for column in np.flatnonzero(weights).tolist():
            load += weights[column] * window_of_column(run, regressor, window, column)
    times = run.start + run.period * (np.arange(len(torques)) * float(window.step) + len(window.weights) // 2)
    moves = ~resting_windows(run, regressor.machine, window)
    return _Part(index, rows, torques, load, moves, np.asarray(times, dtype=np.float64))


def _of_joint(joint: int, parts: Sequence[_Part], present: float, unit: str) -> Estimate | NotIdentifiable:
    equations = _equations(joint, parts)
    rows, load = equations.rows[:, :-1], equations.rows[:, -1]
    if len(load) < _FEWEST_EQUATIONS or not load.any():
        return _refused(joint, Missing.PAYLOAD, {"equations": float(len(load))})
    basis = _basis(rows)
    rest = load - basis @ (basis.T @ load)
    share = float(np.linalg.norm(rest) / np.linalg.norm(load))
    if share < _INDEPENDENT:
        return _refused(joint, Missing.OTHER_MOTION, {"independent_share": share})
    # With the part of the load that nothing else explains, 1 / k does not depend on the basis.
    inverse = float(rest @ equations.torques / (rest @ rest))
    values = np.append(basis.T @ (equations.torques - inverse * load), inverse)
    whole = Equations(
        np.column_stack((basis, load)), equations.torques, equations.joints, equations.times, equations.runs
    )
    blocks = jackknife_blocks(whole, whole.torques - whole.rows @ values)
    error = math.sqrt(float(jackknife_covariance(whole, values, blocks)[-1, -1]))
    if not error < _WORST_ERROR * inverse:
        return _refused(joint, Missing.PAYLOAD, {"inverse": inverse, "standard_error_of_inverse": error})
    value = present / inverse
    relative = error / inverse
    return Estimate("channels.torque", "scale", value, abs(value) * relative, unit, Method.LOADED_RUNS, joint)


def _equations(joint: int, parts: Sequence[_Part]) -> Equations:
    pieces = []
    for part in parts:
        rows = np.column_stack((part.rows[:, joint], part.load[:, joint]))
        torques = part.torques[:, joint]
        valid = part.moves[:, joint] & np.isfinite(torques) & np.isfinite(rows).all(axis=1)
        count = int(valid.sum())
        one = np.ones(count)
        pieces.append((rows[valid], torques[valid], joint * one, part.times[valid], part.index * one))
    return Equations(*(np.concatenate(item) for item in zip(*pieces, strict=True)))


def _basis(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis (m, r) of the columns."""
    norms = np.linalg.norm(rows, axis=0)
    seen = norms > 1e-12 * max(float(norms.max(initial=0.0)), 1e-300)
    left, values, _ = np.linalg.svd(rows[:, seen] / norms[seen], full_matrices=False)
    return np.asarray(left[:, values > _UNSEEN * values[0]])


def _refused(joint: int, missing: Missing, numbers: dict[str, float]) -> NotIdentifiable:
    return NotIdentifiable("channels.torque", "scale", (missing,), numbers, joint)


def _payload_columns(machine: CoupledMachine, regressor: Regressor, payload: Payload) -> FloatArray:
    """Return the payload as weights of the regressor's columns (P,)."""
    weights = np.zeros(len(regressor.columns))
    if isinstance(regressor, TreeRegressor):
        body, parameters = _in_tree(regressor.tree, payload)
        weights[10 * body : 10 * (body + 1)] = parameters
        return weights
    assert isinstance(machine, PlanarArm)
    if payload.link not in machine.joints:
        raise ConfigurationError(f"payload: unknown link '{payload.link}'", nearest(payload.link, machine.joints))
    if payload.centre[2]:
        raise ConfigurationError("payload: its centre is off the link's axis", "give z = 0")
    own, mass, along, gravity = (
        machine.joints.index(payload.link),
        payload.mass,
        payload.centre[0],
        machine.gravity_acceleration,
    )
    weights[own] = mass * along**2 + payload.inertia[3]
    weights[3 + own] = mass * along * gravity
    if own:
        weights[0] = mass * machine.link_length**2
        weights[2] = mass * machine.link_length * along
        weights[3] = mass * machine.link_length * gravity
    return weights


def _in_tree(tree: KinematicTree, payload: Payload) -> tuple[int, FloatArray]:
    """Return the index of the body that carries the payload, and its parameters in the joint's frame."""
    link = next((item for item in tree.links if item.name == payload.link), None)
    if link is None or link.joint < 0:
        moving = [item.name for item in tree.links if item.joint >= 0]
        raise ConfigurationError(f"payload: no moving link '{payload.link}'", nearest(payload.link, moving))
    placement = np.eye(4)
    placement[:3, :3] = np.reshape(link.rotation, (3, 3))
    placement[:3, 3] = link.translation
    return link.joint, body_of(placement @ pseudo_inertia(payload.parameters()) @ placement.T)
