"""What is assumed about a machine where a parameter that matters to a contact is not known: brackets, each simulated.

Impact-free logs show a drive only up to the wind-up of its starts and a torque command only up to the slope that it
had. A contact winds the drive up further and lets the command rise faster. What lies beyond is between two bounds: the
latency is a range.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from enum import Enum

from cdtool.machines.axis_model.parameters import AxisModel, ElasticDrive


class ControllerReaction(Enum):
    """How the drive reacts to the contact, where its controller is not known: two brackets."""

    KNOWN = "known controller"
    FROZEN = "controller frozen"
    STIFF = "controller stiff"


class DriveBeyond(Enum):
    """The drive beyond the largest wind-up that impact-free logs show."""

    AS_BEFORE = "drive as elastic as before"
    RIGID = "drive rigid beyond its observed wind-up"


class SlewBeyond(Enum):
    """The slew limit of the torque command, where only the largest slope that it had is known."""

    NO_LIMIT = "command without a slew limit"
    OBSERVED = "command no steeper than observed"


@dataclass(frozen=True)
class Assumption:
    """One bound of each parameter that is not known; the default where all are."""

    controller: ControllerReaction = ControllerReaction.KNOWN
    drive: DriveBeyond = DriveBeyond.AS_BEFORE
    slew: SlewBeyond = SlewBeyond.NO_LIMIT

    @property
    def suffix(self) -> str:
        """Return what it adds to the name of a group."""
        parts = [] if self.controller is ControllerReaction.KNOWN else [self.controller.name.lower()]
        parts += ["rigid"] if self.drive is DriveBeyond.RIGID else []
        parts += ["limited"] if self.slew is SlewBeyond.OBSERVED else []
        return "".join(f"_{part}" for part in parts)

    @property
    def deviations(self) -> tuple[ControllerReaction | DriveBeyond | SlewBeyond, ...]:
        """Return the bounds that are not the default."""
        default = Assumption()
        both = ((self.controller, default.controller), (self.drive, default.drive), (self.slew, default.slew))
        return tuple(value for value, usual in both if value is not usual)

    def model(self, model: AxisModel) -> AxisModel:
        """Return the model under this assumption about its drive."""
        return replace(model, drive=_rigid_beyond(model)) if self.drive is DriveBeyond.RIGID else model

    def after_contact(self, model: AxisModel) -> AxisModel:
        """Return the model with the assumed slew limit, which applies from the contact on.

        Before it the command is that of the log, whose limit is not known: with the limit as observed it would be late,
        and its integral would wind up.
        """
        if self.slew is SlewBeyond.NO_LIMIT or model.controller is None:
            return model
        return replace(model, controller=replace(model.controller, slew_limit=model.controller.observed_slope))


def assumptions_of(model: AxisModel) -> tuple[Assumption, ...]:
    """Return every combination of the bounds that the model leaves open; one if all parameters are known."""
    controller, drive = model.controller, model.drive
    reactions = [ControllerReaction.KNOWN] if controller else [ControllerReaction.FROZEN, ControllerReaction.STIFF]
    beyond = [DriveBeyond.AS_BEFORE]
    if not drive.is_rigid and math.isinf(drive.take_up_travel) and drive.observed_wind_up > 0.0:
        beyond.append(DriveBeyond.RIGID)
    slews = [SlewBeyond.NO_LIMIT]
    if controller is not None and math.isinf(controller.slew_limit) and controller.observed_slope > 0.0:
        slews.append(SlewBeyond.OBSERVED)
    return tuple(Assumption(*bounds) for bounds in itertools.product(reactions, beyond, slews))


def _rigid_beyond(model: AxisModel) -> ElasticDrive:
    """Return the drive with an end of its take-up travel at the observed wind-up that hardly gives way."""
    drive = model.drive
    # Without a controller in the model 1 ms, as usual.
    period = model.controller.period if model.controller is not None else 1e-3
    reduced = 1.0 / (1.0 / drive.motor_mass + 1.0 / (drive.load_mass - drive.front_mass))
    # Beyond its known wind-up as good as rigid: its oscillation lasts 20 periods of the controller, and is damped to
    # half of critical.
    rate = 2.0 * math.pi / (20.0 * period)
    stiffness = max(reduced * rate**2, drive.stiffness)
    damping = math.sqrt(stiffness * reduced)
    return replace(
        drive, take_up_travel=drive.observed_wind_up, end_stiffness=stiffness, end_damping=max(damping, drive.damping)
    )
