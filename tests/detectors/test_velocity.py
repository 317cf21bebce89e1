"""The velocity observer's matrices against 50 digits, and its recursion against one in plain Python."""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Status
from cdtool.detectors.velocity import observe_velocity, relaxations


def random_matrices(seed: int, size: int, count: int, condition: float) -> FloatArray:
    """Symmetric positive definite matrices with eigenvalues from 1/condition to 1, times 0.1 s."""
    rng = np.random.default_rng(seed)
    turned, _ = np.linalg.qr(rng.normal(size=(count, size, size)))
    values = condition ** -rng.uniform(0.0, 1.0, (count, 1, size))
    values[:, 0, 0] = 1.0
    made = 0.1 * (turned * values) @ turned.transpose(0, 2, 1)
    return 0.5 * (made + made.transpose(0, 2, 1))


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
def test_a_relaxation_has_the_50_digits_of_its_matrix_up_to_rounding(size, condition):
    elapsed = np.tile([1e-5, 1e-4, 1e-3, 2e-3, 4e-3, 8e-3, 0.1, 0.5], 3)
    matrices = random_matrices(3, size, len(elapsed), condition)
    found, _ = relaxations(matrices, elapsed, np.zeros(len(elapsed), dtype=bool))
    _, slowest = relaxations(matrices, elapsed, np.ones(len(elapsed), dtype=bool))
    for k in range(len(elapsed)):
        expected = exact(matrices[k], float(elapsed[k]))
        off = float(np.max(np.abs(np.vectorize(Decimal)(found[k]) - expected)))
        assert off <= 1e-15 * max(condition, 4.0) * float(np.max(np.abs(expected)))
    np.testing.assert_allclose(slowest, 0.1, rtol=1e-14)


@pytest.mark.parametrize("off", [0.0, 1e-15])
def test_a_motion_without_inertia_relaxes_at_once_and_the_others_as_slowly_as_ever(off):
    matrix = np.array([[[0.1, 0.1 + off], [0.1 + off, 0.1]]])
    found, _ = relaxations(matrix, np.array([0.01]), np.zeros(1, dtype=bool))
    together = -np.expm1(-0.01 / 0.2)
    expected = 0.5 * np.array([[together + 1, together - 1], [together - 1, together + 1]])
    np.testing.assert_allclose(found[0], expected, rtol=1e-12)


def observed_by_modes(time, balance, speed, inertia, missing, gains):
    """The same recursion in plain Python, with the eigenvalues of every step."""
    root, value, settled, last = np.sqrt(gains), np.zeros(len(gains)), 0.0, -1
    residual, status = np.zeros(balance.shape), np.full(balance.shape, Status.GAP)
    for k in range(len(time)):
        if missing[k]:
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
        status[k] = Status.START_UP if settled < 3.0 else Status.VALID
    return residual, status


@pytest.mark.parametrize("joints", [1, 2, 6])
@pytest.mark.parametrize("seed", range(3))
def test_residual_and_status_are_those_of_the_modes_of_every_step(joints, seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(300, 700))
    time = np.cumsum(1e-3 + 2e-4 * rng.random(count))
    time[count // 3 :] += 0.08  # bridged
    time[count // 2 :] += 5.0  # a restart
    missing = rng.random(count) < 0.1
    missing[:3] = missing[100:120] = missing[-2:] = True
    balance, speed = rng.normal(size=(count, joints)), 0.01 * rng.normal(size=(count, joints))
    smooth = np.linspace(0.0, 1.0, count)[:, np.newaxis, np.newaxis]
    ends = 20.0 * random_matrices(seed, joints, 2, 20.0)
    inertia = ends[0] + smooth * (ends[1] - ends[0])
    gains = 30.0 * np.diag(ends[0])
    inputs = time, balance, speed
    found, status = observe_velocity(*inputs, lambda rows: inertia[rows], missing, gains)
    expected, expected_status = observed_by_modes(*inputs, inertia, missing, gains)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_array_equal(status, expected_status)
    assert {Status.GAP, Status.START_UP} <= set(status.ravel().tolist())
    for part in (1, 5, 200):
        head, head_status = observe_velocity(
            *(item[:part] for item in inputs),
            lambda rows, part=part: inertia[:part][rows],
            missing[:part],
            gains,
        )
        np.testing.assert_array_equal(head, found[:part])
        np.testing.assert_array_equal(head_status, status[:part])
