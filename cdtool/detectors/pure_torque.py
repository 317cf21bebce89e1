"""Pure torque (PT): the drive's effort alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detectors.base import require_channels
from cdtool.detectors.detection import Signal, Status
from cdtool.detectors.look import BLUE, Look
from cdtool.machines.dynamics import Machine
from cdtool.recordings.recording import Recording


@dataclass(frozen=True)
class PureTorque:
    """i = tau_m / r: the drive force on the load side.

    Notes
    -----
    Thesis 5.2.4 (pure torque), as logged, on the torque's own clock; r is the transmission ratio, load travel per motor
    angle.

    * Needs: torque.
    * Unit: N (linear axis) or N m (rotary axis), positive in positive travel.
    * Status: missing samples only.
    * Fails: it detects an impact only when the controller responds to it, which is late for stiff impacts; friction,
      gravity and acceleration are all part of the signal.

    Examples
    --------
    A motor torque of 0.4 N m on a drive with 10 mm per radian is 40 N at the load.

    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"transmission_ratio": 0.01})
    >>> logged = Recording("run", "", ("axis",), {"torque": Series([0.0, 0.001], [0.4, 0.4], "N m")})
    >>> signal = PureTorque().signal(axis.referred_to_load(logged), axis)
    >>> signal.values[:, 0].tolist(), signal.unit
    ([40.0, 40.0], 'N')
    """

    name: ClassVar[str] = "pure_torque"
    short_name: ClassVar[str] = "pt"
    title: ClassVar[str] = "Pure torque"
    needs: ClassVar[tuple[str, ...]] = ("torque",)
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = False
    look: ClassVar[Look] = Look(BLUE, "s")

    def unit(self, machine: Machine) -> str:
        """Return "N" or "N m"."""
        return str(machine.force_unit)

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the drive force (n, J); see `Detector.signal`."""
        require_channels(self, recording)
        torque = recording["torque"]
        status = np.where(np.isfinite(torque.values), Status.VALID, Status.GAP).astype(np.uint8)
        return Signal(torque.time, torque.values, status, self.unit(machine), self.signed)
