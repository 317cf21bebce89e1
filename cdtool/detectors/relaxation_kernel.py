"""I - exp(-T S^-1) of symmetric positive definite matrices S, for a block of samples at once.

A matrix (J, J) of every sample of a block is a table (J J, BLOCK): the sample is innermost, so that one instruction
handles several samples. No result depends on the other samples of its block.
"""

from __future__ import annotations

import math

from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import FloatArray

BLOCK = 128
# Number of tables of work space for `fill_relaxations`.
WORK_TABLES = 3
TABLE = "float64[:, ::1]"
# Up to this norm of X, the first term left out of the series is below the last bit; X is halved until it is.
_SERIES_NORM = 0.09
# X of more halvings is left to its modes: the error of the inverse, a share of the fastest one, would be doubled too.
_MOST_HALVINGS = 5
# The series of I - exp(-X): X - X^2/2! + X^3/3! - ...
_C2, _C3, _C4, _C5 = -1.0 / 2.0, 1.0 / 6.0, -1.0 / 24.0, 1.0 / 120.0
_C6, _C7, _C8, _C9 = -1.0 / 720.0, 1.0 / 5040.0, -1.0 / 40320.0, 1.0 / 362880.0
# Jacobi rotations converge quadratically: few sweeps are ever needed.
_MOST_SWEEPS, _OFF_DIAGONAL = 60, 1e-36


@kernel(f"void({TABLE}, {TABLE}, int64)")
def invert_symmetric(matrix: FloatArray, work: FloatArray, size: int) -> None:
    """Replace the lower triangle of every matrix by that of its negative inverse: the sweep operator, pivot by pivot.

    Of a positive definite matrix no pivot is 0. Of `work`, 2 J rows are overwritten.
    """
    for p in range(size):
        for i in range(size):
            element = i * size + p if i > p else p * size + i
            for k in range(BLOCK):
                work[i, k] = matrix[element, k]
                work[size + i, k] = matrix[element, k] / matrix[p * size + p, k]
        for i in range(size):
            for j in range(i + 1):
                if i != p and j != p:
                    for k in range(BLOCK):
                        matrix[i * size + j, k] -= work[size + i, k] * work[j, k]
        for i in range(size):
            element = i * size + p if i > p else p * size + i
            for k in range(BLOCK):
                matrix[element, k] = work[size + i, k]
        for k in range(BLOCK):
            matrix[p * size + p, k] = -1.0 / work[p, k]


@kernel(f"int64({TABLE}, {READ_ONLY}, {TABLE}, int64)")
def _scale(x: FloatArray, elapsed: FloatArray, work: FloatArray, size: int) -> int:
    """Fill X = T S^-1 from the lower triangle of -S^-1, halved until its norm is small; return the most halvings.

    Row 0 of `work`: the number of halvings, -1 if they would be too many; row 1 is overwritten.
    """
    for k in range(BLOCK):
        work[0, k] = 0.0
    for i in range(size):
        for j in range(i + 1):
            count = 1.0 if i == j else 2.0
            for k in range(BLOCK):
                work[0, k] += count * x[i * size + j, k] * x[i * size + j, k]
    most = 0
    for k in range(BLOCK):
        norm, halvings = abs(elapsed[k]) * math.sqrt(work[0, k]), 0
        while norm > _SERIES_NORM and halvings <= _MOST_HALVINGS:
            norm *= 0.5
            halvings += 1
        if halvings > _MOST_HALVINGS:
            work[0, k], work[1, k] = -1.0, 0.0
            continue
        work[0, k] = halvings
        work[1, k] = -math.ldexp(elapsed[k], -halvings)
        most = max(most, halvings)
    for i in range(size):
        for j in range(i + 1):
            for k in range(BLOCK):
                x[i * size + j, k] *= work[1, k]
            for k in range(BLOCK):
                x[j * size + i, k] = x[i * size + j, k]
    return most


@kernel(f"void({TABLE}, {TABLE}, {TABLE}, int64)")
def _multiply(a: FloatArray, b: FloatArray, product: FloatArray, size: int) -> None:
    """Fill the product of matrices that are functions of one matrix: it is symmetric, as they are."""
    for i in range(size):
        for j in range(i + 1):
            row, first, second = i * size + j, i * size, j * size
            for k in range(BLOCK):
                product[row, k] = a[first, k] * b[second, k]
            # Two terms at once: a loop over a row takes as long to begin as for one of them.
            for m in range(1, size - 1, 2):
                for k in range(BLOCK):
                    product[row, k] += a[first + m, k] * b[second + m, k] + a[first + m + 1, k] * b[second + m + 1, k]
            if size % 2 == 0:
                for k in range(BLOCK):
                    product[row, k] += a[first + size - 1, k] * b[second + size - 1, k]
            if i != j:
                for k in range(BLOCK):
                    product[j * size + i, k] = product[row, k]


@kernel(f"void({TABLE}, {TABLE}, {TABLE}, float64, float64, float64, int64)")
def _add_terms(sums: FloatArray, x: FloatArray, square: FloatArray, c0: float, c1: float, c2: float, size: int) -> None:
    """Add c0 I + c1 X + c2 X^2."""
    for row in range(size * size):
        for k in range(BLOCK):
            sums[row, k] += c1 * x[row, k] + c2 * square[row, k]
    for i in range(size):
        for k in range(BLOCK):
            sums[i * size + i, k] += c0


@kernel(f"void({TABLE}, {READ_ONLY}, float64[:, :, ::1], {TABLE}, {TABLE}, int64)")
def fill_relaxations(
    x: FloatArray, elapsed: FloatArray, work: FloatArray, rows: FloatArray, result: FloatArray, size: int
) -> None:
    """Fill `result` with E = I - exp(-X), X = T S^-1, from the lower triangle of S in `x`, and T in `elapsed`.

    Nine terms of the series, grouped in powers of X^3; after h halvings of X, E is doubled h times: E (2 I - E). Row 0
    of `rows` becomes h, or -1 where X is too large and E must be found by `relax_by_modes`. `x`, the tables of `work`
    and the other rows (2 J) are overwritten.
    """
    square, cube, sums = work[0], work[1], work[2]
    invert_symmetric(x, rows, size)
    doublings = _scale(x, elapsed, rows, size)
    _multiply(x, x, square, size)
    _multiply(x, square, cube, size)
    for row in range(size * size):
        for k in range(BLOCK):
            result[row, k] = _C9 * cube[row, k]
    _add_terms(result, x, square, _C6, _C7, _C8, size)
    _multiply(cube, result, sums, size)
    _add_terms(sums, x, square, _C3, _C4, _C5, size)
    _multiply(cube, sums, result, size)
    _add_terms(result, x, square, 0.0, 1.0, _C2, size)
    for doubling in range(doublings):
        _multiply(result, result, square, size)
        for row in range(size * size):
            for k in range(BLOCK):
                doubled = 2.0 * result[row, k] - square[row, k]
                result[row, k] = doubled if doubling < rows[0, k] else result[row, k]


@kernel(f"void({TABLE}, {TABLE})")
def find_modes(matrix: FloatArray, vectors: FloatArray) -> None:
    """Fill the eigenvectors of one symmetric matrix (J, J), one per column, by cyclic Jacobi rotations.

    The matrix is overwritten: its diagonal holds the eigenvalues, in no order.
    """
    size = len(matrix)
    for i in range(size):
        for j in range(size):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(_MOST_SWEEPS):
        beside = total = 0.0
        for i in range(size):
            total += matrix[i, i] * matrix[i, i]
            for j in range(i):
                beside += matrix[i, j] * matrix[i, j]
        if not beside > _OFF_DIAGONAL * total:
            return
        for p in range(size - 1):
            for q in range(p + 1, size):
                if matrix[p, q] != 0.0:
                    _rotate(matrix, vectors, p, q)


@kernel(f"void({TABLE}, {TABLE}, int64, int64)")
def _rotate(matrix: FloatArray, vectors: FloatArray, p: int, q: int) -> None:
    """Rotate the axes p and q so that the element of both is 0."""
    half = 0.5 * (matrix[q, q] - matrix[p, p]) / matrix[p, q]
    tangent = 1.0 / (abs(half) + math.sqrt(half * half + 1.0))
    tangent = tangent if half >= 0.0 else -tangent
    cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
    sine, moved = tangent * cosine, tangent * matrix[p, q]
    matrix[p, p] -= moved
    matrix[q, q] += moved
    matrix[p, q] = matrix[q, p] = 0.0
    for k in range(len(matrix)):
        if k not in (p, q):
            a, b = matrix[k, p], matrix[k, q]
            matrix[k, p] = matrix[p, k] = cosine * a - sine * b
            matrix[k, q] = matrix[q, k] = sine * a + cosine * b
        a, b = vectors[k, p], vectors[k, q]
        vectors[k, p], vectors[k, q] = cosine * a - sine * b, sine * a + cosine * b


@kernel(f"void({TABLE}, {TABLE}, float64, float64[::1], float64[::1])")
def relax_by_modes(
    modes: FloatArray, vectors: FloatArray, elapsed: float, vector: FloatArray, change: FloatArray
) -> None:
    """Fill `change` (J,) with E x of one sample, from what `find_modes` made of S: each mode has its own factor."""
    size = len(vector)
    for i in range(size):
        change[i] = 0.0
    for mode in range(size):
        part = 0.0
        for i in range(size):
            part += vectors[i, mode] * vector[i]
        part *= -math.expm1(-elapsed / modes[mode, mode])
        for i in range(size):
            change[i] += vectors[i, mode] * part
