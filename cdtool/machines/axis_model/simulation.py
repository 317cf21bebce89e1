"""Simulate one axis in closed loop along the references of a log, free or against an obstacle."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError
from cdtool.machines.axis_model import axis_loop_kernel
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel, ElasticDrive

# The classical Runge-Kutta method is stable up to 2.78 and accurate well below [-].
LARGEST_STEP = 0.5
# Where nothing is said, a drive runs as if it had one stiffness.
NEVER = 1e12


@dataclass(frozen=True, eq=False)
class AxisInputs:
    """What drives the model, one value per controller period from `start` [s]; arrays (n,) on the load side.

    `command` [N] replaces the controller if it is given, or is added to its output if it is a `feed_forward`.
    `disturbance` [N] acts on the load in positive direction.
    """

    reference_speed: FloatArray
    reference_position: FloatArray | None = None
    command: FloatArray | None = None
    disturbance: FloatArray | None = None
    feed_forward: bool = False
    initial_speed: float = 0.0
    initial_position: float = 0.0


@dataclass(frozen=True, eq=False)
class AxisMotion:
    """The simulated motion (n,) by name (`axis_loop_kernel.ROWS`), every `period` [s].

    `first_contact` [s] counts from the first sample; NaN without a contact.
    """

    period: float
    rows: FloatArray
    first_contact: float = math.nan

    def __getitem__(self, name: str) -> FloatArray:
        row: FloatArray = self.rows[axis_loop_kernel.ROWS.index(name)]
        return row


def simulate_axis(
    model: AxisModel,
    inputs: AxisInputs,
    obstacle: Obstacle | None = None,
    period: float | None = None,
    changes_at: tuple[float, float] = (-math.inf, -math.inf),
) -> AxisMotion:
    """Simulate the axis from rest, or in steady motion with the initial speed.

    `period` [s]: of the inputs, if the model has no controller. `changes_at` [s after the first input]: when the
    obstacle is put there, and when the slew limit begins to apply. Raises ConfigurationError where the model has
    neither controller nor command, or where its parameters need more integration steps than are reasonable.
    """
    controller = model.controller
    if controller is None and (inputs.command is None or inputs.feed_forward):
        raise ConfigurationError("the model has no controller", "give [model.controller], or a command")
    step = period or (controller.period if controller else 0.0)
    if step <= 0.0:
        raise ConfigurationError("the model has no period", "give [model.controller] period")
    count = len(inputs.reference_speed)
    table = np.zeros((len(axis_loop_kernel.INPUTS), count))
    table[0] = inputs.reference_speed
    for row, values in ((1, inputs.reference_position), (2, inputs.command), (3, inputs.disturbance)):
        if values is not None:
            table[row] = values
    rows = np.zeros((len(axis_loop_kernel.ROWS), count))
    against = (0.0, 0.0, 1.0, 0.0, *changes_at)
    curve = np.array([[0.0, 1.0], [0.0, 0.0]])
    if obstacle is not None:
        obstacle = _behind_front(model.drive, obstacle)
        against = (1.0, obstacle.position, float(obstacle.direction), obstacle.damping, *changes_at)
        curve = obstacle.penetration_curve
    first_contact = axis_loop_kernel.integrate_axis(
        _numbers(model, step),
        curve,
        _initial_state(model, inputs),
        table,
        against,
        0.0 if inputs.command is None else 1.0 if inputs.feed_forward else 2.0,
        substeps(model, step, obstacle),
        rows,
    )
    return AxisMotion(step, rows, first_contact)


def substeps(model: AxisModel, period: float, obstacle: Obstacle | None = None) -> int:
    """Return the number of integration steps per period that the fastest motion of the model needs."""
    drive, friction = model.drive, model.friction
    main = drive.load_mass - drive.front_mass
    moving = drive.total_mass - drive.front_mass if drive.is_rigid else main
    rates = [max(friction.coulomb_forward, friction.coulomb_backward, friction.static) / friction.smoothing_speed]
    rates[0] = (rates[0] + friction.viscous) / moving
    if not drive.is_rigid:
        stiffest = max(drive.stiffness, _finite(drive.end_stiffness))
        reduced = 1.0 / (1.0 / drive.motor_mass + 1.0 / main)
        rates += [math.sqrt(stiffest / reduced), max(drive.damping, drive.end_damping) / reduced]
        rates.append(drive.motor_friction / friction.smoothing_speed / drive.motor_mass)
    if drive.front_mass > 0.0:
        rates += [math.sqrt(drive.front_stiffness / drive.front_mass), drive.front_damping / drive.front_mass]
    if obstacle is not None:
        struck = drive.front_mass if drive.front_mass > 0.0 else moving
        rates.append(math.sqrt((obstacle.steepest + _finite(drive.front_stiffness)) / struck))
    if model.controller is not None and model.controller.force_lag > 0.0:
        rates.append(1.0 / model.controller.force_lag)
    return integration_steps(max(rates), period)


def integration_steps(fastest: float, period: float) -> int:
    """Return the steps per period [s] for the fastest rate [1/s] of a model; raises ConfigurationError."""
    needed = math.ceil(fastest * period / LARGEST_STEP)
    if needed > 400:  # at 1 ms a rate of 2e5 1/s: no drive oscillates at 30 kHz
        raise ConfigurationError(
            f"the model needs {needed} integration steps per {period:g} s",
            "a stiffness is too large for its mass, or friction.smoothing_speed too small: leave the stiffness out",
        )
    return max(needed, 4)  # fewer would not save time that matters


def wind_up_at(drive: ElasticDrive, force: float) -> float:
    """Return the wind-up at which the elastic drive has a static force; 0 for a rigid drive."""
    if drive.is_rigid:
        return 0.0
    if force < 0.0:
        return force / (drive.end_stiffness if math.isfinite(drive.end_stiffness) else drive.stiffness) - drive.backlash
    taken_up = drive.stiffness * drive.take_up_travel
    if force <= taken_up:
        return force / drive.stiffness
    return drive.take_up_travel + (force - taken_up) / drive.end_stiffness


def _behind_front(drive: ElasticDrive, obstacle: Obstacle) -> Obstacle:
    """Return the obstacle as the load meets it: a front without mass is a spring in series with it."""
    if drive.front_mass > 0.0 or math.isinf(drive.front_stiffness):
        return obstacle
    compliance = 1.0 / obstacle.series_stiffness + 1.0 / drive.front_stiffness
    return replace(obstacle, series_stiffness=1.0 / compliance)


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _numbers(model: AxisModel, period: float) -> tuple[float, ...]:
    drive, friction, controller = model.drive, model.friction, model.controller
    values = {name: getattr(drive, name, getattr(friction, name, 0.0)) for name in axis_loop_kernel.PARAMETER_ORDER}
    if controller is not None:
        values |= {name: getattr(controller, name) for name in values if hasattr(controller, name)}
        values["delay_samples"] = round(controller.delay / period)
    values["period"] = period
    values["load_mass"] = drive.load_mass - drive.front_mass
    values["rigid"] = float(drive.is_rigid)
    if drive.is_rigid:
        values["stiffness"] = 0.0
    values["take_up_travel"] = min(drive.take_up_travel, NEVER)
    if drive.front_mass > 0.0 and not math.isfinite(drive.front_stiffness):
        values["front_mass"], values["load_mass"] = 0.0, drive.load_mass
    return tuple(float(values[name]) for name in axis_loop_kernel.PARAMETER_ORDER)


def _initial_state(model: AxisModel, inputs: AxisInputs) -> FloatArray:
    """Return the states and the controller's integral in steady motion with the initial speed."""
    position, speed = inputs.initial_position, inputs.initial_speed
    friction = model.friction
    force = friction.offset
    if speed:
        coulomb = friction.coulomb_forward if speed > 0.0 else friction.coulomb_backward
        rise = max(friction.static - coulomb, 0.0) * math.exp(-((speed / friction.stribeck_speed) ** 2))
        force += (coulomb + rise) * math.tanh(speed / friction.smoothing_speed) + friction.viscous * speed
    motor = force + (model.drive.motor_friction * math.tanh(speed / friction.smoothing_speed) if speed else 0.0)
    motor_position = position + wind_up_at(model.drive, force)
    # The controller measures the motor: its position starts where the log's does.
    shift = position - motor_position
    load = position + shift
    return np.array([position, speed, load, speed, load, speed, motor, motor])
