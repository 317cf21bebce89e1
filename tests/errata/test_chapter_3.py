"""Chapter 3: restitution, contact laws and their damping factor, derived and compared with a simulated impact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import cumulative_trapezoid, solve_ivp
from scipy.optimize import brentq

from cdtool.base.arrays import FloatArray

# Thesis 3.3 and 3.6: v = V2 - V1 is negative while the bodies approach.
E = sp.Symbol("e", positive=True)
MASS, SPEED = sp.symbols("m v", positive=True)
V_I = -SPEED
V_F = E * SPEED
P_C = -MASS * V_I
P_F = MASS * V_F - MASS * V_I


@dataclass(frozen=True)
class Impact:
    """A unit mass thrown with `approach` on a unit stiffness: time [s], penetration [m], its rate [m/s], force [N]."""

    time: FloatArray
    penetration: FloatArray
    rate: FloatArray
    force: FloatArray

    @property
    def restitution(self) -> float:
        return float(-self.rate[-1] / self.rate[0])


def impact(force: Callable[[FloatArray, FloatArray], FloatArray], approach: float = 1.0) -> Impact:
    def motion(_: float, state: FloatArray) -> list[float]:
        return [state[1], -float(force(state[0], state[1]))]

    def separation(_: float, state: FloatArray) -> float:
        return float(state[0])

    separation.terminal, separation.direction = True, -1.0
    found = solve_ivp(motion, (0.0, 1e3), [0.0, approach], rtol=1e-9, atol=1e-12, events=separation, dense_output=True)
    time = np.linspace(0.0, found.t[-1], 5001)
    penetration, rate = found.sol(time)
    penetration[0] = penetration[-1] = 0.0
    return Impact(time, penetration, rate, force(penetration, rate))


def hunt_crossley(damping: float, exponent: float = 1.5) -> Impact:
    """3.19 with 3.20 for k = 1 and mu = `damping`; with a unit approach speed, x = mu v / k = `damping`."""
    return impact(lambda depth, rate: np.maximum(depth, 0.0) ** exponent * (1.0 + damping * rate))


def restitution_of(x: float) -> float:
    """e of x = mu v/k, from x (1 + e) = ln((1 + x)/(1 - e x)): the motion 3.19 integrated, for any n."""
    return float(brentq(lambda e: (1.0 - e * x) * exp(x * (1.0 + e)) - (1.0 + x), 0.0, 1.0))


def damping_of(restitution: float) -> float:
    return float(brentq(lambda x: restitution_of(x) - restitution, 1e-6, 3.0))


def test_3_4_gives_plus_e_only_without_its_minus():
    ratio = (P_F - P_C) / P_C
    assert sp.simplify(ratio - E) == 0
    assert sp.simplify(-ratio - E) != 0
    assert sp.simplify(-ratio + E) == 0


def test_3_9_needs_the_square():
    compression = -MASS * V_I**2 / 2
    right = MASS * V_I**2 / 2 * (1 - P_F / P_C) ** 2
    printed = MASS * V_I**2 / 2 * (1 - P_F / P_C)
    assert sp.simplify(-right / compression - E**2) == 0
    assert sp.simplify(right - MASS * V_F**2 / 2) == 0
    assert sp.simplify(-printed / compression + E) == 0
    assert sp.solve(-printed / compression - E**2, E) == []


def test_3_2_3_4_and_3_8_are_one_coefficient_for_a_direct_impact():
    hit = hunt_crossley(0.6)
    deepest = int(np.argmax(hit.penetration))
    impulse = cumulative_trapezoid(hit.force, hit.time, initial=0.0)
    # The contact force opposes the penetration, so its work on the bodies is negative until the deepest point.
    work = cumulative_trapezoid(-hit.force * hit.rate, hit.time, initial=0.0)
    compression, recovered = work[deepest], work[-1] - work[deepest]
    assert impulse[deepest] == pytest.approx(hit.rate[0], abs=1e-3)
    assert (impulse[-1] - impulse[deepest]) / impulse[deepest] == pytest.approx(hit.restitution, abs=1e-3)
    assert np.sqrt(-recovered / compression) == pytest.approx(hit.restitution, abs=1e-3)


def test_3_10_needs_the_magnitude_of_the_approach_speed():
    alpha = 0.2
    for exponent in (1, sp.Rational(1, 5)):
        right, printed = (1 - alpha * v**exponent for v in (sp.Abs(sp.Rational(-1, 4)), sp.Rational(-1, 4)))
        assert 0 < right < 1
        assert not (printed.is_real and printed < 1)


def test_3_14_and_3_15_together_are_the_stiffness_of_hertz():
    youngs, poisson, radii = (210e9, 3e9), (0.3, 0.4), (0.01, 0.05)
    h = [(1 - nu**2) / (np.pi * e) for nu, e in zip(poisson, youngs, strict=True)]
    printed = 4 / (3 * np.pi * sum(h)) * np.sqrt(radii[0] * radii[1] / sum(radii))
    modulus = 1 / sum((1 - nu**2) / e for nu, e in zip(poisson, youngs, strict=True))
    radius = 1 / (1 / radii[0] + 1 / radii[1])
    assert printed == pytest.approx(4 / 3 * modulus * np.sqrt(radius), rel=1e-12)


def test_3_16_unloads_with_the_exponent_of_the_loading():
    depth, n, peak = sp.symbols("delta n F_max", positive=True)
    deepest, left = sp.Integer(1), sp.Rational(1, 5)
    loading = sp.integrate(peak * depth**n, (depth, 0, deepest))

    def restitution_squared(exponent: sp.Expr, permanent: sp.Expr) -> sp.Expr:
        # Substituted u = (delta - delta_p)/(delta_c - delta_p), so that the integral runs from 0 to 1.
        unloading = sp.integrate(peak * depth**exponent, (depth, 0, 1)) * (deepest - permanent)
        return sp.simplify(unloading / loading)

    assert restitution_squared(n, left) == 1 - left
    # No permanent indentation, no loss: that is what the text says of 3.16.
    assert restitution_squared(n, sp.Integer(0)) == 1
    assert restitution_squared(sp.Integer(2), sp.Integer(0)).subs(n, sp.Rational(3, 2)) == sp.Rational(5, 6)


def test_3_17_ends_in_tension_and_3_18_does_not():
    damping = 0.5
    linear = impact(lambda depth, rate: depth + damping * rate)
    hysteresis = impact(lambda depth, rate: depth * (1.0 + damping * rate))
    assert linear.force[0] == pytest.approx(damping)
    assert linear.force[-1] < -0.1
    assert hysteresis.force[0] == 0.0
    assert np.min(hysteresis.force) >= 0.0
    assert np.max(hysteresis.force) > 0.5


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_3_19_loses_the_energy_of_its_closed_form_for_any_exponent(exponent):
    for x in (0.075, 0.3, 1.0):
        assert hunt_crossley(x, exponent).restitution == pytest.approx(restitution_of(x), abs=1e-6)


def test_3_21_belongs_to_e_equal_to_one_less_alpha_v():
    for alpha in (0.002, 0.01):
        achieved = hunt_crossley(1.5 * alpha).restitution
        # Of first order: what is left is of the order of alpha squared.
        assert abs(achieved - (1 - alpha)) < alpha**2
        # With the alpha of 3.10, e^2 = 1 - alpha v, the same factor loses twice the energy.
        assert 1 - achieved**2 == pytest.approx(2 * alpha, rel=0.02)
        assert 1 - hunt_crossley(0.75 * alpha).restitution ** 2 == pytest.approx(alpha, rel=0.02)


def test_3_22_is_the_factor_of_lankarani_and_nikravesh_with_the_alpha_of_3_21():
    alpha, k = sp.symbols("alpha k", positive=True)
    printed = sp.Rational(3, 2) * alpha * k * (1 - alpha * SPEED / 2)
    stated = 3 * k * (1 - E**2) / (4 * SPEED)
    assert sp.simplify(printed - stated.subs(E, 1 - alpha * SPEED)) == 0
    assert sp.simplify(printed - stated.subs(E, sp.sqrt(1 - alpha * SPEED))) != 0


def test_3_21_and_3_22_give_too_little_damping_for_a_low_restitution():
    exact = [damping_of(e) for e in (0.9, 0.8, 0.7, 0.5)]
    assert exact == pytest.approx([0.166482, 0.373146, 0.634828, 1.432751], abs=1e-6)
    assert hunt_crossley(exact[-1]).restitution == pytest.approx(0.5, abs=1e-6)
    for e, x in zip((0.9, 0.8, 0.7, 0.5), exact, strict=True):
        alpha = 1 - e
        assert 1.5 * alpha * (1 - alpha / 2) < 1.5 * alpha < x
    assert 1.5 * (1 - 0.5) / exact[-1] == pytest.approx(0.52, abs=0.01)
