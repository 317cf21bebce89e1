"""The velocity observer's matrices against 50 digits, and its recursion against eigenvalues of every step."""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from cdtool.detection import Status
from cdtool.detectors.velocity import (
    BLOCK,
    WORK_ROWS,
    WORK_TABLES,
    fill_relaxations,
    find_modes,
    observe_velocity,
    relax_by_modes,
)
from cdtool.recording import FloatArray


def random_matrices(seed: int, size: int, count: int, condition: float) -> FloatArray:
    """Symmetric positive definite matrices with eigenvalues from 1/condition to 1, times 0.1 s."""
    rng = np.random.default_rng(seed)
    turned, _ = np.linalg.qr(rng.normal(size=(count, size, size)))
    values = condition ** -rng.uniform(0.0, 1.0, (count, 1, size))
    values[:, 0, 0] = 1.0
    made = 0.1 * (turned * values) @ turned.transpose(0, 2, 1)
    return 0.5 * (made + made.transpose(0, 2, 1))


def relaxations(matrices: FloatArray, elapsed: FloatArray) -> FloatArray:
    """I - exp(-T S^-1) of up to a block of matrices."""
    count, size = len(matrices), matrices.shape[1]
    if count > BLOCK:
        return np.concatenate(
            [relaxations(matrices[k : k + BLOCK], elapsed[k : k + BLOCK]) for k in range(0, count, BLOCK)]
        )
    x = np.repeat(np.eye(size).reshape(-1, 1), BLOCK, axis=1)
    x[:, :count] = matrices.reshape(count, -1).T
    times, result = np.zeros(BLOCK), np.empty_like(x)
    times[:count] = elapsed
    work, rows = np.empty((WORK_TABLES, x.size)), np.empty((size + WORK_ROWS) * BLOCK)
    fill_relaxations(x.ravel(), times, work, rows, result.ravel(), size)
    made = np.ascontiguousarray(result[:, :count].T).reshape(count, size, size)
    for k in np.flatnonzero(rows[:count] < 0.0):
        modes, vectors = matrices[k].copy(), np.empty((size, size))
        find_modes(modes, vectors)
        for j in range(size):
            relax_by_modes(modes, vectors, elapsed[k], np.eye(size)[j], made[k, j])
    return made


def by_modes(matrices: FloatArray, elapsed: FloatArray) -> FloatArray:
    periods, vectors = np.linalg.eigh(matrices)
    return (vectors * -np.expm1(-elapsed[:, np.newaxis] / periods)[:, np.newaxis]) @ vectors.transpose(0, 2, 1)


def exact(matrix: FloatArray, elapsed: float) -> Any:
    """I - exp(-T S^-1) in 50 digits: an inverse of fractions, a series of T S^-1 / 2^40, and 40 doublings."""
    size = len(matrix)
    rows = [[*map(Fraction, row), *(Fraction(i == j) for j in range(size))] for i, row in enumerate(matrix.tolist())]
    for p in range(size):
        rows[p] = [value / rows[p][p] for value in rows[p]]
        for i in range(size):
            if i != p:
                rows[i] = [a - rows[i][p] * b for a, b in zip(rows[i], rows[p], strict=True)]
    scale = Fraction(elapsed) / 2**40
    inverse = [[scale * value for value in row[size:]] for row in rows]
    with localcontext() as context:
        context.prec = 80
        x = np.array([[Decimal(v.numerator) / Decimal(v.denominator) for v in row] for row in inverse])
        total, term = 0 * x, -1 * np.array([[Decimal(int(i == j)) for j in range(size)] for i in range(size)])
        for number in range(1, 12):
            term = -(term @ x) / number
            total = total + term
        for _ in range(40):
            total = 2 * total - total @ total
    return total


@pytest.mark.parametrize("size", [1, 2, 6, 7])
@pytest.mark.parametrize("condition", [1.0, 30.0, 1e3])
def test_against_50_digits_a_relaxation_is_as_accurate_as_by_modes_of_lapack(size, condition):
    elapsed = np.tile([1e-5, 1e-4, 1e-3, 2e-3, 4e-3, 8e-3, 0.1, 0.5], 3)
    matrices = random_matrices(3, size, len(elapsed), condition)
    found, modes, errors = relaxations(matrices, elapsed), by_modes(matrices, elapsed), []
    for k in range(len(elapsed)):
        expected = exact(matrices[k], float(elapsed[k]))
        largest = float(np.max(np.abs(expected)))
        off = [float(np.max(np.abs(np.vectorize(Decimal)(item[k]) - expected))) / largest for item in (found, modes)]
        errors.append(off)
    (kernel, old), (kernel_most, old_most) = np.median(errors, axis=0), np.max(errors, axis=0)
    assert kernel <= 1.5 * old + 2e-16
    assert kernel_most <= max(old_most, 4e-15)


@pytest.mark.parametrize("size", [2, 3, 6])
def test_a_matrix_that_is_not_definite_relaxes_by_its_modes_too(size):
    """As of a robot whose identified links are unphysical in some poses: a mode grows instead."""
    matrices = random_matrices(8, size, 20, 10.0)
    matrices -= 1.5 * np.eye(size) * np.linalg.eigvalsh(matrices)[:, :1, np.newaxis]
    elapsed = np.linspace(1e-5, 1e-2, 20)
    found, expected = relaxations(matrices, elapsed), by_modes(matrices, elapsed)
    largest = np.abs(expected).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(found / largest, expected / largest, rtol=0.0, atol=1e-11)


def test_a_relaxation_does_not_depend_on_the_other_samples_of_its_block():
    matrices, elapsed = random_matrices(5, 6, BLOCK, 50.0), np.geomspace(1e-4, 3.0, BLOCK)
    whole = relaxations(matrices, elapsed)
    for k in (0, 1, BLOCK // 2, BLOCK - 1):
        np.testing.assert_array_equal(relaxations(matrices[k : k + 1], elapsed[k : k + 1])[0], whole[k])


@pytest.mark.parametrize("size", [1, 2, 3, 6, 9])
def test_modes_are_orthogonal_make_up_the_matrix_and_are_those_of_lapack(size):
    for matrix in random_matrices(size, size, 50, 1e6):
        modes, vectors = matrix.copy(), np.empty((size, size))
        find_modes(modes, vectors)
        values = np.diag(modes)
        alone = matrix.copy()
        find_modes(alone, np.empty((0, size)))
        np.testing.assert_array_equal(np.diag(alone), values)
        np.testing.assert_allclose(vectors.T @ vectors, np.eye(size), atol=1e-14)
        np.testing.assert_allclose((vectors * values) @ vectors.T, matrix, atol=1e-15)
        np.testing.assert_allclose(np.sort(values), np.linalg.eigvalsh(matrix), rtol=0.0, atol=1e-15)


def observed_by_modes(time, balance, speed, inertia, missing, motion_missing, gains):
    """The same recursion in plain Python, with the eigenvalues of every step."""
    root, value, settled, last = np.sqrt(gains), np.zeros(len(gains)), 0.0, -1
    residual, status = np.zeros(balance.shape), np.full(balance.shape, Status.GAP)
    for k in range(len(time)):
        if motion_missing[k]:
            residual[k] = value
            continue
        if last >= 0:
            elapsed = time[k] - time[last]
            mean = 0.5 * (inertia[k] + inertia[last])
            periods, vectors = np.linalg.eigh(mean / np.outer(root, root))
            if elapsed > max(3.0 * periods[-1], 0.15):
                value, settled = np.zeros(len(gains)), 0.0
            else:
                force = 0.5 * (balance[k] + balance[last]) - mean @ (speed[k] - speed[last]) / elapsed
                part = -np.expm1(-elapsed / periods) * (vectors.T @ ((force - value) / root))
                value = value + root * (vectors @ part)
                settled += elapsed / periods[-1]
        last = k
        residual[k] = value
        status[k] = Status.GAP if missing[k] else Status.START_UP if settled < 3.0 else Status.VALID
    return residual, status


@pytest.mark.parametrize("joints", [1, 2, 6])
@pytest.mark.parametrize("seed", range(3))
def test_residual_and_status_are_those_of_the_modes_of_every_step(joints, seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(300, 700))
    time = np.cumsum(1e-3 + 2e-4 * rng.random(count))
    time[count // 3 :] += 0.08  # bridged
    time[count // 2 :] += 5.0  # a restart
    motion_missing = rng.random(count) < 0.05
    motion_missing[:3] = motion_missing[100:120] = motion_missing[-2:] = True
    missing = motion_missing | (rng.random(count) < 0.05)
    balance, speed = rng.normal(size=(count, joints)), 0.01 * rng.normal(size=(count, joints))
    smooth = np.linspace(0.0, 1.0, count)[:, np.newaxis, np.newaxis]
    ends = 20.0 * random_matrices(seed, joints, 2, 20.0)
    inertia = ends[0] + smooth * (ends[1] - ends[0])
    gains = 30.0 * np.diag(ends[0])
    inputs = time, balance, speed
    found, status = observe_velocity(*inputs, lambda rows: inertia[rows], missing, motion_missing, gains)
    expected, expected_status = observed_by_modes(*inputs, inertia, missing, motion_missing, gains)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_array_equal(status, expected_status)
    assert {Status.GAP, Status.START_UP, Status.VALID} == set(status.ravel().tolist())
    for part in (1, 5, 200):
        head, head_status = observe_velocity(
            *(item[:part] for item in inputs),
            lambda rows, part=part: inertia[:part][rows],
            missing[:part],
            motion_missing[:part],
            gains,
        )
        np.testing.assert_array_equal(head, found[:part])
        np.testing.assert_array_equal(head_status, status[:part])


def test_without_any_motion_every_sample_is_a_gap():
    nothing, lost = np.zeros((4, 2)), np.ones(4, dtype=bool)
    residual, status = observe_velocity(
        np.arange(4.0), nothing, nothing, lambda _: np.empty((0, 2, 2)), lost, lost, np.ones(2)
    )
    assert not residual.any() and (status == Status.GAP).all()
