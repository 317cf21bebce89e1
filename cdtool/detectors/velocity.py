"""Velocity observer: a disturbance observer on the joint speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

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
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray, Recording

_BOOLS = "Array(b1, 1, 'C', readonly=True)"
_TABLE = "Array(float64, 2, 'C', readonly=True)"
_MATRICES = "Array(float64, 3, 'C', readonly=True)"
# Number of steps whose modes are computed together: their matrices fit into the processor's cache.
_BLOCK = 1024
# Rows of the work space: residual, impulse, target of the residual, the same by modes.
_VALUE, _IMPULSE, _TARGET, _MODE, _WORK = range(5)


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
            np.ascontiguousarray(machine.inertia_matrix(drive.position)),
            np.ascontiguousarray(for_every_joint(drive.missing)[:, 0]),
            np.ascontiguousarray(for_every_joint(drive.interrupted)[:, 0]),
            per_joint(self.bandwidth, len(machine.joints)) * machine.nominal_inertia,
        )
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)


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
def _observe(  # noqa: C901, PLR0913  a kernel: one loop, arrays one by one
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
