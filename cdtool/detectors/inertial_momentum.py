"""Inertial generalised momenta (IGM): the momentum observer on a speed that the accelerometer makes faster."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.base import (
    drive_of,
    for_every_joint,
    gain,
    held_on,
    observe_momentum,
    of_joint,
    require_positive,
    single,
)
from cdtool.detectors.detection import Signal, Status
from cdtool.detectors.look import OCHRE, Look
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.clock import HOLD_PERIODS
from cdtool.recordings.clock.recent_steps import usual_steps
from cdtool.recordings.recording import Recording

# The accelerometer's bias is averaged while the axis stands still, over at most and at least this time [s].
_STANDSTILL_WINDOW, _STANDSTILL_AT_LEAST = 0.3, 0.1
# Over a longer gap than this [s], because of vibration, the change of the speed is better than a straight line.
_LONGEST_LINE = 0.02


@dataclass(frozen=True)
class InertialMomentum:
    """The momentum observer on the fused speed w = (s a + (k1 s + k2) v) / (s^2 + k1 s + k2).

    Parameters
    ----------
    bandwidth : float or tuple of float
        Observer gain K [rad/s].
    crossover : float or tuple of float
        w_c [rad/s]: the fused speed follows the measured speed below it and the accelerometer above it; k2 = w_c^2.
    damping : float or tuple of float
        zeta of the complementary filter, 0.7 to 1; k1 = 2 zeta w_c.

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Thesis 6.3 to 6.5 and 6.27 to 6.32 in the corrected form (docs/errata.md: the left sides are speeds, and 6.27 and
    6.30 have one factor s too many). As states: w' = a + k1 (v - w) + z, z' = k2 (v - w), bilinear with the measured
    step. The filters of a and v add up to 1, and a constant bias of the accelerometer decays completely. w replaces v
    in the momentum observer (`Momentum`).

    * Needs: torque, speed, acceleration; position if joints are coupled.
    * Unit: N or N m, positive if the contact opposes positive travel.
    * Start-up: the longer of 3/K and 3 over the slowest pole of the filter; without the latter if a standstill at the
      beginning shows the bias.
    * Fails: w_c above the resonance of the drive pulls the estimate back to the late motor speed; w_c below 3 rad/s
      lets the drift of the bias through.

    Examples
    --------
    A constant bias of the accelerometer, here 0.03 m/s2, does not change the result.

    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> time = np.arange(2001) * 1e-3
    >>> torque, speed = Series(time, np.where(time < 1.0, 0.0, 30.0), "N"), Series(time, np.full(2001, 0.2), "m/s")
    >>> bias = Series(time, np.full(2001, 0.03), "m/s2")
    >>> run = Recording("run", "", ("axis",), {"torque": torque, "speed": speed, "acceleration": bias})
    >>> InertialMomentum().signal(run, axis).values[2000, 0].round(1).item()
    30.0
    """

    bandwidth: Gain = gain(10.0, "rad/s", "observer gain K")
    crossover: Gain = gain(5.0, "rad/s", "w_c: below it the speed counts, above it the accelerometer")
    damping: Gain = gain(1.0, "1", "zeta of the complementary filter, 0.7 to 1", searched=False)

    name: ClassVar[str] = "inertial_momentum"
    short_name: ClassVar[str] = "igm"
    title: ClassVar[str] = "Inertial momentum"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed", "acceleration")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = True
    look: ClassVar[Look] = Look(OCHRE, "v")

    def __post_init__(self) -> None:
        require_positive(self, "bandwidth", "crossover", "damping")

    def unit(self, machine: Machine) -> str:
        """Return "N" or "N m"."""
        return str(machine.force_unit)

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the residual (n, J) on the speed's clock; see `Detector.signal`."""
        drive = drive_of(self, recording, machine)
        acceleration, lost = held_on(drive.time, recording["acceleration"])
        fused = np.empty_like(drive.speed)
        ready = np.empty(fused.shape[1])
        for j, stick_speed in enumerate(machine.stick_speed):
            fused[:, j], ready[j] = of_joint(self, j, len(ready)).fuse(
                drive.time,
                drive.speed[:, j],
                acceleration[:, j],
                drive.motion_missing[:, j],
                stick_speed,
                lost[:, j],
            )
        if machine.coupled:
            lost = for_every_joint(lost)
            ready[:] = ready.max()
        net_force, momentum = machine.momentum_balance(drive.torque, drive.position, drive.speed, fused)
        residual, status = observe_momentum(drive, net_force, momentum, self.bandwidth, ready)
        status[lost] = Status.GAP
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)

    def fuse(
        self,
        time: FloatArray,
        speed: FloatArray,
        acceleration: FloatArray,
        missing: BoolArray,
        standstill_speed: float,
        lost: BoolArray | None = None,
    ) -> tuple[FloatArray, float]:
        """Return the fused speed of one joint, and the time from which it can be used.

        Parameters
        ----------
        time : ndarray of float, shape (n,)
            Times [s].
        speed, acceleration : ndarray of float, shape (n,)
            Finite, the last value held where one is missing [m/s, m/s2] or [rad/s, rad/s2].
        missing : ndarray of bool, shape (n,)
            Where the speed has no sample; there the acceleration is integrated.
        standstill_speed : float
            Speed up to which the joint is at rest: at the beginning the bias is then averaged [m/s, rad/s].
        lost : ndarray of bool, shape (n,), optional
            Where the acceleration has no sample. A gap of up to 20 ms, or 5 periods of a slower clock, is bridged by a
            straight line, a longer one by the change of the speed.

        Returns
        -------
        fused : ndarray of float, shape (n,)
            The fused speed [m/s, rad/s].
        ready : float
            Time from which it can be used [s].
        """
        crossover = single(self.crossover)
        k1, k2 = 2.0 * single(self.damping) * crossover, crossover**2
        fused = np.empty(len(time))
        lost = np.zeros(len(time), dtype=bool) if lost is None else lost
        inputs = (speed, acceleration, missing, lost, usual_steps(time))
        arrays = (np.ascontiguousarray(item) for item in inputs)
        settle = _settling_time(k1, k2)
        rest = (standstill_speed, _STANDSTILL_WINDOW, _STANDSTILL_AT_LEAST)
        return fused, float(_fuse(time, *arrays, k1, k2, settle, *rest, fused))


@lru_cache(maxsize=64)
def _settling_time(k1: float, k2: float) -> float:
    """Return three time constants [s] of the slowest pole of the complementary filter, s^2 + k1 s + k2 = 0."""
    return 3.0 / float(np.min(np.abs(np.roots([1.0, k1, k2]).real)))


@kernel(
    f"float64({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, "
    f"Array(b1, 1, 'C', readonly=True), Array(b1, 1, 'C', readonly=True), {READ_ONLY}, "
    "float64, float64, float64, float64, float64, float64, float64[::1])"
)
def _fuse(  # noqa: C901, PLR0913  a kernel: one loop, arrays and scalars one by one
    time: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    missing: BoolArray,
    lost: BoolArray,
    usual: FloatArray,
    k1: float,
    k2: float,
    settle: float,
    standstill_speed: float,
    window: float,
    at_least: float,
    fused: FloatArray,
) -> float:
    """Bilinear form of w' = a + k1 (v - w) + z, z' = k2 (v - w); returns the time from which w can be used [s].

    `usual` (n,): the usual step up to each sample.
    """
    w = 0.0
    z = 0.0
    started = False
    resting = True
    begin = 0.0
    total = 0.0
    count = 0
    trusted = math.inf
    last = 0
    gained = 0.0
    bridged = False
    for k in range(len(time)):
        fused[k] = w
        if k > 0:
            gained += 0.5 * (time[k] - time[k - 1]) * (acceleration[k] + acceleration[k - 1])
        bridged = bridged or lost[k]
        if missing[k]:
            continue
        if not started:
            if lost[k]:
                fused[k] = speed[k]
                continue
            started = True
            begin = time[k]
            trusted = begin + settle
            w = speed[k]
            last = k
        if resting:
            resting = abs(speed[k]) <= standstill_speed and time[k] - begin <= window
            if resting:
                if not lost[k]:
                    total += acceleration[k]
                    count += 1
                if time[k] - begin >= at_least:
                    trusted = min(trusted, time[k])  # only now the bias is known
                w = speed[k]
                z = -total / count
                fused[k] = w
                last = k
                gained = 0.0
                bridged = False
                continue
        if lost[k]:
            fused[k] = w + speed[k] - speed[last]
            continue
        span = time[k] - time[last]
        half = 0.5 * span
        straight = bridged or last == k - 1
        change, gained, bridged = gained, 0.0, False
        if straight and span > max(_LONGEST_LINE, HOLD_PERIODS * usual[max(k - 1, 1)]):
            w += speed[k] - speed[last]
            fused[k] = w
            last = k
            continue
        speeds = half * (speed[k] + speed[last])
        if straight:
            right_w = (1.0 - k1 * half) * w + half * z + k1 * speeds + half * (acceleration[k] + acceleration[last])
        else:
            right_w = (1.0 - k1 * half) * w + half * z + k1 * speeds + change
        right_z = z - k2 * half * w + k2 * speeds
        scale = 1.0 / (1.0 + k1 * half + k2 * half * half)
        w = scale * (right_w + half * right_z)
        z = scale * ((1.0 + k1 * half) * right_z - k2 * half * right_w)
        fused[k] = w
        last = k
    return trusted
