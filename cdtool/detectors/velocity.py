"""Velocity observer: a disturbance observer on the joint speeds."""

from __future__ import annotations

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
from cdtool.detectors.relaxation_kernel import BLOCK, TABLE, WORK_TABLES, fill_relaxations, find_modes, relax_by_modes
from cdtool.dynamics import Gain, Machine
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray, Recording

_BOOLS = "Array(b1, 1, 'C', readonly=True)"
_TABLE = "Array(float64, 2, 'C', readonly=True)"
_MATRICES = "Array(float64, 3, 'C', readonly=True)"
# Number of steps whose inertia matrices are computed together: they fit into the processor's cache.
_STEPS = 16 * BLOCK
# Tables (J J, BLOCK): mean inertia of each step, the same scaled, what relaxes, and work space.
_MEAN, _SCALED, _RELAXED, _WORK = 0, 1, 2, 3
# Rows (J,): the residual, which lasts from block to block; impulse, target and change of a step.
_VALUE, _IMPULSE, _TARGET, _CHANGE, _ROWS = range(5)


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
    joints = len(gains)
    residual, status = np.zeros(balance.shape), np.full(balance.shape, Status.GAP, dtype=np.uint8)
    known = np.flatnonzero(~motion_missing)
    tables = np.zeros((_WORK + WORK_TABLES, joints * joints, BLOCK))
    work = (np.zeros(BLOCK), np.zeros((2 * joints, BLOCK)), np.zeros((2, joints, joints)))
    rows, settled = np.zeros((_ROWS, joints)), np.zeros(1)
    for begin in range(0, len(known), _STEPS):
        end = min(begin + _STEPS, len(known))
        # From the sample before, where the first step of this part begins.
        first = int(known[max(begin - 1, 0)])
        part = np.ascontiguousarray(inertia(slice(first, int(known[end - 1]) + 1)))
        samples = (time, balance, speed, missing, known, begin, end, part, first)
        _observe(*samples, np.sqrt(gains), tables, *work, rows, settled, residual, status)
    if len(known):
        residual[known[-1] + 1 :] = residual[known[-1]]
    return residual, status


@kernel(
    f"void({_MATRICES}, int64, Array(int64, 1, 'C', readonly=True), int64, int64, {READ_ONLY}, {READ_ONLY}, "
    f"float64[:, :, ::1], float64[::1])"
)
def _fill_steps(  # noqa: PLR0913  a kernel: arrays one by one
    inertia: FloatArray,
    first: int,
    known: npt.NDArray[np.int64],
    begin: int,
    end: int,
    time: FloatArray,
    root: FloatArray,
    tables: FloatArray,
    elapsed: FloatArray,
) -> None:
    """Fill mean inertia, S and duration of the steps that end at the samples `known` from `begin` to below `end`."""
    joints = len(root)
    for lane in range(BLOCK):
        elapsed[lane] = 0.0
        number = begin + lane
        if 0 < number < end:
            for k in range(known[number - 1] + 1, known[number] + 1):
                elapsed[lane] += time[k] - time[k - 1]
    for i in range(joints):
        for j in range(i + 1):
            row, scale = i * joints + j, 1.0 / (root[i] * root[j])
            for lane in range(BLOCK):
                # Beyond the steps of this block: any matrix that has an inverse.
                mean = 1.0 if i == j else 0.0
                number = begin + lane
                if 0 < number < end:
                    mean = inertia[known[number] - first, i, j] + inertia[known[number - 1] - first, i, j]
                    mean *= 0.5
                tables[_MEAN, row, lane] = mean
                tables[_MEAN, j * joints + i, lane] = mean
                tables[_SCALED, row, lane] = mean * scale


@kernel(f"float64(float64[:, :, ::1], {READ_ONLY}, int64, float64[:, :, ::1])")
def _find_step_modes(tables: FloatArray, root: FloatArray, lane: int, modes: FloatArray) -> float:
    """Fill time constants and vectors of the modes of S of a step; return the time constant of the slowest one."""
    joints = len(root)
    for i in range(joints):
        for j in range(joints):
            modes[0, i, j] = tables[_MEAN, i * joints + j, lane] / (root[i] * root[j])
    find_modes(modes[0], modes[1])
    slowest = modes[0, 0, 0]
    for i in range(1, joints):
        slowest = max(slowest, modes[0, i, i])
    return float(slowest)


@kernel(
    f"void({READ_ONLY}, {_TABLE}, {_TABLE}, {_BOOLS}, Array(int64, 1, 'C', readonly=True), int64, int64, {_MATRICES}, "
    f"int64, {READ_ONLY}, float64[:, :, ::1], float64[::1], {TABLE}, float64[:, :, ::1], {TABLE}, float64[::1], "
    f"{TABLE}, uint8[:, ::1])"
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
    value, impulse, target, change = rows[_VALUE], rows[_IMPULSE], rows[_TARGET], rows[_CHANGE]
    mean, relaxed = tables[_MEAN], tables[_RELAXED]
    for number in range(begin, end):
        lane = (number - begin) % BLOCK
        if lane == 0:
            _fill_steps(inertia, first, known, number, end, time, root, tables, elapsed)
            fill_relaxations(tables[_SCALED], elapsed, tables[_WORK:], lane_rows, relaxed, joints)
        k = known[number]
        if number > 0:
            last, duration = known[number - 1], elapsed[lane]
            for j in range(joints):
                impulse[j] = 0.0
            for at in range(last + 1, k + 1):
                for j in range(joints):
                    impulse[j] += 0.5 * (balance[at, j] + balance[at - 1, j]) * (time[at] - time[at - 1])
                    residual[at, j] = value[j]
            if k > last + 1:
                # Over a gap the balance is based on held values: it is interpolated by a straight line.
                for j in range(joints):
                    impulse[j] = 0.5 * (balance[k, j] + balance[last, j]) * duration
            # The modes are found only where they count: while the residual settles, and in long steps.
            slowest, is_long = 0.0, lane_rows[0, lane] < 0.0
            if settled[0] < 3.0 or duration > BRIDGED or is_long:
                slowest = _find_step_modes(tables, root, lane, modes)
            if duration > max(3.0 * slowest, BRIDGED):
                for i in range(joints):
                    value[i] = 0.0
                settled[0] = 0.0
            else:
                for i in range(joints):
                    force = impulse[i]
                    for j in range(joints):
                        force -= mean[i * joints + j, lane] * (speed[k, j] - speed[last, j])
                    target[i] = (force / duration - value[i]) / root[i]
                if is_long:
                    relax_by_modes(modes[0], modes[1], duration, target, change)
                else:
                    for i in range(joints):
                        change[i] = 0.0
                        for j in range(joints):
                            change[i] += relaxed[i * joints + j, lane] * target[j]
                for i in range(joints):
                    value[i] += root[i] * change[i]
                if settled[0] < 3.0:
                    settled[0] += duration / slowest
        verdict = Status.GAP if missing[k] else Status.START_UP if settled[0] < 3.0 else Status.VALID
        for j in range(joints):
            residual[k, j] = value[j]
            status[k, j] = verdict
