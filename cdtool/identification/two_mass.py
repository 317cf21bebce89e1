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
from itertools import pairwise

import numpy as np

from cdtool.axis_model.parameters import AxisModel, Controller, Drive, Friction, Sensors
from cdtool.axis_model.sensor_filters import second_order_low_pass
from cdtool.axis_model.simulation import AxisInputs, AxisMotion, simulate_axis
from cdtool.errors import ConfigurationError
from cdtool.identification.axis_run import AxisRun
from cdtool.identification.estimate import (
    Estimate,
    IdentificationError,
    Identified,
    Method,
    Missing,
    NotIdentifiable,
)
from cdtool.identification.friction_profile import friction_profile, random_phases
from cdtool.identification.start_ensemble import StartEnsemble, start_ensembles
from cdtool.plain_text import counted
from cdtool.recording import FloatArray

# In the order of the vector of logarithms.
PARAMETERS = ("load_mass", "stiffness", "coulomb", "static", "viscous")
# A parameter with a larger relative standard error is not identifiable.
LARGEST_RELATIVE_ERROR = 0.3
# The fit's stiffness starts at these multiples of the smallest plausible one; the cost has local minima between.
_STIFFNESS_STARTS = 12
# A correction of the measured-force drive towards the measured speed: total mass times this [1/s].
_CORRECTION_RATE = 10.0
# A channel's error counts in its run-to-run deviation, at least in this share of its largest value.
_LEAST_SHARE = 0.01
# The friction's rise is below a speed that a start passes in a few samples: it is given, not fitted [m/s, rad/s].
_STRIBECK_SHARE = 0.1
_AT_BOUND = 1.02
# A drive is as good as rigid if its oscillation lasts so many periods of the log, and its stiffness does not show above
# this share of that.
_PERIODS_OF_RIGID, _MOST_OF_RIGID = 10.0, 0.3
# The cost of the rigid drive over that of the elastic one below which the elasticity does not show.
_CLEARLY_WORSE = 1.5
# The total that a start shows roughly, in masses of the motor: less is an error of the machine file.
_LEAST_TOTAL = 0.7
# A channel of one start counts as so many independent samples: its errors are coloured.
_INDEPENDENT = 20.0


@dataclass(frozen=True, kw_only=True)
class TwoMassSettings:
    """`motor_mass` on the load side [kg, kg m2]; `sensors` as far as they are known.

    `stribeck_speed` [m/s, rad/s] is a tenth of the nominal speed unless it is given. `surrogates`: number of random
    friction profiles from which the standard errors are computed.
    """

    motor_mass: float
    sensors: Sensors = field(default_factory=Sensors)
    stribeck_speed: float | None = None
    surrogates: int = 24
    seed: int = 0
    units: tuple[str, str, str] = ("kg", "N", "m")


@dataclass(frozen=True, eq=False)
class TwoMassFit:
    """The identified model and how well it follows the log.

    `relative_error`: RMS error by channel over its RMS. `condition_number` of the scaled Jacobian. `nominal_friction`
    [N, N m] with its standard error: the friction at the nominal speed, known better than its parts.
    `largest_wind_up` [m, rad] of the drive in the starts: beyond it nothing is known of its stiffness.
    """

    identified: Identified
    model: AxisModel
    ensembles: tuple[StartEnsemble, ...]
    relative_error: Mapping[str, float]
    condition_number: float
    nominal_friction: tuple[float, float]
    largest_wind_up: float


def identify_two_mass(runs: Sequence[AxisRun], settings: TwoMassSettings) -> TwoMassFit:
    """Return load, drive stiffness and friction from the starts of impact-free runs.

    Raises IdentificationError where no run starts from rest, the motor's inertia is not given or above the total, the
    fit ends at a bound, or a rigid drive describes the starts as well. Viscous friction from one speed, and everything
    else with a standard error above 30 %, is not identifiable; the model still has the fitted value.
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
    vector = problem.solve()
    problem.refuse_rigid(vector)
    return problem.result(vector)


class _Problem:
    """The fit of one set of ensembles: simulated and measured channels, weights, start values."""

    def __init__(self, runs: Sequence[AxisRun], ensembles: Sequence[StartEnsemble], settings: TwoMassSettings) -> None:
        self.ensembles = tuple(ensembles)
        self.settings = settings
        self.stribeck = settings.stribeck_speed or _STRIBECK_SHARE * max(item.nominal_speed for item in ensembles)
        self.start = _rough_values(self.ensembles[0], settings.motor_mass)
        self.scales = [_scales(item) for item in self.ensembles]
        total = settings.motor_mass + self.start["load_mass"]
        self.travelled = [_travelled(item) for item in self.ensembles]
        self.profiles = [friction_profile(runs, item, total) for item in self.ensembles]
        self.known = [profile.at(way) for profile, way in zip(self.profiles, self.travelled, strict=True)]
        self.knots = [profile.knots() for profile in self.profiles]
        # Rows that weigh the unknown forces by what the known profile makes plausible.
        self.prior = [np.linalg.inv(np.linalg.cholesky(covariance)) for _, covariance in self.knots]

        self.compared = ["torque", "speed", "position"]
        if settings.sensors.accelerometer_hz > 0.0:
            self.compared.append("acceleration")
        logarithms = [math.log(self.start[name]) for name in PARAMETERS]
        self.first = np.array([*logarithms, *np.zeros(sum(len(rows) for rows in self.prior))])
        self.size = len(self._scaled_errors(self.first, self.frictions(self.first)))

    def model(self, vector: FloatArray) -> AxisModel:
        """Return the model with the parameters exp(vector[:5]); the rest is the unknown friction at the knots."""
        load, stiffness, coulomb, rise, viscous = np.exp(vector[: len(PARAMETERS)])
        settings = self.settings
        drive = Drive(motor_mass=settings.motor_mass, load_mass=float(load), stiffness=float(stiffness))
        friction = Friction(
            coulomb_forward=float(coulomb),
            coulomb_backward=float(coulomb),
            static=float(coulomb + rise),
            stribeck_speed=self.stribeck,
            viscous=float(viscous),
            smoothing_speed=min(1e-3, 0.005 * self.ensembles[0].nominal_speed),
        )
        period = self.ensembles[0].period
        gain = _CORRECTION_RATE * drive.total_mass
        controller = Controller(period=period, speed_gain=gain, speed_filter_order=0)
        return AxisModel(drive=drive, friction=friction, controller=controller, sensors=settings.sensors)

    def frictions(self, vector: FloatArray) -> list[FloatArray]:
        """Return the deviation of the friction from the model's along each ensemble (n,): known, or at the knots."""
        found, used = [], len(PARAMETERS)
        for (positions, _), known, travelled in zip(self.knots, self.known, self.travelled, strict=True):
            forces = vector[used : used + len(positions)]
            used += len(positions)
            if len(positions):
                moving = np.clip(travelled / max(positions[1], 1e-300), 0.0, 0.1) * 10.0
                known = known + moving * np.interp(travelled, positions, forces, right=0.0)
            found.append(known)
        return found

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
        """Return the scaled errors of all channels; large where the model cannot be simulated."""
        try:
            found = self._scaled_errors(vector, self.frictions(vector))
        except ConfigurationError:
            found = np.full(self.size, 1e3)
        return np.nan_to_num(found, nan=1e3, posinf=1e3, neginf=-1e3)

    def _scaled_errors(self, vector: FloatArray, frictions: Sequence[FloatArray]) -> FloatArray:
        model, parts, used = self.model(vector), [], len(PARAMETERS)
        for number, (ensemble, scales) in enumerate(zip(self.ensembles, self.scales, strict=True)):
            motion = self.simulated(model, number, frictions[number])
            for name, values in self.channels(motion, ensemble).items():
                weight = math.sqrt(_INDEPENDENT * ensemble.count / len(values))
                parts.append((values - ensemble.mean[name]) / scales[name] * weight)
        for rows in self.prior:
            parts.append(rows @ vector[used : used + len(rows)])
            used += len(rows)
        return np.concatenate(parts)

    def solve(self) -> FloatArray:
        """Return the logarithms of the parameters, from the best of a grid of stiffnesses."""
        from scipy.optimize import least_squares

        first = self.first
        lowest = math.log(self.start["stiffness"])
        grid = lowest + np.linspace(0.0, math.log(1e3), _STIFFNESS_STARTS)
        candidates = []
        for stiffness in grid:
            vector = first.copy()
            vector[1] = stiffness
            candidates.append((float(np.sum(np.abs(self.errors(vector)))), vector))
        candidates.sort(key=lambda item: item[0])
        count = len(PARAMETERS)
        low, high = np.full(len(first), -np.inf), np.full(len(first), np.inf)
        low[:count], high[:count] = first[:count] - math.log(50.0), first[:count] + math.log(50.0)
        low[1], high[1] = grid[0] - math.log(20.0), grid[-1] + math.log(10.0)
        scale = 0.1 * self.start["coulomb"]
        solutions = [
            least_squares(
                self.errors,
                vector,
                jac=self.jacobian,
                loss="soft_l1",
                ftol=1e-5,
                xtol=1e-4,
                max_nfev=30,
                bounds=(low, high),
                x_scale=np.concatenate((np.full(count, 0.3), np.full(len(first) - count, 0.3 * scale))),
            )
            for _, vector in candidates[:2]
        ]
        best = min(solutions, key=lambda item: item.cost)
        vector = np.asarray(best.x, dtype=np.float64)
        if vector[0] - low[0] < math.log(_AT_BOUND) or high[0] - vector[0] < math.log(_AT_BOUND):
            raise IdentificationError(
                f"the load ends at {math.exp(vector[0]):.3g} {self.settings.units[0]}, the bound of the search",
                "check machine.motor_inertia, the torque's scale, and that the logs are of this machine",
            )
        return vector

    def refuse_rigid(self, vector: FloatArray) -> None:
        """Raise IdentificationError unless the starts show the drive's elasticity.

        All other parameters are fitted again with a drive that is as good as rigid at this sampling rate: the elastic
        one must describe the starts clearly better.
        """
        from scipy.optimize import least_squares

        load, stiffness = np.exp(vector[:2])
        motor, period = self.settings.motor_mass, self.ensembles[0].period
        reduced = motor * load / (motor + load)
        stiff = reduced * (2.0 * math.pi / (_PERIODS_OF_RIGID * period)) ** 2
        first = vector.copy()
        first[0], first[1] = self.first[0], math.log(max(stiff, 3.0 * stiffness))
        free = np.arange(len(vector)) != 1

        def errors(values: FloatArray) -> FloatArray:
            whole = first.copy()
            whole[free] = values
            return self.errors(whole)

        def jacobian(values: FloatArray) -> FloatArray:
            whole = first.copy()
            whole[free] = values
            return self.jacobian(whole)[:, free]

        found = least_squares(errors, first[free], jac=jacobian, loss="soft_l1", ftol=1e-3, xtol=1e-3, max_nfev=8)
        elastic = 2.0 * float(np.sum(np.sqrt(1.0 + self.errors(vector) ** 2) - 1.0))
        if stiffness > _MOST_OF_RIGID * stiff or 2.0 * found.cost < _CLEARLY_WORSE * elastic:
            raise IdentificationError(
                "a rigid drive describes the starts as well as an elastic one: its stiffness does not show",
                "if the drive is rigid, state [model.drive] rigid = true; else log stronger starts at a higher rate",
            )

    def jacobian(self, vector: FloatArray) -> FloatArray:
        """Return the derivatives of the scaled errors by the parameters' logarithms and the forces at the knots."""
        columns = []
        for index in range(len(vector)):
            step = np.zeros(len(vector))
            step[index] = size = 1e-3 if index < len(PARAMETERS) else 1e-2 * self.start["coulomb"]
            columns.append((self.errors(vector + step) - self.errors(vector - step)) / (2.0 * size))
        return np.stack(columns, axis=1)

    def result(self, vector: FloatArray) -> TwoMassFit:
        """Return the fit with standard errors from surrogates of the friction over position."""
        model = self.model(vector)
        jacobian = self.jacobian(vector)
        own = jacobian[:, : len(PARAMETERS)]
        norms = np.linalg.norm(own, axis=0)
        condition = float(np.linalg.cond(own / np.where(norms > 0.0, norms, 1.0)))
        deviations = self._deviations(jacobian, vector)
        frictions = self.frictions(vector)
        relative = np.sqrt(np.mean(deviations**2, axis=0))
        friction, error = self._nominal_friction(vector, deviations)
        largest = max(
            float(np.max(np.abs(self.simulated(model, number, friction)["wind_up"])))
            for number, friction in enumerate(frictions)
        )
        return TwoMassFit(
            identified=self._identified(vector, relative, condition),
            model=replace(model, controller=None),
            ensembles=self.ensembles,
            relative_error=self._relative_error(model, frictions),
            condition_number=condition,
            nominal_friction=(friction, error),
            largest_wind_up=largest,
        )

    def _deviations(self, jacobian: FloatArray, vector: FloatArray) -> FloatArray:
        """Return how far other errors of the same colour would move the parameters' logarithms (surrogates, 5).

        Each is a random friction profile where the friction is not known, plus what the model leaves over in every
        channel, with random phases.
        """
        rng = np.random.default_rng(self.settings.seed)
        inverse = np.linalg.pinv(jacobian, rcond=1e-6)
        base = self.errors(vector)
        blocks = [len(item) for item in self.ensembles for name in self.compared if name in item.mean]
        edges = np.cumsum([0, *blocks])
        drawn = [
            profile.surrogates(travelled, self.settings.surrogates, rng)
            for profile, travelled in zip(self.profiles, self.travelled, strict=True)
        ]
        frictions = self.frictions(vector)
        rows = []
        for number in range(self.settings.surrogates):
            disturbed = [known + item[number] for known, item in zip(frictions, drawn, strict=True)]
            change = self._scaled_errors(vector, disturbed) - base
            for begin, end in pairwise(edges):
                change[begin:end] += random_phases(base[begin:end], rng)
            rows.append(-inverse @ change)
        return np.array(rows)[:, : len(PARAMETERS)]

    def _nominal_friction(self, vector: FloatArray, deviations: FloatArray) -> tuple[float, float]:
        speed = self.ensembles[0].nominal_speed

        def friction(logarithms: FloatArray) -> float:
            return float(np.exp(logarithms[2]) + np.exp(logarithms[4]) * speed)

        value = friction(vector)
        logarithms = vector[: len(PARAMETERS)]
        spread = [friction(logarithms + item) - value for item in np.clip(deviations, -2.0, 2.0)]
        return value, float(np.sqrt(np.mean(np.square(spread))))

    def _identified(self, vector: FloatArray, relative: FloatArray, condition: float) -> Identified:
        mass, force, length = self.settings.units
        load, stiffness, coulomb, rise, viscous = np.exp(vector[: len(PARAMETERS)])
        static = coulomb + rise
        static_error = math.hypot(coulomb * relative[2], rise * relative[3])
        rows: list[tuple[str, str, float, float, str, tuple[Missing, ...]]] = [
            ("machine", "load_mass", load, load * relative[0], mass, (Missing.ACCELERATION,)),
            (
                "model.drive",
                "stiffness",
                stiffness,
                stiffness * relative[1],
                f"{force}/{length}",
                (Missing.HIGHER_RATE, Missing.START_UP),
            ),
            *(
                ("model.friction", key, coulomb, coulomb * relative[2], force, (Missing.SECOND_SPEED,))
                for key in self._directions()
            ),
            ("model.friction", "static", static, static_error, force, (Missing.MORE_RECORDINGS,)),
            (
                "model.friction",
                "viscous",
                viscous,
                viscous * relative[4],
                f"{force} s/{length}",
                (Missing.SECOND_SPEED,),
            ),
        ]
        speeds = _distinct_speeds(self.ensembles)
        estimates, missing = [], []
        for section, key, value, error, unit, needs in rows:
            known = error <= LARGEST_RELATIVE_ERROR * value and not (key == "viscous" and speeds < 2)
            if known:
                estimates.append(Estimate(section, key, float(value), float(error), unit, Method.OUTPUT_ERROR))
            else:
                numbers = {"value": float(value), "relative_standard_error": float(error / value)}
                numbers |= {"speeds": float(speeds), "condition_number": condition}
                missing.append(NotIdentifiable(section, key, needs, numbers))
        return Identified(tuple(estimates), tuple(missing))

    def _directions(self) -> list[str]:
        """Return the keys of the Coulomb friction in the directions of the starts."""
        keys = {1: "coulomb_forward", -1: "coulomb_backward"}
        return [keys[direction] for direction in (1, -1) if any(item.direction == direction for item in self.ensembles)]

    def _relative_error(self, model: AxisModel, frictions: Sequence[FloatArray]) -> dict[str, float]:
        totals: dict[str, list[tuple[float, float]]] = {}
        for number, ensemble in enumerate(self.ensembles):
            motion = self.simulated(model, number, frictions[number])
            for name, values in self.channels(motion, ensemble).items():
                measured = ensemble.mean[name]
                totals.setdefault(name, []).append(
                    (float(np.mean((values - measured) ** 2)), float(np.mean(measured**2)))
                )
        return {
            name: math.sqrt(sum(a for a, _ in pairs) / max(sum(b for _, b in pairs), 1e-300))
            for name, pairs in totals.items()
        }


def _rough_values(ensemble: StartEnsemble, motor_mass: float) -> dict[str, float]:
    """Return start values from the accelerated and from the settled part of a start."""
    sign = float(ensemble.direction)
    speed, force = sign * ensemble.mean["speed"], sign * ensemble.mean["torque"]
    speed = _smooth(speed, ensemble.period, 0.05)
    acceleration = np.gradient(speed, ensemble.period)
    top = float(np.max(speed))
    settled = speed > 0.95 * top
    friction = max(float(np.median(force[settled])), 1e-6 * float(np.max(np.abs(force))))
    speeding = (acceleration > 0.5 * float(np.max(acceleration))) & (speed < 0.9 * top)
    ratio = (force[speeding] - friction) / acceleration[speeding]
    total = float(np.median(ratio)) if speeding.any() else 2.0 * motor_mass
    if total < _LEAST_TOTAL * motor_mass:
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
    }


def _travelled(ensemble: StartEnsemble) -> FloatArray:
    """Return the distance travelled since the rest (n,) [m, rad]."""
    if "position" in ensemble.mean:
        return ensemble.direction * ensemble.mean["position"]
    return ensemble.direction * np.cumsum(ensemble.mean["speed"]) * ensemble.period


def _scales(ensemble: StartEnsemble) -> dict[str, float]:
    """Return in what each channel's error counts: its run-to-run deviation, at least 1 % of its largest value."""
    scales = {}
    for name, mean in ensemble.mean.items():
        spread = float(np.sqrt(np.mean(ensemble.deviation[name] ** 2)))
        scales[name] = max(spread, _LEAST_SHARE * float(np.max(np.abs(mean))), 1e-300)
    return scales


def _distinct_speeds(ensembles: Sequence[StartEnsemble]) -> int:
    """Return the number of nominal speeds that differ by more than 20 %."""
    found: list[float] = []
    for speed in sorted(item.nominal_speed for item in ensembles):
        if not found or speed > 1.2 * found[-1]:
            found.append(speed)
    return len(found)


def _smooth(values: FloatArray, period: float, seconds: float) -> FloatArray:
    width = max(round(seconds / period), 1)
    return np.convolve(values, np.full(width, 1.0 / width), mode="same")
