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
from cdtool.instructions import LANES, add_products, add_rows, aligned_zeros, part_of, set_rows, widest_vectors
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray, Recording

ROW, TABLE = "float64[::1]", "float64[:, ::1]"
_BOOLS = "Array(b1, 1, 'C', readonly=True)"
_TABLE = "Array(float64, 2, 'C', readonly=True)"
_MATRICES = "Array(float64, 3, 'C', readonly=True)"
_INDICES = "Array(int64, 1, 'C', readonly=True)"
# A matrix (J, J) of every sample of a block is a table (J J BLOCK,): element by element, the sample innermost, so that
# one instruction handles several samples. No result depends on the other samples of its block.
BLOCK = LANES
# Number of tables of work space for `fill_relaxations`, and of its rows: so many more than joints.
WORK_TABLES, WORK_ROWS = 2, 6
# Number of steps whose inertia matrices are computed together: they fit into the processor's cache.
_STEPS = 128 * BLOCK
# Tables (J J BLOCK,): S of each step, what relaxes, and work space.
_SCALED, _RELAXED, _WORK = 0, 1, 2
# Rows (J,) of a step: the residual over sqrt(K), which lasts from block to block, and the next one; in long steps what
# relaxes, and its change.
_TARGET, _CHANGE, _ROWS = 2, 3, 4

# Up to this norm of X, the first term left out of the series is below the last bit; X is halved until it is.
_SERIES_NORM = 0.08
# X of more halvings is left to its modes: the error of the inverse, a share of the fastest one, would be doubled too.
_MOST_HALVINGS = 4
# 1 / (1 - exp(-x)) = 1 / x + 1 / 2 + x / 40 + (7 / 120) / (1 / x + x / 42), to the seventh power of x.
_OUTER, _FRACTION, _INNER = 1.0 / 40.0, 7.0 / 120.0, 1.0 / 42.0
# Rows of work space of `fill_relaxations`: halvings; 1 / f, -f / 42 and -f / 40 with f = T / 2^h; for the inverse.
_HALVINGS, _INVERSE, _INNER_SHARE, _OUTER_SHARE, _LEFT = range(0, 5 * BLOCK, BLOCK)
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
    count = joints * joints * BLOCK
    tables = aligned_zeros((_WORK + WORK_TABLES) * count).reshape(-1, count)
    # Duration, change of speed and forces of each step, work space; matrix and vectors of the modes of one step.
    sizes = BLOCK, joints * BLOCK, joints * BLOCK, (joints + WORK_ROWS) * BLOCK
    work = *map(aligned_zeros, sizes), np.zeros((4, BLOCK), dtype=np.int64), np.zeros((2, joints, joints))
    rows, settled = np.zeros(_ROWS * joints), np.zeros(1)
    scales = aligned_zeros(count + joints * BLOCK)
    scales[:] = np.repeat(np.append(1.0 / np.outer(root, root), 1.0 / root), BLOCK)
    for begin in range(0, len(known), _STEPS):
        end = min(begin + _STEPS, len(known))
        # From the sample before, where the first step of this part begins.
        first = int(known[max(begin - 1, 0)])
        part = np.ascontiguousarray(inertia(slice(first, int(known[end - 1]) + 1)))
        samples = (time, balance, speed, missing, known, begin, end, part, first)
        _observe(*samples, root, scales, tables, *work, rows, settled, residual, status)
    if len(known):
        residual[known[-1] + 1 :] = residual[known[-1]]
    return residual, status


@kernel(
    f"void({READ_ONLY}, {_TABLE}, {_TABLE}, {_INDICES}, int64, int64, {_MATRICES}, int64, int64, {ROW}, {ROW}, "
    f"{ROW}, {ROW}, {ROW}, {ROW}, int64[:, ::1])"
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
    joints: int,
    scales: FloatArray,
    scaled: FloatArray,
    elapsed: FloatArray,
    change: FloatArray,
    forces: FloatArray,
    rows: FloatArray,
    ends: npt.NDArray[np.int64],
) -> None:
    """Fill S, duration and (mean balance - M dv / T) / sqrt(K) of the steps that end at `known` from `begin` on.

    Over a gap the balance is based on held values: it is interpolated by a straight line. Beyond the steps of this
    block, S is that of a sample. `scales` (J J + J,): rows 1 / sqrt(K K') and 1 / sqrt(K). `ends` (4, BLOCK), where
    the samples of a step begin, `rows` (1,) and `change` (J,) are overwritten.
    """
    widest_vectors()
    elements = joints * joints
    for lane in range(BLOCK):
        number = min(begin + lane, end - 1)
        k, last = known[number], known[max(number - 1, 0)]
        ends[0, lane], ends[1, lane] = k * joints, last * joints
        ends[2, lane], ends[3, lane] = (k - first) * elements, (last - first) * elements
        elapsed[lane] = 0.0
        for at in range(last + 1, k + 1):
            elapsed[lane] += time[at] - time[at - 1]
        rows[lane] = 1.0 / elapsed[lane]
    # Parts of one element: no index is checked.
    for i in range(joints):
        for lane in range(BLOCK):
            now, before = ends[0, lane] + i, ends[1, lane] + i
            forces[i * BLOCK + lane] = 0.5 * (part_of(balance, now, 1)[0] + part_of(balance, before, 1)[0])
            change[i * BLOCK + lane] = part_of(speed, before, 1)[0] - part_of(speed, now, 1)[0]
        for j in range(i + 1):
            element = i * joints + j
            for lane in range(BLOCK):
                now, before = ends[2, lane] + element, ends[3, lane] + element
                scaled[element * BLOCK + lane] = 0.5 * (part_of(inertia, now, 1)[0] + part_of(inertia, before, 1)[0])
    set_rows(change, 0, change, 0, rows, 0, joints)
    for i in range(joints):
        # M dv / T, from the lower triangle of M.
        add_products(forces, i * BLOCK, scaled, i * joints * BLOCK, change, 0, i + 1)
        for j in range(i):
            add_products(forces, j * BLOCK, scaled, (i * joints + j) * BLOCK, change, i * BLOCK, 1)
    for i in range(joints):
        set_rows(forces, i * BLOCK, forces, i * BLOCK, scales, (elements + i) * BLOCK, 1)
        for j in range(i + 1):
            element = (i * joints + j) * BLOCK
            set_rows(scaled, element, scaled, element, scales, element, 1)


@kernel(f"float64({_MATRICES}, int64, int64, {READ_ONLY}, float64[:, :, ::1], b1)")
def _find_step_modes(
    inertia: FloatArray, begin: int, end: int, root: FloatArray, modes: FloatArray, with_vectors: bool
) -> float:
    """Fill time constants of the modes of S of a step between two samples, and their vectors; return the slowest."""
    joints = len(root)
    for i in range(joints):
        for j in range(joints):
            modes[0, i, j] = 0.5 * (inertia[end, i, j] + inertia[begin, i, j]) / (root[i] * root[j])
    find_modes(modes[0], modes[1] if with_vectors else modes[1, :0])
    slowest = modes[0, 0, 0]
    for i in range(1, joints):
        slowest = max(slowest, modes[0, i, i])
    return float(slowest)


@kernel(
    f"void({READ_ONLY}, {_TABLE}, {_TABLE}, {_BOOLS}, {_INDICES}, int64, int64, {_MATRICES}, int64, {READ_ONLY}, "
    f"{ROW}, {TABLE}, {ROW}, {ROW}, {ROW}, {ROW}, int64[:, ::1], float64[:, :, ::1], {ROW}, {ROW}, {TABLE}, "
    "uint8[:, ::1])"
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
    scales: FloatArray,
    tables: FloatArray,
    elapsed: FloatArray,
    change_of_speed: FloatArray,
    forces: FloatArray,
    lane_rows: FloatArray,
    ends: npt.NDArray[np.int64],
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
    joints, turn = len(root), 0
    relaxed, gained = tables[_RELAXED], tables[_WORK]
    target, change = part_of(rows, _TARGET * joints, joints), part_of(rows, _CHANGE * joints, joints)
    for block in range(begin, end, BLOCK):
        _fill_steps(
            *(time, balance, speed, known, block, end, inertia, first, joints, scales),
            *(tables[_SCALED], elapsed, change_of_speed, forces, lane_rows, ends),
        )
        fill_relaxations(tables[_SCALED], elapsed, tables[_WORK:], lane_rows, relaxed, joints)
        _fill_gains(relaxed, forces, gained, joints)
        for lane in range(min(BLOCK, end - block)):
            number = block + lane
            k = known[number]
            # What was and what follows: each in the place of the other at the next sample.
            value, later = part_of(rows, turn, joints), part_of(rows, joints - turn, joints)
            own, own_status = part_of(residual, k * joints, joints), part_of(status, k * joints, joints)
            relaxes, duration, slowest, is_long = False, 0.0, 0.0, False
            if number > 0:
                last, duration = known[number - 1], elapsed[lane]
                for at in range(last + 1, k):
                    for i in range(joints):
                        residual[at, i] = root[i] * value[i]
                # The modes are found only where they count: while the residual settles, and in long steps.
                is_long = lane_rows[lane] < 0.0
                if settled[0] < 3.0 or duration > BRIDGED or is_long:
                    slowest = _find_step_modes(inertia, last - first, k - first, root, modes, is_long)
                relaxes = not duration > max(3.0 * slowest, BRIDGED)
                if not relaxes:
                    settled[0] = 0.0
                    for i in range(joints):
                        value[i] = 0.0
                elif settled[0] < 3.0:
                    settled[0] += duration / slowest
            verdict = Status.GAP if missing[k] else Status.START_UP if settled[0] < 3.0 else Status.VALID
            if relaxes and is_long:
                for i in range(joints):
                    target[i] = forces[i * BLOCK + lane] - value[i]
                relax_by_modes(modes[0], modes[1], duration, target, change)
                for i in range(joints):
                    value[i] += change[i]
            if relaxes and not is_long:
                # One loop over another: the compiler would handle several joints of a short loop at once, for longer.
                for i in range(joints):
                    share = gained[i * BLOCK + lane]
                    row = part_of(relaxed, i * joints * BLOCK + lane, (joints - 1) * BLOCK + 1)
                    for j in range(joints):
                        share -= row[j * BLOCK] * value[j]
                    later[i] = value[i] + share
                    own[i] = root[i] * later[i]
                    own_status[i] = verdict
                turn = joints - turn
            else:
                for i in range(joints):
                    own[i] = root[i] * value[i]
                    own_status[i] = verdict
    for i in range(joints):
        rows[i] = rows[turn + i]


@kernel(f"void({ROW}, {ROW}, {ROW}, int64)")
def _fill_gains(relaxed: FloatArray, forces: FloatArray, gained: FloatArray, size: int) -> None:
    """Fill `gained` (J,) with E times the forces, of every sample."""
    for k in range(size * BLOCK):
        gained[k] = 0.0
    for i in range(size):
        add_products(gained, i * BLOCK, relaxed, i * size * BLOCK, forces, 0, size)


@kernel(f"void({ROW}, {ROW}, int64, int64)")
def _invert(matrix: FloatArray, rows: FloatArray, left: int, size: int) -> None:
    """Replace the lower triangle of every matrix by that of its negative inverse: the sweep operator, pivot by pivot.

    Of a positive definite matrix no pivot is 0. The J + 1 rows of `rows` from index `left` on are overwritten.
    """
    widest_vectors()
    minus = left + size * BLOCK
    for k in range(BLOCK):
        rows[minus + k] = -1.0
    for p in range(size):
        row, pivot = p * size * BLOCK, (p * size + p) * BLOCK
        for k in range(BLOCK):
            matrix[pivot + k] = 1.0 / matrix[pivot + k]
        # Row and column of the pivot, negative; 0 at the pivot itself, so that they are not changed below.
        set_rows(rows, left, matrix, row, rows, minus, p)
        for k in range(BLOCK):
            rows[left + p * BLOCK + k] = 0.0
        set_rows(matrix, row, matrix, row, matrix, pivot, p)
        for i in range(p + 1, size):
            element = (i * size + p) * BLOCK
            set_rows(rows, left + i * BLOCK, matrix, element, rows, minus, 1)
            set_rows(matrix, element, matrix, element, matrix, pivot, 1)
        for i in range(size):
            if i != p:
                element = (i * size + p) * BLOCK if i > p else row + i * BLOCK
                add_rows(matrix, i * size * BLOCK, rows, left, matrix, element, i + 1)
        set_rows(matrix, pivot, matrix, pivot, rows, minus, 1)


@kernel(f"int64({READ_ONLY}, {READ_ONLY}, {ROW}, int64)")
def _scale(inverse: FloatArray, elapsed: FloatArray, rows: FloatArray, size: int) -> int:
    """Fill the first rows of work space from -S^-1: X = T S^-1 is halved until its norm is small; return most halvings.

    The number of halvings is -1 if they would be too many.
    """
    widest_vectors()
    for k in range(BLOCK):
        rows[_HALVINGS + k] = 0.0
    for i in range(size):
        row = i * size * BLOCK
        add_products(rows, _HALVINGS, inverse, row, inverse, row, i)
    for k in range(BLOCK):
        rows[_HALVINGS + k] *= 2.0
    for i in range(size):
        element = (i * size + i) * BLOCK
        add_products(rows, _HALVINGS, inverse, element, inverse, element, 1)
    most = 0
    for k in range(BLOCK):
        norm, factor, halvings = abs(elapsed[k]) * math.sqrt(rows[_HALVINGS + k]), elapsed[k], 0
        while norm > _SERIES_NORM and halvings <= _MOST_HALVINGS:
            norm *= 0.5
            factor *= 0.5
            halvings += 1
        if halvings <= _MOST_HALVINGS:
            most = max(most, halvings)
        rows[_HALVINGS + k] = halvings if halvings <= _MOST_HALVINGS else -1.0
        rows[_INVERSE + k] = 1.0 / factor
        rows[_INNER_SHARE + k] = -_INNER * factor
        rows[_OUTER_SHARE + k] = -_OUTER * factor
    return most


@kernel(f"void({ROW}, {ROW}, {ROW}, int64)")
def _multiply(a: FloatArray, b: FloatArray, product: FloatArray, size: int) -> None:
    """Fill the product of matrices that are functions of one matrix: it is symmetric, as they are."""
    widest_vectors()
    for k in range(size * size * BLOCK):
        product[k] = 0.0
    for i in range(size):
        for j in range(i + 1):
            add_products(product, (i * size + j) * BLOCK, a, i * size * BLOCK, b, j * size * BLOCK, size)
    _mirror(product, size)


@kernel(f"void({ROW}, int64)")
def _mirror(matrix: FloatArray, size: int) -> None:
    """Fill the upper triangle of every matrix from the lower one."""
    for i in range(size):
        for j in range(i):
            own, mirrored = (i * size + j) * BLOCK, (j * size + i) * BLOCK
            for k in range(BLOCK):
                matrix[mirrored + k] = matrix[own + k]


@kernel(f"void({ROW}, {READ_ONLY}, {TABLE}, {ROW}, {ROW}, int64)")
def fill_relaxations(
    scaled: FloatArray, elapsed: FloatArray, work: FloatArray, rows: FloatArray, result: FloatArray, size: int
) -> None:
    """Fill `result` with E = I - exp(-X), X = T S^-1, from the lower triangle of S in `scaled`, and T in `elapsed`.

    E^-1 = S / T + I / 2 + X / 40 + (7 / 120) (S / T + X / 42)^-1, for X that is small: after h halvings of X, E is
    doubled h times, E (2 I - E). Row 0 of `rows` (J + WORK_ROWS) becomes h, or -1 where X is too large and E must be
    found by `relax_by_modes`. The tables of `work` and the other rows are overwritten.
    """
    widest_vectors()
    doublings = _fill_inverse_relaxations(scaled, elapsed, work, rows, result, size)
    _invert(result, rows, _LEFT, size)
    minus = _LEFT + size * BLOCK
    for i in range(size):
        row = i * size * BLOCK
        for j in range(i):
            set_rows(result, (j * size + i) * BLOCK, result, row + j * BLOCK, rows, minus, 1)
        set_rows(result, row, result, row, rows, minus, i + 1)
    square = work[0]
    for doubling in range(doublings):
        _multiply(result, result, square, size)
        for row in range(0, size * size * BLOCK, BLOCK):
            for k in range(BLOCK):
                doubled = 2.0 * result[row + k] - square[row + k]
                result[row + k] = doubled if doubling < rows[k] else result[row + k]


@kernel(f"int64({ROW}, {READ_ONLY}, {TABLE}, {ROW}, {ROW}, int64)")
def _fill_inverse_relaxations(
    scaled: FloatArray, elapsed: FloatArray, work: FloatArray, rows: FloatArray, result: FloatArray, size: int
) -> int:
    """Fill the lower triangle of E^-1 of X that is small, as in `fill_relaxations`; return the most halvings."""
    widest_vectors()
    inverse, inner = work[0], work[1]
    for k in range(size * size * BLOCK):
        inverse[k] = scaled[k]
    _invert(inverse, rows, _LEFT, size)
    most: int = _scale(inverse, elapsed, rows, size)
    for i in range(size):
        row = i * size * BLOCK
        set_rows(result, row, scaled, row, rows, _INVERSE, i + 1)
        set_rows(inner, row, inverse, row, rows, _INNER_SHARE, i + 1)
        add_rows(inner, row, scaled, row, rows, _INVERSE, i + 1)
        add_rows(result, row, inverse, row, rows, _OUTER_SHARE, i + 1)
    _invert(inner, rows, _LEFT, size)
    for k in range(BLOCK):
        rows[_LEFT + k] = -_FRACTION
    for i in range(size):
        row = i * size * BLOCK
        add_rows(result, row, inner, row, rows, _LEFT, i + 1)
        for k in range(BLOCK):
            result[row + i * BLOCK + k] += 0.5
    return most


@kernel(f"void({TABLE}, {TABLE})")
def find_modes(matrix: FloatArray, vectors: FloatArray) -> None:
    """Fill the eigenvectors of one symmetric matrix (J, J), one per column, by cyclic Jacobi rotations.

    The matrix is overwritten: its diagonal holds the eigenvalues, in no order. Without rows in `vectors`, only these.
    """
    size = len(matrix)
    for i in range(len(vectors)):
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
    for k in range(len(vectors)):
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
