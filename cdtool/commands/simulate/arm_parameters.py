"""Every number of the simulated two-link arm, and what follows from them at rest: inertias, wind-up, references.

The parameters are assumptions that reproduce the thesis's latencies: they show that such a machine is
plausible, not that it is the thesis's machine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from cdtool.base.errors import UsageError
from cdtool.recordings.units import STANDARD_GRAVITY

Array = npt.NDArray[np.float64]
Trial = Literal[1, 2]
Pair = tuple[float, float]


def require_trial(trial: int) -> None:
    """Raise UsageError for a trial other than 1 and 2."""
    if trial not in (1, 2):
        raise UsageError(f"unknown trial {trial!r}", "Choose 1 (obstacle at the arm) or 2 (plate above the forearm).")


@dataclass(frozen=True)
class ArmParameters:
    """On the joint side unless said otherwise; a pair is (arm, forearm), or (trial 1, trial 2) where that is said.

    Choices that matter: the torque ripple has a fixed phase to the encoder, as a motor's cogging has; redrawn
    in each run it would widen the forearm's normal band in trial 2 and make the momentum observer there far slower. The
    speed controller works on the logged, filtered speed. Friction factors and the obstacle's angle are normal, one
    draw per run (and joint), the factor scaling Coulomb and static friction alike. The bumper's slope changes at its
    travel without a step in force, and a contact's factor 1 + damping * penetration speed is held at 0 or above, so
    that no obstacle pulls. Link vibration grows with the arm's speed up to the nominal one, for both links.
    """

    # Links
    link_mass: Pair = (1.3, 1.6)  # the forearm with the wrist [kg]
    link_inertia: Pair = (0.012, 0.018)  # about the centre of mass [kg m2]
    centre_of_mass: Pair = (0.14, 0.18)  # from the joint along the link [m]
    arm_length: float = 0.30  # l1, shoulder to elbow [m]
    gravity: float = 9.81  # [m/s2]

    # Drives
    motor_inertia: Pair = (1.5e-5, 1.5e-5)  # at the motor [kg m2]
    transmission_ratio: Pair = (1.0 / 60.0, 1.0 / 60.0)  # n, link angle per motor angle [rad/rad]
    torque_constant: float = 0.05  # of the motors, whose torque is computed from their current [N m/A]
    soft_stiffness: float = 440.0  # up to `soft_travel` of wind-up [N m/rad]
    soft_travel: float = 0.003  # [rad]
    drive_stiffness: float = 800.0  # beyond it [N m/rad]
    drive_damping: float = 0.22  # [N m s/rad]

    # Friction and disturbances
    coulomb_friction: Pair = (2.5, 1.65)  # Fc [N m]
    static_friction: Pair = (3.0, 1.75)  # Fs [N m]
    stribeck_speed: float = 0.03  # vs [rad/s]
    viscous_friction: float = 0.4  # b [N m s/rad]
    bristle_stiffness: float = 1500.0  # sigma0 [N m/rad]
    bristle_damping: float = 2.0  # sigma1 [N m s/rad]
    friction_scatter: float = 0.05  # standard deviation of a run's friction factors [-]
    torque_ripple: float = 0.075  # amplitude [N m]
    ripple_periods: float = 12.0  # per motor revolution [-]
    ripple_phase: Pair = (0.0, 0.0)  # of each motor at its encoder's zero, the same in every run [rad]
    disturbance_torque: float = 0.042  # standard deviation of a coloured torque on each link [N m]
    disturbance_rate: float = 16.0  # its corner [rad/s]

    # Contact
    contact_position: Pair = (0.28, 0.20)  # from the joint along the link [m]
    obstacle_stiffness: float = 3e4  # load cell 5e5 N/m in series with the link's skin and bending, 3.2e4 N/m [N/m]
    obstacle_damping: float = 0.8  # factor 1 + this * speed [s/m]
    bumper_stiffness: float = 300.0  # up to its travel [N/m]
    bumper_travel: float = 7.5e-3  # where it bottoms out [m]
    bumper_bottom_stiffness: float = 3e4  # [N/m]
    bumper_damping: float = 1.4  # factor 1 + this * speed [s/m]
    obstacle_angle: Pair = (math.radians(62.0), math.radians(72.5))  # the arm's angle at the touch, trial 1, 2 [rad]
    obstacle_scatter: float = math.radians(0.5)  # standard deviation from run to run [rad]

    # Motion and controllers
    start_angle: float = math.radians(45.0)  # of the arm [rad]
    forearm_angle: Pair = (math.radians(90.0), 0.0)  # held, trial 1, 2 [rad]
    nominal_speed: float = math.radians(16.0)  # of the arm [rad/s]
    ramp_acceleration: float = 1.0  # [rad/s2]
    start_time: float = 0.3  # standstill before the ramp [s]
    position_gain: float = 5.7  # [1/s]
    speed_gain: float = 4.4  # [N m s/rad]
    integral_gain: float = 50.0  # [N m/rad]
    anti_windup_rate: float = 10.0  # back-calculation [1/s]
    torque_limit: float = 20.0  # [N m]
    torque_lag: float = 2e-3  # [s]

    # Sensors
    sample_period: float = 1e-3  # of control and log [s]
    encoder_counts: int = 2000  # per motor revolution; 0 = ideal
    speed_filter_frequency: float = 17.0  # corner of each of two first-order low-passes [Hz]
    torque_noise: float = 0.1  # white, before the low-pass [N m rms]
    torque_filter_time: float = 4e-3  # [s]
    imu_position: Pair = (0.22, 0.20)  # from the joint along the link [m]
    vibration_frequency: float = 30.0  # of the links under the sensors [Hz]
    vibration_damping: float = 0.05  # [-]
    vibration_acceleration: float = 0.1  # while the arm moves [m/s2 rms]
    imu_noise: float = 0.12  # white [m/s2 rms]
    imu_bias: float = 0.02  # the same in every run: one sensor, one bias [m/s2]
    imu_frequency: float = 78.0  # second-order low-pass [Hz]
    imu_damping: float = 0.8  # [-]
    imu_resolution: float = STANDARD_GRAVITY / 4096.0  # [m/s2]
    load_cell_noise: float = 0.1  # [N rms]

    # Log, trial 1 and 2
    free_duration: Pair = (2.0, 2.9)  # impact-free stroke: it covers every obstacle position with room [s]
    impact_duration: Pair = (1.85, 2.8)  # ends about 0.4 and 0.7 s after contact: the bumper is slow in trial 2 [s]

    @property
    def reflected_inertia(self) -> Pair:
        """Motor inertia on the joint side, J_a / n^2 [kg m2]."""
        (first, second), (n1, n2) = self.motor_inertia, self.transmission_ratio
        return first / n1**2, second / n2**2

    @property
    def arm_inertia(self) -> float:
        """M11 = m1 lG1^2 + J1 + m2 l1^2, without the motor [kg m2]."""
        own = self.link_mass[0] * self.centre_of_mass[0] ** 2 + self.link_inertia[0]
        return own + self.link_mass[1] * self.arm_length**2

    @property
    def forearm_inertia(self) -> float:
        """M22 = m2 lG2^2 + J2, without the motor [kg m2]."""
        return self.link_mass[1] * self.centre_of_mass[1] ** 2 + self.link_inertia[1]

    @property
    def coupling_inertia(self) -> float:
        """The amplitude h = m2 l1 lG2 of the coupling h cos(q2 - q1) [kg m2]."""
        return self.link_mass[1] * self.arm_length * self.centre_of_mass[1]

    @property
    def gravity_torque(self) -> Pair:
        """Gravity's torque on the level link, (m2 l1 + m1 lG1) g and m2 lG2 g [N m]."""
        arm = self.link_mass[1] * self.arm_length + self.link_mass[0] * self.centre_of_mass[0]
        return arm * self.gravity, self.link_mass[1] * self.centre_of_mass[1] * self.gravity

    @property
    def encoder_step(self) -> Pair:
        """One count of the encoders on the joint side [rad]; 0 = ideal."""
        turn = 2.0 * math.pi / self.encoder_counts if self.encoder_counts else 0.0
        return turn * self.transmission_ratio[0], turn * self.transmission_ratio[1]

    def wind_up(self, torque: float) -> float:
        """Static wind-up of a drive that carries `torque` [N m]: motor minus link, on the joint side [rad]."""
        soft = self.soft_stiffness * self.soft_travel
        beyond = max(abs(torque) - soft, 0.0)
        return math.copysign((abs(torque) - beyond) / self.soft_stiffness + beyond / self.drive_stiffness, torque)

    def obstacle(self, trial: Trial, angle: float) -> float:
        """What is touched with the arm at `angle` [rad]: that angle in trial 1, the plate's height [m] in trial 2."""
        if trial == 1:
            return angle
        return self.arm_length * math.sin(angle) + self.contact_position[1] * math.sin(self.forearm_angle[1])

    def equilibrium(self, trial: Trial) -> Array:
        """The state (6, 2) at rest at the start of a trial: the drives wound up by gravity, the bristles relaxed."""
        state = np.zeros((6, 2))
        for joint, angle in enumerate((self.start_angle, self.forearm_angle[trial - 1])):
            torque = self.gravity_torque[joint] * math.cos(angle)
            state[[0, 2, 5], joint] = angle + self.wind_up(torque), angle, torque
        return state

    def reference(self, trial: Trial, time: Array) -> tuple[Array, Array]:
        """Reference position [rad] and speed [rad/s] of both motors, (2, n) on the joint side.

        The arm ramps to nominal speed after `start_time`; the forearm holds its angle.
        """
        since = np.maximum(time - self.start_time, 0.0)
        ramp = self.nominal_speed / self.ramp_acceleration
        speed = np.zeros((2, time.size))
        speed[0] = self.ramp_acceleration * np.minimum(since, ramp)
        travel = self.ramp_acceleration * np.minimum(since, ramp) * (since - 0.5 * np.minimum(since, ramp))
        position = np.repeat(self.equilibrium(trial)[0][:, np.newaxis], time.size, axis=1)
        position[0] += travel
        return position, speed
