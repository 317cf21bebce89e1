"""Generalized momentum observer (GM)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from cdtool.detection import Signal
from cdtool.detectors.base import (
    drive_on_speed_clock,
    gain,
    observe_momentum,
    require_channels,
    require_positive,
)
from cdtool.recording import Recording


@dataclass(frozen=True)
class Momentum:
    """Residual res = K / (s + K) F_c of the momentum p = m v (thesis 2.16-2.19 and 6.3 corrected).

    Needs: torque, speed. Unit: N (linear) or N m (rotary), positive where the contact opposes positive travel. Start-up
    3 / K; after a gap longer than that it starts anew. Fails: friction that the machine file does not know stays in the
    residual; a compliant drive or clearance delays what the motor's speed can tell.
    """

    bandwidth: float = gain(10.0, "rad/s", "observer gain K: the residual follows a contact with time constant 1/K")

    name: ClassVar[str] = "momentum"
    short_name: ClassVar[str] = "gm"
    title: ClassVar[str] = "Generalized momentum observer"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed")
    signed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        require_positive(self, "bandwidth")

    def unit(self, machine: Any) -> str:
        """N or N m."""
        return str(machine.force_unit)

    def signal(self, recording: Recording, machine: Any) -> Signal:
        """Residual (n, J) on the speed's clock; raises RecordingError where a channel is absent."""
        require_channels(self, recording)
        machine.require_inertia(self.name)
        drive = drive_on_speed_clock(recording)
        net_force = machine.drive_force_minus_known(drive.torque, drive.speed, drive.speed)
        inertia = np.array([axis.inertia for axis in machine.axes])
        ready = np.full(len(inertia), -np.inf)
        residual, status = observe_momentum(drive, net_force, inertia * drive.speed, self.bandwidth, ready)
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)
