"""Velocity observer: a disturbance observer on the joints' speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detection import Signal
from cdtool.detectors.base import (
    drive_of,
    for_every_joint,
    gain,
    observe_momentum,
    per_joint,
    require_positive,
)
from cdtool.detectors.look import SKY, Look
from cdtool.detectors.velocity_kernel import observe_velocity
from cdtool.dynamics import Gain, Machine
from cdtool.recording import Recording


@dataclass(frozen=True)
class Velocity:
    """Residual res = (s I + K M^-1)^-1 K M^-1 tau_c (thesis 2.11-2.15; 2.12 gives d(xhat)/dt, not xhat).

    d(vhat)/dt = M^-1 (tau - C v - g - friction - res), res = K (vhat - v). K = `bandwidth` times the diagonal of M at
    the home pose: there, and where M does not change, it is as fast as a momentum observer of that bandwidth. Sampled
    with M frozen over each step: res = A res + (I - A)(mean balance - M dv / T), A = exp(-K M^-1 T). Needs: torque,
    speed (and position, where joints are coupled). Unit N or N m, positive where the contact opposes positive travel.
    Start-up: until the slowest mode of K M^-1 has had 3 time constants. Fails: its bandwidth changes with the pose, and
    what one joint feels leaks into the others while the estimate settles.
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
        """N or N m."""
        return machine.force_unit

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Residual (n, J) on the speed's clock; raises RecordingError where a channel is absent."""
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
