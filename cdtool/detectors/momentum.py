"""Generalised momentum observer (GM)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.detectors.base import (
    drive_of,
    gain,
    observe_momentum,
    require_positive,
)
from cdtool.detectors.detection import Signal
from cdtool.detectors.look import PLUM, Look
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.recording import Recording


@dataclass(frozen=True)
class Momentum:
    """Residual res = K / (s + K) tau_c of the momentum p = M(q) v.

    Parameters
    ----------
    bandwidth : float or tuple of float
        Observer gain K [rad/s], one number or one per joint: the residual follows a contact with time constant 1/K.

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Thesis 2.16 to 2.19 and 6.1 to 6.4; for an arm the full form in place of 6.28 and 6.31, which have slips in print
    (docs/errata.md):

        dp/dt = tau - beta - tau_c,   beta = g - C'v + friction
        d(phat)/dt = tau - beta - res,   res = K (phat - p),   phat(0) = p(0)

    Neither an acceleration nor the inverse of M is needed. `observe_momentum` has the sampled form.

    * Needs: torque, speed; position if joints are coupled.
    * Unit: N or N m, positive if the contact opposes positive travel.
    * Start-up: 3/K; it restarts after a gap longer than 3/K and 0.15 s.
    * Fails: friction that is not in the machine file stays in the residual; a compliant drive or clearance delays the
      response of the motor speed.

    Examples
    --------
    An axis of 600 kg moves at constant speed and is stopped by an obstacle with 30 N from 1 s; 1/K later the residual
    is 63 % of it.

    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> time = np.arange(2001) * 1e-3
    >>> torque, speed = Series(time, np.where(time < 1.0, 0.0, 30.0), "N"), Series(time, np.full(2001, 0.2), "m/s")
    >>> run = Recording("run", "", ("axis",), {"torque": torque, "speed": speed})
    >>> residual = Momentum(bandwidth=10.0).signal(run, axis)
    >>> residual.values[[999, 1100, 2000], 0].round(1).tolist(), residual.unit
    ([0.0, 19.0, 30.0], 'N')
    """

    bandwidth: Gain = gain(10.0, "rad/s", "observer gain K: the residual follows a contact with time constant 1/K")

    name: ClassVar[str] = "momentum"
    short_name: ClassVar[str] = "gm"
    title: ClassVar[str] = "Momentum observer"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = True
    look: ClassVar[Look] = Look(PLUM, "D")

    def __post_init__(self) -> None:
        require_positive(self, "bandwidth")

    def unit(self, machine: Machine) -> str:
        """Return "N" or "N m"."""
        return str(machine.force_unit)

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the residual (n, J) on the speed's clock; see `Detector.signal`."""
        drive = drive_of(self, recording, machine)
        net_force, momentum = machine.momentum_balance(drive.torque, drive.position, drive.speed, drive.speed)
        ready = np.full(momentum.shape[1], -np.inf)
        residual, status = observe_momentum(drive, net_force, momentum, self.bandwidth, ready)
        return Signal(drive.time, residual, status, self.unit(machine), self.signed)
