"""The dynamics of a tree of joints: closed forms, its own identities, and pinocchio as an independent reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.machines.kinematic_tree import KinematicTree, TreeJoint, TreeLink

PENDULUM = KinematicTree(
    joints=(
        TreeJoint("hinge", -1, False, tuple(np.eye(3).ravel()), (0.0, 0.0, 0.0), 1.0, (1.0, 0.0, 0.0), (0.0,) * 6),
    ),
    links=(TreeLink("rod", 0, tuple(np.eye(3).ravel()), (0.0, 0.0, 0.0)),),
    order=("hinge",),
    gravity=(0.0, -1.0, 0.0),
)
SEEDS = range(12)


def random_rotation(rng):
    turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return turned * np.sign(np.linalg.det(turned))


def random_tree(seed: int) -> KinematicTree:
    """1 to 9 joints, turning and sliding, branching; bodies of five point masses; columns not in the tree's order."""
    rng = np.random.default_rng(seed)
    joints = []
    for index in range(int(rng.integers(1, 10))):
        masses, points = rng.uniform(0.2, 2.0, 5), rng.normal(size=(5, 3)) * 0.3
        inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
        joints.append(
            TreeJoint(
                name=f"joint{index}",
                parent=max(-1, index - int(rng.choice([1, 1, 2, 3]))),
                prismatic=bool(rng.random() < 0.3),
                rotation=tuple(random_rotation(rng).ravel().tolist()),
                translation=tuple(rng.normal(size=3).tolist()),
                mass=float(masses.sum()),
                first_moment=tuple((masses @ points).tolist()),
                inertia=tuple(inertia[np.triu_indices(3)].tolist()),
                drive_inertia=float(rng.uniform(0.0, 0.5)),
            )
        )
    links = [
        TreeLink(
            f"link{index}", index, tuple(random_rotation(rng).ravel().tolist()), tuple(rng.normal(size=3).tolist())
        )
        for index in range(-1, len(joints))
    ]
    order = tuple(rng.permutation([joint.name for joint in joints]).tolist())
    return KinematicTree(tuple(joints), tuple(links), order, tuple(rng.normal(size=3).tolist()))


def states(tree: KinematicTree, count: int, seed: int = 0):
    rng = np.random.default_rng(1000 + seed)
    return rng.normal(size=(count, len(tree.order))) * 2.0, rng.normal(size=(count, len(tree.order)))


def worst(found, expected):
    """Largest error over the samples, relative to the norm of the sample's expected value."""
    count = len(expected)
    error = np.linalg.norm((found - expected).reshape(count, -1), axis=1)
    return np.max(error / (np.linalg.norm(expected.reshape(count, -1), axis=1) + 1e-9))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_momentum_changes_as_torque_velocity_force_and_gravity_say(seed):
    """dp/dt = tau + C' qd - g, which holds for dM/dt = C + C' only."""
    tree = random_tree(seed)
    step, time = 1e-5, np.linspace(0.0, 2.0, 30)[:, np.newaxis]
    rate, phase = np.arange(1.0, len(tree.order) + 1.0), np.arange(len(tree.order)) * 0.7

    def motion(t):
        wave, way = np.sin(rate * t + phase), np.cos(rate * t + phase)
        return wave, rate * way, -(rate**2) * wave

    change = (tree.momentum_terms(*motion(time + step)[:2])[0] - tree.momentum_terms(*motion(time - step)[:2])[0]) / (
        2.0 * step
    )
    _, force, gravity = tree.momentum_terms(*motion(time)[:2])
    expected = tree.inverse_dynamics(*motion(time)) + force - gravity
    assert np.max(np.abs(change - expected)) < 1e-6 * np.max(np.abs(expected))


def test_a_pendulum_has_its_closed_form_and_its_drive_adds_inertia():
    tree = replace(PENDULUM, joints=(replace(PENDULUM.joints[0], inertia=(0, 0, 0, 0, 0, 1.5), drive_inertia=0.25),))
    position, speed = np.array([[0.3], [2.0]]), np.array([[2.0], [-1.0]])
    momentum, force, gravity = tree.momentum_terms(position, speed)
    kinetic, potential = tree.energies(position, speed)
    assert momentum == pytest.approx(1.75 * speed)
    assert force == pytest.approx(0.0 * speed, abs=1e-15)
    assert gravity == pytest.approx(np.cos(position))
    assert kinetic == pytest.approx(0.875 * speed[:, 0] ** 2)
    assert potential == pytest.approx(np.sin(position[:, 0]))
    assert tree.inverse_dynamics(position, speed, speed) == pytest.approx(1.75 * speed + np.cos(position))
    assert tree.inertia_matrix(position) == pytest.approx(np.full((2, 1, 1), 1.75))


@pytest.mark.parametrize("missing", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_voids_its_own_sample_only(missing):
    tree = random_tree(7)
    position, speed = states(tree, 40)
    broken_position, broken_speed = position.copy(), speed.copy()
    broken_position[5, 0], broken_speed[33, -1] = missing, missing
    touched = np.isin(np.arange(40), (5, 33))
    link = tree.links[-1].name

    def results(q, v):
        torque = tree.inverse_dynamics(q, v, v)
        return (*tree.momentum_terms(q, v), *tree.energies(q, v), torque)

    for found, expected in zip(results(broken_position, broken_speed), results(position, speed), strict=True):
        assert np.isnan(found[touched]).all()
        assert np.array_equal(found[~touched], expected[~touched])
    matrix, whole = tree.inertia_matrix(broken_position), tree.inertia_matrix(position)
    assert np.isnan(matrix[5]).all() and np.isnan(tree.inertia_diagonal(broken_position)[5]).all()
    assert np.array_equal(np.delete(matrix, 5, axis=0), np.delete(whole, 5, axis=0))
    jacobian = tree.contact_jacobian(broken_position, link, (0.0, 0.0, 0.0))
    assert np.isnan(jacobian[5]).all()
    assert np.isfinite(np.delete(jacobian, 5, axis=0)).all()


@pytest.mark.parametrize("shape", [(4, 2), (4,), (5, 1)])
def test_a_table_of_another_shape_is_refused(shape):
    with pytest.raises(UsageError, match="speed has the shape"):
        PENDULUM.momentum_terms(np.zeros((4, 1)), np.zeros(shape))
