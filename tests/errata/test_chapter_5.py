"""Chapter 5: the state model of the friction-estimating Kalman filter, its matrices, and the machine at rest."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from cdtool.base.arrays import FloatArray

# The states of 5.5: d_t [N m s/rad], motor acceleration [rad/s2], motor speed [rad/s].
X = sp.Matrix(sp.symbols("x1 x2 x3", real=True))
u, J_t, T_s = sp.symbols("u J_t T_s", positive=True)


def model(state: sp.Matrix) -> sp.Matrix:
    """The right side of 5.5 without noise."""
    return sp.Matrix([state[0], (u - state[0] * state[2]) / J_t, state[2] + T_s * state[1]])


def observation(state: sp.Matrix) -> sp.Matrix:
    """z1 and z2 of 5.5 without noise."""
    return sp.Matrix([state[1], state[2]])


OBSERVATION_MATRIX = sp.Matrix([[0, 1, 0], [0, 0, 1]])


def state_matrix(friction: float, speed: float, inertia: float = 2e-3, step: float = 1e-3) -> FloatArray:
    """5.6 in numbers."""
    return np.array([[1.0, 0.0, 0.0], [-speed / inertia, 0.0, -friction / inertia], [0.0, step, 1.0]])


def test_5_6_is_the_derivative_of_5_5():
    printed = sp.Matrix([[1, 0, 0], [-X[2] / J_t, 0, -X[0] / J_t], [0, T_s, 1]])
    assert sp.simplify(model(X).jacobian(X) - printed) == sp.zeros(3)


def test_5_4_holds_the_contact_force_of_5_3_as_a_friction_coefficient():
    d_t, d_c, r, omega = sp.symbols("d_t d_c r omega", positive=True)
    force = d_c * r * omega
    assert sp.expand(force * r + d_t * omega - (d_t + d_c * r**2) * omega) == 0


def test_the_observations_before_5_5_are_in_the_other_order_than_5_5_and_5_7():
    assert observation(X).jacobian(X) == OBSERVATION_MATRIX
    printed_list = sp.Matrix([X[2], X[1]])
    assert printed_list.jacobian(X) != OBSERVATION_MATRIX


def test_the_state_model_predicts_from_the_old_state_and_not_from_the_new_one():
    following = model(X)
    assert following[2] == X[2] + T_s * X[1]
    # x(k+1) = f(x(k+1), u(k)) is a condition on the new state alone, and allows no acceleration at all.
    fixed = sp.solve(list(model(X) - X), list(X), dict=True)
    assert fixed and all(solution[X[1]] == 0 for solution in fixed)


def test_5_7_is_the_derivative_by_the_state_and_not_by_the_input():
    assert observation(X).jacobian(X) == OBSERVATION_MATRIX
    by_input = observation(X).diff(u)
    assert by_input.shape == (2, 1) != OBSERVATION_MATRIX.shape
    assert by_input == sp.zeros(2, 1)


def test_5_8_holds_variances_and_not_the_noises_of_5_5():
    def mean_normalised_innovation(plant: float, sensor: float) -> float:
        """Kalman filter of a random walk: the squared innovation over its own variance, 1 where Q and R are right."""
        estimate, variance, total = 0.0, 1.0, 0.0
        for z in measured:
            variance += plant
            spread, innovation = variance + sensor, z - estimate
            total += innovation**2 / spread
            estimate += variance / spread * innovation
            variance *= sensor / spread
        return total / len(measured)

    rng, walk, noise = np.random.default_rng(5), 0.1, 3.0
    measured = np.cumsum(rng.normal(scale=walk, size=20_000)) + rng.normal(scale=noise, size=20_000)
    assert mean_normalised_innovation(walk**2, noise**2) == pytest.approx(1.0, abs=0.03)
    assert mean_normalised_innovation(walk, noise) > 2.0


def observability_rank(speed: float) -> int:
    matrix, seen = state_matrix(1e-4, speed), np.array(OBSERVATION_MATRIX, dtype=float)
    return int(np.linalg.matrix_rank(np.vstack([seen, seen @ matrix, seen @ matrix @ matrix])))


def friction_gain_and_variance(speed: float) -> tuple[FloatArray, FloatArray]:
    """Row 1 of the Kalman gain and P11, sample by sample, about a speed held."""
    seen, matrix = np.array(OBSERVATION_MATRIX, dtype=float), state_matrix(1e-4, speed)
    plant, sensor = np.diag([1e-10, 4.0, 1e-2]), np.diag([900.0, 0.25])
    covariance, gains, variances = np.diag([1e-6, 1.0, 1.0]), [], []
    for _ in range(2000):
        covariance = matrix @ covariance @ matrix.T + plant
        gain = covariance @ seen.T @ np.linalg.inv(seen @ covariance @ seen.T + sensor)
        gains.append(gain[0])
        variances.append(covariance[0, 0])
        covariance = (np.eye(3) - gain @ seen) @ covariance
    return np.array(gains), np.array(variances)


def test_at_rest_the_friction_coefficient_is_unobservable_and_not_infinite():
    assert observability_rank(150.0) == 3
    assert observability_rank(0.0) == 2
    gains, variances = friction_gain_and_variance(0.0)
    # No measurement moves the estimate: it stays at its last value, while its variance grows by q1 a sample.
    assert np.all(gains == 0.0)
    assert np.diff(variances) == pytest.approx(np.full(1999, 1e-10), rel=1e-6)
    gains, variances = friction_gain_and_variance(150.0)
    assert np.all(np.abs(gains[-1]) > 1e-7)
    assert variances[-1] == pytest.approx(4.028945e-9, rel=1e-5)
