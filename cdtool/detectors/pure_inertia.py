"""Pure inertia (PI): the accelerometer alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detectors.base import require_channels
from cdtool.detectors.detection import Signal, Status
from cdtool.detectors.look import TEAL, Look
from cdtool.machines.dynamics import Machine
from cdtool.recordings.recording import Recording


@dataclass(frozen=True)
class PureInertia:
    """i = -a: the deceleration of the load along positive travel.

    Notes
    -----
    Thesis 5.2.4 (pure inertia), as logged, on the clock of the accelerometer.

    * Needs: acceleration.
    * Unit: m/s2 (linear axis) or rad/s2 (rotary axis), positive if the load decelerates in positive travel.
    * Status: missing samples only.
    * Fails: fast in stiff impacts, it does not detect soft ones: their deceleration is lost in the vibration of the
      structure. A constant bias becomes part of the signature.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> time = np.arange(2001) * 1e-3
    >>> acceleration = Series(time, np.where(time < 1.0, 0.5, -1.5), "m/s2")
    >>> signal = PureInertia().signal(Recording("run", "", ("axis",), {"acceleration": acceleration}), axis)
    >>> signal.values[[0, 1000], 0].tolist(), signal.unit
    ([-0.5, 1.5], 'm/s2')
    """

    name: ClassVar[str] = "pure_inertia"
    short_name: ClassVar[str] = "pi"
    title: ClassVar[str] = "Pure inertia"
    needs: ClassVar[tuple[str, ...]] = ("acceleration",)
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = False
    look: ClassVar[Look] = Look(TEAL, "^")

    def unit(self, machine: Machine) -> str:
        """Return "m/s2" or "rad/s2"."""
        return str(machine.load_units["acceleration"])

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the deceleration (n, J); see `Detector.signal`."""
        require_channels(self, recording)
        acceleration = recording["acceleration"]
        status = np.where(np.isfinite(acceleration.values), Status.VALID, Status.GAP).astype(np.uint8)
        return Signal(acceleration.time, -acceleration.values, status, self.unit(machine), self.signed)
