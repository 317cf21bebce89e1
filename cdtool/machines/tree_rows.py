"""How the sweeps over a kinematic tree arrange their data: blocks of samples, the sample index innermost.

Conventions: every joint turns about, or slides along, the z axis of its own frame; parents come before children. Twist
(w, v of the frame's origin), momentum (l linear, k angular about the origin), force and torque (f, n) and first moment
s of the mass are in the joint's own frame. E turns a vector of the parent's frame into the joint's, R one of the
joint's frame at position 0 into the parent's, t is the joint's position in its parent. A block is BLOCK samples; a row
holds one component for all samples of the block, so that one instruction handles several samples. The content of the
rows beyond the end of a recording is computed with, but never returned.

Each joint has a slot of rows; the slot before it (the two make a pair) holds its parent's motion and accumulates its
parent's load. Where the parent's own slot is not the one before, that slot is a copy. So all distances between rows are
known at compile time, and the compiler sees that rows do not overlap: without that it does not vectorise.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, kernel

IndexArray = npt.NDArray[np.int64]
Vector = tuple[float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]

#: Samples that one instruction handles, or two: see above.
BLOCK = 16
# Where the rows of a slot begin: joint, motion (W to DV), load (L to S), results.
SINE, COSINE, OFFSET, RATE, RATE_CHANGE = 0 * BLOCK, 1 * BLOCK, 2 * BLOCK, 3 * BLOCK, 4 * BLOCK
W, V, GRAVITY = 5 * BLOCK, 8 * BLOCK, 11 * BLOCK
DW, DV = 11 * BLOCK, 14 * BLOCK  # spatial derivatives of w and v, where the gravity is among them
L, K, S = 17 * BLOCK, 20 * BLOCK, 23 * BLOCK
TERMS = 26 * BLOCK
SLOT = 29 * BLOCK

# Columns of the constants (one row per joint): R and R' t of its placement, own and moved mass, s, upper triangle of I.
ROTATION, TRANSLATION, MASS, MOMENT, INERTIA, DRIVE, SLIDES, MOVED_MASS, CONSTANTS = 0, 9, 12, 13, 16, 22, 23, 24, 25

# Columns of the route (one row per joint): the recording's column, the slot before its own, its original (-1: none),
# and the row of the parent (-1: the base).
COLUMN, BEFORE, COPY_OF, PARENT, STEPS = 0, 1, 2, 3, 4

ROW = "Array(float64, 1, 'C')"
READ_TABLE = "Array(float64, 2, 'C', readonly=True)"
TABLE = "Array(float64, 2, 'C')"
READ_INDEX = "Array(int64, 1, 'C', readonly=True)"
READ_ROUTE = "Array(int64, 2, 'C', readonly=True)"
VECTOR = "UniTuple(float64, 3)"
MATRIX = "UniTuple(float64, 9)"


def work_space(route: IndexArray, first: int, base: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slots for a sweep, with a vector in the base's slot from row `first` on; a row of faults."""
    slots = np.zeros((int(route[:, BEFORE].max()) + 2) * SLOT)
    slots[first : first + 3 * BLOCK] = np.repeat(base, BLOCK)
    return slots, np.zeros(BLOCK)


@kernel(f"{ROW}({ROW}, int64)")
def pair_of(slots: FloatArray, before: int) -> FloatArray:
    """The slot before a joint's own, and its own."""
    return slots[before * SLOT : (before + 2) * SLOT]


@kernel(f"{READ_ONLY}({READ_TABLE}, int64)")
def body_of(bodies: FloatArray, joint: int) -> FloatArray:
    """The constants of a joint."""
    body: FloatArray = bodies[joint]
    return body


@kernel(f"{VECTOR}({ROW}, int64)")
def get_vector(rows: FloatArray, first: int) -> Vector:
    """Three rows at one sample."""
    return rows[first], rows[first + BLOCK], rows[first + 2 * BLOCK]


@kernel(f"void({ROW}, int64, {VECTOR})")
def put_vector(rows: FloatArray, first: int, value: Vector) -> None:
    """Three rows at one sample, set."""
    rows[first], rows[first + BLOCK], rows[first + 2 * BLOCK] = value


@kernel(f"{VECTOR}({VECTOR}, {VECTOR})")
def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel(f"{VECTOR}(float64, {VECTOR})")
def scaled(factor: float, a: Vector) -> Vector:
    """factor a."""
    return factor * a[0], factor * a[1], factor * a[2]


@kernel(f"{VECTOR}({VECTOR}, {VECTOR})")
def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel(f"{VECTOR}(float64, float64, {VECTOR})")
def about_z(sine: float, cosine: float, a: Vector) -> Vector:
    """a, turned about z."""
    return cosine * a[0] - sine * a[1], sine * a[0] + cosine * a[1], a[2]


@kernel(f"{VECTOR}({MATRIX}, {VECTOR})")
def times(r: Matrix, a: Vector) -> Vector:
    """r a."""
    return (
        r[0] * a[0] + r[1] * a[1] + r[2] * a[2],
        r[3] * a[0] + r[4] * a[1] + r[5] * a[2],
        r[6] * a[0] + r[7] * a[1] + r[8] * a[2],
    )


@kernel(f"{VECTOR}({READ_ONLY}, int64)")
def vector_of(body: FloatArray, first: int) -> Vector:
    """Three constants of a joint."""
    return body[first], body[first + 1], body[first + 2]


@kernel(f"{MATRIX}({READ_ONLY})")
def inertia_of(body: FloatArray) -> Matrix:
    """I of a body."""
    xx, xy, xz = body[INERTIA], body[INERTIA + 1], body[INERTIA + 2]
    yy, yz, zz = body[INERTIA + 3], body[INERTIA + 4], body[INERTIA + 5]
    return xx, xy, xz, xy, yy, yz, xz, yz, zz


@kernel(f"{MATRIX}({READ_ONLY})")
def rotation_of(body: FloatArray) -> Matrix:
    """R of a joint."""
    return body[0], body[1], body[2], body[3], body[4], body[5], body[6], body[7], body[8]


@kernel(f"{MATRIX}({READ_ONLY})")
def inverse_rotation_of(body: FloatArray) -> Matrix:
    """R' of a joint."""
    return body[0], body[3], body[6], body[1], body[4], body[7], body[2], body[5], body[8]


@kernel(f"void({READ_TABLE}, int64, int64, int64, {ROW}, int64, {ROW})")
def take_column(
    values: FloatArray, column: int, begin: int, count: int, pair: FloatArray, row: int, fault: FloatArray
) -> None:
    """One column of a recording into a row; `fault` becomes NaN where a value is not finite."""
    for j in range(count):
        pair[SLOT + row + j] = values[begin + j, column]
    # A value times 0 is NaN if it is not finite, else 0.
    for j in range(BLOCK):
        fault[j] += 0.0 * pair[SLOT + row + j]


@kernel(f"void({ROW}, int64, {TABLE}, int64, int64, int64, {ROW})")
def give_column(
    pair: FloatArray, row: int, values: FloatArray, column: int, begin: int, count: int, fault: FloatArray
) -> None:
    """A row into one column of a result, NaN where the sample has a fault."""
    for j in range(count):
        values[begin + j, column] = pair[SLOT + row + j] + fault[j]


@kernel(f"void({ROW}, {ROW})")
def clear(slots: FloatArray, fault: FloatArray) -> None:
    """Before a block: no fault yet, and no load on the base, whose slot is the first."""
    for j in range(BLOCK):
        fault[j] = 0.0
    for j in range(L, TERMS):
        slots[j] = 0.0


@kernel(f"void({ROW}, int64, int64)")
def copy_motion(slots: FloatArray, origin: int, copy: int) -> None:
    """A copy of a slot's motion, without load, for a further child."""
    for j in range(L - W):
        slots[copy * SLOT + W + j] = slots[origin * SLOT + W + j]
    for j in range(TERMS - L):
        slots[copy * SLOT + L + j] = 0.0


@kernel(f"void({ROW}, int64, int64)")
def return_load(slots: FloatArray, origin: int, copy: int) -> None:
    """The load that the further child gave to the copy, added to the original's."""
    for j in range(TERMS - L):
        slots[origin * SLOT + L + j] += slots[copy * SLOT + L + j]


@kernel(f"void({READ_ONLY}, {ROW})")
def carry_load(body: FloatArray, pair: FloatArray) -> None:
    """What a joint moves, added to its parent's load: l_p += R l, k_p += R (k + t x l), s_p += R (s + m t)."""
    rotation = rotation_of(body)
    mass, (tx, ty, tz) = body[MOVED_MASS], vector_of(body, TRANSLATION)
    for j in range(BLOCK):
        sine, cosine = pair[SLOT + SINE + j], pair[SLOT + COSINE + j]
        place = tx, ty, tz + pair[SLOT + OFFSET + j]
        linear = about_z(sine, cosine, get_vector(pair, SLOT + L + j))
        angular = add(about_z(sine, cosine, get_vector(pair, SLOT + K + j)), cross(place, linear))
        s = add(about_z(sine, cosine, get_vector(pair, SLOT + S + j)), scaled(mass, place))
        put_vector(pair, L + j, add(get_vector(pair, L + j), times(rotation, linear)))
        put_vector(pair, K + j, add(get_vector(pair, K + j), times(rotation, angular)))
        put_vector(pair, S + j, add(get_vector(pair, S + j), times(rotation, s)))
