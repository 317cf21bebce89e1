"""Inertia matrix of a kinematic tree: composite bodies inward, then one column per joint. Conventions as in tree_rows.

In this sweep the rows of a load hold what a joint moves: its inertia about the frame's origin (upper triangle) in place
of l and k, and its first moment s. The rows of a motion hold the momentum of that body at a speed of 1 of its joint.
"""

from __future__ import annotations

import numpy as np

from cdtool.kernels import READ_ONLY, kernel
from cdtool.machines.tree_angles import fill_sine_cosine
from cdtool.machines.tree_rows import (
    BEFORE,
    BLOCK,
    COLUMN,
    COPY_OF,
    COSINE,
    DRIVE,
    INERTIA,
    MATRIX,
    MOMENT,
    MOVED_MASS,
    OFFSET,
    PARENT,
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
    clear,
    copy_motion,
    cross,
    get_vector,
    give_column,
    put_vector,
    return_load,
    rotation_of,
    scaled,
    take_column,
    times,
    vector_of,
    work_space,
)
from cdtool.recording import FloatArray

_MATRICES = "Array(float64, 3, 'C')"


def sweep_inertia(
    bodies: FloatArray, route: IndexArray, position: FloatArray, diagonal: FloatArray, matrix: FloatArray
) -> None:
    """Fill the `diagonal` (n, J) of M(q) of every sample, and the `matrix` (n, J, J) unless it is empty."""
    slots, fault = work_space(route, W, np.zeros(3))
    _sweep(bodies, route, position, slots, fault, diagonal, matrix)


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
    """Momentum of everything that a joint moves at a speed of 1 of the joint alone, and the joint's own inertia.

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


@kernel(f"void({ROW}, int64, float64, {_MATRICES}, int64, int64, int64, int64, {ROW})")
def _give_pair(
    slots: FloatArray,
    own: int,
    slides: float,
    matrix: FloatArray,
    row: int,
    column: int,
    begin: int,
    count: int,
    fault: FloatArray,
) -> None:
    """M of two joints, from the momentum of the one in the frame of the other, whose slot is `own`."""
    first = own * SLOT + (W if slides else V) + 2 * BLOCK
    for j in range(count):
        value = slots[first + j] + fault[j]
        matrix[begin + j, row, column] = value
        matrix[begin + j, column, row] = value


@kernel(f"void({READ_TABLE}, {READ_ROUTE}, {READ_TABLE}, {ROW}, {ROW}, {TABLE}, {_MATRICES})")
def _sweep(
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
            pair = slots[before * SLOT : (before + 2) * SLOT]
            pair[SLOT + L : SLOT + TERMS] = 0.0
            take_column(position, column, begin, count, pair, OFFSET, fault)
            fill_sine_cosine(pair, bodies[i, SLIDES])
        for i in range(len(bodies) - 1, -1, -1):
            before, origin = route[i, BEFORE], route[i, COPY_OF]
            pair = slots[before * SLOT : (before + 2) * SLOT]
            _put_body(bodies[i], pair)
            _unit_momentum(bodies[i], pair)
            if route[i, PARENT] >= 0:
                _carry_body(bodies[i], pair)
                if origin >= 0:
                    return_load(slots, origin, before)
            give_column(slots, before + 1, TERMS, diagonal, route[i, COLUMN], begin, count, fault)
        if len(matrix) == 0:
            continue
        for j in range(count):
            matrix[begin + j] = fault[j]
        # Outward: the momentum of a column overwrites those of the columns before it.
        for i in range(len(bodies)):
            column, of = route[i, COLUMN], i
            for j in range(count):
                matrix[begin + j, column, column] = diagonal[begin + j, column]
            while route[of, PARENT] >= 0:
                before, origin, parent = route[of, BEFORE], route[of, COPY_OF], route[of, PARENT]
                _carry_momentum(bodies[of], slots[before * SLOT : (before + 2) * SLOT])
                own = before
                if origin >= 0:
                    own = origin
                    slots[own * SLOT + W : own * SLOT + W + 6 * BLOCK] = slots[
                        before * SLOT + W : before * SLOT + W + 6 * BLOCK
                    ]
                _give_pair(
                    slots, own, bodies[parent, SLIDES], matrix, route[parent, COLUMN], column, begin, count, fault
                )
                of = parent
