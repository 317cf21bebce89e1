"""Friction-estimating extended Kalman filter (FEEKF): a contact seen as a sudden virtual friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.clock import GAP_PERIODS, previous_value
from cdtool.clock.coarse import recent_medians
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
from cdtool.detectors.friction_ekf_arm_kernel import run_arm_filter
from cdtool.detectors.friction_ekf_kernel import run_filter
from cdtool.detectors.look import RED, Look
from cdtool.dynamics import Gain, JointEquation, Machine
from cdtool.recording import BoolArray, FloatArray, Recording

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
        unsettled = _unsettled(drive.time, for_every_joint(lost) if machine.coupled else lost)
        status[unsettled & (status == Status.VALID)] = Status.GAP
        return Signal(drive.time, friction, status, self.unit(machine), self.signed)

    def estimate(self, motion: Motion, equation: JointEquation) -> tuple[FloatArray, StatusArray]:
        """One joint: friction (n,) and status (n,); every accelerometer sample is used once, at its own time."""
        friction = np.zeros(len(motion.time))
        status = np.zeros(len(motion.time), dtype=np.uint8)
        process = tuple(single(x) ** 2 for x in (self.friction_drift, self.drift_acceleration, self.drift_speed))
        noise = (single(self.sigma_acceleration) ** 2, single(self.sigma_speed) ** 2)
        limits = (process[0] * _INITIAL_DRIFT_TIME, single(self.minimum_speed), _ACCELERATION_HOLD, _GLITCH)
        sensor = (motion.missing, motion.acceleration_time, motion.acceleration)
        force = np.ascontiguousarray(equation.force)
        link = equation.pendulum
        if link is None:
            body = (np.ascontiguousarray(equation.inertia), equation.viscous)
            run_filter(motion.time, force, motion.speed, *sensor, *body, *process, *noise, *limits, friction, status)
        else:
            run_arm_filter(
                motion.time,
                force,
                motion.speed,
                motion.position,
                link.other_position,
                link.other_speed,
                link.other_acceleration,
                *sensor,
                float(equation.inertia[0]),
                equation.viscous,
                link.gravity,
                link.coupling,
                *process,
                single(self.drift_position) ** 2,
                *noise,
                single(self.sigma_position) ** 2,
                *limits,
                friction,
                status,
            )
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


def _unsettled(time: FloatArray, lost: BoolArray) -> BoolArray:
    """Where the estimate jumps behind a gap (n, J): for as long as the gap was, at most 10 ms.

    A gap is a step of more than 2.5 usual ones between samples that were not `lost` (n, J): two lost ones or more.
    """
    unsettled = np.zeros(lost.shape, dtype=bool)
    if len(time) < 3:
        return unsettled
    steps = np.diff(time)
    usual = np.concatenate((steps[:1], steps[:1], recent_medians(steps, float(steps[0]))[:-1]))
    for j in range(lost.shape[1]):
        known = np.where(lost[:, j], np.nan, time)
        # How long before each sample the last one was that was not lost.
        since = time - np.fmax.accumulate(np.concatenate(([time[0]], known[:-1])))
        ends = time + np.minimum(since - usual, _LONGEST_UNSETTLED)
        behind = (since > GAP_PERIODS * usual) & ~lost[:, j]
        unsettled[:, j] = time < np.maximum.accumulate(np.where(behind, ends, -np.inf)) - 0.5 * usual
    return unsettled
