"""Pure inertia (PI): the accelerometer alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detection import Signal, Status
from cdtool.detectors.base import require_channels
from cdtool.detectors.look import GREEN, Look
from cdtool.dynamics import Machine
from cdtool.recording import Recording


@dataclass(frozen=True)
class PureInertia:
    """i = -a: the load's deceleration along positive travel (thesis 5.2.4), on the accelerometer's clock.

    Needs: acceleration. Unit: m/s2 (linear) or rad/s2 (rotary). Status: missing samples only. Fast for stiff impacts,
    blind to soft ones: their deceleration drowns in the structure's vibration. A constant bias goes into the signature.
    """

    name: ClassVar[str] = "pure_inertia"
    short_name: ClassVar[str] = "pi"
    title: ClassVar[str] = "Pure inertia"
    needs: ClassVar[tuple[str, ...]] = ("acceleration",)
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = False
    look: ClassVar[Look] = Look(GREEN, "^")

    def unit(self, machine: Machine) -> str:
        """m/s2 or rad/s2."""
        return str(machine.load_units["acceleration"])

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Deceleration (n, J); raises RecordingError without an acceleration."""
        require_channels(self, recording)
        acceleration = recording["acceleration"]
        status = np.where(np.isfinite(acceleration.values), Status.VALID, Status.GAP).astype(np.uint8)
        return Signal(acceleration.time, -acceleration.values, status, self.unit(machine), self.signed)
