"""Velocity observer: a disturbance observer on the joint speeds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import kernel
from cdtool.detectors.base import (
    BRIDGED,
    drive_of,
    for_every_joint,
    gain,
    observe_momentum,
    per_joint,
    require_positive,
)
from cdtool.detectors.detection import Signal, Status, StatusArray
from cdtool.detectors.filters import SETTLED
from cdtool.detectors.look import STEEL, Look
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.recording import Recording

# Number of steps whose matrices are computed together: they fit into the processor's cache.
_STEPS = 2048
# x - x^2/2! + x^3/3! ..., four powers in a row: 1 - exp(-x) up to x = 0.3, where the first term left out is 1e-17.
_SERIES = np.array([-((-1.0) ** k) / math.factorial(k) for k in range(1, 13)]).reshape(3, 4)
# A mode is not faster than the slowest by more: its time constant is 0 up to rounding.
_ROUNDING = np.finfo(np.float64).eps


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
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
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
    look: ClassVar[Look] = Look(STEEL, "<")

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
            per_joint(self.bandwidth, len(machine.joints)) * machine.nominal_inertia,
        )
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)


def observe_velocity(
    time: FloatArray,
    balance: FloatArray,
    speed: FloatArray,
    inertia: Callable[[slice], FloatArray],
    missing: BoolArray,
    gains: FloatArray,
) -> tuple[FloatArray, StatusArray]:
    """Return the residual res (n, J) of an observer of the speed, and its status (n, J).

    res_k = A res_(k-1) + (I - A)(mean balance - M dv / T), A = exp(-K M^-1 T); M is the mean of the step's ends.

    `inertia` returns M (n, J, J) of a part of the samples. With S = K^(-1/2) M K^(-1/2), which is symmetric, A is
    K^(1/2) exp(-T S^-1) K^(-1/2). A `missing` sample (n,) makes the step longer. It restarts after three time constants
    of the slowest mode, and 0.15 s, without a sample.
    """
    root = np.sqrt(gains)
    status = np.full(balance.shape, Status.GAP, dtype=np.uint8)
    known = np.flatnonzero(~missing)
    # Residual over sqrt(K), from row 1 on at the samples that are known; time constants since the start.
    values, settled, since = np.zeros((len(known) + 1, len(gains))), np.zeros(len(known)), 0.0
    for begin in range(1, len(known), _STEPS):
        ends = known[begin - 1 : begin + _STEPS]
        elapsed = np.diff(time[ends])
        masses = inertia(slice(int(ends[0]), int(ends[-1]) + 1))[ends - ends[0]]
        mass = 0.5 * (masses[1:] + masses[:-1])
        rates = np.diff(speed[ends], axis=0) / elapsed[:, np.newaxis]
        targets = (0.5 * (balance[ends[1:]] + balance[ends[:-1]]) - (mass @ rates[:, :, np.newaxis])[:, :, 0]) / root
        scaled = mass / np.outer(root, root)
        # The slowest mode counts only while the residual settles, which begins again only after a long step.
        settles = np.logical_or.accumulate((elapsed > BRIDGED) | (since < SETTLED))
        shares, slowest = relaxations(scaled, elapsed, settles)
        restarts = settles & (elapsed > np.maximum(3.0 * slowest, BRIDGED))
        shares[restarts], targets[restarts] = np.eye(len(gains)), 0.0
        _relax(shares, targets, values[begin : begin + len(ends)])
        total = since + np.cumsum(np.where(restarts | ~settles, 0.0, elapsed / slowest))
        part = total - np.maximum.accumulate(np.where(restarts, total, 0.0))
        settled[begin : begin + len(elapsed)], since = part, part[-1]
    status[known] = np.where(settled < SETTLED, Status.START_UP, Status.VALID)[:, np.newaxis]
    return root * values[np.cumsum(~missing)], status


def relaxations(scaled: FloatArray, elapsed: FloatArray, by_modes: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return I - exp(-X) (n, J, J), X = T S^-1 of the symmetric S in `scaled`, and the slowest time constant (n,).

    Where X is small, a power series of it; its time constant is not computed (1 s is returned). Where that is needed
    (`by_modes`), and where X is not small, each mode of S has its own factor.
    """
    try:
        x = np.linalg.solve(scaled, elapsed[:, np.newaxis, np.newaxis] * np.eye(scaled.shape[1]))
        by_modes = by_modes | ~(np.linalg.norm(x, axis=(1, 2)) <= 0.3)
    except np.linalg.LinAlgError:  # a motion without inertia, as that of a stretched arm of point masses
        x, by_modes = np.zeros_like(scaled), np.ones_like(by_modes)
    square = x @ x
    powers = np.stack((x, square, square @ x, square @ square))
    groups = np.tensordot(_SERIES, powers, 1)
    shares, slowest = groups[-1], np.ones(len(elapsed))
    for group in groups[-2::-1]:
        shares = group + powers[-1] @ shares
    constants, modes = np.linalg.eigh(scaled[by_modes])
    constants = np.maximum(constants, _ROUNDING * constants[:, -1:])
    own = -np.expm1(-elapsed[by_modes, np.newaxis] / constants)
    shares[by_modes], slowest[by_modes] = (modes * own[:, np.newaxis]) @ modes.transpose(0, 2, 1), constants[:, -1]
    return shares, slowest


@kernel("void(float64[:, :, ::1], float64[:, ::1], float64[:, ::1])")
def _relax(shares: FloatArray, targets: FloatArray, values: FloatArray) -> None:
    """Fill `values` (n + 1, J) after its first row: each step removes its share of the distance to its target."""
    steps, joints = targets.shape
    for k in range(steps):
        for i in range(joints):
            value = values[k, i]
            for j in range(joints):
                value += shares[k, i, j] * (targets[k, j] - values[k, j])
            values[k + 1, i] = value
