"""Inertia matrix, bias torques and contact point of a kinematic tree at one state, as an integrator needs them.

The kernels of `cdtool.machines` handle blocks of samples that are known beforehand; an integrator has one state at a
time. All quantities are spatial vectors about the base's origin in base axes, so that inertias, momenta and wrenches of
bodies simply add up (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6)::

    S = (z, o x z) of a joint that turns, (0, z) of one that slides;  V_i = V_p + S_i q_i'
    M_ij = S_i . (I_j^c S_j) for i = j and for every i that carries j;  I^c: of everything that a joint moves
    h_i = S_i . sum over what it moves of (I A + V x* I V),  A_i = A_p + V_i x S_i q_i',  A_base = -gravity

The tree's joints may turn by a constant combination of the machine's coordinates q: q_tree = B q, M = B' M_tree B,
h = B' h_tree.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cdtool.base.kernels import kernel

Array = npt.NDArray[np.float64]

# Columns of the constants, one row per joint: index of the parent (-1: the base), 1 for a joint that slides, its frame
# at position 0 in the parent's, and mass, first moment and inertia (xx, xy, xz, yy, yz, zz) in its own frame.
PARENT, SLIDES, ROTATION, TRANSLATION, MASS, MOMENT, INERTIA, CONSTANTS = 0, 1, 2, 11, 14, 15, 18, 24

# Columns of the work space, one row per joint: frame, S, own inertia about the base's origin (mass, first moment,
# upper triangle), twist, acceleration, wrench, position, speed and bias of the tree's joints.
_FRAME, _ORIGIN, _S, _I, _V, _A, _F, _Q, _QD, _BIAS, WORK = 0, 9, 12, 18, 28, 34, 40, 46, 47, 48, 49

TABLE = "float64[:, ::1]"
ROW = "float64[::1]"


@kernel(f"void({TABLE}, {TABLE}, {ROW}, {TABLE})")
def place_bodies(bodies: Array, combination: Array, position: Array, work: Array) -> None:
    """Fill the frames of the work space (J, WORK) for machine positions (J,)."""
    count = len(bodies)
    for i in range(count):
        q = 0.0
        for j in range(count):
            q += combination[i, j] * position[j]
        work[i, _Q] = q
        parent = int(bodies[i, PARENT])
        slides = bodies[i, SLIDES] > 0.5
        sine, cosine = (0.0, 1.0) if slides else (math.sin(q), math.cos(q))
        for row in range(3):
            for column in range(3):
                # Rotation of the joint in its parent, turned about its own z axis.
                total = 0.0
                for inner in range(3):
                    carried = 1.0 if row == inner else 0.0
                    if parent >= 0:
                        carried = work[parent, _FRAME + 3 * row + inner]
                    first = bodies[i, ROTATION + 3 * inner]
                    second = bodies[i, ROTATION + 3 * inner + 1]
                    if column == 0:
                        total += carried * (cosine * first + sine * second)
                    elif column == 1:
                        total += carried * (cosine * second - sine * first)
                    else:
                        total += carried * bodies[i, ROTATION + 3 * inner + 2]
                work[i, _FRAME + 3 * row + column] = total
        for row in range(3):
            place = 0.0
            for inner in range(3):
                carried = 1.0 if row == inner else 0.0
                if parent >= 0:
                    carried = work[parent, _FRAME + 3 * row + inner]
                place += carried * bodies[i, TRANSLATION + inner]
            if parent >= 0:
                place += work[parent, _ORIGIN + row]
            if slides:
                place += q * work[i, _FRAME + 3 * row + 2]
            work[i, _ORIGIN + row] = place


@kernel(f"void({TABLE}, {TABLE}, {ROW}, UniTuple(float64, 3), {TABLE}, {TABLE}, {ROW})")
def fill_dynamics(
    bodies: Array,
    combination: Array,
    speed: Array,
    gravity: tuple[float, float, float],
    work: Array,
    matrix: Array,
    bias: Array,
) -> None:
    """Fill M (J, J) and h = C v + g (J,) of the machine's coordinates; call `place_bodies` before.

    `speed` (J,) of the machine's coordinates; `gravity` in base axes [m/s2]. Drives are not included.
    """
    count = len(bodies)
    for i in range(count):
        rate = 0.0
        for j in range(count):
            rate += combination[i, j] * speed[j]
        work[i, _QD] = rate
        ox, oy, oz = work[i, _ORIGIN], work[i, _ORIGIN + 1], work[i, _ORIGIN + 2]
        zx, zy, zz = work[i, _FRAME + 2], work[i, _FRAME + 5], work[i, _FRAME + 8]
        if bodies[i, SLIDES] > 0.5:
            sx, sy, sz, ux, uy, uz = 0.0, 0.0, 0.0, zx, zy, zz
        else:
            sx, sy, sz = zx, zy, zz
            ux, uy, uz = oy * zz - oz * zy, oz * zx - ox * zz, ox * zy - oy * zx
        work[i, _S], work[i, _S + 1], work[i, _S + 2] = sx, sy, sz
        work[i, _S + 3], work[i, _S + 4], work[i, _S + 5] = ux, uy, uz

        # Mass, first moment and inertia about the base's origin.
        mass = bodies[i, MASS]
        for row in range(3):
            own = 0.0
            for inner in range(3):
                own += work[i, _FRAME + 3 * row + inner] * bodies[i, MOMENT + inner]
            work[i, _A + row] = own  # about the frame's own origin; the place is used again below
        px, py, pz = work[i, _A], work[i, _A + 1], work[i, _A + 2]
        hx, hy, hz = px + mass * ox, py + mass * oy, pz + mass * oz
        between = 2.0 * (ox * px + oy * py + oz * pz) + mass * (ox * ox + oy * oy + oz * oz)
        work[i, _I], work[i, _I + 1], work[i, _I + 2], work[i, _I + 3] = mass, hx, hy, hz
        xx, xy, xz = bodies[i, INERTIA], bodies[i, INERTIA + 1], bodies[i, INERTIA + 2]
        yy, yz, zz_ = bodies[i, INERTIA + 3], bodies[i, INERTIA + 4], bodies[i, INERTIA + 5]
        place = _I + 4
        for row in range(3):
            rx, ry, rz = work[i, _FRAME + 3 * row], work[i, _FRAME + 3 * row + 1], work[i, _FRAME + 3 * row + 2]
            tx, ty, tz = rx * xx + ry * xy + rz * xz, rx * xy + ry * yy + rz * yz, rx * xz + ry * yz + rz * zz_
            o_row, p_row = work[i, _ORIGIN + row], work[i, _A + row]
            for column in range(row, 3):
                base = _FRAME + 3 * column
                value = tx * work[i, base] + ty * work[i, base + 1] + tz * work[i, base + 2]
                o_column, p_column = work[i, _ORIGIN + column], work[i, _A + column]
                value -= o_row * p_column + p_row * o_column + mass * o_row * o_column
                work[i, place] = value + between if row == column else value
                place += 1

        # Twist and bias acceleration.
        parent = int(bodies[i, PARENT])
        for axis in range(6):
            carried = work[parent, _V + axis] if parent >= 0 else 0.0
            work[i, _V + axis] = carried + work[i, _S + axis] * rate
        wx, wy, wz = work[i, _V], work[i, _V + 1], work[i, _V + 2]
        vx, vy, vz = work[i, _V + 3], work[i, _V + 4], work[i, _V + 5]
        for axis in range(6):
            work[i, _A + axis] = work[parent, _A + axis] if parent >= 0 else 0.0
        if parent < 0:
            for axis in range(3):
                work[i, _A + 3 + axis] = -gravity[axis]
        work[i, _A] += rate * (wy * sz - wz * sy)
        work[i, _A + 1] += rate * (wz * sx - wx * sz)
        work[i, _A + 2] += rate * (wx * sy - wy * sx)
        work[i, _A + 3] += rate * (wy * uz - wz * uy + vy * sz - vz * sy)
        work[i, _A + 4] += rate * (wz * ux - wx * uz + vz * sx - vx * sz)
        work[i, _A + 5] += rate * (wx * uy - wy * ux + vx * sy - vy * sx)

        # Wrench: I A + V x* (I V).
        ixx, ixy, ixz = work[i, _I + 4], work[i, _I + 5], work[i, _I + 6]
        iyy, iyz, izz = work[i, _I + 7], work[i, _I + 8], work[i, _I + 9]
        kx = ixx * wx + ixy * wy + ixz * wz + hy * vz - hz * vy
        ky = ixy * wx + iyy * wy + iyz * wz + hz * vx - hx * vz
        kz = ixz * wx + iyz * wy + izz * wz + hx * vy - hy * vx
        lx, ly, lz = mass * vx - hy * wz + hz * wy, mass * vy - hz * wx + hx * wz, mass * vz - hx * wy + hy * wx
        ax, ay, az = work[i, _A], work[i, _A + 1], work[i, _A + 2]
        bx, by, bz = work[i, _A + 3], work[i, _A + 4], work[i, _A + 5]
        nx = ixx * ax + ixy * ay + ixz * az + hy * bz - hz * by
        ny = ixy * ax + iyy * ay + iyz * az + hz * bx - hx * bz
        nz = ixz * ax + iyz * ay + izz * az + hx * by - hy * bx
        work[i, _F] = nx + wy * kz - wz * ky + vy * lz - vz * ly
        work[i, _F + 1] = ny + wz * kx - wx * kz + vz * lx - vx * lz
        work[i, _F + 2] = nz + wx * ky - wy * kx + vx * ly - vy * lx
        work[i, _F + 3] = mass * bx - hy * az + hz * ay + wy * lz - wz * ly
        work[i, _F + 4] = mass * by - hz * ax + hx * az + wz * lx - wx * lz
        work[i, _F + 5] = mass * bz - hx * ay + hy * ax + wx * ly - wy * lx

    # From the tips to the base: everything that a joint moves. Parents come before children.
    for i in range(count - 1, -1, -1):
        parent = int(bodies[i, PARENT])
        torque = 0.0
        for axis in range(6):
            torque += work[i, _S + axis] * work[i, _F + axis]
        work[i, _BIAS] = torque
        if parent >= 0:
            for axis in range(6):
                work[parent, _F + axis] += work[i, _F + axis]
            for axis in range(10):
                work[parent, _I + axis] += work[i, _I + axis]

    # The matrix of the tree's joints, in machine coordinates.
    for i in range(count):
        bias[i] = 0.0
        for j in range(count):
            matrix[i, j] = 0.0
    for j in range(count):
        mass, hx, hy, hz = work[j, _I], work[j, _I + 1], work[j, _I + 2], work[j, _I + 3]
        ixx, ixy, ixz = work[j, _I + 4], work[j, _I + 5], work[j, _I + 6]
        iyy, iyz, izz = work[j, _I + 7], work[j, _I + 8], work[j, _I + 9]
        wx, wy, wz = work[j, _S], work[j, _S + 1], work[j, _S + 2]
        vx, vy, vz = work[j, _S + 3], work[j, _S + 4], work[j, _S + 5]
        kx = ixx * wx + ixy * wy + ixz * wz + hy * vz - hz * vy
        ky = ixy * wx + iyy * wy + iyz * wz + hz * vx - hx * vz
        kz = ixz * wx + iyz * wy + izz * wz + hx * vy - hy * vx
        lx, ly, lz = mass * vx - hy * wz + hz * wy, mass * vy - hz * wx + hx * wz, mass * vz - hx * wy + hy * wx
        i = j
        while i >= 0:
            element = work[i, _S] * kx + work[i, _S + 1] * ky + work[i, _S + 2] * kz
            element += work[i, _S + 3] * lx + work[i, _S + 4] * ly + work[i, _S + 5] * lz
            for row in range(count):
                for column in range(count):
                    matrix[row, column] += combination[i, row] * element * combination[j, column]
                    if i != j:
                        matrix[row, column] += combination[j, row] * element * combination[i, column]
            i = int(bodies[i, PARENT])
        for row in range(count):
            bias[row] += combination[j, row] * work[j, _BIAS]


@kernel(
    f"float64({TABLE}, {TABLE}, int64, UniTuple(float64, 3), UniTuple(float64, 3), {TABLE}, {ROW})",
)
def fill_lever(
    bodies: Array,
    combination: Array,
    joint: int,
    point: tuple[float, float, float],
    normal: tuple[float, float, float],
    work: Array,
    lever: Array,
) -> float:
    """Fill J_v' n (J,) of a point [m] of a joint's frame, return its place n . P [m]; call `place_bodies` before."""
    nx, ny, nz = normal
    px, py, pz = point
    frame, origin = _FRAME, _ORIGIN
    x = work[joint, origin] + work[joint, frame] * px + work[joint, frame + 1] * py + work[joint, frame + 2] * pz
    y = work[joint, origin + 1] + work[joint, frame + 3] * px + work[joint, frame + 4] * py
    y += work[joint, frame + 5] * pz
    z = work[joint, origin + 2] + work[joint, frame + 6] * px + work[joint, frame + 7] * py
    z += work[joint, frame + 8] * pz
    count = len(bodies)
    for column in range(count):
        lever[column] = 0.0
    i = joint
    while i >= 0:
        zx, zy, zz = work[i, frame + 2], work[i, frame + 5], work[i, frame + 8]
        if bodies[i, SLIDES] > 0.5:
            rate = nx * zx + ny * zy + nz * zz
        else:
            dx, dy, dz = x - work[i, origin], y - work[i, origin + 1], z - work[i, origin + 2]
            rate = nx * (zy * dz - zz * dy) + ny * (zz * dx - zx * dz) + nz * (zx * dy - zy * dx)
        for column in range(count):
            lever[column] += combination[i, column] * rate
        i = int(bodies[i, PARENT])
    place: float = nx * x + ny * y + nz * z
    return place


@kernel(f"void({TABLE}, {ROW})")
def solve_in_place(matrix: Array, vector: Array) -> None:
    """Replace the vector b by the solution x of M x = b, M symmetric and positive definite; M is overwritten.

    Cholesky without pivoting; a matrix that is not positive definite gives NaN.
    """
    count = len(vector)
    for j in range(count):
        for i in range(j, count):
            total = matrix[i, j]
            for inner in range(j):
                total -= matrix[i, inner] * matrix[j, inner]
            if i == j:
                matrix[j, j] = math.sqrt(total) if total > 0.0 else math.nan
            else:
                matrix[i, j] = total / matrix[j, j]
    for i in range(count):
        total = vector[i]
        for inner in range(i):
            total -= matrix[i, inner] * vector[inner]
        vector[i] = total / matrix[i, i]
    for i in range(count - 1, -1, -1):
        total = vector[i]
        for inner in range(i + 1, count):
            total -= matrix[inner, i] * vector[inner]
        vector[i] = total / matrix[i, i]
