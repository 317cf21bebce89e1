"""Torque rate: how quickly the drive's effort changes."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detection import Signal, Status
from cdtool.detectors.base import gain, per_joint, require_channels, require_positive
from cdtool.detectors.filters import low_pass, settling_time, started_at
from cdtool.dynamics import Gain, Machine
from cdtool.recording import Recording


@dataclass(frozen=True)
class TorqueRate:
    """i = s LP{tau}: the rate of change of the low-passed drive force on the load side, on the torque's own clock.

    Needs: torque. Unit: N/s or N m/s. Start-up: until the low-pass has settled. Fails: it answers to every start, stop
    and change of load, and a slow controller shows a contact late.
    """

    cutoff: Gain = gain(2.0, "Hz", "cut-off frequency of the low-pass")

    name: ClassVar[str] = "torque_rate"
    short_name: ClassVar[str] = "tr"
    title: ClassVar[str] = "Torque rate"
    needs: ClassVar[tuple[str, ...]] = ("torque",)
    signed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        require_positive(self, "cutoff")

    def unit(self, machine: Machine) -> str:
        """N/s or N m/s."""
        return f"{machine.force_unit}/s"

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Rate of the drive force (n, J); raises RecordingError without a torque."""
        require_channels(self, recording)
        torque = recording["torque"]
        missing = ~np.isfinite(torque.values)
        cutoff = per_joint(self.cutoff, torque.joint_count)
        _, rate = low_pass(torque.time, torque.values, missing, cutoff)
        settle = settling_time(cutoff)
        started = started_at(torque.time, missing, settle)
        starting = torque.time[:, np.newaxis] < started + settle
        status = np.where(starting, Status.START_UP, Status.VALID).astype(np.uint8)
        status[missing] = Status.GAP
        return Signal(torque.time, rate, status, self.unit(machine), self.signed)
