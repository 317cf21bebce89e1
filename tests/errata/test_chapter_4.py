"""Chapter 4: the impact on a rigid, an elastic and a controlled drive, and the example of Table 4.1 simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from cdtool.base.arrays import FloatArray

# Table 4.1 with its units put right: tau_m [N m], J_t [kg m2], d_t [N m s/rad], r [m/rad], k_c [N/m^1.5], n.
TORQUE, INERTIA, FRICTION, RATIO, STIFFNESS, EXPONENT = 0.5, 2.35e-4, 0.03, 0.015, 9.8261e8, 1.5
DAMPING = 2.9478e8  # d_c [N s/m^2.5]
MASS, LOAD_FRICTION, PUSH = INERTIA / RATIO**2, FRICTION / RATIO**2, TORQUE / RATIO
SPEED = RATIO * TORQUE / FRICTION

s, r, J_m, M_l, d_m, d_l, k_el, d_el, K_c, D_c = sp.symbols("s r J_m M_l d_m d_l k_el d_el K_c D_c", positive=True)
# The unit names stand for themselves; an equation that fits is an equation between monomials of them.
newton, metre, second = sp.symbols("N m s_", positive=True)


@dataclass(frozen=True)
class Contact:
    """One contact of the example: time since the touch [s], penetration [m], its rate [m/s], force [N], loss [J]."""

    time: FloatArray
    depth: FloatArray
    rate: FloatArray
    force: FloatArray
    friction_loss: FloatArray
    lasting: bool

    @property
    def restitution(self) -> float:
        return float(-self.rate[-1] / self.rate[0])

    @property
    def energy_loss(self) -> float:
        """Share of the kinetic energy of the approach that is gone after the contact."""
        return 1.0 - self.restitution**2


def contact_force(depth: FloatArray, rate: FloatArray, damping_ratio: float) -> FloatArray:
    return STIFFNESS * np.maximum(depth, 0.0) ** EXPONENT * (1.0 + damping_ratio * rate)


def fly(start: float, state: list[float], damping_ratio: float, driven: bool, crossing: float) -> Any:
    """Motion from `start` [s] until the penetration crosses zero upward (+1) or downward (-1), or until 0.1 s.

    The state is penetration [m], its rate [m/s] and the energy that friction has taken [J].
    """
    push, drag = (PUSH, LOAD_FRICTION) if driven else (0.0, 0.0)

    def motion(_: float, now: FloatArray) -> list[float]:
        force = contact_force(now[0], now[1], damping_ratio)
        return [now[1], (push - drag * now[1] - float(force)) / MASS, drag * now[1] ** 2]

    def crosses(_: float, now: FloatArray) -> float:
        return float(now[0])

    crosses.terminal, crosses.direction = True, crossing
    settings = {"rtol": 1e-9, "atol": 1e-13, "method": "DOP853", "dense_output": True}
    return solve_ivp(motion, (start, 0.1), state, events=crosses, **settings)


@cache
def contacts(damping_ratio: float = DAMPING / STIFFNESS, driven: bool = True, most: int = 20) -> tuple[Contact, ...]:
    """Every contact of the example, d_c/k_c = `damping_ratio` [s/m]; `driven`: by the motor against friction."""
    found: list[Contact] = []
    start, state = 0.0, [0.0, SPEED, 0.0]
    while len(found) < most:
        touch = fly(start, state, damping_ratio, driven, -1.0)
        time = np.linspace(start, touch.t[-1], 2000)
        depth, rate, lost = touch.sol(time)
        force = contact_force(depth, rate, damping_ratio)
        found.append(Contact(time, depth, rate, force, lost, lasting=touch.status == 0))
        if found[-1].lasting:
            break
        gap = fly(time[-1], [0.0, rate[-1], lost[-1]], damping_ratio, driven, +1.0)
        start, state = gap.t[-1], [0.0, gap.y[1, -1], gap.y[2, -1]]
    return tuple(found)


def test_4_2_pulls_without_a_clamp_and_holds_for_a_motionless_obstacle_only():
    def printed(depth: float, rate: float) -> float:
        return STIFFNESS * depth**EXPONENT + DAMPING * depth**EXPONENT * rate

    depth, withdrawal = 1e-5, -1.1 * STIFFNESS / DAMPING
    assert printed(depth, withdrawal) < 0.0
    # Cart and obstacle move together at 0.25 m/s: nothing is compressed any more, so nothing is damped.
    assert printed(depth, SPEED - SPEED) == STIFFNESS * depth**EXPONENT
    assert printed(depth, SPEED) > 1.07 * STIFFNESS * depth**EXPONENT


def test_4_5_has_the_unit_of_a_damping_only_divided_by_the_speed():
    n = sp.Symbol("n", positive=True)
    stiffness, damping = newton / metre**n, newton * second / metre ** (n + 1)
    right = stiffness / (metre / second)
    printed = stiffness * sp.sqrt(metre)
    assert sp.simplify(right / damping) == 1
    assert all(sp.simplify(printed / unit).free_symbols for unit in (damping, stiffness))


def test_the_units_and_names_of_table_4_1_are_not_those_of_its_equations():
    force = newton
    assert sp.simplify(force / metre ** sp.Rational(3, 2) * metre ** sp.Rational(3, 2)) == force
    assert sp.simplify(newton / metre * metre ** sp.Rational(3, 2)) != force
    damping = newton * second / metre ** sp.Rational(5, 2)
    assert sp.simplify(damping * metre ** sp.Rational(3, 2) * metre / second) == force
    assert sp.simplify(newton * second / metre * metre ** sp.Rational(3, 2) * metre / second) != force
    # The row called tau is r and the row called d_m is d_t: only so the steady speed is the 0.25 m/s of the text.
    assert pytest.approx(0.25) == SPEED


def test_table_4_1_does_not_hold_a_restitution_of_0_8():
    ratio = DAMPING / STIFFNESS
    assert ratio == pytest.approx(1.5 * (1 - 0.8), rel=1e-4)
    restitution = contacts(ratio, driven=False, most=1)[0].restitution
    assert restitution == pytest.approx(0.9524, abs=2e-4)
    # 3.21 with alpha = 0.2 s/m gives the same d_c, and the e of that alpha is the one simulated.
    assert restitution == pytest.approx(1 - ratio / 1.5 * SPEED, abs=3e-3)
    by_4_5_with_speed = 1.5 * (1 - 0.8) / SPEED
    assert contacts(by_4_5_with_speed, driven=False, most=1)[0].restitution == pytest.approx(0.83, abs=0.01)


def test_4_15_and_4_17_follow_from_4_14():
    J_t, d_t, k_c, d_c, n, theta, omega, torque = sp.symbols("J_t d_t k_c d_c n theta omega tau_m", positive=True)
    delta, rate = r * theta, r * omega
    from_4_14 = (torque - (k_c * delta**n + d_c * delta**n * rate) * r - d_t * omega) / J_t
    contact = d_c * theta**n * omega * r ** (2 + n) + k_c * theta**n * r ** (1 + n)
    assert sp.simplify(sp.expand_power_base(from_4_14 - (torque - d_t * omega - contact) / J_t)) == 0
    stiffness = k_c * n * r ** (n + 1) * theta ** (n - 1) + d_c * n * r ** (n + 2) * theta ** (n - 1) * omega
    assert sp.simplify(contact.diff(theta) - stiffness) == 0
    assert sp.simplify(contact.diff(omega) - d_c * r ** (n + 2) * theta**n) == 0


def test_4_19_is_4_18_only_with_gain_and_inertia():
    inertia, damping, stiffness = sp.symbols("J_t d K", positive=True)
    thesis_4_18 = 1 / (inertia * s**2 + damping * s + stiffness)
    natural = sp.sqrt(stiffness / inertia)

    def second_order(numerator: sp.Expr, ratio: sp.Expr) -> sp.Expr:
        return numerator / (s**2 + 2 * ratio * natural * s + natural**2)

    right = second_order(natural**2 / stiffness, damping / (2 * inertia * natural))
    assert sp.simplify(right - thesis_4_18) == 0
    assert sp.simplify(second_order(natural, damping / (2 * natural)) - thesis_4_18) != 0
    # Each of the two slips is one on its own.
    assert sp.simplify(second_order(natural**2 / stiffness, damping / (2 * natural)) - thesis_4_18) != 0
    assert sp.simplify(second_order(natural, damping / (2 * inertia * natural)) - thesis_4_18) != 0


def linearised(depth: float, speed: float) -> tuple[float, float]:
    """Natural frequency [rad/s] and damping ratio of 4.19, corrected, about a penetration [m] and its rate [m/s]."""
    stiffness = EXPONENT * RATIO**2 * depth ** (EXPONENT - 1) * (STIFFNESS + DAMPING * speed)
    damping = FRICTION + DAMPING * RATIO**2 * depth**EXPONENT
    natural = math.sqrt(stiffness / INERTIA)
    return natural, damping / (2 * INERTIA * natural)


def test_the_damping_ratio_does_not_rise_with_penetration_and_speed():
    natural, ratio = zip(*(linearised(depth * 1e-6, SPEED) for depth in (0.1, 1, 10, 50, 91)), strict=True)
    assert natural == pytest.approx([692.6, 1231.7, 2190.3, 3275.2, 3804.2], rel=1e-3)
    assert ratio == pytest.approx([0.0922, 0.0519, 0.0312, 0.0347, 0.0490], abs=1e-4)
    assert list(natural) == sorted(natural)
    assert list(ratio) != sorted(ratio)
    assert linearised(1e-5, 0.2)[1] < linearised(1e-5, 0.1)[1]


def test_4_21_leaves_the_friction_of_the_load_out():
    def stiff(load_friction: sp.Expr) -> sp.Expr:
        """Motor torque of 4.21 at acceleration a and speed w of the motor, with the stiff drive x = r theta."""
        elastic_torque = r * (M_l * r * a + load_friction * r * w)
        return elastic_torque + J_m * a + d_m * w

    a, w = sp.symbols("a w")
    thesis_4_6 = (J_m + M_l * r**2) * a + (d_m + d_l * r**2) * w
    assert sp.expand(stiff(d_l) - thesis_4_6) == 0
    assert sp.expand(stiff(sp.Integer(0)) - thesis_4_6) != 0


def test_4_24_has_a_factor_r_too_many():
    force, acceleration, a = sp.symbols("F_c deltadd a", positive=True)
    stiff = {acceleration: r * a}
    for factor, fits in ((1, True), (r, False)):
        elastic_torque = r * (M_l * acceleration + factor * force)
        torque = (elastic_torque + J_m * a).subs(stiff)
        thesis_4_14 = force * r + (J_m + M_l * r**2) * a
        assert (sp.expand(torque - thesis_4_14) == 0) == fits


def test_4_24_hides_the_pre_tension_of_the_transmission():
    theta, delta, omega, rate, theta_c, x_o = sp.symbols("theta delta omega rate theta_c x_o")

    def elastic_torque(angle: sp.Expr, position: sp.Expr) -> sp.Expr:
        return k_el * (angle - position / r) + d_el * (omega - rate / r)

    right = elastic_torque(theta + theta_c, delta + x_o)
    hidden = sp.expand(right - elastic_torque(theta, delta))
    assert sp.expand(hidden - k_el * (theta_c - x_o / r)) == 0
    # At steady speed the transmission carries the friction of the load, so it is slack only for d_l = 0.
    steady = sp.solve(hidden / r - d_l * rate, theta_c)[0]
    assert sp.simplify(hidden.subs(theta_c, steady) - r * d_l * rate) == 0
    # The whole torque at the first touch would count the damper twice where the two speeds differ.
    at_touch = elastic_torque(theta_c, x_o)
    assert sp.expand(at_touch - hidden) != 0
    assert sp.expand((at_touch - hidden).subs(rate, r * omega)) == 0


def test_4_25_is_not_linear():
    depth, rate = sp.symbols("delta rate", positive=True)
    printed, right = K_c * depth + D_c * depth * rate, K_c * depth + D_c * rate
    doubled = {depth: 2 * depth, rate: 2 * rate}
    assert sp.expand(right.subs(doubled, simultaneous=True) - 2 * right) == 0
    assert sp.expand(printed.subs(doubled, simultaneous=True) - 2 * printed) != 0


def test_4_26_needs_the_angle_since_the_contact_in_its_first_line():
    t, theta_c = sp.symbols("t theta_c", positive=True)
    since_contact = sp.sin(2 * t)  # any motion that begins at 0
    first, second = since_contact.diff(t), since_contact.diff(t, 2)

    def transform(of: sp.Expr) -> sp.Expr:
        return sp.laplace_transform(of, t, s, noconds=True)

    torque = transform(J_m * second + d_m * first)

    def right_side(angle: sp.Expr) -> sp.Expr:
        return J_m * transform(angle) * s**2 + d_m * transform(angle) * s - J_m * first.subs(t, 0)

    assert sp.simplify(right_side(since_contact) - torque) == 0
    assert sp.simplify(right_side(since_contact + theta_c) - torque) != 0


D_T = d_m + d_el


def solved_4_26() -> tuple[sp.Expr, sp.Expr]:
    """Penetration a unit of the load's initial momentum, and motor angle a unit of penetration, from 4.26."""
    theta, delta, impulse = sp.symbols("Theta Delta P")
    elastic_torque = (k_el + d_el * s) * (theta - delta / r)
    motor = sp.Eq(-elastic_torque, J_m * theta * s**2 + d_m * theta * s)
    load = sp.Eq(elastic_torque / r + impulse, (M_l * s**2 + D_c * s + K_c) * delta)
    found = sp.solve([motor, load], [theta, delta], dict=True)[0]
    return sp.cancel(found[delta] / impulse), sp.cancel(found[theta] / found[delta])


def g_c(a1: sp.Expr) -> sp.Expr:
    """4.27 with 4.30 and the a0, a2, a3, a4 of 4.29."""
    a3 = J_m * D_c + D_T * M_l + J_m / r**2 * d_el
    a2 = J_m * K_c + D_c * D_T + k_el * M_l + J_m / r**2 * k_el + d_m / r**2 * d_el
    return (J_m * s**2 + D_T * s + k_el) / (J_m * M_l * s**4 + a3 * s**3 + a2 * s**2 + a1 * s + K_c * k_el)


def test_4_29_has_a_term_too_many_in_a1():
    right = D_T * K_c + D_c * k_el + d_m / r**2 * k_el
    penetration = solved_4_26()[0]
    assert sp.simplify(g_c(right) - penetration) == 0
    assert sp.simplify(g_c(right + J_m / r**2 * d_el) - penetration) != 0


def test_4_28_has_no_factor_one_over_r():
    printed = (d_el * s + k_el) / (J_m * s**2 + D_T * s + k_el)
    angle = solved_4_26()[1]
    assert sp.simplify(printed / r - angle) == 0
    assert sp.simplify(printed - angle) != 0
    assert sp.simplify(angle.subs(s, 0) * r) == 1


def undamped_denominator(square: sp.Expr) -> sp.Expr:
    """The denominator of 4.31 as a polynomial in s^2, with K_c for K_delta."""
    return J_m * M_l * square**2 + (J_m * K_c + k_el * M_l + J_m * k_el / r**2) * square + K_c * k_el


def test_4_33_and_4_35_are_without_the_imaginary_unit():
    free = {d_m: 0, d_el: 0, D_c: 0}
    penetration, angle = (part.subs(free) for part in solved_4_26())
    assert sp.simplify(penetration - (J_m * s**2 + k_el) / undamped_denominator(s**2)) == 0
    printed = sp.sqrt(k_el / J_m)
    for polynomial in (sp.numer(sp.together(penetration)), sp.denom(sp.together(angle))):
        assert sp.simplify(polynomial.subs(s, sp.I * printed)) == 0
        assert sp.simplify(polynomial.subs(s, printed)) != 0
    assert sp.simplify(penetration.subs(s, 0) - 1 / K_c) == 0


def resonances(fraction: float, load: float) -> tuple[float, float]:
    """w1 and w2 over sqrt(k_el/J_m), K_c as a share of the limit 4.36, `load` = M_l r^2/J_m."""
    limit = k_el * (J_m + M_l * r**2) / (J_m * r**2)
    values = {J_m: 1, k_el: 1, r: 1, M_l: load}
    coefficients = sp.Poly(undamped_denominator(s).subs(K_c, fraction * limit).subs(values), s).all_coeffs()
    low, high = sorted(-np.roots([float(item) for item in coefficients]).real)
    return math.sqrt(low), math.sqrt(high)


def test_4_36_does_not_separate_the_two_cases_of_its_text():
    # Negative between two positive ends: one resonance lies below and one above that of the transmission, always.
    between = sp.simplify(undamped_denominator(-k_el / J_m))
    assert between == -(k_el**2) / r**2
    assert resonances(1.0, 1.35) == pytest.approx((0.7780, 1.696), abs=1e-3)

    def motion_ratio(fraction: float, load: float) -> float:
        return 1 / (1 - resonances(fraction, load)[0] ** 2)

    for load in (0.01, 1.35, 100.0):
        assert resonances(0.01, load)[0] < 1 < resonances(0.01, load)[1]
        assert resonances(100.0, load)[0] < 1 < resonances(100.0, load)[1]
        # The text has the two cases exchanged: the soft contact, below the transmission, is the rigid one.
        assert motion_ratio(0.01, load) < 1.02 < 20.0 < motion_ratio(100.0, load)
        # At the printed limit motor and load are far from moving as one; a tenth or a twentieth of it is needed.
        assert motion_ratio(1.0, load) > 2.0
        assert 1.10 <= round(motion_ratio(0.1, load), 3) <= 1.112
        assert 1.05 <= round(motion_ratio(0.05, load), 3) <= 1.053
    assert motion_ratio(1.0, 1.35) == pytest.approx(2.533, abs=1e-3)


def test_4_38_is_a_transfer_function_only_without_the_error_and_with_a_filter():
    error, k_p, k_i, k_d, filter_time = sp.symbols("E K_P K_I K_D T_f", positive=True)
    printed = error * (k_p + k_d * s + k_i / s)
    right = k_p + k_d * s / (1 + filter_time * s) + k_i / s
    assert (printed * error).diff(error, 2) != 0
    assert (right * error).diff(error, 2) == 0
    assert sp.limit(printed, s, sp.oo) == sp.oo
    assert sp.limit(right, s, sp.oo) == k_p + k_d / filter_time


def test_4_39_needs_the_factor_r_and_the_speed_loop():
    J_t, d_t, tau_a, gain, k_p, k_i = sp.symbols("J_t d_t tau_a mu_a K_P K_I", positive=True)
    torque, force, u = sp.symbols("tau_m F_c u")
    position, actuator, regulator = 1 / (J_t * s**2 + d_t * s), gain / (tau_a * s + 1), k_p + k_i / s
    speed = s * position * (torque - r * force)
    found = sp.solve([sp.Eq(u, -regulator * speed), sp.Eq(torque, actuator * u)], [torque, u], dict=True)[0]
    loop = s * position * regulator * actuator
    printed_loop = position * regulator * actuator
    assert sp.simplify(found[torque] / force - r * loop / (1 + loop)) == 0
    assert sp.simplify(found[u] / force - r / actuator * loop / (1 + loop)) == 0
    assert sp.simplify(found[torque] / force - loop / (1 + loop)) != 0
    assert sp.simplify(found[torque] / force - r * printed_loop / (1 + printed_loop)) != 0
    # A speed controller with an integral part holds the whole contact force in the end: r F_c, not F_c.
    assert sp.limit(sp.simplify(found[torque] / force), s, 0) == r


def test_the_example_of_figure_4_3_agrees_in_speed_time_force_and_penetration():
    decay = FRICTION / INERTIA
    # The gap is not stated; 0.100 m from standstill gives the 408 ms of the text.
    touch = brentq(lambda t: SPEED * (t - (1 - math.exp(-decay * t)) / decay) - 0.1, 0.1, 1.0)
    assert touch == pytest.approx(0.4078, abs=2e-4)
    first = contacts()[0]
    assert np.max(first.force) == pytest.approx(864.6, abs=0.2)
    assert np.max(first.depth) == pytest.approx(91.7e-6, abs=0.1e-6)
    assert first.time[-1] == pytest.approx(1.130e-3, abs=2e-6)
    # With 1/v_i in 4.5 and e = 0.8 the peak would not be the 864 N of the text.
    assert np.max(contacts(1.5 * (1 - 0.8) / SPEED, most=1)[0].force) == pytest.approx(821.8, abs=0.2)


def test_the_first_contact_of_figure_4_3_loses_24_percent_of_the_kinetic_energy_and_not_52():
    first, kinetic = contacts()[0], MASS * SPEED**2 / 2
    assert first.rate[-1] == pytest.approx(-0.2181, abs=1e-4)
    assert first.energy_loss == pytest.approx(0.239, abs=0.001)
    assert first.friction_loss[-1] / kinetic == pytest.approx(0.146, abs=0.001)
    # A damping that does lose 52 % gives neither the peak force nor the penetration of the text.
    needed = brentq(lambda ratio: contacts(ratio, most=1)[0].energy_loss - 0.52, 1.0, 3.0, xtol=1e-4)
    assert needed == pytest.approx(1.7315, abs=1e-3)
    softer = contacts(needed, most=1)[0]
    assert np.max(softer.force) == pytest.approx(809.5, abs=0.2)
    assert np.max(softer.depth) == pytest.approx(84.7e-6, abs=0.1e-6)


def test_nothing_ends_63_ms_after_the_first_touch_of_figure_4_3():
    *bounces, last = contacts()
    assert len(bounces) == 8 and last.lasting
    starts = [12.25e-3, 20.14e-3, 26.08e-3, 30.89e-3, 35.00e-3]
    assert [contact.time[0] for contact in bounces[1:6]] == pytest.approx(starts, abs=0.01e-3)
    assert bounces[-1].time[-1] == pytest.approx(44.25e-3, abs=0.01e-3)
    # Then the motor presses the cart to the wall permanently: the force oscillates about 33.3 N and decays slowly.
    assert last.time[0] == pytest.approx(44.84e-3, abs=0.01e-3)
    swing = np.abs(last.force / PUSH - 1)
    assert last.time[swing > 0.5][-1] == pytest.approx(61.1e-3, abs=0.1e-3)
    assert np.max(swing[last.time > 63e-3]) == pytest.approx(0.41, abs=0.01)
    assert last.time[swing > 0.2][-1] == pytest.approx(73.1e-3, abs=0.1e-3)
    assert last.time[np.abs(last.rate) > 0.01 * SPEED][-1] == pytest.approx(76.5e-3, abs=0.1e-3)
