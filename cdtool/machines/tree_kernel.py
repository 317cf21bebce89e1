"""Momentum and energies of a kinematic tree: one sweep out, one back. Conventions as in tree_rows."""

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
    GRAVITY,
    MASS,
    MOMENT,
    MOVED_MASS,
    OFFSET,
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
    S,
    V,
    W,
    about_z,
    add,
    carry_load,
    clear,
    copy_motion,
    cross,
    get_vector,
    give_column,
    inertia_of,
    inverse_rotation_of,
    put_vector,
    return_load,
    scaled,
    take_column,
    times,
    vector_of,
    work_space,
)
from cdtool.recording import FloatArray


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
            pair = slots[before * SLOT : (before + 2) * SLOT]
            take_column(position, column, begin, count, pair, OFFSET, fault)
            take_column(speed, column, begin, count, pair, RATE, fault)
            fill_sine_cosine(pair, bodies[i, SLIDES])
            _carry_motion(bodies[i], pair)
        for i in range(len(bodies) - 1, -1, -1):
            before, origin = route[i, BEFORE], route[i, COPY_OF]
            pair = slots[before * SLOT : (before + 2) * SLOT]
            _joint_terms(bodies[i], pair)
            carry_load(bodies[i], pair)
            if origin >= 0:
                return_load(slots, origin, before)
        if len(momentum) > 0:
            for i in range(len(bodies)):
                own, column = route[i, BEFORE] + 1, route[i, COLUMN]
                give_column(slots, own, TERMS, momentum, column, begin, count, fault)
                give_column(slots, own, TERMS + BLOCK, velocity_force, column, begin, count, fault)
                give_column(slots, own, TERMS + 2 * BLOCK, gravity, column, begin, count, fault)
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
