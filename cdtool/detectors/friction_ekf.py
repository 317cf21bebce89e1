"""Friction-estimating extended Kalman filter (FEEKF): a contact seen as a sudden virtual friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.clock import previous_value
from cdtool.clock.lost import lost_samples
from cdtool.detection import Signal, Status, StatusArray
from cdtool.detectors.base import (
    drive_of,
    for_every_joint,
    gain,
    hold_last,
    of_joint,
    require_positive,
    single,
)
from cdtool.detectors.filters import unsettled
from cdtool.detectors.friction_ekf_arm_kernel import AngleVariances, Link, run_arm_filter
from cdtool.detectors.friction_ekf_kernel import Bounds, Samples, Variances, run_filter
from cdtool.detectors.look import RED, Look
from cdtool.dynamics import Gain, JointEquation, Machine
from cdtool.kernels import read_only
from cdtool.recording import FloatArray, Recording

# The filter starts with the uncertainty of the friction that its drift gathers in this time [s].
_INITIAL_DRIFT_TIME = 10.0
# An accelerometer that has been silent for longer than this leaves the estimate without its fast input [s].
_ACCELERATION_HOLD = 0.05
# A speed that falls below the minimum for no longer than this is a glitch, not a stop: no new start-up [s].
_GLITCH = 0.02
# The covariance has grown over a gap: what comes behind it moves the estimate at once, for at most this time [s].
_LONGEST_UNSETTLED = 0.01


@dataclass(frozen=True)
class Motion:
    """What is measured of one joint: `speed` and `position` (n,) at `time`, NaN = no sample, `acceleration` at its own.

    `missing` (n,): any input has no sample.
    """

    time: FloatArray
    speed: FloatArray
    position: FloatArray
    missing: StatusArray
    acceleration_time: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True)
class FrictionEkf:
    """Virtual viscous friction d from m a = F - d v, state x = (d, a, v), measured (a, v) (thesis 5.5-5.8 corrected).

    A planar arm's joint has its angle as a fourth state, measured too (6.34-6.44 corrected); for a joint of another
    robot the other joints' coupling is a known input. Needs: torque, speed, acceleration (and position, where joints
    are coupled). Unit: N s/m (linear) or N m s/rad (rotary), positive where something opposes the
    motion. Load-side units, sequential scalar updates in Joseph form, no matrix inverse. Not applicable below
    `minimum_speed`: there the friction cannot be observed; after re-entry it is starting up until the integral of its
    bandwidth over time reaches 3. Its bandwidth falls in proportion to the speed. After the speed changes sign the
    estimate's sign is wrong: only the first crossing counts.
    """

    sigma_acceleration: Gain = gain(0.1, "m/s2", "noise of the accelerometer, structure included (standard deviation)")
    sigma_speed: Gain = gain(3.5e-3, "m/s", "noise of the speed (standard deviation)")
    friction_drift: Gain = gain(220.0, "N s/m per sqrt(s)", "how fast the friction may change: the square is q_d")
    drift_acceleration: Gain = gain(9e-3, "m/s2 per sample", "unmodelled force over mass (standard deviation)")
    drift_speed: Gain = gain(1e-4, "m/s per sample", "unmodelled speed (standard deviation)")
    sigma_position: Gain = gain(1e-3, "rad", "noise of the angle (standard deviation); planar arm")
    drift_position: Gain = gain(1e-4, "rad per sample", "unmodelled angle (standard deviation); planar arm")
    minimum_speed: Gain = gain(0.03, "m/s", "below it the filter is not applicable; 15 % of the nominal speed")

    name: ClassVar[str] = "friction_ekf"
    short_name: ClassVar[str] = "feekf"
    title: ClassVar[str] = "Friction-estimating EKF"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed", "acceleration")
    signed: ClassVar[bool] = False
    contact_torque: ClassVar[bool] = False
    look: ClassVar[Look] = Look(RED, "o")

    def __post_init__(self) -> None:
        require_positive(
            self,
            "sigma_acceleration",
            "sigma_speed",
            "friction_drift",
            "drift_acceleration",
            "drift_speed",
            "sigma_position",
            "drift_position",
            "minimum_speed",
        )

    def unit(self, machine: Machine) -> str:
        """N s/m or N m s/rad."""
        return f"{machine.force_unit} s/{machine.load_units['position']}"

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Virtual friction (n, J) on the speed's clock; raises RecordingError where a channel is absent."""
        drive = drive_of(self, recording, machine)
        acceleration = recording["acceleration"]
        others = previous_value(acceleration, drive.time)
        lost = ~np.isfinite(others)
        equations = machine.joint_equations(drive.torque, drive.position, drive.speed, hold_last(others, lost))
        measured = np.where(drive.speed_missing, np.nan, drive.speed)
        missing = drive.missing | for_every_joint(lost) if machine.coupled else drive.missing
        friction = np.zeros(measured.shape)
        status = np.zeros(measured.shape, dtype=np.uint8)
        for j, equation in enumerate(equations):
            motion = Motion(
                drive.time,
                np.ascontiguousarray(measured[:, j]),
                np.where(drive.speed_missing[:, j], np.nan, drive.position[:, j]),
                np.ascontiguousarray(missing[:, j]).view(np.uint8),
                acceleration.time,
                np.ascontiguousarray(acceleration.values[:, j]),
            )
            friction[:, j], status[:, j] = of_joint(self, j, len(equations)).estimate(motion, equation)
        late = lost_samples(recording, ("acceleration",), drive.time)
        lost = drive.missing if late is None else drive.missing | late
        behind = unsettled(drive.time, for_every_joint(lost) if machine.coupled else lost, _LONGEST_UNSETTLED)
        status[behind & (status == Status.VALID)] = Status.GAP
        return Signal(drive.time, friction, status, self.unit(machine), self.signed)

    def estimate(self, motion: Motion, equation: JointEquation) -> tuple[FloatArray, StatusArray]:
        """One joint: friction (n,) and status (n,); every accelerometer sample is used once, at its own time."""
        friction = np.zeros(len(motion.time))
        status = np.zeros(len(motion.time), dtype=np.uint8)
        samples = Samples(
            read_only(motion.time),
            read_only(equation.force),
            read_only(motion.speed),
            read_only(motion.missing),
            read_only(motion.acceleration_time),
            read_only(motion.acceleration),
        )
        drift = single(self.friction_drift) ** 2
        variances = Variances(
            q_d=drift,
            q_a=single(self.drift_acceleration) ** 2,
            q_v=single(self.drift_speed) ** 2,
            r_a=single(self.sigma_acceleration) ** 2,
            r_v=single(self.sigma_speed) ** 2,
            initial=drift * _INITIAL_DRIFT_TIME,
        )
        bounds = Bounds(single(self.minimum_speed), _ACCELERATION_HOLD, _GLITCH)
        pendulum = equation.pendulum
        if pendulum is None:
            inertia = np.ascontiguousarray(equation.inertia)
            run_filter(samples, inertia, equation.viscous, variances, bounds, friction, status)
            return friction, status
        link = Link(
            read_only(motion.position),
            read_only(pendulum.other_position),
            read_only(pendulum.other_speed),
            read_only(pendulum.other_acceleration),
            inertia=float(equation.inertia[0]),
            viscous=float(equation.viscous),
            gravity=float(pendulum.gravity),
            coupling=float(pendulum.coupling),
        )
        angle = AngleVariances(q_q=single(self.drift_position) ** 2, r_q=single(self.sigma_position) ** 2)
        run_arm_filter(samples, link, variances, angle, bounds, friction, status)
        return friction, status

    def steady_state(self, inertia: float, speed: float, friction: float, period: float) -> tuple[FloatArray, float]:
        """Estimator poles [rad/s], slowest first, and predicted variance of d in the steady state at a constant speed.

        From the discrete algebraic Riccati equation with F, Q and R frozen; raises nothing for speed > 0.
        """
        from scipy.linalg import solve_discrete_are

        transition = np.array(
            [[1.0, 0.0, 0.0], [-speed / inertia, 0.0, -friction / inertia], [0.0, period, 1.0]],
            dtype=np.float64,
        )
        observation = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        process = np.diag(
            [
                single(self.friction_drift) ** 2 * period,
                single(self.drift_acceleration) ** 2,
                single(self.drift_speed) ** 2,
            ]
        )
        noise = np.diag([single(self.sigma_acceleration) ** 2, single(self.sigma_speed) ** 2])
        covariance = solve_discrete_are(transition.T, observation.T, process, noise)
        innovation = observation @ covariance @ observation.T + noise
        kalman_gain = covariance @ observation.T @ np.linalg.inv(innovation)
        closed = (np.eye(3) - kalman_gain @ observation) @ transition
        eigenvalues = np.linalg.eigvals(closed)
        poles = np.sort(np.abs(np.log(np.maximum(np.abs(eigenvalues), math.exp(-700.0)) + 0j)) / period)
        return np.asarray(poles.real, dtype=np.float64), float(covariance[0, 0])
