"""Torque deviation (TD): the drive's effort beyond the one that the controller expects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detectors.base import require_channels
from cdtool.detectors.detection import Signal, Status
from cdtool.detectors.look import UMBER, Look
from cdtool.machines.dynamics import Machine
from cdtool.recordings.clock import previous_value
from cdtool.recordings.recording import Recording


@dataclass(frozen=True)
class TorqueDeviation:
    """i = (tau_m - tau_ref) / r: the drive force on the load side minus the one that the controller computed.

    Notes
    -----
    Not from the thesis: the residual of robot controllers that log the current or torque which their model expects, as
    `target_current` or `target_moment` beside the actual one. On the torque's own clock, with the last reference at or
    before each sample; r is the transmission ratio, load travel per motor angle.

    * Needs: torque, reference_torque.
    * Unit: N (linear axis) or N m (rotary axis), positive in positive travel.
    * Status: missing samples only.
    * Fails: if the reference is the output of a feedback controller, as the torque command of most drives, it responds
      to the contact as well and little remains; if the controller's model is wrong, its error is part of the signal.

    Examples
    --------
    The controller expects 0.4 N m on a drive with 10 mm per radian; 0.1 N m more are 10 N at the load.

    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Series
    >>> axis = LinearAxis.of({"transmission_ratio": 0.01})
    >>> torque, expected = (Series([0.0, 0.001], values, "N m") for values in ([0.4, 0.5], [0.4, 0.4]))
    >>> logged = Recording("run", "", ("axis",), {"torque": torque, "reference_torque": expected})
    >>> TorqueDeviation().signal(axis.referred_to_load(logged), axis).values[:, 0].round(9).tolist()
    [0.0, 10.0]
    """

    name: ClassVar[str] = "torque_deviation"
    short_name: ClassVar[str] = "td"
    title: ClassVar[str] = "Torque deviation"
    needs: ClassVar[tuple[str, ...]] = ("torque", "reference_torque")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = False
    look: ClassVar[Look] = Look(UMBER, "h")

    def unit(self, machine: Machine) -> str:
        """Return "N" or "N m"."""
        return str(machine.force_unit)

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the deviation (n, J); see `Detector.signal`."""
        require_channels(self, recording)
        torque = recording["torque"]
        deviation = torque.values - previous_value(recording["reference_torque"], torque.time)
        status = np.where(np.isfinite(deviation), Status.VALID, Status.GAP).astype(np.uint8)
        return Signal(torque.time, deviation, status, self.unit(machine), self.signed)
