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


def depth_first(tree: KinematicTree, parent: int = -1) -> list[int]:
    """The only order of joints in which pinocchio's inertia matrix is right."""
    children = [number for number, joint in enumerate(tree.joints) if joint.parent == parent]
    return [item for number in children for item in (number, *depth_first(tree, number))]


class Reference:
    """pinocchio's model of the same tree, columns in the tree's order."""

    def __init__(self, tree: KinematicTree) -> None:
        pin = pytest.importorskip("pinocchio")
        self.pin, self.model, index = pin, pin.Model(), {-1: 0}
        self.model.gravity.linear = np.array(tree.gravity)
        for number in depth_first(tree):
            joint = tree.joints[number]
            kind = pin.JointModelPZ() if joint.prismatic else pin.JointModelRZ()
            place = pin.SE3(np.reshape(joint.rotation, (3, 3)), np.array(joint.translation))
            index[number] = self.model.addJoint(index[joint.parent], kind, place, joint.name)
            centre, inertia = np.array(joint.first_moment) / joint.mass, np.zeros((3, 3))
            inertia[np.triu_indices(3)] = joint.inertia
            inertia = inertia + np.triu(inertia, 1).T
            inertia -= joint.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
            self.model.appendBodyToJoint(index[number], pin.Inertia(joint.mass, centre, inertia), pin.SE3.Identity())
        for link in tree.links:
            place = pin.SE3(np.reshape(link.rotation, (3, 3)), np.array(link.translation))
            self.model.addFrame(pin.Frame(link.name, index[link.joint], 0, place, pin.FrameType.BODY))
        self.model.armature = np.array([tree.joints[number].drive_inertia for number in depth_first(tree)])
        self.data = self.model.createData()
        self.column = [tree.order.index(tree.joints[number].name) for number in depth_first(tree)]

    def each(self, function, *tables):
        """The function of every sample, on vectors in pinocchio's order; its last axis back in the tree's order."""
        found = [np.asarray(function(*rows)) for rows in zip(*(table[:, self.column] for table in tables), strict=True)]
        return np.stack(found)[..., np.argsort(self.column)]


@pytest.mark.parametrize("seed", SEEDS)
def test_momentum_velocity_force_and_gravity_are_those_of_pinocchio(seed):
    tree = random_tree(seed)
    reference, (position, speed) = Reference(tree), states(tree, 70, seed)
    pin, model, data = reference.pin, reference.model, reference.data
    momentum, force, gravity = tree.momentum_terms(position, speed)
    assert worst(momentum, reference.each(lambda q, v: pin.crba(model, data, q) @ v, position, speed)) < 1e-12
    coriolis = reference.each(lambda q, v: pin.computeCoriolisMatrix(model, data, q, v).T @ v, position, speed)
    # Small where it cancels, so that rounding is measured against the momentum as well.
    assert np.max(np.abs(force - coriolis)) < 1e-12 * np.max(np.abs(momentum))
    assert worst(gravity, reference.each(lambda q: pin.computeGeneralizedGravity(model, data, q), position)) < 1e-12


@pytest.mark.parametrize("seed", SEEDS)
def test_inertia_matrix_and_jacobian_are_those_of_pinocchio(seed):
    tree = random_tree(seed)
    reference, (position, _) = Reference(tree), states(tree, 10, seed)
    pin, model, data = reference.pin, reference.model, reference.data
    inertia = reference.each(lambda q: pin.crba(model, data, q), position)
    rows = np.argsort(reference.column)
    assert worst(tree.inertia_matrix(position), inertia[:, rows]) < 1e-12
    point = (0.3, -0.2, 0.1)
    for link in tree.links:
        frame = model.getFrameId(link.name)

        def jacobian(q, frame=frame):
            found = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED).reshape(6, -1)
            pin.updateFramePlacement(model, data, frame)
            lever = data.oMf[frame].rotation @ np.array(point)
            return np.vstack((found[:3] - np.cross(lever, found[3:], axis=0), found[3:]))

        assert worst(tree.contact_jacobian(position, link.name, point), reference.each(jacobian, position)) < 1e-12


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


def test_another_order_of_the_columns_permutes_them_and_changes_no_bit():
    tree = random_tree(9)
    turned = np.random.default_rng(2).permutation(len(tree.order))
    other = replace(tree, order=tuple(tree.order[k] for k in turned))
    position, speed = states(tree, 50)
    for found, expected in zip(
        other.momentum_terms(position[:, turned], speed[:, turned]), tree.momentum_terms(position, speed), strict=True
    ):
        assert np.array_equal(found, expected[:, turned])
    jacobian = tree.contact_jacobian(position, tree.links[-1].name, (0.0, 0.0, 0.0))
    assert np.array_equal(
        other.contact_jacobian(position[:, turned], tree.links[-1].name, (0.0, 0.0, 0.0)), jacobian[:, :, turned]
    )


@pytest.mark.parametrize("missing", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_voids_its_own_sample_only(missing):
    tree = random_tree(7)
    position, speed = states(tree, 40)
    broken_position, broken_speed = position.copy(), speed.copy()
    broken_position[5, 1], broken_speed[33, 2] = missing, missing
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
