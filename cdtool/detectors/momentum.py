"""Generalized momentum observer (GM)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detection import Signal
from cdtool.detectors.base import (
    drive_of,
    gain,
    observe_momentum,
    require_positive,
)
from cdtool.detectors.look import VIOLET, Look
from cdtool.dynamics import Gain, Machine
from cdtool.recording import Recording


@dataclass(frozen=True)
class Momentum:
    """Residual res = K / (s + K) tau_c of the momentum p = M(q) v (thesis 2.16-2.19, 6.3, 6.28 and 6.31 corrected).

    dp/dt = tau - beta - tau_c with beta = g - C'v + friction: no acceleration and no inverse of M is needed. Needs:
    torque, speed (and position, where joints are coupled). Unit: N or N m, positive where the contact opposes positive
    travel. Start-up 3 / K; after a gap longer than that it restarts. Fails: friction that the machine file does not
    know stays in the residual; a compliant drive or clearance delays what the motor's speed can tell.
    """

    bandwidth: Gain = gain(10.0, "rad/s", "observer gain K: the residual follows a contact with time constant 1/K")

    name: ClassVar[str] = "momentum"
    short_name: ClassVar[str] = "gm"
    title: ClassVar[str] = "Generalized momentum observer"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = True
    look: ClassVar[Look] = Look(VIOLET, "D")

    def __post_init__(self) -> None:
        require_positive(self, "bandwidth")

    def unit(self, machine: Machine) -> str:
        """N or N m."""
        return str(machine.force_unit)

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Residual (n, J) on the speed's clock; raises RecordingError where a channel is absent."""
        drive = drive_of(self, recording, machine)
        net_force, momentum = machine.momentum_balance(drive.torque, drive.position, drive.speed, drive.speed)
        ready = np.full(momentum.shape[1], -np.inf)
        residual, status = observe_momentum(drive, net_force, momentum, self.bandwidth, ready)
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)
