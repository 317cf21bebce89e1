"""Direct derivation: the contact torque straight from the equation of motion, every term through one low-pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detection import Signal, Status
from cdtool.detectors.base import (
    drive_of,
    for_every_joint,
    gain,
    per_joint,
    require_positive,
)
from cdtool.detectors.filters import longest_gap, low_pass, settling_time, started_at
from cdtool.detectors.look import BROWN, Look
from cdtool.dynamics import Gain, Machine
from cdtool.recording import Recording


@dataclass(frozen=True)
class Direct:
    """res = LP{tau - C v - g - friction} - M(q) s LP{v} (thesis 2.6, friction added).

    Every term goes through the same second-order Butterworth low-pass, and the acceleration is that filter's own rate:
    nothing is differenced. With a first-order low-pass and a constant M this is the momentum observer. Needs: torque,
    speed (and position, where joints are coupled). Unit N or N m, positive where the contact opposes positive travel.
    Start-up 3 over the real part of the filter's poles. Fails: noise of the speed grows with `cutoff` times the
    inertia; where M changes within the filter's memory the terms no longer match.
    """

    cutoff: Gain = gain(5.0, "Hz", "cut-off frequency of the low-pass")

    name: ClassVar[str] = "direct"
    short_name: ClassVar[str] = "dd"
    title: ClassVar[str] = "Direct derivation"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = True
    look: ClassVar[Look] = Look(BROWN, "X")

    def __post_init__(self) -> None:
        require_positive(self, "cutoff")

    def unit(self, machine: Machine) -> str:
        """N or N m."""
        return machine.force_unit

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Residual (n, J) on the speed's clock; raises RecordingError where a channel is absent."""
        drive = drive_of(self, recording, machine)
        balance = machine.force_balance(drive.torque, drive.position, drive.speed)
        cutoff = per_joint(self.cutoff, len(machine.joints))
        waits = drive.interrupted
        filtered, _ = low_pass(drive.time, balance, waits, cutoff)
        _, acceleration = low_pass(drive.time, drive.speed, waits, cutoff)
        residual = filtered - machine.inertia_times(drive.position, acceleration)
        settle = settling_time(cutoff)
        started = started_at(drive.time, waits, longest_gap(cutoff))
        status = np.where(drive.time[:, np.newaxis] < started + settle, Status.START_UP, Status.VALID).astype(np.uint8)
        missing = for_every_joint(drive.missing) if machine.coupled else drive.missing
        status[missing] = Status.GAP
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)
