"""A heavy sliding gate that runs against an obstacle: parameters, and a run's measured channels and truth.

A motor drives a leaf with an elastic front post through a rack with lost motion; a speed loop commands a
slew-limited torque. The parameters are assumptions that reproduce the thesis's latencies: they show
that such a machine is plausible, not that it is the thesis's machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.base.errors import UsageError
from cdtool.commands.simulate import gate_kernel, sensors
from cdtool.recordings.units import STANDARD_GRAVITY

Array = npt.NDArray[np.float64]
Impact = Literal["none", "stiff", "soft"]
Friction = Callable[[Array], Array]


@dataclass(frozen=True)
class GateParameters:
    """Every number of the gate, on the load side (linear SI units); motor_mass = motor_inertia / r^2."""

    # Masses and transmission
    leaf_mass: float = 620.0  # whole leaf with its front post [kg]
    post_mass: float = 60.0  # front post, part of the leaf's mass [kg]
    motor_inertia: float = 9.5e-4  # [kg m2]
    transmission_ratio: float = 1.333e-3  # r, leaf travel per motor angle [m/rad]

    # Drive: rack, pinion and motor foot, with backlash on the back flank
    take_up_stiffness: float = 8e4  # k1, over the first `take_up_travel` of wind-up [N/m]
    take_up_travel: float = 5e-3  # g [m]
    take_up_damping: float = 150.0  # c1 [N s/m]
    drive_stiffness: float = 1.2e6  # k2, after the take-up and on the back flank [N/m]
    drive_damping: float = 1500.0  # c2 [N s/m]
    backlash: float = 1.5e-3  # b [m]

    # Friction and disturbances
    motor_friction: float = 20.0  # [N]
    coulomb_friction: float = 150.0  # Fc0 [N]
    static_friction: float = 190.0  # Fs [N]
    stribeck_speed: float = 0.02  # vs [m/s]
    viscous_friction: float = 150.0  # bv [N s/m]
    friction_waviness: float = 0.065  # A, along the track [-]
    friction_waves: tuple[tuple[float, float, float], ...] = (
        (0.37, 0.7, 1.0),
        (0.93, 2.1, 0.6),
        (0.11, 0.0, 0.3),
    )
    # (length [m], phase [rad], weight [-]) of each wave of the Coulomb friction along the track
    friction_scatter: float = 0.03  # standard deviation of the run's friction factor [-]
    friction_smoothing_speed: float = 1e-3  # the sign of a speed is tanh(v / this) [m/s]
    disturbance_force: float = 15.0  # F_r, standard deviation of a coloured force on the leaf [N]
    disturbance_rate: float = 60.0  # its corner [rad/s]
    cogging_force: float = 30.0  # amplitude [N]
    cogging_periods: float = 36.0  # per motor revolution [-]

    # Front post, load cell and bumper
    post_stiffness: float = 1.15e6  # ks [N/m]
    post_damping: float = 1200.0  # cs [N s/m]
    load_cell_stiffness: float = 5e5  # K [N/m]
    load_cell_damping: float = 0.5  # factor 1 + this * speed [s/m]
    bumper_stiffness: float = 2.2e4  # kb, up to the buckling travel [N/m]
    bumper_buckling_travel: float = 11.5e-3  # x1 [m]
    bumper_buckled_stiffness: float = 500.0  # kb2, of the buckled hollow profile [N/m]
    bumper_bottom_travel: float = 60e-3  # x_bot, where it bottoms out [m]
    bumper_bottom_stiffness: float = 5e5  # [N/m]
    bumper_damping: float = 0.5  # db, factor 1 + this * speed [s/m]
    obstacle_position: float = 1.0  # [m]
    obstacle_scatter: float = 0.02  # standard deviation from run to run [m]

    # Speed loop
    speed_gain: float = 4300.0  # Kp [N s/m]
    integral_gain: float = 8000.0  # Ki [N/m]
    anti_windup_rate: float = 10.0  # back-calculation [1/s]
    force_slew_limit: float = 800.0  # of the torque reference [N/s]
    force_limit: float = 1200.0  # [N]
    current_lag: float = 2e-3  # [s]
    nominal_speed: float = 0.2  # [m/s]
    ramp_acceleration: float = 0.2  # [m/s2]
    start_time: float = 0.3  # standstill before the ramp [s]

    # Sensors
    sample_period: float = 1e-3  # of control and log [s]
    resolver_counts: int = 4096  # per revolution (12 bit); 0 = ideal
    speed_filter_frequency: float = 60.0  # corner of each of two first-order low-passes [Hz]
    torque_noise: float = 60.0  # white, before the low-pass [N rms]
    torque_filter_time: float = 10e-3  # [s]
    panel_frequency: float = 18.0  # local mode under the accelerometer [Hz]
    panel_damping: float = 0.06  # [-]
    panel_acceleration: float = 0.16  # at nominal speed [m/s2 rms]
    accelerometer_noise: float = 0.04  # white [m/s2 rms]
    accelerometer_bias: float = 0.03  # the same in every run: one sensor, one bias [m/s2]
    accelerometer_frequency: float = 25.0  # second-order low-pass [Hz]
    accelerometer_damping: float = 0.8  # [-]
    accelerometer_resolution: float = STANDARD_GRAVITY / 4096.0  # [m/s2]
    load_cell_noise: float = 3.0  # [N rms]

    # Log
    free_duration: float = 8.2  # impact-free stroke, 1.44 m: it covers every obstacle position with room [s]
    impact_duration: float = 7.2  # ends about 1.2 s after contact [s]

    @property
    def motor_mass(self) -> float:
        """Motor inertia on the load side, J_m / r^2 [kg]."""
        return self.motor_inertia / self.transmission_ratio**2

    @property
    def leaf_main_mass(self) -> float:
        """The leaf without its front post [kg]; the accelerometer sits here."""
        return self.leaf_mass - self.post_mass

    @property
    def resolver_step(self) -> float:
        """One count of the resolver on the load side [m]; 0 = ideal."""
        return 2.0 * math.pi / self.resolver_counts * self.transmission_ratio if self.resolver_counts else 0.0

    def reference_speed(self, time: Array) -> Array:
        """The stroke's speed reference on the load side [m/s]: a ramp from `start_time` to nominal speed."""
        return np.clip(self.ramp_acceleration * (time - self.start_time), 0.0, self.nominal_speed)


@dataclass(frozen=True)
class GateRun:
    """One stroke at the log rate; the last six fields are the simulator's truth."""

    time: Array  # [s]
    motor_torque: Array  # from the motor current [N m]
    motor_speed: Array  # from the resolver, filtered [rad/s]
    motor_position: Array  # resolver, quantised [rad]
    acceleration: Array  # sensor on the leaf, along the travel [m/s2]
    reference_speed: Array  # of the motor [rad/s]
    reference_torque: Array  # output of the speed controller after slew and limit [N m]
    load_cell: Array  # [N]
    contact_start: float | None  # instant of first touch [s]; None without one
    contact_force: Array  # what the gate exerts on the obstacle [N]
    leaf_position: Array  # [m]
    leaf_speed: Array  # [m/s]
    motor_force: Array  # of the current loop, on the load side [N]
    bumper_compression: Array  # [m]; zero without a bumper


def simulate_gate_run(
    parameters: GateParameters,
    rng: np.random.Generator,
    impact: Impact,
    substeps: int = 5,
    added_friction: Friction | None = None,
) -> GateRun:
    """Simulate one stroke from rest, free or against a stiff or soft (bumper) obstacle.

    All random numbers are drawn before the integration, sample by sample: the same seed gives the same run up
    to the contact whatever `impact` is, and the same noise whatever `substeps` (of a log period) is. A free
    stroke keeps nominal speed to the end of its log. `added_friction`: a force on the leaf against its travel [N], of
    the log's time [s]. Raises `UsageError` for unknown `impact`, `substeps` < 1.
    """
    if impact not in gate_kernel.CONTACT_KINDS:
        raise UsageError(f"unknown impact {impact!r}", "Choose one of: none, stiff, soft.")
    if substeps < 1:
        raise UsageError(f"substeps is {substeps}", "A log period needs at least one integration step.")
    duration = parameters.free_duration if impact == "none" else parameters.impact_duration
    period = parameters.sample_period
    time = np.arange(round(duration / period), dtype=np.float64) * period
    friction, obstacle = rng.standard_normal(2)
    run = (
        1.0 + parameters.friction_scatter * friction,
        rng.uniform(0.0, 2.0 * math.pi),
        parameters.obstacle_position + parameters.obstacle_scatter * obstacle,
    )
    noise = rng.standard_normal((time.size, 5))
    reference_speed = parameters.reference_speed(time)
    disturbance = sensors.coloured_noise(noise[:, 0], parameters.disturbance_force, parameters.disturbance_rate, period)
    if added_friction is not None:
        disturbance -= added_friction(time)
    truth, first_contact = integrate_gate(parameters, np.zeros(7), reference_speed, disturbance, run, impact, substeps)
    return _measure(parameters, time, reference_speed, truth, noise, first_contact)


def integrate_gate(
    parameters: GateParameters,
    initial_state: Array,
    reference_speed: Array,
    disturbance: Array,
    run: tuple[float, float, float],
    impact: Impact,
    substeps: int,
) -> tuple[dict[str, Array], float]:
    """The true motion by name (`gate_kernel.ROWS`) and the instant of first contact [s], NaN without one.

    `initial_state` (7,) is in the order of `ROWS`; `reference_speed` [m/s] and `disturbance` [N] hold one value
    per sample; `run` holds the run's friction factor [-], cogging phase [rad] and obstacle position [m].
    """
    log = np.zeros((len(gate_kernel.ROWS), reference_speed.size))
    numbers = gate_kernel.Numbers(*(float(getattr(parameters, name)) for name in gate_kernel.Numbers._fields))
    waves = np.array(parameters.friction_waves, dtype=np.float64).reshape(-1, 3)
    kind = gate_kernel.CONTACT_KINDS[impact]
    first_contact = gate_kernel.integrate_gate(
        numbers, waves, initial_state, reference_speed, disturbance, run, kind, substeps, log
    )
    return dict(zip(gate_kernel.ROWS, log, strict=True)), first_contact


def _measure(
    parameters: GateParameters,
    time: Array,
    reference_speed: Array,
    truth: dict[str, Array],
    noise: Array,
    first_contact: float,
) -> GateRun:
    """Return what sensors and drive log; column 0 of `noise` was the disturbance."""
    ratio, period = parameters.transmission_ratio, parameters.sample_period
    panel = sensors.resonance(
        noise[:, 2],
        parameters.panel_acceleration,
        parameters.panel_frequency,
        parameters.panel_damping,
        period,
    )
    force = sensors.measured_torque(
        truth["motor_force"], noise[:, 1], parameters.torque_noise, parameters.torque_filter_time, period
    )
    sensor = sensors.Accelerometer(
        noise=parameters.accelerometer_noise,
        bias=parameters.accelerometer_bias,
        frequency=parameters.accelerometer_frequency,
        damping=parameters.accelerometer_damping,
        resolution=parameters.accelerometer_resolution,
        period=period,
    )
    vibration = panel * np.abs(truth["leaf_speed"]) / parameters.nominal_speed
    acceleration = sensor.reading(truth["leaf_acceleration"], vibration, noise[:, 3])
    return GateRun(
        time=time,
        motor_torque=force * ratio,
        motor_speed=truth["measured_speed"] / ratio,
        motor_position=truth["measured_position"] / ratio,
        acceleration=acceleration,
        reference_speed=reference_speed / ratio,
        reference_torque=truth["reference_force"] * ratio,
        load_cell=truth["contact_force"] + parameters.load_cell_noise * noise[:, 4],
        contact_start=None if math.isnan(first_contact) else first_contact,
        contact_force=truth["contact_force"],
        leaf_position=truth["leaf_position"],
        leaf_speed=truth["leaf_speed"],
        motor_force=truth["motor_force"],
        bumper_compression=truth["bumper_compression"],
    )
