"""Pure torque (PT): the drive's effort alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detection import Signal, Status
from cdtool.detectors.base import require_channels
from cdtool.detectors.look import BLUE, Look
from cdtool.dynamics import Machine
from cdtool.recording import Recording


@dataclass(frozen=True)
class PureTorque:
    """i = tau_m / r: the drive force on the load side (thesis 5.2.4), as logged, on the torque's own clock.

    Needs: torque. Unit: N (linear) or N m (rotary). Status: missing samples only. It sees an impact when the controller
    answers it: late for stiff impacts; friction, gravity and acceleration are all in it.
    """

    name: ClassVar[str] = "pure_torque"
    short_name: ClassVar[str] = "pt"
    title: ClassVar[str] = "Pure torque"
    needs: ClassVar[tuple[str, ...]] = ("torque",)
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = False
    look: ClassVar[Look] = Look(BLUE, "s")

    def unit(self, machine: Machine) -> str:
        """N or N m."""
        return str(machine.force_unit)

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Drive force (n, J); raises RecordingError without a torque."""
        require_channels(self, recording)
        torque = recording["torque"]
        status = np.where(np.isfinite(torque.values), Status.VALID, Status.GAP).astype(np.uint8)
        return Signal(torque.time, torque.values, status, self.unit(machine), self.signed)
