"""The velocity observer's compiled recursion for coupled joints."""

from __future__ import annotations

import numpy as np

from cdtool.detection import StatusArray
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

_BOOLS = "Array(b1, 1, 'C', readonly=True)"


@kernel(
    f"void({READ_ONLY}, float64[:, ::1], Array(float64, 2, 'C', readonly=True), Array(float64, 3, 'C', readonly=True), "
    f"{_BOOLS}, {_BOOLS}, {READ_ONLY}, float64[:, ::1], uint8[:, ::1])"
)
def observe_velocity(
    time: FloatArray,
    balance: FloatArray,
    speed: FloatArray,
    inertia: FloatArray,
    missing: BoolArray,
    motion_missing: BoolArray,
    gains: FloatArray,
    residual: FloatArray,
    status: StatusArray,
) -> None:
    """res_k = A res_(k-1) + (I - A)(mean balance - M dv / T), A = exp(-K M^-1 T); M is the mean of the step's ends.

    K^(-1/2) M K^(-1/2) is symmetric: its eigenvectors V and eigenvalues 1/w give A = K^(1/2) V exp(-w T) V' K^(-1/2).
    A missing motion makes the step longer; `missing` (any input) marks a sample as missing. After three time constants
    of the slowest mode without a sample it starts anew.
    """
    joints = balance.shape[1]
    root = np.zeros(joints)
    for j in range(joints):
        root[j] = np.sqrt(gains[j])
    value = np.zeros(joints)
    impulse = np.zeros(joints)
    target = np.zeros(joints)
    modes = np.zeros(joints)
    mean_inertia = np.zeros((joints, joints))
    scaled = np.zeros((joints, joints))
    started = False
    elapsed = 0.0
    settled = 0.0
    last = 0
    for k in range(len(time)):
        if started:
            step = time[k] - time[k - 1]
            for j in range(joints):
                impulse[j] += 0.5 * (balance[k, j] + balance[k - 1, j]) * step
            elapsed += step
        if motion_missing[k]:
            for j in range(joints):
                residual[k, j] = value[j]
                status[k, j] = 3
            continue
        if started:
            for i in range(joints):
                for j in range(joints):
                    mean_inertia[i, j] = 0.5 * (inertia[k, i, j] + inertia[last, i, j])
                    scaled[i, j] = mean_inertia[i, j] / (root[i] * root[j])
            periods, vectors = np.linalg.eigh(scaled)
            slowest = periods[joints - 1]
            if elapsed > 3.0 * slowest:
                for i in range(joints):
                    value[i] = 0.0
                settled = 0.0
            else:
                for i in range(joints):
                    target[i] = impulse[i]
                    for j in range(joints):
                        target[i] -= mean_inertia[i, j] * (speed[k, j] - speed[last, j])
                    target[i] = (target[i] / elapsed - value[i]) / root[i]
                for mode in range(joints):
                    modes[mode] = 0.0
                    for i in range(joints):
                        modes[mode] += vectors[i, mode] * target[i]
                    modes[mode] *= -np.expm1(-elapsed / periods[mode])
                for i in range(joints):
                    change = 0.0
                    for mode in range(joints):
                        change += vectors[i, mode] * modes[mode]
                    value[i] += root[i] * change
                settled += elapsed / slowest
        started = True
        elapsed = 0.0
        last = k
        for j in range(joints):
            impulse[j] = 0.0
            residual[k, j] = value[j]
            if missing[k]:
                status[k, j] = 3
            elif settled < 3.0:
                status[k, j] = 1
            else:
                status[k, j] = 0
