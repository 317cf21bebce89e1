"""Momentum, energies and inertia matrix of a kinematic tree: one sweep out, one back. Conventions as in tree_rows.

For the inertia matrix, composite bodies are made inward first, then one column per joint outward. In that sweep the
rows of a load hold what a joint moves: its inertia about the frame's origin (upper triangle) in place of l and k, and
its first moment s. The rows of a motion hold the momentum of that body at a speed of 1 of its joint.
"""

from __future__ import annotations

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.machines.tree_angles import fill_sine_cosine
from cdtool.machines.tree_rows import (
    BEFORE,
    BLOCK,
    COLUMN,
    COPY_OF,
    COSINE,
    DRIVE,
    GRAVITY,
    INERTIA,
    MASS,
    MATRIX,
    MOMENT,
    MOVED_MASS,
    OFFSET,
    PARENT,
    RATE,
    READ_ROUTE,
    READ_TABLE,
    ROW,
    SINE,
    SLIDES,
    SLOT,
    TABLE,
    TERMS,
    TRANSLATION,
    IndexArray,
    K,
    L,
    Matrix,
    S,
    V,
    W,
    about_z,
    add,
    body_of,
    carry_load,
    clear,
    copy_motion,
    cross,
    get_vector,
    give_column,
    inertia_of,
    inverse_rotation_of,
    pair_of,
    put_vector,
    return_load,
    rotation_of,
    scaled,
    take_column,
    times,
    vector_of,
    work_space,
)

_MATRICES = "Array(float64, 3, 'C')"


@kernel(f"void({READ_ONLY}, {ROW})")
def _carry_motion(body: FloatArray, pair: FloatArray) -> None:
    """Twist and gravity from the parent's frame into the joint's; the body's own momentum there.

    w = E w_p + z qd, v = E (v_p + w_p x t), g = E g_p; l = m v + w x s, k = I w + s x v. A joint that slides adds z qd
    to v instead.
    """
    inverse, inertia = inverse_rotation_of(body), inertia_of(body)
    mass, moment, (tx, ty, tz) = body[MASS], vector_of(body, MOMENT), vector_of(body, TRANSLATION)
    slides = body[SLIDES]
    turns = 1.0 - slides
    for j in range(BLOCK):
        sine, cosine, rate = -pair[SLOT + SINE + j], pair[SLOT + COSINE + j], pair[SLOT + RATE + j]
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        spin = times(inverse, get_vector(pair, W + j))
        flow = add(times(inverse, get_vector(pair, V + j)), cross(spin, place))
        w = add(about_z(sine, cosine, spin), (0.0, 0.0, turns * rate))
        v = add(about_z(sine, cosine, flow), (0.0, 0.0, slides * rate))
        put_vector(pair, SLOT + W + j, w)
        put_vector(pair, SLOT + V + j, v)
        put_vector(pair, SLOT + GRAVITY + j, about_z(sine, cosine, times(inverse, get_vector(pair, GRAVITY + j))))
        put_vector(pair, SLOT + L + j, add(scaled(mass, v), cross(w, moment)))
        put_vector(pair, SLOT + K + j, add(times(inertia, w), cross(moment, v)))
        put_vector(pair, SLOT + S + j, moment)


@kernel(f"void({READ_ONLY}, {ROW})")
def _carry_twist(body: FloatArray, pair: FloatArray) -> None:
    """As `_carry_motion` without gravity and first moment: what the momentum alone needs."""
    inverse, inertia = inverse_rotation_of(body), inertia_of(body)
    mass, moment, (tx, ty, tz) = body[MASS], vector_of(body, MOMENT), vector_of(body, TRANSLATION)
    slides = body[SLIDES]
    turns = 1.0 - slides
    for j in range(BLOCK):
        sine, cosine, rate = -pair[SLOT + SINE + j], pair[SLOT + COSINE + j], pair[SLOT + RATE + j]
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        spin = times(inverse, get_vector(pair, W + j))
        flow = add(times(inverse, get_vector(pair, V + j)), cross(spin, place))
        w = add(about_z(sine, cosine, spin), (0.0, 0.0, turns * rate))
        v = add(about_z(sine, cosine, flow), (0.0, 0.0, slides * rate))
        put_vector(pair, SLOT + W + j, w)
        put_vector(pair, SLOT + V + j, v)
        put_vector(pair, SLOT + L + j, add(scaled(mass, v), cross(w, moment)))
        put_vector(pair, SLOT + K + j, add(times(inertia, w), cross(moment, v)))


@kernel(f"void({READ_ONLY}, {ROW})")
def _joint_momentum(body: FloatArray, pair: FloatArray) -> None:
    """p of a joint as in `_joint_terms`, and l and k added to its parent's as in `carry_load`."""
    slides, drive = body[SLIDES], body[DRIVE]
    turns = 1.0 - slides
    rotation, (tx, ty, tz) = rotation_of(body), vector_of(body, TRANSLATION)
    for j in range(BLOCK):
        own_l, own_k = get_vector(pair, SLOT + L + j), get_vector(pair, SLOT + K + j)
        pair[SLOT + TERMS + j] = drive * pair[SLOT + RATE + j] + turns * own_k[2] + slides * own_l[2]
        sine, cosine = pair[SLOT + SINE + j], pair[SLOT + COSINE + j]
        linear = about_z(sine, cosine, own_l)
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        angular = add(about_z(sine, cosine, own_k), cross(place, linear))
        put_vector(pair, L + j, add(get_vector(pair, L + j), times(rotation, linear)))
        put_vector(pair, K + j, add(get_vector(pair, K + j), times(rotation, angular)))


@kernel(f"void({READ_ONLY}, {ROW})")
def _joint_terms(body: FloatArray, pair: FloatArray) -> None:
    """p, C^T qd and g of a joint from the momentum and first moment of everything it moves.

    Turning: p = z.k, C^T qd = z.(l x v + k x w), g = -z.(s x g_vec); sliding: z.l, z.(l x w), -m z.g_vec.
    """
    slides, drive, mass = body[SLIDES], body[DRIVE], body[MOVED_MASS]
    turns = 1.0 - slides
    for j in range(BLOCK):
        w, v, g = get_vector(pair, SLOT + W + j), get_vector(pair, SLOT + V + j), get_vector(pair, SLOT + GRAVITY + j)
        linear, angular, s = (
            get_vector(pair, SLOT + L + j),
            get_vector(pair, SLOT + K + j),
            get_vector(pair, SLOT + S + j),
        )
        momentum = drive * pair[SLOT + RATE + j] + turns * angular[2] + slides * linear[2]
        turning = linear[0] * v[1] - linear[1] * v[0] + angular[0] * w[1] - angular[1] * w[0]
        sliding = linear[0] * w[1] - linear[1] * w[0]
        gravity = turns * (s[1] * g[0] - s[0] * g[1]) - slides * (mass * g[2])
        put_vector(pair, SLOT + TERMS + j, (momentum, turns * turning + slides * sliding, gravity))


def sweep_momentum(
    bodies: FloatArray,
    route: IndexArray,
    gravity_vector: FloatArray,
    position: FloatArray,
    speed: FloatArray,
    terms: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    """Fill `terms` with p = M qd, C^T qd and g, (n, J) each, of every sample."""
    none, (slots, fault) = np.empty(0), work_space(route, GRAVITY, gravity_vector)
    _sweep(bodies, route, position, speed, slots, fault, *terms, gravity_vector, none, none)


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
    none, (slots, fault) = np.empty((0, 0)), work_space(route, GRAVITY, gravity_vector)
    _sweep(bodies, route, position, speed, slots, fault, none, none, none, gravity_vector, kinetic, potential)


def sweep_inertia_times(
    bodies: FloatArray, route: IndexArray, position: FloatArray, vector: FloatArray, product: FloatArray
) -> None:
    """Fill `product` (n, J) with M x of every sample: the momentum at the speeds x."""
    _sweep_momentum_alone(bodies, route, position, vector, *work_space(route, W, np.zeros(3)), product)


@kernel(f"void({READ_TABLE}, {READ_ROUTE}, {READ_TABLE}, {READ_TABLE}, {ROW}, {ROW}, {TABLE})")
def _sweep_momentum_alone(
    bodies: FloatArray,
    route: IndexArray,
    position: FloatArray,
    speed: FloatArray,
    slots: FloatArray,
    fault: FloatArray,
    momentum: FloatArray,
) -> None:
    for begin in range(0, len(position), BLOCK):
        count = min(BLOCK, len(position) - begin)
        clear(slots, fault)
        for i in range(len(bodies)):
            before, origin, column = route[i, BEFORE], route[i, COPY_OF], route[i, COLUMN]
            if origin >= 0:
                copy_motion(slots, origin, before)
            pair = pair_of(slots, before)
            take_column(position, column, begin, count, pair, OFFSET, fault)
            take_column(speed, column, begin, count, pair, RATE, fault)
            fill_sine_cosine(pair, bodies[i, SLIDES])
            _carry_twist(body_of(bodies, i), pair)
        for i in range(len(bodies) - 1, -1, -1):
            before, origin = route[i, BEFORE], route[i, COPY_OF]
            pair = pair_of(slots, before)
            _joint_momentum(body_of(bodies, i), pair)
            if origin >= 0:
                return_load(slots, origin, before)
            give_column(pair, TERMS, momentum, route[i, COLUMN], begin, count, fault)


@kernel(
    f"void({READ_TABLE}, {READ_ROUTE}, {READ_TABLE}, {READ_TABLE}, {ROW}, {ROW}, {TABLE}, {TABLE}, {TABLE}, "
    f"{READ_ONLY}, {ROW}, {ROW})"
)
def _sweep(
    bodies: FloatArray,
    route: IndexArray,
    position: FloatArray,
    speed: FloatArray,
    slots: FloatArray,
    fault: FloatArray,
    momentum: FloatArray,
    velocity_force: FloatArray,
    gravity: FloatArray,
    gravity_vector: FloatArray,
    kinetic: FloatArray,
    potential: FloatArray,
) -> None:
    """Momentum, velocity force and gravity, or else the energies: of the results those that are not empty."""
    for begin in range(0, len(position), BLOCK):
        count = min(BLOCK, len(position) - begin)
        clear(slots, fault)
        for i in range(len(bodies)):
            before, origin, column = route[i, BEFORE], route[i, COPY_OF], route[i, COLUMN]
            if origin >= 0:
                copy_motion(slots, origin, before)
            pair = pair_of(slots, before)
            take_column(position, column, begin, count, pair, OFFSET, fault)
            take_column(speed, column, begin, count, pair, RATE, fault)
            fill_sine_cosine(pair, bodies[i, SLIDES])
            _carry_motion(body_of(bodies, i), pair)
        for i in range(len(bodies) - 1, -1, -1):
            before, origin = route[i, BEFORE], route[i, COPY_OF]
            pair = pair_of(slots, before)
            _joint_terms(body_of(bodies, i), pair)
            carry_load(body_of(bodies, i), pair)
            if origin >= 0:
                return_load(slots, origin, before)
        if len(momentum) > 0:
            for i in range(len(bodies)):
                pair, column = pair_of(slots, route[i, BEFORE]), route[i, COLUMN]
                give_column(pair, TERMS, momentum, column, begin, count, fault)
                give_column(pair, TERMS + BLOCK, velocity_force, column, begin, count, fault)
                give_column(pair, TERMS + 2 * BLOCK, gravity, column, begin, count, fault)
        if len(kinetic) > 0:
            for j in range(count):
                twice = fault[j]
                for i in range(len(bodies)):
                    own = (route[i, BEFORE] + 1) * SLOT
                    twice += slots[own + RATE + j] * slots[own + TERMS + j]
                kinetic[begin + j] = 0.5 * twice
                moment = get_vector(slots, S + j)
                lifted = moment[0] * gravity_vector[0] + moment[1] * gravity_vector[1] + moment[2] * gravity_vector[2]
                potential[begin + j] = fault[j] - lifted


def sweep_inertia(
    bodies: FloatArray, route: IndexArray, position: FloatArray, diagonal: FloatArray, matrix: FloatArray
) -> None:
    """Fill the `diagonal` (n, J) of M(q) of every sample, and the `matrix` (n, J, J) unless it is empty."""
    slots, fault = work_space(route, W, np.zeros(3))
    _sweep_bodies(bodies, route, position, slots, fault, diagonal, matrix)


@kernel(f"{MATRIX}({MATRIX}, {MATRIX})")
def _times_transposed(r: Matrix, s: Matrix) -> Matrix:
    """r s'."""
    a, b, c = (s[0], s[1], s[2]), (s[3], s[4], s[5]), (s[6], s[7], s[8])
    x, y, z = times(r, a), times(r, b), times(r, c)
    return x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]


@kernel(f"void({READ_ONLY}, {ROW})")
def _put_body(body: FloatArray, pair: FloatArray) -> None:
    """The joint's own body, added to what its children gave it."""
    moment = vector_of(body, MOMENT)
    upper, lower = vector_of(body, INERTIA), vector_of(body, INERTIA + 3)
    for j in range(BLOCK):
        put_vector(pair, SLOT + L + j, add(get_vector(pair, SLOT + L + j), upper))
        put_vector(pair, SLOT + K + j, add(get_vector(pair, SLOT + K + j), lower))
        put_vector(pair, SLOT + S + j, add(get_vector(pair, SLOT + S + j), moment))


@kernel(f"void({READ_ONLY}, {ROW})")
def _unit_momentum(body: FloatArray, pair: FloatArray) -> None:
    """Momentum of everything that a joint moves at a speed of 1, the other joints at rest; the joint's own inertia.

    Turning: l = z x s, k = I z; sliding: l = m z, k = s x z.
    """
    slides, drive, mass = body[SLIDES], body[DRIVE], body[MOVED_MASS]
    turns = 1.0 - slides
    for j in range(BLOCK):
        s, xz = get_vector(pair, SLOT + S + j), pair[SLOT + L + 2 * BLOCK + j]
        yz, zz = pair[SLOT + K + BLOCK + j], pair[SLOT + K + 2 * BLOCK + j]
        put_vector(pair, SLOT + W + j, (-turns * s[1], turns * s[0], slides * mass))
        put_vector(pair, SLOT + V + j, (turns * xz + slides * s[1], turns * yz - slides * s[0], turns * zz))
        pair[SLOT + TERMS + j] = drive + turns * zz + slides * mass


@kernel(f"void({READ_ONLY}, {ROW})")
def _carry_body(body: FloatArray, pair: FloatArray) -> None:
    """What a joint moves, added to what its parent moves.

    Turned about z and moved by d: s + m d, and I + 2 (s.d) E - s d' - d s' + m (d.d E - d d'); then turned by R.
    """
    rotation = rotation_of(body)
    mass, (tx, ty, tz) = body[MOVED_MASS], vector_of(body, TRANSLATION)
    for j in range(BLOCK):
        sine, cosine = pair[SLOT + SINE + j], pair[SLOT + COSINE + j]
        d = tx, ty, tz + pair[SLOT + OFFSET + j]
        (xx, xy, xz), (yy, yz, zz) = get_vector(pair, SLOT + L + j), get_vector(pair, SLOT + K + j)
        s = about_z(sine, cosine, get_vector(pair, SLOT + S + j))
        # About z: E (I E'), by columns.
        first, second = about_z(sine, cosine, (xx, xy, xz)), about_z(sine, cosine, (xy, yy, yz))
        xz, yz = cosine * xz - sine * yz, sine * xz + cosine * yz
        xx, xy = cosine * first[0] - sine * second[0], cosine * first[1] - sine * second[1]
        yy = sine * first[1] + cosine * second[1]
        # h = s + m d / 2: both terms of the shift together.
        h = add(s, scaled(0.5 * mass, d))
        twice = 2.0 * (h[0] * d[0] + h[1] * d[1] + h[2] * d[2])
        xx, yy, zz = xx + twice - 2.0 * h[0] * d[0], yy + twice - 2.0 * h[1] * d[1], zz + twice - 2.0 * h[2] * d[2]
        xy, xz = xy - h[0] * d[1] - h[1] * d[0], xz - h[0] * d[2] - h[2] * d[0]
        yz = yz - h[1] * d[2] - h[2] * d[1]
        moved = times(rotation, add(s, scaled(mass, d)))
        half = _times_transposed((xx, xy, xz, xy, yy, yz, xz, yz, zz), rotation)
        x, y = times(rotation, (half[0], half[3], half[6])), times(rotation, (half[1], half[4], half[7]))
        z = times(rotation, (half[2], half[5], half[8]))
        put_vector(pair, L + j, add(get_vector(pair, L + j), (x[0], y[0], z[0])))
        put_vector(pair, K + j, add(get_vector(pair, K + j), (y[1], z[1], z[2])))
        put_vector(pair, S + j, add(get_vector(pair, S + j), moved))


@kernel(f"void({READ_ONLY}, {ROW})")
def _carry_momentum(body: FloatArray, pair: FloatArray) -> None:
    """The momentum of one column of M, from a joint's frame into its parent's: R l, R (k + t x l)."""
    rotation = rotation_of(body)
    tx, ty, tz = vector_of(body, TRANSLATION)
    for j in range(BLOCK):
        sine, cosine = pair[SLOT + SINE + j], pair[SLOT + COSINE + j]
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        linear = about_z(sine, cosine, get_vector(pair, SLOT + W + j))
        angular = add(about_z(sine, cosine, get_vector(pair, SLOT + V + j)), cross(place, linear))
        put_vector(pair, W + j, times(rotation, linear))
        put_vector(pair, V + j, times(rotation, angular))


@kernel(f"void({ROW}, int64, {_MATRICES}, int64, int64, int64, int64, {ROW})")
def _give_element(
    rows: FloatArray,
    first: int,
    matrix: FloatArray,
    row: int,
    column: int,
    begin: int,
    count: int,
    fault: FloatArray,
) -> None:
    """An element of M and its mirror image, NaN where the sample has a fault."""
    for j in range(count):
        matrix[begin + j, row, column] = matrix[begin + j, column, row] = rows[first + j] + fault[j]


@kernel(f"void({READ_TABLE}, {READ_ROUTE}, {READ_TABLE}, {ROW}, {ROW}, {TABLE}, {_MATRICES})")
def _sweep_bodies(
    bodies: FloatArray,
    route: IndexArray,
    position: FloatArray,
    slots: FloatArray,
    fault: FloatArray,
    diagonal: FloatArray,
    matrix: FloatArray,
) -> None:
    for begin in range(0, len(position), BLOCK):
        count = min(BLOCK, len(position) - begin)
        clear(slots, fault)
        for i in range(len(bodies)):
            before, origin, column = route[i, BEFORE], route[i, COPY_OF], route[i, COLUMN]
            if origin >= 0:
                copy_motion(slots, origin, before)
            pair = pair_of(slots, before)
            for j in range(TERMS - L):
                pair[SLOT + L + j] = 0.0
            take_column(position, column, begin, count, pair, OFFSET, fault)
            fill_sine_cosine(pair, bodies[i, SLIDES])
        for i in range(len(bodies) - 1, -1, -1):
            before, origin = route[i, BEFORE], route[i, COPY_OF]
            pair = pair_of(slots, before)
            _put_body(body_of(bodies, i), pair)
            _unit_momentum(body_of(bodies, i), pair)
            if route[i, PARENT] >= 0:
                _carry_body(body_of(bodies, i), pair)
                if origin >= 0:
                    return_load(slots, origin, before)
            give_column(pair, TERMS, diagonal, route[i, COLUMN], begin, count, fault)
        if len(matrix) == 0:
            continue
        for j in range(count):
            matrix[begin + j] = fault[j]
        # Outward: the momentum of a column overwrites those of the columns before it.
        for i in range(len(bodies)):
            column, of = route[i, COLUMN], i
            pair = pair_of(slots, route[i, BEFORE])
            _give_element(pair, SLOT + TERMS, matrix, column, column, begin, count, fault)
            while route[of, PARENT] >= 0:
                before, origin, parent = route[of, BEFORE], route[of, COPY_OF], route[of, PARENT]
                pair = pair_of(slots, before)
                _carry_momentum(body_of(bodies, of), pair)
                if origin >= 0:
                    for j in range(6 * BLOCK):
                        slots[origin * SLOT + W + j] = pair[W + j]
                first = (W if bodies[parent, SLIDES] else V) + 2 * BLOCK
                _give_element(pair, first, matrix, route[parent, COLUMN], column, begin, count, fault)
                of = parent
