"""Velocity observer: a disturbance observer on the joint speeds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.detection import Signal, Status, StatusArray
from cdtool.detectors.base import (
    BRIDGED,
    drive_of,
    for_every_joint,
    gain,
    observe_momentum,
    per_joint,
    require_positive,
)
from cdtool.detectors.look import SKY, Look
from cdtool.dynamics import Gain, Machine
from cdtool.instructions import LANES, STRIDE, add_products
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray, Recording

ROW, TABLE = "float64[::1]", "float64[:, ::1]"
_BOOLS = "Array(b1, 1, 'C', readonly=True)"
_TABLE = "Array(float64, 2, 'C', readonly=True)"
_MATRICES = "Array(float64, 3, 'C', readonly=True)"
_INDICES = "Array(int64, 1, 'C', readonly=True)"
# A matrix (J, J) of every sample of a block is a table (J J BLOCK,): element by element, the sample innermost, so that
# one instruction handles several samples. No result depends on the other samples of its block.
BLOCK = STRIDE
# Number of tables of work space for `fill_relaxations`.
WORK_TABLES = 3
# Number of steps whose inertia matrices are computed together: they fit into the processor's cache.
_STEPS = 64 * BLOCK
# Tables (J J BLOCK,): S of each step, what relaxes, and work space.
_SCALED, _RELAXED, _WORK = 0, 1, 2
# Rows (J,) of a step: the residual over sqrt(K), which lasts from block to block; what relaxes of it; its change.
_VALUE, _TARGET, _CHANGE, _ROWS = range(4)

# Up to this norm of X, the first term left out of the series is below the last bit; X is halved until it is.
_SERIES_NORM = 0.05
# X of more halvings is left to its modes: the error of the inverse, a share of the fastest one, would be doubled too.
_MOST_HALVINGS = 5
# exp(A) to the eighth power of A by three products (Bader, Blanes and Casas, Mathematics 7:1174, 2019):
# I + A + Y2 A^2 + (X3 A^2 + A4) (X4 I + X5 A + X6 A^2 + X7 A4) with A4 = A^2 (X1 A + X2 A^2).
_ROOT = math.sqrt(177.0)
_X1, _X2, _X3 = (1.0 + _ROOT) / 132.0, (1.0 + _ROOT) / 528.0, 2.0 / 3.0
_X4, _X5 = (29.0 * _ROOT - 271.0) / 210.0, 11.0 * (_ROOT - 1.0) / 840.0
_X6, _X7, _Y2 = 11.0 * (_ROOT - 9.0) / 3360.0, (89.0 - _ROOT) / 2240.0, (857.0 - 58.0 * _ROOT) / 630.0
# Jacobi rotations converge quadratically: few sweeps are ever needed.
_MOST_SWEEPS, _OFF_DIAGONAL = 60, 1e-36


@dataclass(frozen=True)
class Velocity:
    """Residual res = (s I + K M^-1)^-1 K M^-1 tau_c of the joint speeds.

    Parameters
    ----------
    bandwidth : float or tuple of float
        K divided by the diagonal of M at the home pose [rad/s], one number or one per joint. In that pose, and where M
        does not change, the observer is as fast as a momentum observer of this bandwidth.

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Thesis 2.11 to 2.15; 2.12 is the rate of the estimated speed, not the speed (docs/errata.md), and friction is added:

        d(vhat)/dt = M^-1 (tau - C v - g - friction - res),   res = K (vhat - v),   vhat(0) = v(0)

    Sampled with M frozen over each step: res_k = A res_{k-1} + (I - A) (mean force balance - M dv / T), A = exp(-K M^-1
    T).

    * Needs: torque, speed; position if joints are coupled.
    * Unit: N or N m, positive if the contact opposes positive travel.
    * Start-up: until 3 time constants of the slowest mode of K M^-1 have passed.
    * Fails: its bandwidth changes with the pose, and a contact of one joint appears in the others while the estimate
      settles.

    Examples
    --------
    On one axis it is the momentum observer.

    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recording import Recording, Series
    >>> from cdtool.tables import Table
    >>> axis = LinearAxis.from_table(Table({"coordinates": "load", "load_mass": 600.0}, "machine.toml"))
    >>> time = np.arange(2001) * 1e-3
    >>> torque, speed = Series(time, np.where(time < 1.0, 0.0, 30.0), "N"), Series(time, np.full(2001, 0.2), "m/s")
    >>> run = Recording("run", "", ("axis",), {"torque": torque, "speed": speed})
    >>> Velocity(bandwidth=10.0).signal(run, axis).values[[999, 1100, 2000], 0].round(1).tolist()
    [0.0, 19.0, 30.0]
    """

    bandwidth: Gain = gain(10.0, "rad/s", "K over the diagonal of M at the home pose")

    name: ClassVar[str] = "velocity"
    short_name: ClassVar[str] = "vo"
    title: ClassVar[str] = "Velocity observer"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = True
    look: ClassVar[Look] = Look(SKY, "<")

    def __post_init__(self) -> None:
        require_positive(self, "bandwidth")

    def unit(self, machine: Machine) -> str:
        """Return "N" or "N m"."""
        return machine.force_unit

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the residual (n, J) on the speed's clock; see `Detector.signal`."""
        drive = drive_of(self, recording, machine)
        balance = machine.force_balance(drive.torque, drive.position, drive.speed)
        if not machine.coupled:
            # M is constant and diagonal: joint by joint the same recursion as the momentum observer's.
            momentum = machine.inertia_times(drive.position, drive.speed)
            ready = np.full(momentum.shape[1], -np.inf)
            residual, status = observe_momentum(drive, balance, momentum, self.bandwidth, ready)
            return Signal(drive.time, residual, status, self.unit(machine), self.signed)
        residual, status = observe_velocity(
            drive.time,
            np.ascontiguousarray(balance),
            np.ascontiguousarray(drive.speed),
            lambda rows: machine.inertia_matrix(drive.position[rows]),
            np.ascontiguousarray(for_every_joint(drive.missing)[:, 0]),
            np.ascontiguousarray(for_every_joint(drive.interrupted)[:, 0]),
            per_joint(self.bandwidth, len(machine.joints)) * machine.nominal_inertia,
        )
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)


def observe_velocity(
    time: FloatArray,
    balance: FloatArray,
    speed: FloatArray,
    inertia: Callable[[slice], FloatArray],
    missing: BoolArray,
    motion_missing: BoolArray,
    gains: FloatArray,
) -> tuple[FloatArray, StatusArray]:
    """Return the residual res (n, J) and its status:

    res_k = A res_(k-1) + (I - A)(mean balance - M dv / T), A = exp(-K M^-1 T); M is the mean of the step's ends.

    `inertia` returns M (n, J, J) of a part of the samples. With S = K^(-1/2) M K^(-1/2), which is symmetric, A is
    K^(1/2) exp(-T S^-1) K^(-1/2). A missing motion makes the step longer; `missing` (any input) marks a sample as
    missing. It restarts after three time constants of the slowest mode, and 0.15 s, without a sample.
    """
    joints, root = len(gains), np.sqrt(gains)
    residual, status = np.zeros(balance.shape), np.full(balance.shape, Status.GAP, dtype=np.uint8)
    known = np.flatnonzero(~motion_missing)
    tables = np.zeros((_WORK + WORK_TABLES, joints * joints * BLOCK))
    # Duration and forces of each step, work space; matrix and vectors of the modes of one step.
    work = np.zeros(BLOCK), np.zeros(joints * BLOCK), np.zeros(2 * joints * BLOCK), np.zeros((2, joints, joints))
    rows, settled = np.zeros((_ROWS, joints)), np.zeros(1)
    for begin in range(0, len(known), _STEPS):
        end = min(begin + _STEPS, len(known))
        # From the sample before, where the first step of this part begins.
        first = int(known[max(begin - 1, 0)])
        part = np.ascontiguousarray(inertia(slice(first, int(known[end - 1]) + 1)))
        samples = (time, balance, speed, missing, known, begin, end, part, first)
        _observe(*samples, root, tables, *work, rows, settled, residual, status)
    if len(known):
        residual[known[-1] + 1 :] = residual[known[-1]]
    return residual, status


@kernel(
    f"void({READ_ONLY}, {_TABLE}, {_TABLE}, {_INDICES}, int64, int64, {_MATRICES}, int64, {READ_ONLY}, {ROW}, {ROW}, "
    f"{ROW})"
)
def _fill_steps(  # noqa: C901, PLR0913  a kernel: one loop, arrays one by one
    time: FloatArray,
    balance: FloatArray,
    speed: FloatArray,
    known: npt.NDArray[np.int64],
    begin: int,
    end: int,
    inertia: FloatArray,
    first: int,
    root: FloatArray,
    scaled: FloatArray,
    elapsed: FloatArray,
    forces: FloatArray,
) -> None:
    """Fill S, duration and (mean balance - M dv / T) / sqrt(K) of the steps that end at `known` from `begin` on."""
    joints = len(root)
    for lane in range(BLOCK):
        number = begin + lane
        elapsed[lane] = 0.0
        for i in range(joints):
            forces[i * BLOCK + lane] = 0.0
        if not 0 < number < end:
            # Beyond the steps of this block: any matrix that has an inverse.
            for i in range(joints):
                for j in range(i + 1):
                    scaled[(i * joints + j) * BLOCK + lane] = 1.0 if i == j else 0.0
            continue
        k, last = known[number], known[number - 1]
        for at in range(last + 1, k + 1):
            step = time[at] - time[at - 1]
            elapsed[lane] += step
            for i in range(joints):
                forces[i * BLOCK + lane] += 0.5 * (balance[at, i] + balance[at - 1, i]) * step
        if k > last + 1:
            # Over a gap the balance is based on held values: it is interpolated by a straight line.
            for i in range(joints):
                forces[i * BLOCK + lane] = 0.5 * (balance[k, i] + balance[last, i]) * elapsed[lane]
        now, before = inertia[k - first], inertia[last - first]
        for i in range(joints):
            force, scale = forces[i * BLOCK + lane], 1.0 / root[i]
            for j in range(joints):
                mean = 0.5 * (now[i, j] + before[i, j])
                force -= mean * (speed[k, j] - speed[last, j])
                if j <= i:
                    scaled[(i * joints + j) * BLOCK + lane] = mean * scale / root[j]
            forces[i * BLOCK + lane] = force * scale / elapsed[lane]


@kernel(f"float64({_MATRICES}, int64, int64, {READ_ONLY}, float64[:, :, ::1])")
def _find_step_modes(inertia: FloatArray, begin: int, end: int, root: FloatArray, modes: FloatArray) -> float:
    """Fill time constants and vectors of the modes of S of a step between two samples; return the slowest constant."""
    joints = len(root)
    for i in range(joints):
        for j in range(joints):
            modes[0, i, j] = 0.5 * (inertia[end, i, j] + inertia[begin, i, j]) / (root[i] * root[j])
    find_modes(modes[0], modes[1])
    slowest = modes[0, 0, 0]
    for i in range(1, joints):
        slowest = max(slowest, modes[0, i, i])
    return float(slowest)


@kernel(
    f"void({READ_ONLY}, {_TABLE}, {_TABLE}, {_BOOLS}, {_INDICES}, int64, int64, {_MATRICES}, int64, {READ_ONLY}, "
    f"{TABLE}, {ROW}, {ROW}, {ROW}, float64[:, :, ::1], {TABLE}, {ROW}, {TABLE}, uint8[:, ::1])"
)
def _observe(  # noqa: C901, PLR0913  a kernel: one loop, arrays one by one
    time: FloatArray,
    balance: FloatArray,
    speed: FloatArray,
    missing: BoolArray,
    known: npt.NDArray[np.int64],
    begin: int,
    end: int,
    inertia: FloatArray,
    first: int,
    root: FloatArray,
    tables: FloatArray,
    elapsed: FloatArray,
    forces: FloatArray,
    lane_rows: FloatArray,
    modes: FloatArray,
    rows: FloatArray,
    settled: FloatArray,
    residual: FloatArray,
    status: StatusArray,
) -> None:
    """Run the recursion of `observe_velocity` over the samples `known` from `begin` to below `end`.

    `inertia` is that of the samples from `first` on; `settled` (1,) counts time constants since the start. `status` is
    GAP where nothing is set.
    """
    joints = len(root)
    value, target, change, relaxed = rows[_VALUE], rows[_TARGET], rows[_CHANGE], tables[_RELAXED]
    for number in range(begin, end):
        lane = (number - begin) % BLOCK
        if lane == 0:
            _fill_steps(
                time, balance, speed, known, number, end, inertia, first, root, tables[_SCALED], elapsed, forces
            )
            fill_relaxations(tables[_SCALED], elapsed, tables[_WORK:], lane_rows, relaxed, joints)
        k = known[number]
        if number > 0:
            last, duration = known[number - 1], elapsed[lane]
            for at in range(last + 1, k):
                for i in range(joints):
                    residual[at, i] = root[i] * value[i]
            # The modes are found only where they count: while the residual settles, and in long steps.
            slowest, is_long = 0.0, lane_rows[lane] < 0.0
            if settled[0] < 3.0 or duration > BRIDGED or is_long:
                slowest = _find_step_modes(inertia, last - first, k - first, root, modes)
            if duration > max(3.0 * slowest, BRIDGED):
                for i in range(joints):
                    value[i] = 0.0
                settled[0] = 0.0
            else:
                for i in range(joints):
                    target[i] = forces[i * BLOCK + lane] - value[i]
                if is_long:
                    relax_by_modes(modes[0], modes[1], duration, target, change)
                else:
                    for i in range(joints):
                        share = 0.0
                        for j in range(joints):
                            share += relaxed[(i * joints + j) * BLOCK + lane] * target[j]
                        change[i] = share
                for i in range(joints):
                    value[i] += change[i]
                if settled[0] < 3.0:
                    settled[0] += duration / slowest
        verdict = Status.GAP if missing[k] else Status.START_UP if settled[0] < 3.0 else Status.VALID
        for i in range(joints):
            residual[k, i] = root[i] * value[i]
            status[k, i] = verdict


@kernel(f"void({ROW}, {ROW}, int64)")
def _invert(matrix: FloatArray, work: FloatArray, size: int) -> None:  # noqa: C901  a kernel: loops over a table
    """Replace the lower triangle of every matrix by that of its negative inverse: the sweep operator, pivot by pivot.

    Of a positive definite matrix no pivot is 0. Of `work`, 2 J rows are overwritten.
    """
    for p in range(size):
        pivot = matrix[(p * size + p) * BLOCK : (p * size + p + 1) * BLOCK]
        for k in range(BLOCK):
            pivot[k] = 1.0 / pivot[k]
        for i in range(size):
            if i != p:
                element = i * size + p if i > p else p * size + i
                own, kept = matrix[element * BLOCK : (element + 1) * BLOCK], work[2 * i * BLOCK : 2 * (i + 1) * BLOCK]
                for k in range(BLOCK):
                    kept[k] = -own[k]
                    own[k] *= pivot[k]
                    kept[BLOCK + k] = own[k]
        for i in range(size):
            for j in range(i + 1):
                if p not in (i, j):
                    for k in range(0, BLOCK, LANES):
                        own_at, first_at = (i * size + j) * BLOCK + k, (2 * i + 1) * BLOCK + k
                        add_products(matrix, own_at, work, first_at, work, 2 * j * BLOCK + k, 1)
        for k in range(BLOCK):
            pivot[k] = -pivot[k]


@kernel(f"int64({ROW}, {READ_ONLY}, {ROW}, int64)")
def _scale(x: FloatArray, elapsed: FloatArray, work: FloatArray, size: int) -> int:  # noqa: C901  a kernel
    """Fill X = T S^-1 from the lower triangle of -S^-1, halved until its norm is small; return the most halvings.

    Row 0 of `work`: the number of halvings, -1 if they would be too many; row 1 is overwritten.
    """
    norms, factors = work[:BLOCK], work[BLOCK : 2 * BLOCK]
    for k in range(BLOCK):
        norms[k] = 0.0
    for i in range(size):
        for j in range(i + 1):
            count, own = 1.0 if i == j else 2.0, x[(i * size + j) * BLOCK : (i * size + j + 1) * BLOCK]
            for k in range(BLOCK):
                norms[k] += count * own[k] * own[k]
    large = 0
    for k in range(BLOCK):
        factors[k] = -elapsed[k]
        norms[k] = abs(elapsed[k]) * math.sqrt(norms[k])
        large += 1 if norms[k] > _SERIES_NORM else 0
    most = 0
    for k in range(BLOCK):
        if large == 0:
            norms[k] = 0.0
            continue
        halvings = 0
        while norms[k] > _SERIES_NORM and halvings <= _MOST_HALVINGS:
            norms[k] *= 0.5
            factors[k] *= 0.5
            halvings += 1
        norms[k] = halvings
        if halvings > _MOST_HALVINGS:
            norms[k], factors[k] = -1.0, 0.0
        else:
            most = max(most, halvings)
    for i in range(size):
        for j in range(i + 1):
            own = x[(i * size + j) * BLOCK : (i * size + j + 1) * BLOCK]
            for k in range(BLOCK):
                own[k] *= factors[k]
            if i != j:
                mirrored = x[(j * size + i) * BLOCK : (j * size + i + 1) * BLOCK]
                for k in range(BLOCK):
                    mirrored[k] = own[k]
    return most


@kernel(f"void({ROW}, {ROW}, {ROW}, int64)")
def _multiply(a: FloatArray, b: FloatArray, product: FloatArray, size: int) -> None:
    """Fill the product of matrices that are functions of one matrix: it is symmetric, as they are."""
    for k in range(size * size * BLOCK):
        product[k] = 0.0
    for i in range(size):
        for j in range(i + 1):
            for k in range(0, BLOCK, LANES):
                row, first, second = (i * size + j) * BLOCK + k, i * size * BLOCK + k, j * size * BLOCK + k
                add_products(product, row, a, first, b, second, size)
            own = product[(i * size + j) * BLOCK : (i * size + j + 1) * BLOCK]
            if i != j:
                mirrored = product[(j * size + i) * BLOCK : (j * size + i + 1) * BLOCK]
                for k in range(BLOCK):
                    mirrored[k] = own[k]


@kernel(f"void({ROW}, {READ_ONLY}, {TABLE}, {ROW}, {ROW}, int64)")
def fill_relaxations(
    x: FloatArray, elapsed: FloatArray, work: FloatArray, rows: FloatArray, result: FloatArray, size: int
) -> None:
    """Fill `result` with E = I - exp(-X), X = T S^-1, from the lower triangle of S in `x`, and T in `elapsed`.

    A series to X^8; after h halvings of X, E is doubled h times: E (2 I - E). Row 0 of `rows` becomes h, or -1 where X
    is too large and E must be found by `relax_by_modes`. `x`, the tables of `work` and the other rows (2 J) are
    overwritten.
    """
    square, left, right = work[0], work[1], work[2]
    _invert(x, rows, size)
    doublings = _scale(x, elapsed, rows, size)
    _multiply(x, x, square, size)
    for k in range(size * size * BLOCK):
        left[k] = _X2 * square[k] - _X1 * x[k]
    _multiply(square, left, right, size)
    for k in range(size * size * BLOCK):
        left[k] = _X3 * square[k] + right[k]
        right[k] = _X7 * right[k] + _X6 * square[k] - _X5 * x[k]
    for i in range(size):
        own = right[(i * size + i) * BLOCK : (i * size + i + 1) * BLOCK]
        for k in range(BLOCK):
            own[k] += _X4
    _multiply(left, right, result, size)
    for k in range(size * size * BLOCK):
        result[k] = x[k] - (_Y2 * square[k] + result[k])
    for doubling in range(doublings):
        _multiply(result, result, square, size)
        for row in range(0, size * size * BLOCK, BLOCK):
            for k in range(BLOCK):
                doubled = 2.0 * result[row + k] - square[row + k]
                result[row + k] = doubled if doubling < rows[k] else result[row + k]


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
