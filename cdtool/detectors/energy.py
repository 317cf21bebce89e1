"""Energy observer: the power that a contact takes from the machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detection import WHOLE_MACHINE, Signal, Status
from cdtool.detectors.base import (
    Drive,
    drive_of,
    for_every_joint,
    gain,
    observe_momentum,
    per_joint,
    require_positive,
)
from cdtool.detectors.filters import unsettled
from cdtool.detectors.look import OLIVE, Look
from cdtool.dynamics import Gain, Machine
from cdtool.recording import Recording

# A gap as long as a period of the drive's vibration hides its power: what was guessed has mostly decayed by then [s].
_LONGEST_UNSETTLED = 0.015


@dataclass(frozen=True)
class Energy:
    """Residual res = k / (s + k) v'tau_c of the machine's energy (thesis 2.9, 2.10 with the sign put right).

    res = k [int (v'(tau - friction) - res) dt - (E - E(0))]: as printed, 2.9 tends to minus the contact's power. Needs:
    torque, speed (and position, where joints are coupled). Unit W, positive where the contact takes power. One signal
    for the whole machine; joints that are not coupled have one each. Start-up 3 / k. Not applicable below
    `minimum_speed` (the norm of all speeds): a contact takes no power from a machine at rest. Fails: a force across the
    motion; a slow joint beside fast ones; friction that the machine file does not know. Behind a gap of coupled joints
    the power of the gap is a guess: as long as the gap was, at most 15 ms, the signal rests on it (`Signal.lost`).
    """

    bandwidth: Gain = gain(10.0, "rad/s", "observer gain k: the residual follows the power with time constant 1/k")
    minimum_speed: Gain = gain(0.03, "m/s", "below it the observer is not applicable; norm of the joints' speeds")

    name: ClassVar[str] = "energy"
    short_name: ClassVar[str] = "eo"
    title: ClassVar[str] = "Energy observer"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed")
    signed: ClassVar[bool] = False
    contact_torque: ClassVar[bool] = False
    look: ClassVar[Look] = Look(OLIVE, "p")

    def __post_init__(self) -> None:
        require_positive(self, "bandwidth", "minimum_speed")

    def unit(self, machine: Machine) -> str:  # noqa: ARG002 - the contract hands the machine over
        """W."""
        return "W"

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Power taken by a contact (n, 1), or (n, J) of uncoupled joints; raises RecordingError."""
        drive = drive_of(self, recording, machine)
        power = machine.drive_power(drive.torque, drive.speed)
        energy = machine.energy(drive.position, drive.speed)
        # From the first sample on: a potential energy may be large, and only its changes count.
        energy = energy - energy[:1]
        speed = np.abs(drive.speed)
        missing, motion_missing = drive.missing, drive.speed_missing
        if machine.coupled:
            speed = np.linalg.norm(speed, axis=1, keepdims=True)
            missing, motion_missing = (for_every_joint(item)[:, :1] for item in (missing, motion_missing))
        alone = Drive(drive.time, drive.torque, drive.position, drive.speed, missing, motion_missing, drive.coupled)
        ready = np.full(energy.shape[1], -np.inf)
        residual, status = observe_momentum(alone, power, energy, self.bandwidth, ready)
        lost = unsettled(drive.time, missing, _LONGEST_UNSETTLED) if machine.coupled else None
        lost = lost if lost is not None and lost.any() else None
        slow = speed < per_joint(self.minimum_speed, speed.shape[1])
        status[(status == Status.VALID) & slow] = Status.NOT_APPLICABLE
        names = WHOLE_MACHINE if machine.coupled else ()
        return Signal(drive.time, residual, status, self.unit(machine), self.signed, names, lost=lost)
