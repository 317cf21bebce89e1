"""Direct derivation: the contact torque from the equation of motion, with every term through the same low-pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detectors.base import (
    drive_of,
    for_every_joint,
    gain,
    per_joint,
    require_positive,
)
from cdtool.detectors.detection import Signal, Status
from cdtool.detectors.filters import longest_gap, low_pass, settling_time, started_at
from cdtool.detectors.look import BROWN, Look
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.recording import Recording


@dataclass(frozen=True)
class Direct:
    """res = LP{tau - C v - g - friction} - M(q) s LP{v}: the equation of motion solved for the contact.

    Parameters
    ----------
    cutoff : float or tuple of float
        Cut-off frequency of the low-pass [Hz], one number or one per joint.

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Thesis 2.6 with friction added (docs/errata.md). LP is a second-order Butterworth low-pass; every term passes
    through it, and the acceleration is the rate of that filter, so that nothing is differentiated numerically. With a
    first-order low-pass and a constant M it would be the momentum observer.

    * Needs: torque, speed; position if joints are coupled.
    * Unit: N or N m, positive if the contact opposes positive travel.
    * Start-up: 3 over the real part of the filter's poles.
    * Fails: noise of the speed is amplified by `cutoff` times the inertia; if M changes within the filter's memory, the
      terms no longer match.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> time = np.arange(2001) * 1e-3
    >>> torque, speed = Series(time, np.where(time < 1.0, 0.0, 30.0), "N"), Series(time, np.full(2001, 0.2), "m/s")
    >>> run = Recording("run", "", ("axis",), {"torque": torque, "speed": speed})
    >>> Direct(cutoff=5.0).signal(run, axis).values[[999, 2000], 0].round(1).tolist()
    [0.0, 30.0]
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
        """Return "N" or "N m"."""
        return machine.force_unit

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the residual (n, J) on the speed's clock; see `Detector.signal`."""
        drive = drive_of(self, recording, machine)
        balance = machine.force_balance(drive.torque, drive.position, drive.speed)
        cutoff = per_joint(self.cutoff, len(machine.joints))
        waits = drive.missing
        filtered, _ = low_pass(drive.time, balance, waits, cutoff)
        _, acceleration = low_pass(drive.time, drive.speed, waits, cutoff)
        residual = filtered - machine.inertia_times(drive.position, acceleration)
        settle = settling_time(cutoff)
        started = started_at(drive.time, waits, longest_gap(cutoff))
        status = np.full(started.shape, Status.VALID, dtype=np.uint8)
        status[drive.time[:, np.newaxis] < started + settle] = Status.START_UP
        missing = for_every_joint(drive.missing) if machine.coupled else drive.missing
        status[missing] = Status.GAP
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)
