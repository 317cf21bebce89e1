"""Energy observer: the power that a contact takes from the machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detectors.base import (
    Drive,
    drive_of,
    for_every_joint,
    gain,
    observe_momentum,
    per_joint,
    require_positive,
)
from cdtool.detectors.detection import WHOLE_MACHINE, Signal, Status
from cdtool.detectors.filters import unsettled
from cdtool.detectors.look import OLIVE, Look
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.recording import Recording

# A gap as long as a period of the drive's vibration hides its power; by then the estimate has mostly decayed [s].
_LONGEST_UNSETTLED = 0.015


@dataclass(frozen=True)
class Energy:
    """Residual res = k / (s + k) v'tau_c of the machine's energy.

    Parameters
    ----------
    bandwidth : float or tuple of float
        Observer gain k [rad/s]: the residual follows the power with time constant 1/k.
    minimum_speed : float or tuple of float
        Speed below which the observer is not applicable [m/s]; with coupled joints the norm of all speeds. A contact
        takes no power from a machine at rest.

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Thesis 2.9 and 2.10 with the signs of 2.4 (docs/errata.md; as printed, 2.9 tends to minus the contact's power):

        res = k [int (v'(tau - friction) - res) dt - (E - E(0))],   E = kinetic + potential energy

    * Needs: torque, speed; position if joints are coupled.
    * Unit: W, positive if the contact takes power. One signal for the whole machine; uncoupled joints have one each.
    * Start-up: 3/k.
    * After a gap of coupled joints the power during the gap is an estimate: for the length of the gap, at most 15 ms,
      the signal is based on it (`Signal.lost`).
    * Fails: a force across the motion takes no power; a slow joint next to fast ones; friction that is not in the
      machine file.

    Examples
    --------
    At 0.2 m/s a contact of 30 N takes 6 W.

    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> time = np.arange(2001) * 1e-3
    >>> torque, speed = Series(time, np.where(time < 1.0, 0.0, 30.0), "N"), Series(time, np.full(2001, 0.2), "m/s")
    >>> run = Recording("run", "", ("axis",), {"torque": torque, "speed": speed})
    >>> power = Energy(bandwidth=10.0).signal(run, axis)
    >>> power.values[[999, 1100, 2000], 0].round(1).tolist(), power.unit
    ([0.0, 3.8, 6.0], 'W')
    """

    bandwidth: Gain = gain(10.0, "rad/s", "observer gain k: the residual follows the power with time constant 1/k")
    minimum_speed: Gain = gain(
        0.03, "m/s", "below it the observer is not applicable; norm of the joints' speeds", searched=False
    )

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
        """Return "W"."""
        return "W"

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the power taken by a contact (n, 1), or (n, J) if joints are not coupled; see `Detector.signal`."""
        drive = drive_of(self, recording, machine)
        power = machine.drive_power(drive.torque, drive.speed)
        energy = machine.energy(drive.position, drive.speed)
        # Relative to the first sample: a potential energy may be large, and only its changes count.
        energy = energy - energy[:1]
        speed = np.abs(drive.speed)
        without = drive.torque_missing, drive.motion_missing
        if machine.coupled:
            speed = np.linalg.norm(speed, axis=1, keepdims=True)
            without = for_every_joint(without[0])[:, :1], for_every_joint(without[1])[:, :1]
        alone = Drive(drive.time, drive.torque, drive.position, drive.speed, *without, drive.coupled)
        ready = np.full(energy.shape[1], -np.inf)
        residual, status = observe_momentum(alone, power, energy, self.bandwidth, ready)
        lost = unsettled(drive.time, alone.missing, _LONGEST_UNSETTLED) if machine.coupled else None
        lost = lost if lost is not None and lost.any() else None
        slow = speed < per_joint(self.minimum_speed, speed.shape[1])
        status[(status == Status.VALID) & slow] = Status.NOT_APPLICABLE
        names = WHOLE_MACHINE if machine.coupled else ()
        return Signal(drive.time, residual, status, self.unit(machine), self.signed, names, lost=lost)
