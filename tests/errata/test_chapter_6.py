"""Chapter 6: the arm, its momentum observers, complementary filters and Kalman filter, against Lagrange's equations."""

from __future__ import annotations

import pytest
import sympy as sp

t = sp.Symbol("t")
q1, q2 = (sp.Function(name)(t) for name in ("q1", "q2"))
qd1, qd2, qdd1, qdd2 = q1.diff(t), q2.diff(t), q1.diff(t, 2), q2.diff(t, 2)
m1, m2, J1, J2, J_a1, J_a2, n1, n2, l1, l_g1, l_g2, l_imu1, l_imu2, g = sp.symbols(
    "m1 m2 J1 J2 J_a1 J_a2 n1 n2 l1 l_G1 l_G2 l_IMU1 l_IMU2 g", positive=True
)
s, k1, k2 = sp.symbols("s k1 k2", positive=True)
h = m2 * l1 * l_g2
GRAVITY_1, GRAVITY_2 = (m2 * l1 + m1 * l_g1) * g, m2 * l_g2 * g
M11, M22 = J_a1 / n1**2 + J1 + m2 * l1**2 + m1 * l_g1**2, J_a2 / n2**2 + J2 + m2 * l_g2**2
ELBOW = sp.Matrix([l1 * sp.cos(q1), l1 * sp.sin(q1)])


def along(length: sp.Expr, angle: sp.Expr) -> sp.Matrix:
    return sp.Matrix([length * sp.cos(angle), length * sp.sin(angle)])


CENTRES = (along(l_g1, q1), ELBOW + along(l_g2, q2))  # 6.13 to 6.16, with 6.14 put right


def vanishes(expression: sp.Expr) -> bool:
    """Whether an expression is zero; where it is not simplified to zero, its value at a point must differ from zero."""
    left = sp.simplify(sp.expand(sp.expand_trig(expression)))
    if left == 0:
        return True
    for item, value in zip((qdd1, qdd2, qd1, qd2, q1, q2), (7, -4, 3, 2, 5, -6), strict=True):
        left = left.subs(item, sp.Rational(value, 8))
    symbols = sorted(left.free_symbols, key=str)
    assert abs(sp.N(left.subs({item: sp.Rational(5 + i, 6) for i, item in enumerate(symbols)}))) > 1e-9
    return False


def lagrange() -> tuple[sp.Expr, sp.Expr]:
    """Joint torques of the arm with its motors on the base, from its energies."""
    links = ((m1, J1, J_a1, n1, q1), (m2, J2, J_a2, n2, q2))
    kinetic, potential = sp.Integer(0), sp.Integer(0)
    for (mass, inertia, motor_inertia, ratio, angle), centre in zip(links, CENTRES, strict=True):
        velocity, speed = centre.diff(t), angle.diff(t)
        kinetic += mass * velocity.dot(velocity) / 2 + inertia * speed**2 / 2 + motor_inertia * (speed / ratio) ** 2 / 2
        potential += mass * g * centre[1]
    energy = kinetic - potential
    first, second = (energy.diff(q.diff(t)).diff(t) - energy.diff(q) for q in (q1, q2))
    return first, second


TORQUE_1, TORQUE_2 = lagrange()
COS, SIN = sp.cos(q2 - q1), sp.sin(q2 - q1)


def filtered_speed(acceleration: sp.Expr, speed: sp.Expr, acceleration_power: int) -> sp.Expr:
    """6.5, 6.27, 6.30: the acceleration through s^power and the speed through k1 s + k2, over s^2 + k1 s + k2."""
    return (acceleration * s**acceleration_power + speed * (k1 * s + k2)) / (s**2 + k1 * s + k2)


def test_6_3_is_the_rate_of_the_estimated_momentum_and_not_the_momentum():
    p, res, gain, net, collision = sp.symbols("p res K net tau_c")
    momentum_rate = net - collision  # net = tau_m - d_t thetadot
    right = gain * ((net - res) - momentum_rate)
    assert sp.expand(right - gain * (collision - res)) == 0
    printed = sp.solve(sp.Eq(res, gain * ((net - res) - p)), res)[0]
    # Free steady motion, net = 0: no collision, yet the printed form follows the momentum.
    assert sp.simplify(printed.subs({net: 0}) + gain / (1 + gain) * p) == 0


def test_6_5_gives_a_speed_free_of_the_bias_of_the_accelerometer():
    speed, n, bias = sp.symbols("w n b", positive=True)
    right = filtered_speed(n * s * speed / n, speed, 1)
    assert sp.simplify(right - speed) == 0
    assert sp.simplify(right - speed / s) != 0
    of_bias = filtered_speed(bias / n / s, sp.Integer(0), 1)
    assert sp.limit(s * of_bias, s, 0) == 0


def test_6_6_relates_angle_to_angle_and_speed_to_speed():
    motor_angle = q1 / n1
    motor_speed = motor_angle.diff(t)
    assert vanishes(qd1 / n1 - motor_speed)
    assert not vanishes(q1 / n1 - motor_speed)


def specific_force(sensor: sp.Matrix, angle: sp.Expr) -> sp.Expr:
    """What the z axis of an accelerometer at `sensor` feels on a link at `angle`: upright at 0, so +g at rest there."""
    axis = sp.Matrix([-sp.sin(angle), sp.cos(angle)])
    return axis.dot(sensor.diff(t, 2) + sp.Matrix([0, g]))


def test_6_7_needs_the_acceleration_of_the_elbow_for_the_second_link():
    arm = specific_force(along(l_imu1, q1), q1) - g * sp.cos(q1)
    assert vanishes(arm / l_imu1 - qdd1)
    forearm = specific_force(ELBOW + along(l_imu2, q2), q2) - g * sp.cos(q2)
    elbow = l1 * (qdd1 * COS + qd1**2 * SIN)
    assert vanishes((forearm - elbow) / l_imu2 - qdd2)
    assert not vanishes(forearm / l_imu2 - qdd2)


def newton_euler(mass: sp.Expr, height: sp.Expr, height_acceleration: sp.Expr | None = None) -> sp.Expr:
    """6.9 with 6.11 to 6.20: `mass` is the one beside l_G1, `height` that of the first centre of mass."""
    rise = height.diff(t, 2) if height_acceleration is None else height_acceleration
    (x_1, _), (x_2, z_2) = CENTRES
    r_x, r_z = m2 * x_2.diff(t, 2), m2 * g + m2 * z_2.diff(t, 2)
    own = J1 * qdd1 + (g + rise) * mass * l_g1 * sp.cos(q1) - m1 * x_1.diff(t, 2) * l_g1 * sp.sin(q1)
    return own - r_x * l1 * sp.sin(q1) + r_z * l1 * sp.cos(q1)


def test_6_9_has_the_mass_of_the_wrong_link():
    without_motor = TORQUE_1.subs(J_a1, 0)
    assert vanishes(newton_euler(m1, CENTRES[0][1]) - without_motor)
    assert not vanishes(newton_euler(m2, CENTRES[0][1]) - without_motor)


def test_6_14_and_6_18_have_the_indices_of_the_forearm():
    without_motor = TORQUE_1.subs(J_a1, 0)
    printed_height = l_g2 * sp.sin(q2)
    assert not vanishes(CENTRES[0][0] ** 2 + printed_height**2 - l_g1**2)
    assert not vanishes(newton_euler(m1, printed_height) - without_motor)
    right, printed = (l_g1 * (q.diff(t, 2) * sp.cos(q) - q.diff(t) ** 2 * sp.sin(q)) for q in (q1, q2))
    assert vanishes(right - CENTRES[0][1].diff(t, 2))
    assert vanishes(newton_euler(m1, CENTRES[0][1], right) - without_motor)
    assert not vanishes(newton_euler(m1, CENTRES[0][1], printed) - without_motor)


def test_6_10_to_6_20_are_right_but_for_6_14_and_6_18():
    (x_1, _), (x_2, z_2) = CENTRES
    first = qdd1 * sp.sin(q1) + qd1**2 * sp.cos(q1), qdd1 * sp.cos(q1) - qd1**2 * sp.sin(q1)
    second = qdd2 * sp.sin(q2) + qd2**2 * sp.cos(q2), qdd2 * sp.cos(q2) - qd2**2 * sp.sin(q2)
    thesis_6_19, thesis_6_20 = -l1 * first[0] - l_g2 * second[0], l1 * first[1] + l_g2 * second[1]
    assert vanishes(x_1.diff(t, 2) + l_g1 * first[0])
    assert vanishes(x_2.diff(t, 2) - thesis_6_19)
    assert vanishes(z_2.diff(t, 2) - thesis_6_20)
    lever = m2 * l_g2 * ((g + thesis_6_20) * sp.cos(q2) - thesis_6_19 * sp.sin(q2))
    assert vanishes(J2 * qdd2 + lever - TORQUE_2.subs(J_a2, 0))


def test_6_21_to_6_25_are_lagranges_equations():
    first = M11 * qdd1 + h * COS * qdd2 - h * SIN * qd2**2 + GRAVITY_1 * sp.cos(q1)
    second = M22 * qdd2 + h * COS * qdd1 + h * SIN * qd1**2 + GRAVITY_2 * sp.cos(q2)
    assert vanishes(first - TORQUE_1)
    assert vanishes(second - TORQUE_2)
    # 6.25: the torque at the joint is the motor's power by the speed of the joint.
    motor_torque = sp.Symbol("tau_m")
    assert (motor_torque * (qd1 / n1)).diff(qd1) == motor_torque / n1


def test_6_26_removes_gravity_and_not_a_share_of_the_reading():
    at_rest = g * sp.cos(q1)
    assert vanishes(specific_force(along(l_imu1, q1), q1).subs({qdd1: 0, qd1: 0}) - at_rest)
    assert vanishes(at_rest - g * sp.cos(q1))
    assert not vanishes(at_rest - at_rest * sp.cos(q1))


def test_6_27_and_6_30_are_filters_of_the_speed_with_one_s_too_many():
    speed = sp.Symbol("w", positive=True)
    acceleration = s * speed
    assert sp.simplify(filtered_speed(acceleration, speed, 1) - speed) == 0
    assert sp.simplify(filtered_speed(acceleration, speed, 2) - speed) != 0
    assert sp.simplify(filtered_speed(acceleration, speed, 2) - speed / s) != 0


def tends_to_the_collision(integrand: sp.Expr, torque: sp.Symbol, momentum: sp.Expr, lagrangian: sp.Expr) -> bool:
    """Whether res = K (int(integrand - res) - p) obeys d(res)/dt = K (tau_c - res); lagrangian = torque - tau_c."""
    collision = torque - lagrangian
    return vanishes(integrand - momentum.diff(t) - collision)


T1, T2 = sp.symbols("T1 T2")


def test_6_28_has_a_coupling_twice_and_no_gravity():
    momentum = M11 * qd1
    right = T1 - h * COS * qdd2 + h * SIN * qd2**2 - GRAVITY_1 * sp.cos(q1)
    printed = T1 - 2 * h * COS * qdd2 + h * SIN * qd2**2
    assert tends_to_the_collision(right, T1, momentum, TORQUE_1)
    for wrong in (printed, printed + h * COS * qdd2, printed - GRAVITY_1 * sp.cos(q1)):
        assert not tends_to_the_collision(wrong, T1, momentum, TORQUE_1)


def test_6_31_multiplies_gravity_by_a_squared_speed():
    momentum = M22 * qd2
    coupling = T2 - h * COS * qdd1 - h * SIN * qd1**2
    assert tends_to_the_collision(coupling - GRAVITY_2 * sp.cos(q2), T2, momentum, TORQUE_2)
    assert not tends_to_the_collision(coupling - GRAVITY_2 * sp.cos(q2) * qd2**2, T2, momentum, TORQUE_2)


def test_6_29_and_6_32_are_momenta_of_the_speed_and_not_of_the_angle():
    first = T1 - h * COS * qdd2 + h * SIN * qd2**2 - GRAVITY_1 * sp.cos(q1)
    second = T2 - h * COS * qdd1 - h * SIN * qd1**2 - GRAVITY_2 * sp.cos(q2)
    for integrand, torque, inertia, angle, lagrangian in (
        (first, T1, M11, q1, TORQUE_1),
        (second, T2, M22, q2, TORQUE_2),
    ):
        assert tends_to_the_collision(integrand, torque, inertia * angle.diff(t), lagrangian)
        assert not tends_to_the_collision(integrand, torque, inertia * angle, lagrangian)


def test_the_full_momentum_needs_no_acceleration_of_the_other_link():
    momenta = M11 * qd1 + h * COS * qd2, h * COS * qd1 + M22 * qd2
    beta_1 = GRAVITY_1 * sp.cos(q1) - h * SIN * qd1 * qd2
    beta_2 = GRAVITY_2 * sp.cos(q2) + h * SIN * qd1 * qd2
    assert tends_to_the_collision(T1 - beta_1, T1, momenta[0], TORQUE_1)
    assert tends_to_the_collision(T2 - beta_2, T2, momenta[1], TORQUE_2)
    assert not tends_to_the_collision(T1 - GRAVITY_1 * sp.cos(q1), T1, momenta[0], TORQUE_1)


x1, x2, x3, x4, u, T_s, a2, w2, p2 = sp.symbols("x1 x2 x3 x4 u T_s qdd2 qd2 q2", real=True)
X = sp.Matrix([x1, x2, x3, x4])
M_1 = sp.Symbol("M11", positive=True)
ACCELERATION = (  # 6.37
    u - h * sp.cos(p2 - x4) * a2 + h * sp.sin(p2 - x4) * w2**2 - GRAVITY_1 * sp.cos(x4) - x1 * x3
) / M_1
FOLLOWING = sp.Matrix([x1, ACCELERATION, x3 + T_s * x2, x4 + T_s * x3])
OBSERVED = sp.Matrix([x2, x3, x4])


def test_6_37_is_6_33_solved_for_the_acceleration():
    thesis_6_33 = TORQUE_1.subs(qdd1, x2).subs({qdd2: a2}).subs({qd1: x3, qd2: w2}).subs({q1: x4, q2: p2}) + x1 * x3
    acceleration = sp.solve(sp.Eq(u, sp.expand(thesis_6_33)), x2)[0]
    assert vanishes(acceleration - ACCELERATION.subs(M_1, M11))


def test_6_35_has_no_transmission_ratio():
    offset = sp.Symbol("offset", positive=True)
    motor_angle = (q1 - offset) / n1
    motor_speed = motor_angle.diff(t)
    assert vanishes(n1 * motor_speed - qd1)
    assert not vanishes(motor_speed - qd1)
    assert vanishes(n1 * motor_angle + offset - q1)
    assert not vanishes(motor_angle - q1)


def test_6_36_gives_two_sensors_one_noise():
    right = sp.eye(3)  # which noise v1 v2 v3 enters which observation
    printed = sp.Matrix([[1, 0, 0], [0, 1, 0], [1, 0, 0]])
    variances = sp.diag(*sp.symbols("r1 r2 r3", positive=True))
    assert (right * variances * right.T).is_diagonal()
    assert not (printed * variances * printed.T).is_diagonal()
    assert (printed * variances * printed.T).det() == 0


def test_6_38_to_6_40_are_derivatives_of_6_37_with_6_39_named_wrongly():
    matrix = FOLLOWING.jacobian(X)
    pattern = sp.Matrix([[1, 0, 0, 0], [matrix[1, 0], 0, matrix[1, 2], matrix[1, 3]], [0, T_s, 1, 0], [0, 0, T_s, 1]])
    assert matrix == pattern
    assert sp.simplify(matrix[1, 0] + x3 / M_1) == 0
    assert sp.simplify(matrix[1, 2] + x1 / M_1) == 0
    assert sp.simplify(matrix[1, 2] + x3 / M_1) != 0


def test_6_41_has_the_indices_of_another_robot():
    entry = FOLLOWING.jacobian(X)[1, 3]
    l2, l_g3, m3, q3 = sp.symbols("l2 l_G3 m3 q3", positive=True)
    right = (GRAVITY_1 * sp.sin(x4) - h * w2**2 * sp.cos(p2 - x4) - h * a2 * sp.sin(p2 - x4)) / M_1
    printed = (
        g * sp.sin(x4) * (l2 * m3 + l_g2 * m2)
        - l2 * l_g3 * m3 * w2**2 * sp.cos(x4 - q3)
        + l2 * l_g3 * m3 * a2 * sp.sin(x4 - p2)
    ) / M_1
    assert vanishes(entry - right)
    assert not vanishes(entry - printed)
    # Only the indices are wrong, not the signs: links 2 and 3 of that robot are links 1 and 2 of this one.
    renamed = printed.subs({l_g2: l_g1, m2: m1}).subs({l2: l1, m3: m2, l_g3: l_g2, q3: p2})
    assert vanishes(entry - renamed)


def test_6_42_to_6_44_have_the_sizes_of_chapter_5():
    right = sp.Matrix([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    printed = sp.Matrix([[0, 1, 0], [0, 0, 1]])
    assert OBSERVED.jacobian(X) == right != printed
    assert OBSERVED.diff(u) == sp.zeros(3, 1)
    predicted = FOLLOWING.jacobian(X) * FOLLOWING.jacobian(X).T + sp.eye(4)  # Q is 4x4: one noise a state
    innovation = right * predicted * right.T
    assert (innovation + sp.eye(3)).shape == (3, 3)  # R is 3x3: one noise an observation
    with pytest.raises(sp.matrices.exceptions.ShapeError):
        printed * predicted
    with pytest.raises(sp.matrices.exceptions.ShapeError):
        innovation + sp.eye(4)


# Means of Tables 6.1 and 6.2 [ms]; FEEKF has no entry in trial 2.
STIFF = {("FEEKF", 1): 10, ("IGM", 1): 13, ("GM", 1): 35, ("IGM", 2): 19, ("GM", 2): 67}
SOFT = {("FEEKF", 1): 93, ("IGM", 1): 96, ("GM", 1): 122, ("IGM", 2): 412, ("GM", 2): 438}


def test_the_text_of_6_2_4_and_its_tables_disagree():
    assert STIFF["IGM", 1] - STIFF["FEEKF", 1] == 3 != 20
    assert STIFF["GM", 2] - STIFF["IGM", 2] == 48
    fastest = {trial: min((time, name) for (name, of), time in SOFT.items() if of == trial)[1] for trial in (1, 2)}
    assert fastest == {1: "FEEKF", 2: "IGM"}
