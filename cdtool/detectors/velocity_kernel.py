"""The velocity observer's recursion for coupled joints: the modes of all steps together, then a compiled loop."""

from __future__ import annotations

import math

import numpy as np

from cdtool.detection import Status, StatusArray
from cdtool.detectors.base import BRIDGED
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

_BOOLS = "Array(b1, 1, 'C', readonly=True)"
_TABLE = "Array(float64, 2, 'C', readonly=True)"
_MATRICES = "Array(float64, 3, 'C', readonly=True)"
# Number of steps whose modes are computed together: their matrices fit into the processor's cache.
_BLOCK = 1024
# Rows of the work space: residual, impulse, target of the residual, the same by modes.
_VALUE, _IMPULSE, _TARGET, _MODE, _WORK = range(5)


def observe_velocity(
    time: FloatArray,
    balance: FloatArray,
    speed: FloatArray,
    inertia: FloatArray,
    missing: BoolArray,
    motion_missing: BoolArray,
    gains: FloatArray,
) -> tuple[FloatArray, StatusArray]:
    """Return the residual res (n, J) and its status:

    res_k = A res_(k-1) + (I - A)(mean balance - M dv / T), A = exp(-K M^-1 T); M is the mean of the step's ends.

    K^(-1/2) M K^(-1/2) is symmetric: its eigenvectors V and eigenvalues 1/w give A = K^(1/2) V exp(-w T) V' K^(-1/2). A
    missing motion makes the step longer; `missing` (any input) marks a sample as missing. It restarts after three time
    constants of the slowest mode, and 0.15 s, without a sample.
    """
    residual, status = np.empty(balance.shape), np.empty(balance.shape, dtype=np.uint8)
    root = np.sqrt(gains)
    known = np.flatnonzero(~motion_missing)
    periods, vectors = np.empty(balance.shape), np.empty(inertia.shape)
    for begin in range(1, len(known), _BLOCK):
        ends, starts = known[begin : begin + _BLOCK], known[begin - 1 : begin - 1 + _BLOCK][: len(known) - begin]
        mean = 0.5 * (inertia[ends] + inertia[starts])
        periods[ends], vectors[ends] = np.linalg.eigh(mean / (root[:, np.newaxis] * root))
    work = np.zeros((_WORK, len(root)))
    _observe(time, balance, speed, inertia, periods, vectors, missing, motion_missing, root, work, residual, status)
    return residual, status


@kernel(
    f"void({READ_ONLY}, {_TABLE}, {_TABLE}, {_MATRICES}, {_TABLE}, {_MATRICES}, {_BOOLS}, {_BOOLS}, {READ_ONLY}, "
    "float64[:, ::1], float64[:, ::1], uint8[:, ::1])"
)
def _observe(
    time: FloatArray,
    balance: FloatArray,
    speed: FloatArray,
    inertia: FloatArray,
    periods: FloatArray,
    vectors: FloatArray,
    missing: BoolArray,
    motion_missing: BoolArray,
    root: FloatArray,
    work: FloatArray,
    residual: FloatArray,
    status: StatusArray,
) -> None:
    """Run the recursion of `observe_velocity`; `periods` 1/w (n, J) and `vectors` V (n, J, J) of each sample's step."""
    joints = len(root)
    started = False
    elapsed = 0.0
    settled = 0.0
    last = 0
    for k in range(len(time)):
        if started:
            step = time[k] - time[k - 1]
            for j in range(joints):
                work[_IMPULSE, j] += 0.5 * (balance[k, j] + balance[k - 1, j]) * step
            elapsed += step
        if motion_missing[k]:
            for j in range(joints):
                residual[k, j] = work[_VALUE, j]
                status[k, j] = Status.GAP
            continue
        if started:
            slowest = periods[k, joints - 1]
            if k > last + 1:
                # Over a gap the balance is based on held values: it is interpolated by a straight line.
                for j in range(joints):
                    work[_IMPULSE, j] = 0.5 * (balance[k, j] + balance[last, j]) * elapsed
            if elapsed > max(3.0 * slowest, BRIDGED):
                for i in range(joints):
                    work[_VALUE, i] = 0.0
                settled = 0.0
            else:
                for i in range(joints):
                    target = work[_IMPULSE, i]
                    for j in range(joints):
                        mean = 0.5 * (inertia[k, i, j] + inertia[last, i, j])
                        target -= mean * (speed[k, j] - speed[last, j])
                    work[_TARGET, i] = (target / elapsed - work[_VALUE, i]) / root[i]
                for mode in range(joints):
                    part = 0.0
                    for i in range(joints):
                        part += vectors[k, i, mode] * work[_TARGET, i]
                    work[_MODE, mode] = part * -math.expm1(-elapsed / periods[k, mode])
                for i in range(joints):
                    change = 0.0
                    for mode in range(joints):
                        change += vectors[k, i, mode] * work[_MODE, mode]
                    work[_VALUE, i] += root[i] * change
                settled += elapsed / slowest
        started = True
        elapsed = 0.0
        last = k
        verdict = Status.GAP if missing[k] else Status.START_UP if settled < 3.0 else Status.VALID
        for j in range(joints):
            work[_IMPULSE, j] = 0.0
            residual[k, j] = work[_VALUE, j]
            status[k, j] = verdict
