"""Torque rate (TR): the rate of change of the drive force."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detectors.base import gain, per_joint, require_channels, require_positive
from cdtool.detectors.detection import Signal, Status
from cdtool.detectors.filters import low_pass, settling_time, started_at
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.recording import Recording


@dataclass(frozen=True)
class TorqueRate:
    """i = s LP{tau}: the rate of change of the low-passed drive force on the load side.

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
    LP is a second-order Butterworth low-pass, on the torque's own clock.

    * Needs: torque.
    * Unit: N/s (linear axis) or N m/s (rotary axis), positive in positive travel.
    * Status: start-up until the low-pass has settled; missing samples.
    * Fails: it responds to every start, stop and change of load; with a slow controller it detects a contact late.

    Examples
    --------
    A drive force that rises by 1 N per millisecond has a rate of 1000 N/s.

    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load"})
    >>> time = np.arange(2000) * 1e-3
    >>> run = Recording("run", "", ("axis",), {"torque": Series(time, 1000.0 * time, "N")})
    >>> signal = TorqueRate().signal(run, axis)
    >>> signal.values[-1, 0].round(3).item(), signal.unit
    (1000.0, 'N/s')
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
        """Return "N/s" or "N m/s"."""
        return f"{machine.force_unit}/s"

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the rate of the drive force (n, J); raises RecordingError if the torque is missing."""
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
