"""Which detectors an injected contact can test: those whose channels the model gives what they need."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from cdtool.commands.inject.assumption import ControllerReaction
from cdtool.machines.axis_model.parameters import AxisModel


class Refusal(Enum):
    """Why the latency of a detector from injected contacts would be wrong, with what to add."""

    CONTROLLER = "its signal is the reaction of the controller: identify [model.controller]"
    ACCELEROMETER = "the accelerometer's bandwidth is not known: give [model.sensors] accelerometer_hz"
    DRIVE = (
        "the stiffness of the drive is not known: identify it from starts at rest, or state [model.drive] rigid = true"
    )


def refusal(needs: Sequence[str], model: AxisModel, reaction: ControllerReaction) -> Refusal | None:
    """Return why a detector with these `needs` (channels) is not tested; None if it is.

    Torque alone shows a contact only when the controller reacts. A rigid drive in the place of an elastic one reports
    a contact to the motor far too early (45 ms on the simulated gate), and only the acceleration is not affected.
    """
    if "acceleration" in needs and model.sensors.accelerometer_hz == 0.0:
        return Refusal.ACCELEROMETER
    senses_motion = any(channel in needs for channel in ("speed", "position", "acceleration"))
    if not senses_motion and reaction is not ControllerReaction.KNOWN:
        return Refusal.CONTROLLER
    if "acceleration" not in needs and model.drive.is_rigid and not model.drive.stated_rigid:
        return Refusal.DRIVE
    return None
