"""Derivation from desired dynamics: the measured torque compared with the torque that the reference motion needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.detectors.base import (
    for_every_joint,
    gain,
    held_on,
    per_joint,
    require_channels,
    require_positive,
)
from cdtool.detectors.detection import Signal, Status
from cdtool.detectors.filters import longest_gap, low_pass, polynomial_rates, settling_time, started_at
from cdtool.detectors.look import GREY, Look
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.clock import previous_value
from cdtool.recordings.clock.held_samples import hold_last
from cdtool.recordings.recording import Recording

# The rates of the reference are those of a cubic through this many of its last samples.
_SAMPLES = 21


@dataclass(frozen=True)
class DesiredDynamics:
    """res = LP{tau - M(q_ref) a_ref - C v_ref - g(q_ref) - friction(v_ref)}: the model driven by the reference motion.

    Parameters
    ----------
    cutoff : float or tuple of float
        Cut-off frequency of the low-pass [Hz], one number or one per joint.
    tracking_limit : float or tuple of float
        Tracking error |q_ref - q| above which the method is not applicable, because q_ref no longer represents q [m];
        rad for robots.

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Thesis 2.7 and 2.8 with friction added. v_ref and a_ref are derived from the reference only, by a causal cubic
    through its last samples; a logged reference_speed is used as it is. The rms and the largest tracking error are
    among the notes of the signal.

    * Needs: torque, position, reference_position.
    * Unit: N or N m, positive if the contact opposes positive travel.
    * Start-up: that of the low-pass, as for the direct derivation.
    * Fails: with a soft controller or an elastic drive the acceleration is not that of the reference, and every start
      and stop appears in the signal; after a contact the error grows, and above `tracking_limit` nothing is detected.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> time = np.arange(2001) * 1e-3
    >>> torque, travel = Series(time, np.where(time < 1.0, 0.0, 30.0), "N"), Series(time, 0.2 * time, "m")
    >>> channels = {"torque": torque, "position": travel, "reference_position": travel}
    >>> signal = DesiredDynamics(cutoff=5.0).signal(Recording("run", "", ("axis",), channels), axis)
    >>> abs(signal.values[[999, 2000], 0]).round(1).tolist()
    [0.0, 30.0]
    """

    cutoff: Gain = gain(5.0, "Hz", "cut-off frequency of the low-pass")
    tracking_limit: Gain = gain(
        0.2, "m", "tracking error beyond which the method is not applicable (rad: robots)", searched=False
    )

    name: ClassVar[str] = "desired_dynamics"
    short_name: ClassVar[str] = "ddd"
    title: ClassVar[str] = "Derivation from desired dynamics"
    needs: ClassVar[tuple[str, ...]] = ("torque", "position", "reference_position")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = True
    look: ClassVar[Look] = Look(GREY, "P")

    def __post_init__(self) -> None:
        require_positive(self, "cutoff", "tracking_limit")

    def unit(self, machine: Machine) -> str:
        """Return "N" or "N m"."""
        return machine.force_unit

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the residual (n, J) on the reference's clock; see `Detector.signal`."""
        require_channels(self, recording)
        machine.require_inertia(self.name)
        reference = recording["reference_position"]
        time = reference.time
        torque, torque_missing = held_on(time, recording["torque"])
        error = reference.values - previous_value(recording["position"], time)
        speed, acceleration = _rates(recording)
        motion_missing = ~np.isfinite(reference.values + speed + acceleration)
        missing = motion_missing | torque_missing | ~np.isfinite(error)
        if machine.coupled:
            motion_missing, missing = for_every_joint(motion_missing), for_every_joint(missing)
        pose, speed, acceleration = (
            hold_last(item, ~np.isfinite(item)) for item in (reference.values, speed, acceleration)
        )
        balance = machine.force_balance(torque, pose, speed, acceleration)
        cutoff = per_joint(self.cutoff, len(machine.joints))
        # A missing torque interrupts the low-pass, like a missing reference; a missing position does not.
        waits = motion_missing | torque_missing
        residual, _ = low_pass(time, balance, waits, cutoff)
        settle = settling_time(cutoff)
        started = started_at(time, waits, longest_gap(cutoff))
        status = np.full(started.shape, Status.VALID, dtype=np.uint8)
        status[time[:, np.newaxis] < started + settle] = Status.START_UP
        too_far = np.abs(error) > per_joint(self.tracking_limit, error.shape[1])
        status[for_every_joint(too_far) if machine.coupled else too_far] = Status.NOT_APPLICABLE
        status[missing] = Status.GAP
        notes = _tracking_notes(error, recording.joints, machine.load_units["position"])
        return Signal(time, residual, status, self.unit(machine), self.signed, notes=notes)


def _rates(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """Return speed and acceleration of the reference (n, J) on the clock of the reference position."""
    reference = recording["reference_position"]
    if "reference_speed" not in recording:
        return polynomial_rates(reference.time, reference.values, _SAMPLES)
    logged = recording["reference_speed"]
    acceleration, _ = polynomial_rates(logged.time, logged.values, _SAMPLES)
    held = previous_value(logged, reference.time)
    if acceleration.shape == held.shape and np.array_equal(logged.time, reference.time):
        return held, acceleration
    at = np.searchsorted(logged.time, reference.time, side="right") - 1
    known: BoolArray = np.isfinite(held) & (at >= 0)[:, np.newaxis]
    return held, np.where(known, acceleration[np.maximum(at, 0)], np.nan)


def _tracking_notes(error: FloatArray, joints: tuple[str, ...], unit: str) -> tuple[str, ...]:
    notes = []
    for joint, column in zip(joints, np.ascontiguousarray(error.T), strict=True):
        is_known = np.isfinite(column)
        known = column if is_known.all() else column[is_known]
        if len(known):
            rms, largest = float(np.sqrt(np.mean(known**2))), float(np.abs(known).max())
            notes.append(f"tracking error of {joint}: rms {rms:.3g} {unit}, largest {largest:.3g} {unit}")
    return tuple(notes)
