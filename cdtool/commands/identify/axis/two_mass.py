"""Load, drive stiffness and friction of an axis whose motor drives the load through an elastic drive.

Prediction error on the mean of many starts from rest: the model is driven by the measured force and by a weak
correction towards the measured speed, without which it would drift, and its channels are compared with the measured
ones. So the controller need not be known; with the controller in the loop (output error) friction that the model does
not know moves load and viscous friction further. The motor's inertia is given: fitted with the rest it is off by up to
its own size.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError
from cdtool.base.plain_text import counted
from cdtool.commands.identify.axis.filtered_regression import IntArray
from cdtool.commands.identify.axis.friction_profile import (
    friction_profile,
    friction_shares,
    random_phases,
)
from cdtool.commands.identify.axis.start_ensemble import StartEnsemble, start_ensembles
from cdtool.commands.identify.estimate import (
    Estimate,
    IdentificationError,
    Identified,
    Method,
    Missing,
    NotIdentifiable,
)
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.parameters import AxisModel, Controller, ElasticDrive, Friction, Sensors
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass, second_order_low_pass
from cdtool.machines.axis_model.simulation import AxisInputs, AxisMotion, simulate_axis

# In the order of the vector of logarithms.
_ALWAYS = ("load_mass", "stiffness", "coulomb", "viscous", "static", "onset", "damping", "rise_speed")
PARAMETERS = (*_ALWAYS, "take_up", "end_stiffness")
# Of a drive with one stiffness those before the take-up are fitted, which is beyond every wind-up.
_ONE_STIFFNESS, _NEVER = len(_ALWAYS), math.log(1e9)
# Without the speed at which friction sets in and the drive's damping, starts give a wrong stiffness, or a second one;
# without the friction's rise towards rest, a wrong load. Alone they show these badly, and a rise that vanishes has no
# error: each is guessed within a factor (one standard deviation), by which the fit moves it at most. Friction that sets
# in only where its rise has gone again had 5 times the static friction, and a long rise took the place of the load.
_GUESSED, _GUESSED_WITHIN = slice(PARAMETERS.index("static"), _ONE_STIFFNESS), np.log([3.0, 2.0, 3.0, 2.0])


@dataclass(frozen=True, kw_only=True)
class TwoMassSettings:
    """`motor_mass` on the load side [kg, kg m2]; `sensors` as far as they are known.

    `surrogates`: number of random friction profiles from which the standard errors are computed.
    """

    motor_mass: float
    sensors: Sensors = field(default_factory=Sensors)
    surrogates: int = 96
    seed: int = 0
    units: tuple[str, str, str] = ("kg", "N", "m")
    #: A parameter with a larger relative standard error is not identifiable.
    largest_relative_error: float = 0.5
    #: The fit's stiffness starts at so many multiples of the smallest plausible one: there are local minima between.
    stiffness_starts: int = 12
    #: The measured-force drive is corrected towards the measured speed, or it drifts: total mass times this [1/s].
    correction_rate: float = 10.0
    #: A channel's error counts in its run-to-run deviation, at least in this share of its largest value.
    least_share: float = 0.01
    #: A channel of one start counts as so many independent samples: its errors are coloured.
    independent: float = 20.0
    #: The search ends at this multiple of a rough value ...
    most_change: float = 50.0
    #: ... and within this factor of the bound a value is at it.
    at_bound: float = 1.02
    #: The search for a second stiffness begins at each of these: the first one as a share of that of a drive with one
    #: stiffness, the share of the largest wind-up at which the second begins, and its multiple of the first.
    second_starts: tuple[tuple[float, float, float], ...] = ((0.95, 0.8, 1.2), (0.8, 0.7, 3.0), (0.6, 0.8, 9.0))
    #: The take-up may change by this factor: far below, it would stand for the friction near rest.
    take_up_change: float = 2.0
    #: A second stiffness exists if the cost falls below this share: noise and friction lower it by a few percent.
    second_stiffness: float = 0.9
    #: A drive is as good as rigid if its oscillation lasts so many periods of the log ...
    periods_of_rigid: float = 10.0
    #: ... and its stiffness does not show above this share of that.
    most_of_rigid: float = 0.3
    #: Below this cost of the rigid drive over that of the elastic one the elasticity does not show; above this cost of
    #: the elastic one over what its starts differ by it does not describe them.
    clearly_worse: float = 1.5
    #: The total that a start shows roughly, in masses of the motor: less is an error of the machine file.
    least_total: float = 0.7


@dataclass(frozen=True, eq=False)
class StartComparison:
    """Aligned starts and the model's channels (n,) that are compared with their means, driven by their mean force.

    The model includes the friction along the travel where it is known, and is corrected weakly towards the measured
    speed: what `torque` differs by from the measured one is the force that the model does not explain.
    """

    ensemble: StartEnsemble
    modelled: Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class TwoMassFit:
    """The identified model and how well it follows the log.

    `starts`: by ensemble. `condition_number` of the scaled Jacobian. `largest_wind_up` [m, rad] of the drive in the
    starts, or its take-up travel: beyond it nothing is known of its stiffness.
    """

    identified: Identified
    model: AxisModel
    starts: tuple[StartComparison, ...]
    condition_number: float
    largest_wind_up: float


def identify_two_mass(runs: Sequence[AxisRun], settings: TwoMassSettings) -> TwoMassFit:
    """Return load, drive stiffness and friction from the starts of impact-free runs.

    A drive that a second stiffness describes clearly better has one: the load is then that of this model, and the
    stiffness is not identifiable. What a second stiffness would change is in the load's error. Nothing is identifiable
    from starts that neither drive describes. A value with a standard error above 50 % is not identifiable, and neither
    are Coulomb and viscous friction where one of them is not; the model still has the fitted values.

    Raises IdentificationError where no run starts from rest, the motor's inertia is not given or above the total, the
    fit ends at a bound, or a rigid drive describes the starts as well.
    """
    if settings.motor_mass <= 0.0:
        raise IdentificationError(
            "a drive's stiffness cannot be identified without the motor's inertia", "set machine.motor_inertia"
        )
    ensembles = start_ensembles(runs)
    if not ensembles:
        raise IdentificationError(
            f"none of {counted(len(runs), 'run')} starts from rest",
            "the drive's stiffness shows only in a start: log it from rest",
        )
    problem = _Problem(runs, ensembles, settings)
    return problem.result(problem.solve())


class _Problem:
    """The fit of one set of ensembles: simulated and measured channels, weights, start values."""

    def __init__(self, runs: Sequence[AxisRun], ensembles: Sequence[StartEnsemble], settings: TwoMassSettings) -> None:
        # The model is driven by the torque as logged: the motion that it is compared with is made as late.
        self.ensembles: tuple[StartEnsemble, ...] = ()
        for item in ensembles:
            lag = partial(first_order_low_pass, time_constant=settings.sensors.torque_filter_time, period=item.period)
            mean = {key: values if key == "torque" else lag(values) for key, values in item.mean.items()}
            self.ensembles += (replace(item, mean=mean),)
        self.settings = settings
        self.start = _rough_values(self.ensembles[0], settings)
        self.scales = [_scales(item, settings) for item in self.ensembles]
        self.travelled = [_travelled(item) for item in self.ensembles]
        self.profiles = [friction_profile(runs, item, settings.motor_mass) for item in self.ensembles]
        self.known = [profile.at(way) for profile, way in zip(self.profiles, self.travelled, strict=True)]
        self._weigh(friction_shares(self.start["load_mass"], math.inf, 0.0))
        logarithms = [math.log(self.start[name]) for name in PARAMETERS[:_ONE_STIFFNESS]]
        ends = np.cumsum([len(PARAMETERS), *map(len, self.prior)])
        self.of_knots = [slice(*pair) for pair in pairwise(ends)]
        self.one_stiffness = np.delete(np.arange(ends[-1]), slice(_ONE_STIFFNESS, len(PARAMETERS)))
        self.first = np.array([*logarithms, _NEVER, 0.0, *np.zeros(ends[-1] - ends[0])])
        self.load_change, self.is_described = 0.0, True  # by a second stiffness; by either drive
        # The force at a knot acts on one ensemble: the others are as they were.
        self._part = lru_cache(maxsize=64)(self._errors_of)

    def _weigh(self, shares: FloatArray) -> None:
        """Weigh the unknown forces by what the known profile, as these shares give it, makes plausible."""
        self.profiles = [replace(profile, shares=shares) for profile in self.profiles]
        self.knots = [profile.knots() for profile in self.profiles]
        self.prior = [np.linalg.inv(np.linalg.cholesky(covariance)) for _, covariance in self.knots]

    def model(self, vector: FloatArray) -> AxisModel:
        """Return the model with the `PARAMETERS` exp(vector); the rest is the unknown friction at the knots."""
        values = map(float, np.exp(vector[: len(PARAMETERS)]))
        load, stiffness, coulomb, viscous, rise, onset, ratio, rise_speed, take_up, end = values
        settings, motor = self.settings, self.settings.motor_mass
        damping = 2.0 * ratio * math.sqrt(stiffness * motor * load / (motor + load))
        drive = ElasticDrive(motor_mass=motor, load_mass=load, stiffness=stiffness, damping=damping)
        if vector[_ONE_STIFFNESS] < _NEVER:
            drive = replace(drive, take_up_travel=take_up, end_stiffness=end, end_damping=damping)
        friction = Friction(
            coulomb_forward=coulomb,
            coulomb_backward=coulomb,
            static=coulomb + rise,
            stribeck_speed=rise_speed,
            viscous=viscous,
            smoothing_speed=onset * rise_speed,
        )
        period = self.ensembles[0].period
        gain = self.settings.correction_rate * drive.total_mass
        controller = Controller(period=period, speed_gain=gain, speed_filter_order=0)
        return AxisModel(drive=drive, friction=friction, controller=controller, sensors=settings.sensors)

    def frictions(self, vector: FloatArray) -> list[FloatArray]:
        """Return the deviation of the friction from the model's along each ensemble (n,): known, or at the knots."""
        return [self._friction(number, vector, vector[part]) for number, part in enumerate(self.of_knots)]

    def _friction(self, number: int, vector: FloatArray, forces: FloatArray) -> FloatArray:
        travelled, (positions, _) = self.travelled[number], self.knots[number]
        known = _shares(vector) @ self.known[number]
        if not len(positions):
            return known
        moving = np.clip(travelled / max(positions[1], 1e-300), 0.0, 0.1) * 10.0
        return np.asarray(known + moving * np.interp(travelled, positions, forces, right=0.0))

    def simulated(self, model: AxisModel, number: int, friction: FloatArray) -> AxisMotion:
        """Return the model's motion along an ensemble's references, with `friction` (n,) against its travel."""
        ensemble = self.ensembles[number]
        disturbance = -ensemble.direction * friction
        inputs = AxisInputs(
            ensemble.mean["speed"], command=ensemble.mean["torque"], feed_forward=True, disturbance=disturbance
        )
        return simulate_axis(model, inputs)

    def channels(self, motion: AxisMotion, ensemble: StartEnsemble) -> dict[str, FloatArray]:
        """Return the simulated channels as the log has them."""
        sensors = self.settings.sensors
        channels = {
            "torque": motion["command"],
            "speed": motion["motor_speed"],
            "position": motion["motor_position"],
        }
        if sensors.accelerometer_hz > 0.0:
            channels["acceleration"] = second_order_low_pass(
                motion["load_acceleration"], sensors.accelerometer_hz, sensors.accelerometer_damping, ensemble.period
            )
        return {name: values for name, values in channels.items() if name in ensemble.mean}

    def errors(self, vector: FloatArray) -> FloatArray:
        """Return the scaled errors of all channels, of what is guessed and of the knots' forces.

        Those of the channels are large where the model cannot be run.
        """
        parameters = vector[: len(PARAMETERS)].tobytes()
        parts = [self._part(number, parameters, vector[part].tobytes()) for number, part in enumerate(self.of_knots)]
        guessed = (vector - self.first)[_GUESSED] / _GUESSED_WITHIN
        return np.concatenate(
            (*parts, guessed, *(rows @ vector[part] for rows, part in zip(self.prior, self.of_knots, strict=True)))
        )

    def _errors_of(self, number: int, parameters: bytes, forces: bytes) -> FloatArray:
        vector = np.frombuffer(parameters)
        friction = self._friction(number, vector, np.frombuffer(forces))
        try:
            found = self.scaled_errors(number, self.model(vector), friction)
        except ConfigurationError:
            found = np.full(len(self.scales[number]) * len(self.ensembles[number]), 1e3)
        return np.nan_to_num(found, nan=1e3, posinf=1e3, neginf=-1e3)

    def scaled_errors(self, number: int, model: AxisModel, friction: FloatArray) -> FloatArray:
        """Return the errors of the channels of an ensemble, each in its scale and as if its samples were few."""
        ensemble, scales = self.ensembles[number], self.scales[number]
        weight = math.sqrt(self.settings.independent * ensemble.count / len(ensemble))
        channels = self.channels(self.simulated(model, number, friction), ensemble)
        return np.concatenate([(channels[name] - ensemble.mean[name]) / scales[name] * weight for name in scales])

    def solve(self) -> FloatArray:
        """Return the logarithms of the parameters, from the best of a grid of stiffnesses; refuse a rigid drive."""
        lowest = math.log(self.start["stiffness"])
        candidates = []
        for stiffness in lowest + np.linspace(0.0, math.log(1e3), self.settings.stiffness_starts):
            vector = self.first.copy()
            vector[1] = stiffness
            candidates.append((float(np.sum(np.abs(self.errors(vector)))), vector))
        candidates.sort(key=lambda item: item[0])
        rough, _ = min(
            (self._fitted(item, self.one_stiffness, 1e-2, 6) for _, item in candidates[:2]), key=lambda item: item[1]
        )
        self._weigh(_shares(rough))
        vector, cost = self._fitted(rough, self.one_stiffness, 1e-5, 30)
        if abs(vector[0] - self.first[0]) > math.log(self.settings.most_change / self.settings.at_bound):
            raise IdentificationError(
                f"the load ends at {math.exp(vector[0]):.3g} {self.settings.units[0]}, the bound of the search",
                "check machine.motor_inertia, the torque's scale, and that the logs are of this machine",
            )
        largest, others = self.largest_wind_up(rough), []
        for softer, take_up, ratio in self.settings.second_starts:
            first = rough.copy()
            first[1] += math.log(softer)
            first[_ONE_STIFFNESS : len(PARAMETERS)] = math.log(take_up * largest), first[1] + math.log(ratio)
            others.append(self._fitted(first, np.arange(len(vector)), 1e-4, 20))
        other, lower = min(others, key=lambda item: item[1])
        self._refuse_rigid(vector, min(cost, lower))
        if lower < cost:
            self.load_change = float(np.exp(other[0]) - np.exp(vector[0]))
        channels = sum(item.count * len(scales) for item, scales in zip(self.ensembles, self.scales, strict=True))
        self.is_described = min(cost, lower) < self.settings.clearly_worse * self.settings.independent * channels
        return other if lower < self.settings.second_stiffness * cost else vector

    def _fitted(self, first: FloatArray, free: IntArray, tolerance: float, calls: int) -> tuple[FloatArray, float]:
        """Return the vector whose `free` values fit best, and its cost."""
        from scipy.optimize import least_squares

        count, knots = len(PARAMETERS), len(first) - len(PARAMETERS)
        reach = np.concatenate((np.full(count, math.log(self.settings.most_change)), np.full(knots, np.inf)))
        reach[_ONE_STIFFNESS], reach[_GUESSED] = math.log(self.settings.take_up_change), _GUESSED_WITHIN
        centre = np.array([*first[: _GUESSED.start], *self.first[_GUESSED], *first[_GUESSED.stop :]])
        bounds = (centre - reach)[free], (centre + reach)[free]
        scale = np.concatenate((np.full(count, 0.3), np.full(knots, 0.03 * self.start["coulomb"])))[free]

        def whole(values: FloatArray) -> FloatArray:
            vector = first.copy()
            vector[free] = values
            return vector

        def errors(values: FloatArray) -> FloatArray:
            return self.errors(whole(values))

        def jacobian(values: FloatArray) -> FloatArray:
            return self.jacobian(whole(values), free)

        found = least_squares(
            errors,
            first[free],
            jac=jacobian,
            loss="soft_l1",
            ftol=tolerance,
            xtol=1e-4,
            max_nfev=calls,
            bounds=bounds,
            x_scale=scale,
        )
        return whole(np.asarray(found.x, dtype=np.float64)), 2.0 * float(found.cost)

    def _refuse_rigid(self, vector: FloatArray, cost: float) -> None:
        """Raise IdentificationError unless the starts show the drive's elasticity.

        All other parameters are fitted again with a drive that is as good as rigid at this sampling rate: the elastic
        one must describe the starts clearly better.
        """
        load, stiffness = np.exp(vector[:2])
        motor, period = self.settings.motor_mass, self.ensembles[0].period
        stiff = motor * load / (motor + load) * (2.0 * math.pi / (self.settings.periods_of_rigid * period)) ** 2
        first = vector.copy()
        first[0], first[1] = self.first[0], math.log(max(stiff, 3.0 * stiffness))
        _, rigid = self._fitted(first, np.delete(self.one_stiffness, 1), 1e-3, 8)
        if stiffness > self.settings.most_of_rigid * stiff or rigid < self.settings.clearly_worse * cost:
            raise IdentificationError(
                "a rigid drive describes the starts as well as an elastic one: its stiffness does not show",
                "if the drive is rigid, state [model.drive] rigid = true; else log stronger starts at a higher rate",
            )

    def jacobian(self, vector: FloatArray, free: IntArray) -> FloatArray:
        """Return the derivatives of the errors by the free logarithms of parameters and forces at knots."""
        base, columns = self.errors(vector), []
        for index in free:
            size = 1e-3 if index < len(PARAMETERS) else 1e-2 * self.start["coulomb"]
            moved = vector.copy()
            moved[index] += size
            columns.append((self.errors(moved) - base) / size)
        return np.stack(columns, axis=1)

    def largest_wind_up(self, vector: FloatArray) -> float:
        """Return the largest wind-up of the drive in all starts [m, rad]."""
        model, frictions = self.model(vector), self.frictions(vector)
        return max(float(np.max(np.abs(self.simulated(model, *item)["wind_up"]))) for item in enumerate(frictions))

    def result(self, vector: FloatArray) -> TwoMassFit:
        """Return the fit with standard errors from surrogates of the friction over position."""
        model, frictions = self.model(vector), self.frictions(vector)
        free = np.arange(len(vector)) if vector[_ONE_STIFFNESS] < _NEVER else self.one_stiffness
        jacobian = self.jacobian(vector, free)
        own = jacobian[:, free < len(PARAMETERS)]
        norms = np.linalg.norm(own, axis=0)
        condition = float(np.linalg.cond(own / np.where(norms > 0.0, norms, 1.0)))
        inverse = np.asarray(np.linalg.pinv(jacobian, rcond=1e-6), np.float64)
        # At least what the weights of the fit give: what it leaves over is smaller where it follows the noise.
        least = np.linalg.norm(inverse, axis=1) if self.is_described else np.full(len(free), np.inf)
        relative = np.maximum(self._relative_deviation(inverse, vector), least)
        return TwoMassFit(
            identified=self._identified(vector, relative, condition),
            model=replace(model, controller=None),
            starts=tuple(
                StartComparison(ensemble, self.channels(self.simulated(model, number, frictions[number]), ensemble))
                for number, ensemble in enumerate(self.ensembles)
            ),
            condition_number=condition,
            largest_wind_up=min(self.largest_wind_up(vector), model.drive.take_up_travel),
        )

    def _relative_deviation(self, inverse: FloatArray, vector: FloatArray) -> FloatArray:
        """Return how far (RMS) other errors of the same colour would move the free values (p,), by the fit's inverse.

        Each is a random friction profile where the friction is not known and other guesses, plus what the model leaves
        over in every channel, with random phases.
        """
        rng = np.random.default_rng(self.settings.seed)
        model, frictions = self.model(vector), self.frictions(vector)
        # All starts pass the same track: their frictions are as wrong together.
        drawn = [
            profile.surrogates(travelled, self.settings.surrogates, np.random.default_rng((self.settings.seed, 1)))
            for profile, travelled in zip(self.profiles, self.travelled, strict=True)
        ]
        base = [self.scaled_errors(number, model, friction) for number, friction in enumerate(frictions)]
        rows = []
        for surrogate in range(self.settings.surrogates):
            parts = []
            for number, (friction, left) in enumerate(zip(frictions, base, strict=True)):
                moved = self.scaled_errors(number, model, friction + drawn[number][surrogate]) - left
                channels = np.split(left, len(self.scales[number]))
                parts.append(moved + np.concatenate([random_phases(item, rng) for item in channels]))
            change = np.concatenate((*parts, rng.standard_normal(len(_GUESSED_WITHIN))))
            rows.append(inverse[:, : len(change)] @ change)
        return np.asarray(np.sqrt(np.mean(np.square(rows), axis=0)))

    def _identified(self, vector: FloatArray, relative: FloatArray, condition: float) -> Identified:
        mass, force, length = self.settings.units
        load, stiffness, coulomb, viscous, rise = np.exp(vector[: _GUESSED.start + 1])
        static = coulomb + rise
        static_error = math.hypot(coulomb * relative[2], rise * relative[4]) / static
        load_error = math.hypot(relative[0], self.load_change / load)
        # What is taken from one of the two is in the other; one that has vanished has no error of its own.
        vanished = np.min((vector - self.first)[[2, 3]]) < -math.log(self.settings.most_change / self.settings.at_bound)
        dry = math.inf if vanished else max(relative[2], relative[3])
        has_second = vector[_ONE_STIFFNESS] < _NEVER or not self.is_described
        gentler = (Missing.GENTLER_START,) if has_second else ()
        rows: list[tuple[str, str, float, float, float, str, tuple[Missing, ...]]] = [
            ("machine", "load_mass", load, load_error, load_error, mass, gentler or (Missing.ACCELERATION,)),
            (
                "model.drive",
                "stiffness",
                stiffness,
                relative[1],
                math.inf if has_second else relative[1],
                f"{force}/{length}",
                gentler or (Missing.HIGHER_RATE, Missing.START_UP),
            ),
            *(
                ("model.friction", key, coulomb, relative[2], dry, force, (Missing.SECOND_SPEED,))
                for key in self._directions()
            ),
            ("model.friction", "static", static, static_error, static_error, force, (Missing.MORE_RECORDINGS,)),
            ("model.friction", "viscous", viscous, relative[3], dry, f"{force} s/{length}", (Missing.SECOND_SPEED,)),
        ]
        estimates, missing = [], []
        for section, key, value, error, judged, unit, needed in rows:
            if judged <= self.settings.largest_relative_error:
                estimates.append(Estimate(section, key, float(value), float(error * value), unit, Method.OUTPUT_ERROR))
            else:
                known = {"value": float(value), "standard_error": float(error * value)}
                missing.append(NotIdentifiable(section, key, needed, {**known, "condition_number": condition}))
        return Identified(tuple(estimates), tuple(missing))

    def _directions(self) -> list[str]:
        """Return the keys of the Coulomb friction in the directions of the starts."""
        keys = {1: "coulomb_forward", -1: "coulomb_backward"}
        return [keys[direction] for direction in (1, -1) if any(item.direction == direction for item in self.ensembles)]


def _rough_values(ensemble: StartEnsemble, settings: TwoMassSettings) -> dict[str, float]:
    """Return start values from the accelerated and from the settled part of a start."""
    motor_mass = settings.motor_mass
    sign = float(ensemble.direction)
    speed, force = sign * ensemble.mean["speed"], sign * ensemble.mean["torque"]
    width = max(round(0.05 / ensemble.period), 1)
    speed = np.convolve(speed, np.full(width, 1.0 / width), mode="same")
    acceleration = np.gradient(speed, ensemble.period)
    top = float(np.max(speed))
    settled = speed > 0.95 * top
    friction = max(float(np.median(force[settled])), 1e-6 * float(np.max(np.abs(force))))
    speeding = (acceleration > 0.5 * float(np.max(acceleration))) & (speed < 0.9 * top)
    ratio = (force[speeding] - friction) / acceleration[speeding]
    total = float(np.median(ratio)) if speeding.any() else 2.0 * motor_mass
    if total < settings.least_total * motor_mass:
        raise IdentificationError(
            f"the starts show a total of {total:.3g}, the motor alone is stated to have {motor_mass:.3g}",
            "check machine.motor_inertia, transmission_ratio, and the scale and sign of the torque",
        )
    load = max(total - motor_mass, 0.05 * motor_mass)
    # A drive that is wound up further than the start takes would not move the load in time.
    travel = max(top * 0.1, 1e-9)
    return {
        "load_mass": load,
        "stiffness": max(float(np.max(np.abs(force))) / travel, 1e-9),
        "coulomb": 0.8 * friction,
        "static": 0.2 * friction,
        "viscous": 0.2 * friction / top,
        "onset": 0.05,
        "damping": 0.03,
        "rise_speed": 0.1 * top,
    }


def _shares(vector: FloatArray) -> FloatArray:
    """Return the shares of the parts of the known friction for these `PARAMETERS`."""
    load, stiffness, *_, viscous = np.exp(vector[: _GUESSED.start])
    return friction_shares(load, stiffness, viscous)


def _travelled(ensemble: StartEnsemble) -> FloatArray:
    """Return the distance travelled since the rest (n,) [m, rad]."""
    if "position" in ensemble.mean:
        return ensemble.direction * ensemble.mean["position"]
    return ensemble.direction * np.cumsum(ensemble.mean["speed"]) * ensemble.period


def _scales(ensemble: StartEnsemble, settings: TwoMassSettings) -> dict[str, float]:
    """Return in what the error of each channel that is compared counts: its deviation, at least 1 % of it."""
    scales, accelerometer = {}, ("acceleration",) if settings.sensors.accelerometer_hz > 0.0 else ()
    for name in ("torque", "speed", "position", *accelerometer):
        if name in ensemble.mean:
            spread = float(np.sqrt(np.mean(ensemble.deviation[name] ** 2)))
            scales[name] = max(spread, settings.least_share * float(np.max(np.abs(ensemble.mean[name]))), 1e-300)
    return scales
