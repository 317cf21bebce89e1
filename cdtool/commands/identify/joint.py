"""What was identified of one joint by all methods, and what is missing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from cdtool.commands.identify.axis.excitation import Excitation
from cdtool.commands.identify.axis.rigid_axis import RigidAxisFit
from cdtool.commands.identify.axis.speed_controller import ControllerFit
from cdtool.commands.identify.axis.two_mass import TwoMassFit
from cdtool.commands.identify.estimate import Estimate, Method, NotIdentifiable
from cdtool.commands.identify.evidence import ForceEvidence
from cdtool.commands.identify.robot.friction_choice import JointFriction
from cdtool.machines.axis_model.model_table import finite_values

_CONTROLLER_UNITS = {"period": "s", "speed_filter_hz": "Hz", "force_lag": "s", "delay": "s", "position_gain": "1/s"}


@dataclass(frozen=True, eq=False)
class JointIdentification:
    """What was identified of one joint, by each method; a method that could not be used has its reason in `refused`.

    `units`: of inertia, force, travel and viscous friction. `has_torque_filter`: the machine file states it. `robot`:
    of a robot or planar arm, whose joints have none of the other fits. `evidence` and `excitation`: how well the model
    describes the logs, and what their motion excites; None without motion.
    """

    joint: str
    rigid: RigidAxisFit | None = None
    two_mass: TwoMassFit | None = None
    controller: ControllerFit | None = None
    units: tuple[str, str, str, str] = ("kg", "N", "m", "N s/m")
    has_torque_filter: bool = False
    refused: Mapping[str, str] = field(default_factory=dict)
    robot: JointFriction | None = None
    evidence: ForceEvidence | None = None
    excitation: Excitation | None = None

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Return the estimates that the machine file gets.

        The load's mass is that of the elastic drive if there is one, else that of the rigid axis. Friction is rather
        that of several speeds than that of the starts.
        """
        found: dict[tuple[str, str], Estimate] = {}
        for fit in (self.two_mass, self.rigid, self.controller, self.robot):
            for estimate in fit.identified.estimates if fit else ():
                if fit is not self.rigid or not (self.two_mass and estimate.key == "load_mass"):
                    found[estimate.section, estimate.key] = estimate
        if ("model.controller", "speed_gain") not in found:  # a table without it cannot be read
            found = {key: item for key, item in found.items() if key[0] != "model.controller"}
        if self.rigid and (viscous := found.get(("machine", "viscous_friction"))):
            # A table [model.friction] comes before [machine]: an old value of it must not apply with new ones.
            found["model.friction", "viscous"] = replace(viscous, section="model.friction", key="viscous")
        return tuple(found.values())

    @property
    def together(self) -> tuple[Estimate, ...]:
        """Return values that are not identifiable alone, but without which the identified ones describe nothing."""
        known = {(item.section, item.key) for item in self.estimates}
        found: list[Estimate] = [*(self.robot.together if self.robot else ()), *self._friction_of_starts()]
        found += [*self._of_starts(), *self._of_controller()]
        if ("model.friction", "coulomb_backward") in known and ("machine", "constant_force") in known:
            # The difference of the directions contains the constant force: it must not count twice.
            found.append(_exact("model.friction", "offset", 0.0, self.units[1]))
        known |= {(item.section, item.key) for item in self.not_identifiable if not self.robot}
        return tuple(item for item in found if (item.section, item.key) not in known)

    def _friction_of_starts(self) -> list[Estimate]:
        """Return Coulomb and viscous friction where only their sum is known: without both a model has neither."""
        units = dict.fromkeys(("coulomb_forward", "coulomb_backward"), self.units[1]) | {"viscous": self.units[3]}
        found = {item.key for item in self.estimates if item.section == "model.friction"}
        if not self.two_mass or "load_mass" not in self.two_mass.identified or found & units.keys():
            return []
        refused = {item.key for item in self.two_mass.identified.not_identifiable} & units.keys()
        values = vars(self.two_mass.model.friction)
        return [_exact("model.friction", key, values[key], units[key]) for key in units if key in refused]

    def _of_starts(self) -> list[Estimate]:
        """Return what the starts show together with the identified values: how far they go."""
        if not self.two_mass:
            return []
        found, identified = [], self.two_mass.identified
        if "stiffness" in identified:
            found.append(_exact("model.drive", "observed_wind_up", self.two_mass.largest_wind_up, self.units[2]))
        if "static" in identified:
            values, unit = vars(self.two_mass.model.friction), f"{self.units[2]}/s"
            found += [_exact("model.friction", key, values[key], unit) for key in ("stribeck_speed", "smoothing_speed")]
        return found

    def _of_controller(self) -> list[Estimate]:
        """Return what is needed to simulate the identified controller."""
        fit = self.controller
        if fit is None or fit.controller is None:
            return []
        found: list[Estimate] = []
        for key, value in finite_values(fit.controller).items():
            if value or key == "speed_filter_order":
                found.append(_exact("model.controller", key, value, _CONTROLLER_UNITS.get(key, "")))
        slope = {item.key: item.numbers for item in fit.identified.not_identifiable}.get("slew_limit", {})
        if slope.get("largest_n_per_s", 0.0) > 0.0:
            found.append(_exact("model.controller", "observed_slope", slope["largest_n_per_s"], f"{self.units[1]}/s"))
        if math.isfinite(fit.lag) and fit.lag > 0.0 and not self.has_torque_filter:
            found.append(_exact("model.sensors", "torque_filter_time", fit.lag, "s"))
        return found

    @property
    def not_identifiable(self) -> tuple[NotIdentifiable, ...]:
        """Return the parameters that no method could identify."""
        known = {(item.section, item.key) for item in (*self.estimates, *self._friction_of_starts())}
        found: dict[tuple[str, str], NotIdentifiable] = {}
        for fit in (self.rigid, self.two_mass, self.controller, self.robot):
            for item in fit.identified.not_identifiable if fit else ():
                if (item.section, item.key) not in known:
                    found.setdefault((item.section, item.key), item)
        return tuple(found.values())

    @property
    def summary(self) -> dict[str, Any]:
        """Return everything but the samples as JSON values."""
        validation = self.evidence.cross_validation if self.evidence else None
        values = {
            "joint": self.joint,
            "estimates": [item.summary for item in self.estimates],
            "not_identifiable": [item.summary for item in self.not_identifiable],
            "refused": dict(self.refused),
            "force_error_on_unseen_runs": validation and validation.summary,
            "excitation": self.excitation and asdict(self.excitation),
        }
        return {**values, **({"friction_decision": self.robot.summary} if self.robot else _of_axis(self))}


def _exact(section: str, key: str, value: float, unit: str) -> Estimate:
    return Estimate(section, key, value, math.nan, unit, Method.OUTPUT_ERROR)


def _of_axis(joint: JointIdentification) -> dict[str, Any]:
    rigid, two_mass, controller = joint.rigid, joint.two_mass, joint.controller
    return {
        "friction_at_speed": [asdict(level) for level in rigid.levels] if rigid else [],
        "condition_number": rigid and rigid.condition_number,
        "two_mass": two_mass
        and {
            "condition_number": two_mass.condition_number,
            "largest_wind_up": two_mass.largest_wind_up,
        },
        "controller": controller and {"kind": controller.kind.value, "residual_rms": controller.residual_rms},
    }
