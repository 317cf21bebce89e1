"""Inverse dynamics and contact Jacobian of a kinematic tree. Conventions as in tree_rows."""

from __future__ import annotations

import math

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
    DV,
    DW,
    MASS,
    MATRIX,
    MOMENT,
    OFFSET,
    RATE,
    RATE_CHANGE,
    READ_INDEX,
    READ_ROUTE,
    READ_TABLE,
    ROW,
    SINE,
    SLIDES,
    SLOT,
    TABLE,
    TERMS,
    TRANSLATION,
    VECTOR,
    IndexArray,
    K,
    L,
    Matrix,
    V,
    Vector,
    W,
    about_z,
    add,
    body_of,
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


@kernel(f"void({READ_ONLY}, {ROW})")
def _carry_acceleration(body: FloatArray, pair: FloatArray) -> None:
    """Twist and its spatial derivative into the joint's frame; force and torque that the body's own motion takes.

    dw = E dw_p + w x z qd + z qdd, dv = E (dv_p + dw_p x t) + v x z qd for a joint that turns; one that slides has
    dv + w x z qd + z qdd. f = m dv + dw x s + w x l, n = I dw + s x dv + w x k + v x l.
    """
    inverse, inertia = inverse_rotation_of(body), inertia_of(body)
    mass, moment, (tx, ty, tz) = body[MASS], vector_of(body, MOMENT), vector_of(body, TRANSLATION)
    slides = body[SLIDES]
    turns = 1.0 - slides
    for j in range(BLOCK):
        sine, cosine = -pair[SLOT + SINE + j], pair[SLOT + COSINE + j]
        rate, change = pair[SLOT + RATE + j], pair[SLOT + RATE_CHANGE + j]
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        spin, spin_change = times(inverse, get_vector(pair, W + j)), times(inverse, get_vector(pair, DW + j))
        flow = add(times(inverse, get_vector(pair, V + j)), cross(spin, place))
        flow_change = add(times(inverse, get_vector(pair, DV + j)), cross(spin_change, place))
        w = add(about_z(sine, cosine, spin), (0.0, 0.0, turns * rate))
        v = add(about_z(sine, cosine, flow), (0.0, 0.0, slides * rate))
        turn, slide = turns * rate, slides * rate
        dw = add(about_z(sine, cosine, spin_change), (turn * w[1], -turn * w[0], turns * change))
        dv = add(
            about_z(sine, cosine, flow_change),
            (turn * v[1] + slide * w[1], -turn * v[0] - slide * w[0], slides * change),
        )
        linear = add(scaled(mass, v), cross(w, moment))
        angular = add(times(inertia, w), cross(moment, v))
        force = add(add(scaled(mass, dv), cross(dw, moment)), cross(w, linear))
        torque = add(add(times(inertia, dw), cross(moment, dv)), add(cross(w, angular), cross(v, linear)))
        put_vector(pair, SLOT + W + j, w)
        put_vector(pair, SLOT + V + j, v)
        put_vector(pair, SLOT + DW + j, dw)
        put_vector(pair, SLOT + DV + j, dv)
        put_vector(pair, SLOT + L + j, force)
        put_vector(pair, SLOT + K + j, torque)


@kernel(f"void({READ_ONLY}, {ROW})")
def _joint_torque(body: FloatArray, pair: FloatArray) -> None:
    """The joint's share of force and torque of everything it moves, and what its drive's inertia takes.

    Force and torque, in place of l and k, are added to the parent's: l_p += R l, k_p += R (k + t x l).
    """
    slides, drive = body[SLIDES], body[DRIVE]
    turns = 1.0 - slides
    rotation, (tx, ty, tz) = rotation_of(body), vector_of(body, TRANSLATION)
    for j in range(BLOCK):
        force, torque = get_vector(pair, SLOT + L + j), get_vector(pair, SLOT + K + j)
        pair[SLOT + TERMS + j] = drive * pair[SLOT + RATE_CHANGE + j] + (turns * torque[2] + slides * force[2])
        sine, cosine = pair[SLOT + SINE + j], pair[SLOT + COSINE + j]
        linear = about_z(sine, cosine, force)
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        angular = add(about_z(sine, cosine, torque), cross(place, linear))
        put_vector(pair, L + j, add(get_vector(pair, L + j), times(rotation, linear)))
        put_vector(pair, K + j, add(get_vector(pair, K + j), times(rotation, angular)))


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
    _sweep(bodies, route, position, speed, acceleration, *work_space(route, DV, -gravity_vector), torque)


@kernel(f"void({READ_TABLE}, {READ_ROUTE}, {READ_TABLE}, {READ_TABLE}, {READ_TABLE}, {ROW}, {ROW}, {TABLE})")
def _sweep(
    bodies: FloatArray,
    route: IndexArray,
    position: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    slots: FloatArray,
    fault: FloatArray,
    torque: FloatArray,
) -> None:
    """As `sweep_inverse_dynamics`, with the work space, whose base has its acceleration."""
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
            take_column(acceleration, column, begin, count, pair, RATE_CHANGE, fault)
            fill_sine_cosine(pair, bodies[i, SLIDES])
            _carry_acceleration(body_of(bodies, i), pair)
        for i in range(len(bodies) - 1, -1, -1):
            before, origin = route[i, BEFORE], route[i, COPY_OF]
            pair = pair_of(slots, before)
            _joint_torque(body_of(bodies, i), pair)
            if origin >= 0:
                return_load(slots, origin, before)
        for i in range(len(bodies)):
            give_column(pair_of(slots, route[i, BEFORE]), TERMS, torque, route[i, COLUMN], begin, count, fault)


@kernel(f"{MATRIX}({MATRIX}, {MATRIX})")
def _product(r: Matrix, s: Matrix) -> Matrix:
    """r s."""
    first, second = times(r, (s[0], s[3], s[6])), times(r, (s[1], s[4], s[7]))
    third = times(r, (s[2], s[5], s[8]))
    return first[0], second[0], third[0], first[1], second[1], third[1], first[2], second[2], third[2]


@kernel(f"void({READ_TABLE}, {READ_ROUTE}, {READ_INDEX}, {VECTOR}, {READ_TABLE}, Array(float64, 3, 'C'))")
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
            turned = _product(turned, rotation_of(bodies[i]))
            tx, ty, tz = vector_of(bodies[i], TRANSLATION)
            moved = add(moved, times(turned, (tx, ty, tz + offset)))
            sine, cosine = math.sin(angle), math.cos(angle)
            turned = _product(turned, (cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0))
            for axis in range(3):
                jacobian[sample, axis, route[i, COLUMN]] = moved[axis]
                jacobian[sample, 3 + axis, route[i, COLUMN]] = turned[3 * axis + 2]
        moved = add(moved, times(turned, point))
        for i in path:
            lever = jacobian[sample, :, route[i, COLUMN]]
            turns = 1.0 - bodies[i, SLIDES]
            z = lever[3], lever[4], lever[5]
            way = cross(z, (moved[0] - lever[0], moved[1] - lever[1], moved[2] - lever[2]))
            for axis in range(3):
                lever[axis] = turns * way[axis] + (1.0 - turns) * z[axis]
                lever[3 + axis] = turns * z[axis]
        for row in range(6):
            for column in range(position.shape[1]):
                jacobian[sample, row, column] += fault
