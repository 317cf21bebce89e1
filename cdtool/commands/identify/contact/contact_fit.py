"""Take-up travel, end stiffness and load of an elastic axis from contacts with a load cell.

Impact-free motion shows only the first stiffness of a drive. In a hard contact the load stops, the motor runs on and
winds the drive up further. The load is simulated between two measured quantities, the motor's motion x_m and the
contact force F_c, and the drive force that follows is compared with the torque channel (output error)::

    tau = LP(m_m x_m'' + F_el(x_m - x) + f_m sign(x_m')),  m x'' = F_el - F_r(x') - F_c

and so is the load's acceleration with the accelerometer, if its bandwidth is known. Neither the controller nor the
obstacle needs to be known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.contact import contact_kernel
from cdtool.commands.identify.contact.load_cell_contact import LoadCellContact
from cdtool.commands.identify.estimate import (
    Estimate,
    IdentificationError,
    Identified,
    Method,
    Missing,
    NotIdentifiable,
)
from cdtool.machines.axis_model.parameters import AxisModel, ElasticDrive, Friction
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass, second_order_low_pass
from cdtool.machines.axis_model.simulation import wind_up_at

# Integration steps: the classical Runge-Kutta method is accurate well below 1 [-]; the damping's change at the take-up
# travel must not be passed in one [s].
_LARGEST_STEP, _MOST_SUBSTEPS, _LONGEST_STEP = 0.5, 400, 3e-4

_SECOND_STAGE = ("take_up_travel", "end_stiffness", "end_damping")
_AS_LOGARITHM = ("load_mass", "take_up_travel", "end_stiffness")
_SHARED = (
    *_AS_LOGARITHM,
    "damping",
    "end_damping",
    "front_mass",
    "front_damping",
    "motor_friction",
    "static",
    "viscous",
    "stiffness",
)
_OF_CONTACT = ("friction", "drive_force", "load_speed", "offset")
# What the machine file gets.
_REPORTED = (
    "load_mass",
    "take_up_travel",
    "end_stiffness",
    "stiffness",
    "damping",
    "end_damping",
    "front_mass",
    "front_damping",
    "motor_friction",
)
_POSITIVE = ("damping", "end_damping", "front_damping", "motor_friction")


@dataclass(frozen=True, kw_only=True)
class ContactSettings:
    """What is known before the fit, and how well.

    `largest_wind_up` [m, rad] of the drive in the impact-free logs (`TwoMassFit.largest_wind_up`); 0: what the model
    states as `observed_wind_up`.
    `stiffness_error` [-]: relative standard error of the model's stiffness. `clock_error` [s]: standard deviation of
    the load cell's delay. `units` of inertia, force and travel.
    """

    largest_wind_up: float = 0.0
    stiffness_error: float = 0.03
    clock_error: float = 2e-3
    units: tuple[str, str, str] = ("kg", "N", "m")
    #: A parameter with a larger relative standard error is not identifiable.
    largest_relative_error: float = 0.3
    #: The drive force of the contacts must exceed that of the impact-free runs by this factor.
    beyond: float = 1.1
    #: A model that is further off than this share of the torque (RMS) does not describe the contacts.
    largest_torque_error: float = 0.25
    #: So many standard errors between the stiffnesses, or the drive has only one.
    distinct: float = 2.0
    #: Start values of the take-up travel, as shares of the largest wind-up ...
    travels: tuple[float, ...] = (0.3, 0.45, 0.6, 0.75, 0.9)
    #: ... and of the end stiffness over the first one; the cost has local minima between.
    ratios: tuple[float, ...] = (3.0, 10.0, 30.0)
    #: Start values that are followed to their end.
    followed: int = 2
    #: A channel's error counts in its noise and in this share of its largest value.
    least_share: float = 0.01
    #: Errors closer together than this are not independent [s].
    correlated: float = 0.02
    #: The load's friction counts as at least this share of the largest drive force.
    least_level: float = 0.05
    #: Correlation of the residuals is taken into account up to this lag [s].
    lags: float = 0.06
    #: Step of the derivatives, in the units of the vector.
    step: float = 1e-3
    #: Step by the take-up travel, which passes a bend of the drive's force.
    travel_step: float = 5e-3
    #: The end stiffness shows only in an oscillation of which a sample is at most this angle [rad].
    largest_angle: float = 0.3
    #: Deviations of what is known before the fit: damping ratio of the drive in its first stage ...
    damping_ratio: float = 0.05
    #: ... and in its second one.
    end_damping_ratio: float = 0.1
    #: Static friction against the model's, in shares of the friction before the contact ...
    static_error: float = 0.15
    #: ... viscous friction in the same shares ...
    viscous_error: float = 0.15
    #: ... friction at the beginning ...
    friction_error: float = 0.05
    #: ... and drive force at the beginning.
    force_error: float = 0.1
    #: Speed of the load at the beginning, in shares of the approach speed.
    speed_error: float = 0.02
    #: Share of the friction that acts on the motor instead of the load.
    motor_share: float = 0.1
    #: Usual share of the front mass in the load ...
    front_share: float = 0.1
    #: ... and its deviation.
    front_error: float = 0.1
    #: A front that is not rigid, although its stiffness is not given, moves the values by about this share.
    front_unknown: float = 0.02


@dataclass(frozen=True, eq=False)
class ContactFit:
    """What the contacts show of drive and load.

    `drive` and `friction`: the model's with what was identified; friction that acts on the motor is no longer that of
    the load. `together`: values that are not identifiable alone, but without which `drive` does not describe the
    contacts. `delays` [s]: by how much the load cell is late, per contact. `wind_up` [m, rad] and `drive_force` [N,
    N m]: the largest in the contacts. `relative_error`: RMS error of each channel over its RMS. `condition_number` of
    the scaled Jacobian.
    """

    identified: Identified
    together: tuple[Estimate, ...]
    drive: ElasticDrive
    friction: Friction
    delays: tuple[float, ...]
    wind_up: float
    drive_force: float
    relative_error: Mapping[str, float]
    condition_number: float


def with_contacts(model: AxisModel, fit: ContactFit) -> AxisModel:
    """Return the model with the drive, the load and the friction that the contacts show."""
    return replace(model, drive=fit.drive, friction=fit.friction)


def identify_contacts(
    contacts: Sequence[LoadCellContact], model: AxisModel, settings: ContactSettings | None = None
) -> ContactFit:
    """Return take-up travel, end stiffness, damping and load from contacts of an axis whose stiffness is known.

    `model` is that of the impact-free logs: stiffness, friction, sensors, motor mass. With a front stiffness the front
    mass is fitted too; without one the front is taken as rigid, and 2 % are added to the standard errors. These hold
    for exact scales of torque and load cell and an exact motor mass. Where the drive force of the contacts hardly
    exceeds that of the impact-free logs, or the second stiffness does not differ from the first, take-up travel and end
    stiffness are not identifiable. Raises IdentificationError without contacts, if the model's drive is rigid, or if
    the model cannot follow the contacts.
    """
    if not contacts:
        raise IdentificationError("no contact with a load cell is left", "give logs with a contact and channel 'force'")
    if model.drive.is_rigid:
        raise IdentificationError(
            "contacts show what is beyond the drive's first stiffness, which is not known",
            "identify model.drive.stiffness from impact-free logs first",
        )
    settings = settings or ContactSettings()
    peak = _largest_drive_force(contacts, model.drive)
    known = (settings.largest_wind_up or model.drive.observed_wind_up) * model.drive.stiffness
    if peak <= settings.beyond * known:
        one_stage = _ContactProblem(contacts, model, settings, two_stage=False).fit()
        numbers = {"drive_force": peak, "drive_force_of_impact_free_runs": known}
        refused = [NotIdentifiable("model.drive", key, (Missing.CONTACTS,), numbers) for key in _SECOND_STAGE[:2]]
        return _checked(_refusing(one_stage, refused), settings)
    fit = _ContactProblem(contacts, model, settings, two_stage=True).fit()
    if not math.isinf(fit.drive.take_up_travel):
        return _checked(fit, settings)
    refused = [item for item in fit.identified.not_identifiable if item.key in _SECOND_STAGE[:2]]
    one_stage = _ContactProblem(contacts, model, settings, two_stage=False).fit()
    # A second stage that is not known well may still be needed to know the load.
    is_needed = fit.relative_error["torque"] < 0.9 * one_stage.relative_error["torque"]
    return _checked(fit if is_needed else _refusing(one_stage, refused), settings)


def _refusing(fit: ContactFit, refused: Sequence[NotIdentifiable]) -> ContactFit:
    return replace(
        fit, identified=replace(fit.identified, not_identifiable=(*refused, *fit.identified.not_identifiable))
    )


def _checked(fit: ContactFit, settings: ContactSettings) -> ContactFit:
    """Raise IdentificationError where the model does not follow the contacts."""
    error = fit.relative_error["torque"]
    if error > settings.largest_torque_error:
        raise IdentificationError(
            f"the model's torque is {100.0 * error:.0f} % off in the contacts",
            "check motor_inertia, the scales of torque and load cell, torque_filter_time and the position's resolution",
        )
    return fit


class _ContactProblem:
    """The fit of one set of contacts.

    The vector has a number per name of `shared`, then one per name of `_OF_CONTACT` for each contact: logarithms of
    the values in `_AS_LOGARITHM`, multiples of their usual deviation of the others.
    """

    def __init__(
        self, contacts: Sequence[LoadCellContact], model: AxisModel, settings: ContactSettings, *, two_stage: bool
    ) -> None:
        self.contacts, self.model, self.settings, self.two_stage = tuple(contacts), model, settings, two_stage
        self.has_front = math.isfinite(model.drive.front_stiffness)
        left_out = set() if two_stage else set(_SECOND_STAGE)
        left_out |= set() if self.has_front else {"front_mass", "front_damping"}
        left_out |= {"motor_friction"} if model.drive.motor_friction > 0.0 else set()
        self.shared = tuple(name for name in _SHARED if name not in left_out)
        self.frictions = [_friction_towards(model.friction, item.direction) for item in contacts]
        self.scales = [_scales(item, settings.least_share) for item in contacts]
        least = self.settings.least_level * _largest_drive_force(contacts, model.drive)
        self.levels = [max(abs(item.level), least) for item in contacts]
        self.size = len(self.shared) + len(_OF_CONTACT) * len(self.contacts)

    def values(self, vector: FloatArray) -> dict[str, float]:
        """Return the shared values by name: those in `_AS_LOGARITHM` themselves, the others as in the vector."""
        values = dict(zip(self.shared, map(float, vector), strict=False))
        return values | {name: math.exp(values[name]) for name in _AS_LOGARITHM if name in values}

    def slots(self, number: int) -> slice:
        """Return where the vector has the values of one contact."""
        begin = len(self.shared) + number * len(_OF_CONTACT)
        return slice(begin, begin + len(_OF_CONTACT))

    def unit(self, name: str) -> float:
        """Return the change of a parameter of the drive by which its entry in the vector changes by 1."""
        base = self.model.drive
        load = base.load_mass
        units = {
            "damping": 2.0 * self.settings.damping_ratio * math.sqrt(base.stiffness * load),
            "end_damping": 2.0
            * self.settings.end_damping_ratio
            * math.sqrt(self.settings.ratios[1] * base.stiffness * load),
            "front_damping": 2.0
            * self.settings.damping_ratio
            * math.sqrt(base.front_stiffness * self.settings.front_share * load),
            "front_mass": self.settings.front_error * load,
            "motor_friction": self.settings.motor_share * float(np.mean(self.levels)),
            "stiffness": self.settings.stiffness_error * base.stiffness,
        }
        return units[name]

    def drive(self, vector: FloatArray) -> ElasticDrive:
        """Return the drive of a vector."""
        base, values = self.model.drive, self.values(vector)
        load = values["load_mass"]
        first = base.stiffness * math.exp(values["stiffness"] * self.settings.stiffness_error)
        damping = values["damping"] * self.unit("damping")
        front = (
            self.settings.front_share * base.load_mass + values["front_mass"] * self.unit("front_mass")
            if self.has_front
            else 0.0
        )
        front_damping = values["front_damping"] * self.unit("front_damping") if self.has_front else 0.0
        motor = base.motor_friction
        if "motor_friction" in values:
            motor = values["motor_friction"] * self.unit("motor_friction")
        drive = replace(
            base,
            motor_friction=motor,
            load_mass=load,
            stiffness=first,
            damping=damping,
            take_up_travel=math.inf,
            end_stiffness=math.inf,
            end_damping=0.0,
            front_mass=front,
            front_damping=front_damping,
        )
        if not self.two_stage:
            return drive
        return replace(
            drive,
            take_up_travel=values["take_up_travel"],
            end_stiffness=values["end_stiffness"],
            end_damping=values["end_damping"] * self.unit("end_damping"),
        )

    def friction(self, vector: FloatArray, number: int, level: float) -> Friction:
        """Return the load's friction in one contact: the model's, at the `level` [N, N m] before the contact."""
        contact, base, values = self.contacts[number], self.frictions[number], self.values(vector)
        share = vector[self.slots(number)][0]
        unit = self.levels[number]
        speed = max(contact.approach_speed, 1e-9)
        viscous = base.viscous + values["viscous"] * self.settings.viscous_error * unit / speed
        rise = max(base.static - base.coulomb_forward, 0.0) + values["static"] * self.settings.static_error * unit
        coulomb = level + share * self.settings.friction_error * unit - base.offset - max(viscous, 0.0) * speed
        coulomb = max(coulomb, 0.0)
        # The other direction shows only where the load recoils: as much as the model says for it in proportion.
        back = base.coulomb_backward / base.coulomb_forward if base.coulomb_forward > 0.0 else 1.0
        return replace(
            base,
            coulomb_forward=coulomb,
            coulomb_backward=back * coulomb,
            static=coulomb + max(rise, 0.0),
            viscous=max(viscous, 0.0),
        )

    def simulated(self, vector: FloatArray, number: int) -> dict[str, FloatArray]:
        """Return the simulated channels of one contact (n,) by name, and rows of the kernel."""
        contact, drive = self.contacts[number], self.drive(vector)
        level = contact.level - drive.motor_friction
        friction = self.friction(vector, number, level)
        _, force_share, speed_share, delay = vector[self.slots(number)]
        force = level + force_share * self.settings.force_error * self.levels[number]
        position = float(contact.motor[0, 0]) - wind_up_at(drive, force)
        speed = float(contact.motor[1, 0]) + speed_share * self.settings.speed_error * contact.approach_speed
        contact_force = contact.force_at(delay * self.settings.clock_error)
        output = np.zeros((len(contact_kernel.ROWS), len(contact_force)))
        contact_kernel.simulate_contact(
            _numbers(drive, friction, contact.period),
            np.array([position, speed, position, speed]),
            np.stack((contact.motor[0], contact.motor[1], contact_force)),
            _substeps(drive, friction, contact.period),
            output,
        )
        sensors, period, margin = self.model.sensors, contact.period, contact.margin
        rows = {
            name: np.convolve(row, contact.low_pass, mode="valid")
            for name, row in zip(contact_kernel.ROWS, output, strict=True)
        }
        sign = np.tanh(contact.motor[1, margin:-margin] / friction.smoothing_speed)
        inertia = drive.motor_mass * contact.motor_acceleration
        drive_force = rows["drive_force"] + inertia + drive.motor_friction * sign
        begins = drive_force[0]
        rows["torque"] = begins + first_order_low_pass(drive_force - begins, sensors.torque_filter_time, period)
        if contact.acceleration is not None:
            rows["acceleration"] = second_order_low_pass(
                rows["load_acceleration"], sensors.accelerometer_hz, sensors.accelerometer_damping, period
            )
        return rows

    def contact_errors(self, vector: FloatArray, number: int) -> list[FloatArray]:
        """Return the scaled errors of each channel of one contact."""
        contact = self.contacts[number]
        rows = self.simulated(vector, number)
        weight = math.sqrt(min(contact.period / self.settings.correlated, 1.0))
        pairs = [(rows["torque"] - contact.torque, self.scales[number][0])]
        if contact.acceleration is not None:
            pairs.append((rows["acceleration"] - contact.acceleration, self.scales[number][1]))
        return [np.clip(np.nan_to_num(error / scale * weight, nan=1e4), -1e4, 1e4) for error, scale in pairs]

    def errors(self, vector: FloatArray) -> FloatArray:
        """Return the scaled errors of all contacts, then every entry that has a usual deviation."""
        parts = [item for number in range(len(self.contacts)) for item in self.contact_errors(vector, number)]
        return np.concatenate((*parts, vector[self.known]))

    @property
    def known(self) -> FloatArray:
        """Return where the vector counts in usual deviations (size,), as booleans."""
        named = [name not in _AS_LOGARITHM for name in self.shared]
        return np.array(named + [True] * (self.size - len(named)))

    def jacobian(self, vector: FloatArray) -> FloatArray:
        """Return the derivatives of the errors; the values of one contact act on its own errors only."""
        blocks = []
        for number in range(len(self.contacts)):
            before = np.concatenate(self.contact_errors(vector, number))
            block = np.zeros((len(before), self.size))
            own = range(self.size)[self.slots(number)]
            for index in (*range(len(self.shared)), *own):
                moved = vector.copy()
                if self.two_stage and index == self.shared.index("take_up_travel"):
                    moved[index] -= 0.5 * self.settings.travel_step
                    lower = np.concatenate(self.contact_errors(moved, number))
                    moved[index] += self.settings.travel_step
                    block[:, index] = (
                        np.concatenate(self.contact_errors(moved, number)) - lower
                    ) / self.settings.travel_step
                else:
                    moved[index] += self.settings.step
                    block[:, index] = (np.concatenate(self.contact_errors(moved, number)) - before) / self.settings.step
            blocks.append(block)
        return np.concatenate((*blocks, np.eye(self.size)[self.known]))

    def starts(self) -> list[FloatArray]:
        """Return the start values, the best first."""
        base = self.model.drive
        first = np.zeros(self.size)
        first[0] = math.log(base.load_mass)
        for name in _POSITIVE:
            if name in self.shared:
                first[self.shared.index(name)] = 0.5
        if not self.two_stage:
            return [first]
        reach = max(float(np.max(_rough_wind_up(item, base))) for item in self.contacts)
        reach = max(reach, 1e-3 * _largest_drive_force(self.contacts, base) / base.stiffness)
        candidates = []
        for travel in self.settings.travels:
            for ratio in self.settings.ratios:
                vector = first.copy()
                vector[1], vector[2] = math.log(travel * reach), math.log(ratio * base.stiffness)
                candidates.append((float(np.sum(np.abs(self.errors(vector)))), vector))
        candidates.sort(key=lambda item: item[0])
        return [vector for _, vector in candidates[: self.settings.followed]]

    def solve(self) -> FloatArray:
        """Return the vector of least cost."""
        from scipy.optimize import least_squares

        low, high = np.full(self.size, -10.0), np.full(self.size, 10.0)
        starts = self.starts()
        for index, name in enumerate(self.shared):
            if name in _AS_LOGARITHM:
                low[index], high[index] = starts[0][index] - math.log(50.0), starts[0][index] + math.log(50.0)
            if name in _POSITIVE:
                low[index] = 0.0
            if name == "front_mass":
                low[index], high[index] = (
                    -0.99 * self.settings.front_share / self.settings.front_error,
                    0.4 / self.settings.front_error,
                )
        scale = np.where(self.known, 1.0, 0.1)
        solutions = [
            least_squares(
                self.errors,
                start,
                jac=self.jacobian,
                bounds=(low, high),
                x_scale=scale,
                ftol=1e-5,
                xtol=1e-5,
                max_nfev=60,
            )
            for start in starts
        ]
        best = min(solutions, key=lambda item: item.cost)
        return np.asarray(best.x, dtype=np.float64)

    def covariance(self, vector: FloatArray, jacobian: FloatArray) -> FloatArray:
        """Return the covariance of the vector: of correlated residuals, and of what is known before the fit."""
        from scipy.linalg import matmul_toeplitz

        inverse = np.linalg.pinv(jacobian)
        parts = [self.contact_errors(vector, number) for number in range(len(self.contacts))]
        longest = max(math.ceil(self.settings.lags / item.period) for item in self.contacts)
        covariances = [
            _autocovariance([item[channel] for item in parts if len(item) > channel], longest) for channel in (0, 1)
        ]
        total = np.zeros((self.size, self.size))
        row = 0
        for item in parts:
            for channel, errors in enumerate(item):
                part = inverse[:, row : row + len(errors)]
                column = np.zeros(len(errors))
                lags = min(len(errors), longest + 1)
                column[:lags] = covariances[channel][:lags]
                total += part @ matmul_toeplitz(column, part.T)
                row += len(errors)
        # The residuals are smaller than the errors by what the parameters explain of them.
        pairs = zip(parts, self.contacts, strict=True)
        samples = sum(
            len(item) * len(item[0]) * min(contact.period / self.settings.correlated, 1.0) for item, contact in pairs
        )
        explained = float(np.trace(jacobian[:row] @ inverse[:, :row]))
        total *= samples / max(samples - explained, 0.2 * samples)
        prior = inverse[:, row:]
        total += prior @ prior.T
        return total

    def fit(self) -> ContactFit:
        """Return the solution with standard errors."""
        vector = self.solve()
        jacobian = self.jacobian(vector)
        norms = np.linalg.norm(jacobian, axis=0)
        # What moves nothing is not known at all.
        errors = np.where(norms > 0.0, np.sqrt(np.diag(self.covariance(vector, jacobian))), np.inf)
        rows = [self.simulated(vector, number) for number in range(len(self.contacts))]
        drive = self.drive(vector)
        estimates = self.estimates(drive, errors)
        wind_up = max(float(np.max(item["wind_up"])) for item in rows)
        doubts = self.doubts(drive, estimates, errors, wind_up)
        drive, friction, kept = self.kept(drive, set(doubts), wind_up)
        delays = [vector[self.slots(number)][3] * self.settings.clock_error for number in range(len(self.contacts))]
        doubtful = [item for item in estimates if item.key in doubts]
        missing = [
            _not_identifiable(item, doubts[item.key]) for item in doubtful if item.key in (*kept, *_AS_LOGARITHM)
        ]
        return ContactFit(
            identified=Identified(
                tuple(item for item in estimates if item.key in kept and item not in doubtful), tuple(missing)
            ),
            together=(*(item for item in doubtful if item.key in kept), *self.moved_friction(friction)),
            drive=drive,
            friction=friction,
            delays=tuple(map(float, delays)),
            wind_up=wind_up,
            drive_force=_largest_drive_force(self.contacts, self.model.drive),
            relative_error=_relative_errors(self.contacts, rows),
            condition_number=float(np.linalg.cond(jacobian / np.where(norms > 0.0, norms, 1.0))),
        )

    def estimates(self, drive: ElasticDrive, errors: FloatArray) -> list[Estimate]:
        """Return all parameters of the drive that were fitted."""
        mass, force, travel = self.settings.units
        units = {
            "load_mass": mass,
            "front_mass": mass,
            "take_up_travel": travel,
            "end_stiffness": f"{force}/{travel}",
            "stiffness": f"{force}/{travel}",
            "motor_friction": force,
        }
        estimates = []
        for name in _REPORTED:
            if name in self.shared:
                value = float(getattr(drive, name))
                error = float(errors[self.shared.index(name)]) * (value if name in _AS_LOGARITHM else self.unit(name))
                error = error if self.has_front else math.hypot(error, self.settings.front_unknown * value)
                section = "machine" if name == "load_mass" else "model.drive"
                unit = units.get(name, f"{force} s/{travel}")
                estimates.append(Estimate(section, name, value, error, unit, Method.CONTACTS))
        return estimates

    def doubts(
        self, drive: ElasticDrive, estimates: Sequence[Estimate], errors: FloatArray, wind_up: float
    ) -> dict[str, Missing]:
        """Return what is needed for each parameter that these contacts do not determine."""
        doubts = {}
        for item in estimates:
            if not item.relative_error <= self.settings.largest_relative_error:
                doubts[item.key] = Missing.CONTACTS if item.key in _SECOND_STAGE else Missing.MORE_RECORDINGS
        if any(not item.is_motion_exact for item in self.contacts):
            # A delay of the speed channel looks like damping.
            doubts |= {item.key: Missing.POSITION for item in estimates if item.key in ("damping", "end_damping")}
        if not self.two_stage:
            return doubts
        both = math.hypot(errors[self.shared.index("end_stiffness")], self.settings.stiffness_error)
        is_distinct = math.log(drive.end_stiffness / drive.stiffness) > self.settings.distinct * both
        if not is_distinct or wind_up <= drive.take_up_travel:
            doubts |= dict.fromkeys(_SECOND_STAGE, Missing.CONTACTS)
        rate = math.sqrt(drive.end_stiffness * (1.0 / drive.motor_mass + 1.0 / drive.load_mass))
        if rate * max(item.period for item in self.contacts) > self.settings.largest_angle:
            doubts |= dict.fromkeys(_SECOND_STAGE, Missing.HIGHER_RATE)
        return doubts

    def kept(
        self, drive: ElasticDrive, doubtful: set[str], wind_up: float
    ) -> tuple[ElasticDrive, Friction, tuple[str, ...]]:
        """Return drive and friction with what is identified, and the names of the values that they have from here."""
        base, friction = self.model.drive, self.model.friction
        if "load_mass" in doubtful:
            return base, friction, ()
        names: tuple[str, ...] = ("load_mass", "front_mass", "front_damping")
        if self.two_stage and not {"take_up_travel", "end_stiffness"} & doubtful:
            names = _REPORTED
            moved = drive.motor_friction - base.motor_friction
            friction = replace(
                friction,
                coulomb_forward=max(friction.coulomb_forward - moved, 0.0),
                coulomb_backward=max(friction.coulomb_backward - moved, 0.0),
                static=max(friction.static - moved, 0.0),
            )
            base = replace(base, observed_wind_up=max(base.observed_wind_up, wind_up))
        names = tuple(name for name in names if name in self.shared)
        return replace(base, **{name: getattr(drive, name) for name in names}), friction, names

    def moved_friction(self, friction: Friction) -> list[Estimate]:
        """Return the friction of the load where a part of the model's acts on the motor."""
        force = self.settings.units[1]
        return [
            Estimate("model.friction", name, getattr(friction, name), math.nan, force, Method.CONTACTS)
            for name in ("coulomb_forward", "coulomb_backward", "static")
            if getattr(friction, name) != getattr(self.model.friction, name)
        ]


def _not_identifiable(estimate: Estimate, needed: Missing) -> NotIdentifiable:
    numbers = {"value": estimate.value, "relative_standard_error": estimate.relative_error}
    return NotIdentifiable(estimate.section, estimate.key, (needed,), numbers)


def _numbers(drive: ElasticDrive, friction: Friction, period: float) -> tuple[float, ...]:
    values = {name: getattr(drive, name, getattr(friction, name, 0.0)) for name in contact_kernel.PARAMETER_ORDER}
    values |= {"main_mass": drive.load_mass - drive.front_mass, "period": period}
    if not math.isfinite(drive.end_stiffness):
        values |= {"take_up_travel": 1e12, "end_stiffness": drive.stiffness, "end_damping": drive.damping}
    return tuple(float(values[name]) for name in contact_kernel.PARAMETER_ORDER)


def _substeps(drive: ElasticDrive, friction: Friction, period: float) -> int:
    """Return the number of integration steps per sample that the fastest motion of the load needs."""
    main = drive.load_mass - drive.front_mass
    stiffest = max(drive.stiffness, drive.end_stiffness if math.isfinite(drive.end_stiffness) else 0.0)
    rates = [
        math.sqrt(stiffest / main),
        max(drive.damping, drive.end_damping) / main,
        max(friction.coulomb_forward, friction.coulomb_backward, friction.static) / friction.smoothing_speed / main,
    ]
    if drive.front_mass > 0.0:
        rates += [math.sqrt(drive.front_stiffness / drive.front_mass), drive.front_damping / drive.front_mass]
    return int(np.clip(math.ceil(period * max(max(rates) / _LARGEST_STEP, 1.0 / _LONGEST_STEP)), 1, _MOST_SUBSTEPS))


def _largest_drive_force(contacts: Sequence[LoadCellContact], drive: ElasticDrive) -> float:
    """Return the largest force of the drive on the load, as torque and motor show it [N, N m]."""
    return max(float(np.max(item.drive_force_of(drive.motor_mass))) for item in contacts)


def _rough_wind_up(contact: LoadCellContact, drive: ElasticDrive) -> FloatArray:
    """Return the wind-up (n,) [m, rad] that follows from the forces on a load of the model's mass."""
    margin = contact.margin
    elastic = contact.drive_force_of(drive.motor_mass)
    net = (elastic - contact.force_at(0.0)[margin:-margin] - contact.level) / drive.load_mass
    position, speed = contact.motor[:, margin]
    travelled = np.cumsum(speed + np.cumsum(net) * contact.period) * contact.period
    wind_up: FloatArray = contact.level / drive.stiffness + contact.motor[0, margin:-margin] - position - travelled
    return wind_up


def _scales(contact: LoadCellContact, least_share: float) -> tuple[float, float]:
    """Return in what the errors of torque and acceleration count."""
    torque = math.hypot(contact.noise[0], least_share * float(np.max(np.abs(contact.torque))))
    if contact.acceleration is None:
        return torque, math.nan
    return torque, math.hypot(contact.noise[1], least_share * float(np.max(np.abs(contact.acceleration))))


def _autocovariance(parts: Sequence[FloatArray], lags: int) -> FloatArray:
    """Return the mean autocovariance (lags + 1,) of several series around 0, tapered linearly."""
    found = np.zeros(lags + 1)
    if not parts:
        return found
    total = sum(map(len, parts))
    for lag in range(lags + 1):
        found[lag] = sum(float(np.dot(item[lag:], item[: len(item) - lag])) for item in parts if len(item) > lag)
    tapered: FloatArray = found / total * (1.0 - np.arange(lags + 1) / (lags + 1))
    return tapered


def _relative_errors(contacts: Sequence[LoadCellContact], rows: Sequence[Mapping[str, FloatArray]]) -> dict[str, float]:
    found = {}
    for name in ("torque", "acceleration"):
        pairs = [
            (row[name], getattr(item, name))
            for item, row in zip(contacts, rows, strict=True)
            if getattr(item, name) is not None
        ]
        if pairs:
            error = sum(float(np.sum((model - log) ** 2)) for model, log in pairs)
            found[name] = math.sqrt(error / max(sum(float(np.sum(log**2)) for _, log in pairs), 1e-300))
    return found


def _friction_towards(friction: Friction, direction: int) -> Friction:
    """Return the friction as it acts along a direction of approach."""
    if direction > 0:
        return friction
    return replace(
        friction,
        coulomb_forward=friction.coulomb_backward,
        coulomb_backward=friction.coulomb_forward,
        offset=-friction.offset,
    )
