"""The compiled sweeps over a kinematic tree: blocks of samples, the sample index innermost.

Conventions: every joint turns about, or slides along, the z axis of its own frame; parents come before children. Twist
(w, v of the frame's origin), momentum (l linear, k angular about the origin), force and torque (f, n) and first moment
s of the mass are in the joint's own frame. A block is BLOCK samples; a row holds one component for all samples of the
block, so that one instruction handles several samples. A block that the recording does not fill is padded with zeros.

Each joint has a slot of rows; the slot before it holds its parent's motion and gathers its parent's load. Where the
parent's own slot is not the one before, that slot is a copy. So all distances between rows are known at compile time,
and the compiler sees that rows do not overlap: without that it does not vectorise.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import FloatArray

IndexArray = npt.NDArray[np.int64]
Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float, float, float, float, float, float]

BLOCK = 32
# Where the rows of a slot begin: joint, motion (W to DV), load (L to S), results.
SINE, COSINE, OFFSET, RATE, RATE_CHANGE = 0 * BLOCK, 1 * BLOCK, 2 * BLOCK, 3 * BLOCK, 4 * BLOCK
W, V, GRAVITY = 5 * BLOCK, 8 * BLOCK, 11 * BLOCK
DW, DV = 11 * BLOCK, 14 * BLOCK  # spatial derivatives of w and v, where the gravity is among them
L, K, S = 17 * BLOCK, 20 * BLOCK, 23 * BLOCK
TERMS = 26 * BLOCK
SLOT = 29 * BLOCK

# Columns of the constants (one row a joint): R and R' t of its placement, own and moved mass, s, upper triangle of I.
ROTATION, TRANSLATION, MASS, MOMENT, INERTIA, DRIVE, SLIDES, MOVED_MASS, CONSTANTS = 0, 9, 12, 13, 16, 22, 23, 24, 25

# Columns of the route (one row a joint): the recording's column, the slot before its own, whose copy it is (-1: none).
COLUMN, BEFORE, COPY_OF, STEPS = 0, 1, 2, 3

_ROW = "Array(float64, 1, 'C')"
_READ_TABLE = "Array(float64, 2, 'C', readonly=True)"
_TABLE = "Array(float64, 2, 'C')"
_READ_INDEX = "Array(int64, 1, 'C', readonly=True)"
_READ_ROUTE = "Array(int64, 2, 'C', readonly=True)"
_V3 = "UniTuple(float64, 3)"
_V9 = "UniTuple(float64, 9)"

# Adding and subtracting it rounds to an integer: the spacing of the numbers near it is 1.
_ROUND = 6755399441055744.0
# pi in three parts of 33, 33 and 53 bits: an integer below 2^20 times one of the first two is exact.
_PI_1, _PI_2, _PI_3 = 3.1415926534682512, 1.2154201012607932e-10, 4.044532497591901e-21
_REDUCIBLE = 1e6


@kernel(f"{_V3}({_ROW}, int64)")
def _get(rows: FloatArray, first: int) -> Vector:
    return rows[first], rows[first + BLOCK], rows[first + 2 * BLOCK]


@kernel(f"void({_ROW}, int64, {_V3})")
def _put(rows: FloatArray, first: int, value: Vector) -> None:
    rows[first], rows[first + BLOCK], rows[first + 2 * BLOCK] = value


@kernel(f"{_V3}({_V3}, {_V3})")
def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel(f"{_V3}(float64, {_V3})")
def _scaled(factor: float, a: Vector) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]


@kernel(f"{_V3}({_V3}, {_V3})")
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel(f"{_V3}(float64, float64, {_V3})")
def _about_z(sine: float, cosine: float, a: Vector) -> Vector:
    return cosine * a[0] - sine * a[1], sine * a[0] + cosine * a[1], a[2]


@kernel(f"{_V3}({_V9}, {_V3})")
def _times(r: Rotation, a: Vector) -> Vector:
    return (
        r[0] * a[0] + r[1] * a[1] + r[2] * a[2],
        r[3] * a[0] + r[4] * a[1] + r[5] * a[2],
        r[6] * a[0] + r[7] * a[1] + r[8] * a[2],
    )


@kernel(f"{_V9}({_V9}, {_V9})")
def _product(r: Rotation, s: Rotation) -> Rotation:
    first, second = _times(r, (s[0], s[3], s[6])), _times(r, (s[1], s[4], s[7]))
    third = _times(r, (s[2], s[5], s[8]))
    return first[0], second[0], third[0], first[1], second[1], third[1], first[2], second[2], third[2]


@kernel(f"{_V3}({READ_ONLY}, int64)")
def _vector(body: FloatArray, first: int) -> Vector:
    return body[first], body[first + 1], body[first + 2]


@kernel(f"{_V9}({READ_ONLY})")
def _inertia(body: FloatArray) -> Rotation:
    xx, xy, xz = body[INERTIA], body[INERTIA + 1], body[INERTIA + 2]
    yy, yz, zz = body[INERTIA + 3], body[INERTIA + 4], body[INERTIA + 5]
    return xx, xy, xz, xy, yy, yz, xz, yz, zz


@kernel(f"{_V9}({READ_ONLY})")
def _rotation(body: FloatArray) -> Rotation:
    return body[0], body[1], body[2], body[3], body[4], body[5], body[6], body[7], body[8]


@kernel(f"{_V9}({READ_ONLY})")
def _inverse_rotation(body: FloatArray) -> Rotation:
    return body[0], body[3], body[6], body[1], body[4], body[7], body[2], body[5], body[8]


@kernel(f"void({_ROW}, float64)")
def _fill_sine_cosine(pair: FloatArray, slides: float) -> None:
    """Sine and cosine of the angles in the displacement row, to 3e-16; a joint that slides turns by 0.

    q = k pi + r with |r| <= pi/2: sin q = (-1)^k sin r, cos q = (-1)^k cos r, each by its Taylor series.
    """
    if slides != 0.0:
        for j in range(BLOCK):
            pair[SLOT + SINE + j] = 0.0
            pair[SLOT + COSINE + j] = 1.0
        return
    beyond = 0
    for j in range(BLOCK):
        q = pair[SLOT + OFFSET + j]
        beyond += 1 if abs(q) > _REDUCIBLE else 0
        k = (q * 0.3183098861837907 + _ROUND) - _ROUND
        r = ((q - k * _PI_1) - k * _PI_2) - k * _PI_3
        half = 0.5 * k
        sign = 1.0 - 4.0 * abs(half - ((half + _ROUND) - _ROUND))
        z = r * r
        sine = 1.9572941063391263e-20
        sine = sine * z - 8.22063524662433e-18
        sine = sine * z + 2.8114572543455206e-15
        sine = sine * z - 7.647163731819816e-13
        sine = sine * z + 1.6059043836821613e-10
        sine = sine * z - 2.505210838544172e-08
        sine = sine * z + 2.7557319223985893e-06
        sine = sine * z - 0.0001984126984126984
        sine = sine * z + 0.008333333333333333
        sine = sine * z - 0.16666666666666666
        cosine = -8.896791392450574e-22
        cosine = cosine * z + 4.110317623312165e-19
        cosine = cosine * z - 1.5619206968586225e-16
        cosine = cosine * z + 4.779477332387385e-14
        cosine = cosine * z - 1.1470745597729725e-11
        cosine = cosine * z + 2.08767569878681e-09
        cosine = cosine * z - 2.755731922398589e-07
        cosine = cosine * z + 2.48015873015873e-05
        cosine = cosine * z - 0.001388888888888889
        cosine = cosine * z + 0.041666666666666664
        cosine = cosine * z - 0.5
        pair[SLOT + SINE + j] = sign * (r + r * (z * sine))
        pair[SLOT + COSINE + j] = sign * (1.0 + z * cosine)
    if beyond:
        for j in range(BLOCK):
            q = pair[SLOT + OFFSET + j]
            if abs(q) > _REDUCIBLE:
                pair[SLOT + SINE + j] = math.sin(q)
                pair[SLOT + COSINE + j] = math.cos(q)
    for j in range(BLOCK):
        pair[SLOT + OFFSET + j] = 0.0


@kernel(f"void({_READ_TABLE}, int64, int64, int64, {_ROW}, int64, {_ROW})")
def _take_column(
    values: FloatArray, column: int, begin: int, count: int, pair: FloatArray, row: int, fault: FloatArray
) -> None:
    """One column of a recording into a row; `fault` becomes NaN where a value is not finite."""
    for j in range(count):
        pair[SLOT + row + j] = values[begin + j, column]
    for j in range(count, BLOCK):
        pair[SLOT + row + j] = 0.0
    for j in range(BLOCK):
        fault[j] += pair[SLOT + row + j] - pair[SLOT + row + j]


@kernel(f"void({_ROW}, int64, int64, {_TABLE}, int64, int64, int64, {_ROW})")
def _give_column(
    slots: FloatArray, own: int, row: int, values: FloatArray, column: int, begin: int, count: int, fault: FloatArray
) -> None:
    """A row into one column of a result, NaN where the sample has a fault."""
    for j in range(count):
        values[begin + j, column] = slots[own * SLOT + row + j] + fault[j]


@kernel(f"void({_ROW}, {_ROW})")
def _clear(slots: FloatArray, fault: FloatArray) -> None:
    """Before a block: no fault yet, and no load on the base, whose slot is the first."""
    for j in range(BLOCK):
        fault[j] = 0.0
    for j in range(L, TERMS):
        slots[j] = 0.0


@kernel(f"void({_ROW}, int64, int64)")
def _copy_motion(slots: FloatArray, origin: int, copy: int) -> None:
    """A copy of a slot's motion, without load, for a further child."""
    for j in range(L - W):
        slots[copy * SLOT + W + j] = slots[origin * SLOT + W + j]
    for j in range(TERMS - L):
        slots[copy * SLOT + L + j] = 0.0


@kernel(f"void({_ROW}, int64, int64)")
def _return_load(slots: FloatArray, origin: int, copy: int) -> None:
    """The load that the further child gave to the copy, added to the original's."""
    for j in range(TERMS - L):
        slots[origin * SLOT + L + j] += slots[copy * SLOT + L + j]


@kernel(f"void({READ_ONLY}, {_ROW})")
def _carry_motion(body: FloatArray, pair: FloatArray) -> None:
    """Twist and gravity from the parent's frame into the joint's; the body's own momentum there.

    w = E w_p + z qd, v = E (v_p + w_p x t), g = E g_p; l = m v + w x s, k = I w + s x v. A joint that slides adds z qd
    to v instead.
    """
    inverse, inertia = _inverse_rotation(body), _inertia(body)
    mass, moment, (tx, ty, tz) = body[MASS], _vector(body, MOMENT), _vector(body, TRANSLATION)
    slides = body[SLIDES]
    turns = 1.0 - slides
    for j in range(BLOCK):
        sine, cosine, rate = -pair[SLOT + SINE + j], pair[SLOT + COSINE + j], pair[SLOT + RATE + j]
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        spin = _times(inverse, _get(pair, W + j))
        flow = _sum(_times(inverse, _get(pair, V + j)), _cross(spin, place))
        w = _sum(_about_z(sine, cosine, spin), (0.0, 0.0, turns * rate))
        v = _sum(_about_z(sine, cosine, flow), (0.0, 0.0, slides * rate))
        _put(pair, SLOT + W + j, w)
        _put(pair, SLOT + V + j, v)
        _put(pair, SLOT + GRAVITY + j, _about_z(sine, cosine, _times(inverse, _get(pair, GRAVITY + j))))
        _put(pair, SLOT + L + j, _sum(_scaled(mass, v), _cross(w, moment)))
        _put(pair, SLOT + K + j, _sum(_times(inertia, w), _cross(moment, v)))
        _put(pair, SLOT + S + j, moment)


@kernel(f"void({READ_ONLY}, {_ROW})")
def _joint_terms(body: FloatArray, pair: FloatArray) -> None:
    """p, C^T qd and g of a joint from the momentum and first moment of everything it moves.

    Turning: p = z.k, C^T qd = z.(l x v + k x w), g = -z.(s x g_vec); sliding: z.l, z.(l x w), -m z.g_vec.
    """
    slides, drive, mass = body[SLIDES], body[DRIVE], body[MOVED_MASS]
    turns = 1.0 - slides
    for j in range(BLOCK):
        w, v, g = _get(pair, SLOT + W + j), _get(pair, SLOT + V + j), _get(pair, SLOT + GRAVITY + j)
        linear, angular, s = _get(pair, SLOT + L + j), _get(pair, SLOT + K + j), _get(pair, SLOT + S + j)
        momentum = drive * pair[SLOT + RATE + j] + turns * angular[2] + slides * linear[2]
        turning = linear[0] * v[1] - linear[1] * v[0] + angular[0] * w[1] - angular[1] * w[0]
        sliding = linear[0] * w[1] - linear[1] * w[0]
        gravity = turns * (s[1] * g[0] - s[0] * g[1]) - slides * (mass * g[2])
        _put(pair, SLOT + TERMS + j, (momentum, turns * turning + slides * sliding, gravity))


@kernel(f"void({READ_ONLY}, {_ROW})")
def _carry_acceleration(body: FloatArray, pair: FloatArray) -> None:
    """Twist and its spatial derivative into the joint's frame; force and torque that the body's own motion takes.

    dw = E dw_p + w x z qd + z qdd, dv = E (dv_p + dw_p x t) + v x z qd for a joint that turns; one that slides has
    dv + w x z qd + z qdd. f = m dv + dw x s + w x l, n = I dw + s x dv + w x k + v x l.
    """
    inverse, inertia = _inverse_rotation(body), _inertia(body)
    mass, moment, (tx, ty, tz) = body[MASS], _vector(body, MOMENT), _vector(body, TRANSLATION)
    slides = body[SLIDES]
    turns = 1.0 - slides
    for j in range(BLOCK):
        sine, cosine = -pair[SLOT + SINE + j], pair[SLOT + COSINE + j]
        rate, change = pair[SLOT + RATE + j], pair[SLOT + RATE_CHANGE + j]
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        spin, spin_change = _times(inverse, _get(pair, W + j)), _times(inverse, _get(pair, DW + j))
        flow = _sum(_times(inverse, _get(pair, V + j)), _cross(spin, place))
        flow_change = _sum(_times(inverse, _get(pair, DV + j)), _cross(spin_change, place))
        w = _sum(_about_z(sine, cosine, spin), (0.0, 0.0, turns * rate))
        v = _sum(_about_z(sine, cosine, flow), (0.0, 0.0, slides * rate))
        turn, slide = turns * rate, slides * rate
        dw = _sum(_about_z(sine, cosine, spin_change), (turn * w[1], -turn * w[0], turns * change))
        dv = _sum(
            _about_z(sine, cosine, flow_change),
            (turn * v[1] + slide * w[1], -turn * v[0] - slide * w[0], slides * change),
        )
        linear = _sum(_scaled(mass, v), _cross(w, moment))
        angular = _sum(_times(inertia, w), _cross(moment, v))
        force = _sum(_sum(_scaled(mass, dv), _cross(dw, moment)), _cross(w, linear))
        torque = _sum(_sum(_times(inertia, dw), _cross(moment, dv)), _sum(_cross(w, angular), _cross(v, linear)))
        _put(pair, SLOT + W + j, w)
        _put(pair, SLOT + V + j, v)
        _put(pair, SLOT + DW + j, dw)
        _put(pair, SLOT + DV + j, dv)
        _put(pair, SLOT + L + j, force)
        _put(pair, SLOT + K + j, torque)
        _put(pair, SLOT + S + j, (0.0, 0.0, 0.0))


@kernel(f"void({READ_ONLY}, {_ROW})")
def _joint_torque(body: FloatArray, pair: FloatArray) -> None:
    """The joint's share of force and torque of everything it moves, and what its drive's inertia takes."""
    slides, drive = body[SLIDES], body[DRIVE]
    turns = 1.0 - slides
    for j in range(BLOCK):
        share = turns * pair[SLOT + K + 2 * BLOCK + j] + slides * pair[SLOT + L + 2 * BLOCK + j]
        pair[SLOT + TERMS + j] = drive * pair[SLOT + RATE_CHANGE + j] + share


@kernel(f"void({READ_ONLY}, {_ROW})")
def _carry_load(body: FloatArray, pair: FloatArray) -> None:
    """What a joint moves, added to its parent's load: l_p += R l, k_p += R (k + t x l), s_p += R (s + m t).

    Force and torque, in place of l and k, are carried by the same equations.
    """
    rotation = _rotation(body)
    mass, (tx, ty, tz) = body[MOVED_MASS], _vector(body, TRANSLATION)
    for j in range(BLOCK):
        sine, cosine = pair[SLOT + SINE + j], pair[SLOT + COSINE + j]
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        linear = _about_z(sine, cosine, _get(pair, SLOT + L + j))
        angular = _sum(_about_z(sine, cosine, _get(pair, SLOT + K + j)), _cross(place, linear))
        s = _sum(_about_z(sine, cosine, _get(pair, SLOT + S + j)), _scaled(mass, place))
        _put(pair, L + j, _sum(_get(pair, L + j), _times(rotation, linear)))
        _put(pair, K + j, _sum(_get(pair, K + j), _times(rotation, angular)))
        _put(pair, S + j, _sum(_get(pair, S + j), _times(rotation, s)))


@kernel(
    f"void({_READ_TABLE}, {_READ_ROUTE}, {_READ_TABLE}, {_READ_TABLE}, int64, int64, {_ROW}, {_ROW})",
)
def _momentum_block(
    bodies: FloatArray,
    route: IndexArray,
    position: FloatArray,
    speed: FloatArray,
    begin: int,
    count: int,
    slots: FloatArray,
    fault: FloatArray,
) -> None:
    """p, C^T qd and g of a block into the result rows of every joint's slot."""
    _clear(slots, fault)
    for i in range(len(bodies)):
        before, origin = route[i, BEFORE], route[i, COPY_OF]
        if origin >= 0:
            _copy_motion(slots, origin, before)
        pair = slots[before * SLOT : (before + 2) * SLOT]
        _take_column(position, route[i, COLUMN], begin, count, pair, OFFSET, fault)
        _take_column(speed, route[i, COLUMN], begin, count, pair, RATE, fault)
        _fill_sine_cosine(pair, bodies[i, SLIDES])
        _carry_motion(bodies[i], pair)
    for i in range(len(bodies) - 1, -1, -1):
        before, origin = route[i, BEFORE], route[i, COPY_OF]
        pair = slots[before * SLOT : (before + 2) * SLOT]
        _joint_terms(bodies[i], pair)
        _carry_load(bodies[i], pair)
        if origin >= 0:
            _return_load(slots, origin, before)


@kernel(f"void({_READ_TABLE}, {_READ_ROUTE}, {READ_ONLY}, {_READ_TABLE}, {_READ_TABLE}, {_TABLE}, {_TABLE}, {_TABLE})")
def sweep_momentum(
    bodies: FloatArray,
    route: IndexArray,
    gravity_vector: FloatArray,
    position: FloatArray,
    speed: FloatArray,
    momentum: FloatArray,
    velocity_force: FloatArray,
    gravity: FloatArray,
) -> None:
    """p = M qd, C^T qd and g, (n, J) each, of every sample."""
    slots, fault = np.zeros((np.max(route[:, BEFORE]) + 2) * SLOT), np.zeros(BLOCK)
    for j in range(3 * BLOCK):
        slots[GRAVITY + j] = gravity_vector[j // BLOCK]
    for begin in range(0, len(position), BLOCK):
        count = min(BLOCK, len(position) - begin)
        _momentum_block(bodies, route, position, speed, begin, count, slots, fault)
        for i in range(len(bodies)):
            own, column = route[i, BEFORE] + 1, route[i, COLUMN]
            _give_column(slots, own, TERMS, momentum, column, begin, count, fault)
            _give_column(slots, own, TERMS + BLOCK, velocity_force, column, begin, count, fault)
            _give_column(slots, own, TERMS + 2 * BLOCK, gravity, column, begin, count, fault)


@kernel(f"void({_READ_TABLE}, {_READ_ROUTE}, {READ_ONLY}, {_READ_TABLE}, {_READ_TABLE}, {_ROW}, {_ROW})")
def sweep_energies(
    bodies: FloatArray,
    route: IndexArray,
    gravity_vector: FloatArray,
    position: FloatArray,
    speed: FloatArray,
    kinetic: FloatArray,
    potential: FloatArray,
) -> None:
    """T = qd.p / 2 and U = -s.g_vec of every sample, s: first moment of all moving mass about the base's origin."""
    slots, fault = np.zeros((np.max(route[:, BEFORE]) + 2) * SLOT), np.zeros(BLOCK)
    for j in range(3 * BLOCK):
        slots[GRAVITY + j] = gravity_vector[j // BLOCK]
    for begin in range(0, len(position), BLOCK):
        count = min(BLOCK, len(position) - begin)
        _momentum_block(bodies, route, position, speed, begin, count, slots, fault)
        for j in range(count):
            twice = fault[j]
            for i in range(len(bodies)):
                own = (route[i, BEFORE] + 1) * SLOT
                twice += slots[own + RATE + j] * slots[own + TERMS + j]
            kinetic[begin + j] = 0.5 * twice
            moment = _get(slots, S + j)
            lifted = moment[0] * gravity_vector[0] + moment[1] * gravity_vector[1] + moment[2] * gravity_vector[2]
            potential[begin + j] = fault[j] - lifted


@kernel(f"void({_READ_TABLE}, {_READ_ROUTE}, {READ_ONLY}, {_READ_TABLE}, {_READ_TABLE}, {_READ_TABLE}, {_TABLE})")
def sweep_inverse_dynamics(
    bodies: FloatArray,
    route: IndexArray,
    gravity_vector: FloatArray,
    position: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    torque: FloatArray,
) -> None:
    """M qdd + C qd + g of every sample: recursive Newton-Euler, gravity as an acceleration of the base."""
    slots, fault = np.zeros((np.max(route[:, BEFORE]) + 2) * SLOT), np.zeros(BLOCK)
    for j in range(3 * BLOCK):
        slots[DV + j] = -gravity_vector[j // BLOCK]
    for begin in range(0, len(position), BLOCK):
        count = min(BLOCK, len(position) - begin)
        _clear(slots, fault)
        for i in range(len(bodies)):
            before, origin, column = route[i, BEFORE], route[i, COPY_OF], route[i, COLUMN]
            if origin >= 0:
                _copy_motion(slots, origin, before)
            pair = slots[before * SLOT : (before + 2) * SLOT]
            _take_column(position, column, begin, count, pair, OFFSET, fault)
            _take_column(speed, column, begin, count, pair, RATE, fault)
            _take_column(acceleration, column, begin, count, pair, RATE_CHANGE, fault)
            _fill_sine_cosine(pair, bodies[i, SLIDES])
            _carry_acceleration(bodies[i], pair)
        for i in range(len(bodies) - 1, -1, -1):
            before, origin = route[i, BEFORE], route[i, COPY_OF]
            pair = slots[before * SLOT : (before + 2) * SLOT]
            _joint_torque(bodies[i], pair)
            _carry_load(bodies[i], pair)
            if origin >= 0:
                _return_load(slots, origin, before)
        for i in range(len(bodies)):
            _give_column(slots, route[i, BEFORE] + 1, TERMS, torque, route[i, COLUMN], begin, count, fault)


@kernel(f"void({_READ_TABLE}, {_READ_ROUTE}, {_READ_INDEX}, {_V3}, {_READ_TABLE}, Array(float64, 3, 'C'))")
def sweep_jacobian(
    bodies: FloatArray, route: IndexArray, path: IndexArray, point: Vector, position: FloatArray, jacobian: FloatArray
) -> None:
    """The Jacobian of a point that moves with the last joint of `path`, which leads there from the base."""
    for sample in range(len(position)):
        fault = 0.0
        for column in range(position.shape[1]):
            fault += position[sample, column] - position[sample, column]
        turned, moved = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
        for i in path:
            q, slides = position[sample, route[i, COLUMN]], bodies[i, SLIDES]
            angle, offset = (1.0 - slides) * q, slides * q
            turned = _product(turned, _rotation(bodies[i]))
            tx, ty, tz = _vector(bodies[i], TRANSLATION)
            moved = _sum(moved, _times(turned, (tx, ty, tz + offset)))
            sine, cosine = math.sin(angle), math.cos(angle)
            turned = _product(turned, (cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0))
            for axis in range(3):
                jacobian[sample, axis, route[i, COLUMN]] = moved[axis]
                jacobian[sample, 3 + axis, route[i, COLUMN]] = turned[3 * axis + 2]
        moved = _sum(moved, _times(turned, point))
        for i in path:
            lever = jacobian[sample, :, route[i, COLUMN]]
            turns = 1.0 - bodies[i, SLIDES]
            z = lever[3], lever[4], lever[5]
            way = _cross(z, (moved[0] - lever[0], moved[1] - lever[1], moved[2] - lever[2]))
            for axis in range(3):
                lever[axis] = turns * way[axis] + (1.0 - turns) * z[axis]
                lever[3 + axis] = turns * z[axis]
        for row in range(6):
            for column in range(position.shape[1]):
                jacobian[sample, row, column] += fault
