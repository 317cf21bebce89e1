"""Inertial generalized momenta (IGM): the momentum observer on a speed that the accelerometer has made faster."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.clock import HOLD_PERIODS, previous_value
from cdtool.clock.coarse import recent_medians
from cdtool.detection import Signal, Status
from cdtool.detectors.base import (
    drive_of,
    for_every_joint,
    gain,
    hold_last,
    observe_momentum,
    of_joint,
    require_positive,
    single,
)
from cdtool.detectors.look import ORANGE, Look
from cdtool.dynamics import Gain, Machine
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray, Recording

# The accelerometer's bias is averaged while the axis stands still, over at most this time [s].
_STANDSTILL_WINDOW = 0.3
_STANDSTILL_AT_LEAST = 0.1
# Over a longer gap than this [s] vibration makes a straight line of the acceleration worse than the speed's change.
_LONGEST_LINE = 0.02


@dataclass(frozen=True)
class InertialMomentum:
    """Complementary filter w = (s a + (k1 s + k2) v) / (s2 + k1 s + k2) a joint, then the momentum observer on w.

    Source: thesis 6.3-6.5 and 6.27-6.32, whose left sides are speeds and of which the latter lack one 1/s; k1 = 2 zeta
    w_c, k2 = w_c^2. Needs: torque, speed, acceleration (and position, where joints are coupled). Unit: N or N m.
    Start-up: the longer of 3/K and, without a standstill at the start that shows the accelerometer's bias, 3 over the
    filter's slowest pole. Fails: w_c above the drive's resonance pulls the estimate back to the late motor speed; w_c
    below 3 rad/s lets the bias drift in.
    """

    bandwidth: Gain = gain(10.0, "rad/s", "observer gain K")
    crossover: Gain = gain(5.0, "rad/s", "w_c: below it the speed counts, above it the accelerometer")
    damping: Gain = gain(1.0, "1", "zeta of the complementary filter, 0.7 to 1")

    name: ClassVar[str] = "inertial_momentum"
    short_name: ClassVar[str] = "igm"
    title: ClassVar[str] = "Inertial generalized momenta"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed", "acceleration")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = True
    look: ClassVar[Look] = Look(ORANGE, "v")

    def __post_init__(self) -> None:
        require_positive(self, "bandwidth", "crossover", "damping")

    def unit(self, machine: Machine) -> str:
        """N or N m."""
        return str(machine.force_unit)

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Residual (n, J) on the speed's clock; raises RecordingError where a channel is absent."""
        drive = drive_of(self, recording, machine)
        acceleration = previous_value(recording["acceleration"], drive.time)
        lost = ~np.isfinite(acceleration)
        # Before the first sample of the accelerometer nothing is lost.
        unknown = lost & (np.cumsum(~lost, axis=0) > 0)
        fused = np.empty_like(drive.speed)
        ready = np.empty(fused.shape[1])
        for j, stick_speed in enumerate(machine.stick_speed):
            fused[:, j], ready[j] = of_joint(self, j, len(ready)).fuse(
                drive.time,
                drive.speed[:, j],
                hold_last(acceleration, lost)[:, j],
                drive.speed_missing[:, j],
                stick_speed,
                unknown[:, j],
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
        """Fused speed (n,) of one joint, and the time from which it may be trusted [s].

        `missing` and `lost` (n,): where speed and acceleration have no sample. While the speed is missing the
        acceleration is integrated; a gap in the acceleration is bridged by a straight line up to 20 ms (or 5 periods of
        a slower clock), by the change of the speed where it is longer.
        """
        crossover = single(self.crossover)
        k1, k2 = 2.0 * single(self.damping) * crossover, crossover**2
        fused = np.empty(len(time))
        lost = np.zeros(len(time), dtype=bool) if lost is None else lost
        inputs = (speed, acceleration, missing, lost, _longest_line(time))
        arrays = (np.ascontiguousarray(item) for item in inputs)
        settle = 3.0 / float(np.min(np.abs(np.roots([1.0, k1, k2]).real)))
        rest = (standstill_speed, _STANDSTILL_WINDOW, _STANDSTILL_AT_LEAST)
        return fused, float(_fuse(time, *arrays, k1, k2, settle, *rest, fused))


def _longest_line(time: FloatArray) -> FloatArray:
    """At each sample (n,) the longest gap in the acceleration that a straight line bridges [s]."""
    steps = np.diff(time)
    usual = recent_medians(steps, float(steps[0])) if len(steps) else steps
    return np.maximum(_LONGEST_LINE, HOLD_PERIODS * np.concatenate((usual[:1], usual[:1], usual[:-1])))[: len(time)]


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
    longest_line: FloatArray,
    k1: float,
    k2: float,
    settle: float,
    standstill_speed: float,
    window: float,
    at_least: float,
    fused: FloatArray,
) -> float:
    """Bilinear form of w' = a + k1 (v - w) + z, z' = k2 (v - w); returns when it may be trusted [s]."""
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
            started = True
            begin = time[k]
            trusted = begin + settle
            w = speed[k]
            last = k
        if resting:
            resting = abs(speed[k]) <= standstill_speed and time[k] - begin <= window
            if resting:
                total += acceleration[k]
                count += 1
                if time[k] - begin >= at_least:
                    trusted = min(trusted, time[k])  # from here on the bias is known, and not before
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
        if straight and span > longest_line[k]:
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
