"""Chapter 2: the estimators of the collision torque, derived on a two-link arm in absolute link angles."""

from __future__ import annotations

import sympy as sp

Q = sp.Matrix(sp.symbols("q1 q2", real=True))
V = sp.Matrix(sp.symbols("qd1 qd2", real=True))
TAU_J = sp.Matrix(sp.symbols("tau_J1 tau_J2", real=True))
TAU_C = sp.Matrix(sp.symbols("tau_c1 tau_c2", real=True))
TAU_F = sp.Matrix(sp.symbols("tau_f1 tau_f2", real=True))
RES = sp.Matrix(sp.symbols("res1 res2", real=True))
M11, M22, H, G1, G2, K1, K2, S = sp.symbols("M11 M22 h g1 g2 k1 k2 s", positive=True)
K = sp.diag(K1, K2)
M = sp.Matrix([[M11, H * sp.cos(Q[1] - Q[0])], [H * sp.cos(Q[1] - Q[0]), M22]])
POTENTIAL_ENERGY = G1 * sp.sin(Q[0]) + G2 * sp.sin(Q[1])
GRAVITY = sp.Matrix([POTENTIAL_ENERGY]).jacobian(Q).T


def christoffel_matrix() -> sp.Matrix:
    """C of C qd with C_ij = 1/2 sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) qd_k."""

    def entry(i: int, j: int) -> sp.Expr:
        return sum((M[i, j].diff(Q[k]) + M[i, k].diff(Q[j]) - M[j, k].diff(Q[i])) * V[k] / 2 for k in range(2))

    return sp.Matrix(2, 2, entry)


C = christoffel_matrix()
# The forces that accelerate the arm, from 2.4 with friction: M qdd = tau_J - C qd - g - tau_f - tau_c.
ACCELERATING = TAU_J - C * V - GRAVITY - TAU_F - TAU_C
MASS_RATE = M.diff(Q[0]) * V[0] + M.diff(Q[1]) * V[1]
MOMENTUM_RATE = MASS_RATE * V + ACCELERATING


def vanishes(expression: sp.Expr | sp.Matrix) -> bool:
    """Whether an expression is zero; where it is not simplified to zero, its value at a point must differ from zero."""
    left = sp.Matrix([expression]).applyfunc(sp.simplify)
    if left.is_zero_matrix:
        return True
    symbols = sorted(left.free_symbols, key=str)
    assert sp.N(left.subs({item: sp.Rational(5 + i, 6) for i, item in enumerate(symbols)}).norm()) > 1e-9
    return False


def energy_rate() -> sp.Expr:
    """dE/dt of E = T + U along the motion of the arm."""
    kinetic = (V.T * (MASS_RATE * V / 2 + ACCELERATING))[0]
    return kinetic + (GRAVITY.T * V)[0]


def test_the_christoffel_form_of_c_gives_the_rate_of_the_inertia_matrix():
    lagrange = MASS_RATE * V - sp.Matrix([(V.T * M * V)[0] / 2]).jacobian(Q).T
    assert vanishes(C * V - lagrange)
    assert vanishes(MASS_RATE - C - C.T)
    # Another C with the same product C qd is as good in 2.1, and useless in 2.17.
    other = C + H * sp.sin(Q[1] - Q[0]) * sp.Matrix([[V[1], -V[0]], [0, 0]])
    assert vanishes(other * V - C * V)
    assert not vanishes(MASS_RATE - other - other.T)


def test_2_6_without_friction_mistakes_friction_for_a_collision():
    printed = TAU_J - ACCELERATING - C * V - GRAVITY
    right = printed - TAU_F
    assert vanishes(right - TAU_C)
    assert not vanishes(printed - TAU_C)


def test_2_9_tends_to_plus_the_collision_power_only_with_its_signs_exchanged():
    k, res = sp.symbols("k res", positive=True)
    supplied, collision = (V.T * (TAU_J - TAU_F))[0], (V.T * TAU_C)[0]
    right = k * (supplied - res - energy_rate())
    printed = k * (energy_rate() - (supplied + res))
    thesis_2_10 = -k * res + k * collision
    assert vanishes(right - thesis_2_10)
    assert not vanishes(printed - thesis_2_10)
    assert vanishes(printed - (-k * res - k * collision))


def test_2_10_filters_the_power_of_the_collision_and_not_its_work():
    t, k, power = sp.symbols("t k P", positive=True)
    res = sp.Function("res")
    found = sp.dsolve(res(t).diff(t) + k * res(t) - k * power, res(t), ics={res(0): 0}).rhs
    assert sp.limit(found, t, sp.oo) == power
    assert sp.limit(found / (power * t), t, sp.oo) == 0
    # A body that pushes the machine forward takes power from the obstacle: the signal then falls below zero.
    assert found.subs({power: -1, k: 1, t: 1}) < 0


def test_2_12_is_the_rate_of_the_estimated_speed_and_not_the_speed():
    n = C * V + GRAVITY + TAU_F
    right = K * (M.inv() * (TAU_J - n - RES) - M.inv() * ACCELERATING)
    assert vanishes(right - K * M.inv() * (TAU_C - RES))
    # Taken literally 2.12 and 2.13 are algebraic; free steady motion, tau_J = n, then looks like a collision.
    printed = (sp.eye(2) + K * M.inv()).inv() * K * (M.inv() * (TAU_J - n) - V)
    free = dict(zip(TAU_J, n, strict=True))
    assert not vanishes(printed.subs(free))
    assert vanishes(right.subs(free).subs(dict.fromkeys([*RES, *TAU_C], 0)))


def test_2_11_assumes_a_constant_torque_and_not_a_constant_estimate():
    rate = K * M.inv() * (TAU_C - RES)
    assert vanishes(rate.subs(dict(zip(RES, TAU_C, strict=True))))
    # With d(res)/dt = 0 the estimate stays at its start value 0, whatever the collision.
    assert not vanishes(rate.subs(dict.fromkeys(RES, 0)))


def test_2_15_solves_the_velocity_observer_for_a_frozen_inertia_matrix():
    filtered = (S * sp.eye(2) + K * M.inv()).inv() * K * M.inv() * TAU_C
    assert vanishes(S * filtered - K * M.inv() * (TAU_C - filtered))


def test_2_17_holds_with_beta_equal_to_gravity_less_c_transposed_qd_plus_friction():
    right = GRAVITY - C.T * V + TAU_F
    assert vanishes(MOMENTUM_RATE - (TAU_J - right - TAU_C))
    # The sum that 2.14 calls n is the one a reader would take.
    n = C * V + GRAVITY + TAU_F
    assert not vanishes(MOMENTUM_RATE - (TAU_J - n - TAU_C))
    assert vanishes(MOMENTUM_RATE - (TAU_J - n - TAU_C) - MASS_RATE * V)


def test_2_18_and_2_19_give_2_20_driven_by_tau_c():
    beta = GRAVITY - C.T * V + TAU_F
    estimated_rate = TAU_J - beta - RES
    right = K * (estimated_rate - MOMENTUM_RATE)
    assert vanishes(right - (-K * RES + K * TAU_C))
    assert not vanishes(K * (MOMENTUM_RATE - estimated_rate) - (-K * RES + K * TAU_C))
    # tau_e, read as the external torque on the robot, is -tau_c.
    assert not vanishes(right - (-K * RES + K * -TAU_C))


def test_2_21_needs_a_diagonal_gain():
    def residual(gain: sp.Matrix) -> sp.Matrix:
        return (S * sp.eye(2) + gain).inv() * gain * TAU_C

    assert vanishes(residual(K) - sp.Matrix([K1 / (S + K1) * TAU_C[0], K2 / (S + K2) * TAU_C[1]]))
    assert not vanishes(residual(sp.Matrix([[K1, 1], [1, K2]]))[0].diff(TAU_C[1]))
