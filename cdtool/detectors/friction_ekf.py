"""Friction-estimating extended Kalman filter (FEEKF): a contact appears as a sudden virtual friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import read_only
from cdtool.detectors.base import (
    drive_of,
    for_every_joint,
    gain,
    held_on,
    of_joint,
    require_positive,
    single,
)
from cdtool.detectors.detection import Signal, Status, StatusArray
from cdtool.detectors.filters import unsettled
from cdtool.detectors.friction_ekf_kernel import Bounds, Samples, Variances, run_filter
from cdtool.detectors.look import RUST, Look
from cdtool.machines.dynamics import Gain, JointEquation, Machine
from cdtool.recordings.clock.lost_samples import lost_samples
from cdtool.recordings.recording import Recording

# The filter starts with the uncertainty of the friction that its drift gathers in this time [s].
_INITIAL_DRIFT_TIME = 10.0
# After a longer silence of the accelerometer the estimate has no fast input [s].
_ACCELERATION_HOLD = 0.05
# A speed that falls below the minimum for no longer than this is a glitch, not a stop: no new start-up [s].
_GLITCH = 0.02
# The covariance has grown over a gap: the samples after it move the estimate at once, for at most this time [s].
_LONGEST_UNSETTLED = 0.01


@dataclass(frozen=True)
class FrictionEkf:
    """Virtual viscous friction d of m a = F - d v, estimated with the state (d, a, v) from measured a and v.

    Parameters
    ----------
    sigma_acceleration : float or tuple of float
        Standard deviation of the noise of the accelerometer, vibration of the structure included [m/s2].
    sigma_speed : float or tuple of float
        Standard deviation of the noise of the speed [m/s].
    friction_drift : float or tuple of float
        How fast the friction may change [N s/m per sqrt(s)]; its square is q_d.
    drift_acceleration : float or tuple of float
        Standard deviation of the unmodelled force divided by the mass [m/s2 per sample].
    drift_speed : float or tuple of float
        Standard deviation of the unmodelled speed [m/s per sample].
    sigma_position : float or tuple of float
        Planar arm only: standard deviation of the noise of the angle [rad].
    drift_position : float or tuple of float
        Planar arm only: standard deviation of the unmodelled angle [rad per sample].
    minimum_speed : float or tuple of float
        Speed below which the filter is not applicable [m/s]; 15 % of the nominal speed is usual.

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Thesis 5.1 to 5.8 in the corrected form (docs/errata.md), on the load side. Prediction, all three from the old
    state:

        d_{k+1} = d_k,   a_{k+1} = (F_k - d_k v_k) / m,   v_{k+1} = v_k + T a_k

    with Q = diag(q_d T, q_a, q_v); then one scalar update in Joseph form per measurement, each accelerometer sample at
    its own time. No matrix is inverted. A joint of a planar arm has its measured angle as a fourth state (6.34 to 6.44
    corrected); for a joint of another robot the coupling with the other joints is a known input.

    * Needs: torque, speed, acceleration; position if joints are coupled.
    * Unit: N s/m (linear axis) or N m s/rad (rotary axis), positive if something opposes the motion.
    * Not applicable: below `minimum_speed`, where the friction is unobservable. Above it again, the status is start-up
      until the integral of the bandwidth over time reaches 3.
    * Fails: the bandwidth falls in proportion to the speed. After the speed changes sign, as in a rebound, the estimate
      has the wrong sign: only the first crossing of a limit counts.

    Examples
    --------
    A drive force of 30 N at 0.2 m/s is a friction of 150 N s/m; an obstacle that takes another 60 N makes it 450 N s/m.

    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> time = np.arange(2001) * 1e-3
    >>> torque, speed = Series(time, np.where(time < 1.0, 30.0, 90.0), "N"), Series(time, np.full(2001, 0.2), "m/s")
    >>> steady = Series(time, np.zeros(2001), "m/s2")
    >>> run = Recording("run", "", ("axis",), {"torque": torque, "speed": speed, "acceleration": steady})
    >>> friction = FrictionEkf().signal(run, axis)
    >>> friction.values[[999, 2000], 0].round().tolist(), friction.unit
    ([150.0, 450.0], 'N s/m')
    """

    sigma_acceleration: Gain = gain(0.1, "m/s2", "noise of the accelerometer, structure included (standard deviation)")
    sigma_speed: Gain = gain(3.5e-3, "m/s", "noise of the speed (standard deviation)", searched=False)
    friction_drift: Gain = gain(220.0, "N s/m per sqrt(s)", "how fast the friction may change: the square is q_d")
    drift_acceleration: Gain = gain(
        9e-3, "m/s2 per sample", "unmodelled force over mass (standard deviation)", searched=False
    )
    drift_speed: Gain = gain(1e-4, "m/s per sample", "unmodelled speed (standard deviation)", searched=False)
    sigma_position: Gain = gain(1e-3, "rad", "noise of the angle (standard deviation); planar arm", searched=False)
    drift_position: Gain = gain(
        1e-4, "rad per sample", "unmodelled angle (standard deviation); planar arm", searched=False
    )
    minimum_speed: Gain = gain(
        0.03, "m/s", "below it the filter is not applicable; 15 % of the nominal speed", searched=False
    )

    name: ClassVar[str] = "friction_ekf"
    short_name: ClassVar[str] = "feekf"
    title: ClassVar[str] = "Friction-estimating EKF"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed", "acceleration")
    signed: ClassVar[bool] = False
    contact_torque: ClassVar[bool] = False
    look: ClassVar[Look] = Look(RUST, "o")

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
        """Return "N s/m" or "N m s/rad"."""
        return f"{machine.force_unit} s/{machine.load_units['position']}"

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the virtual friction (n, J) on the speed's clock; see `Detector.signal`."""
        drive = drive_of(self, recording, machine)
        acceleration = recording["acceleration"]
        others, lost = held_on(drive.time, acceleration)
        equations = machine.joint_equations(drive.torque, drive.position, drive.speed, others)
        missing = drive.missing | for_every_joint(lost) if machine.coupled else drive.missing
        unknown = drive.motion_missing
        speed, position = (
            np.where(unknown, np.nan, item) if unknown.any() else item for item in (drive.speed, drive.position)
        )
        # Joint by joint in memory, as the filter reads and writes it.
        inputs = (np.ascontiguousarray(item.T) for item in (speed, missing, acceleration.values))
        friction = np.empty(speed.shape[::-1])
        status = np.empty(friction.shape, dtype=np.uint8)
        for j, (equation, *own) in enumerate(zip(equations, *inputs, strict=True)):
            own_speed, own_missing, own_acceleration = own
            samples = Samples(
                read_only(drive.time),
                read_only(equation.force),
                read_only(own_speed),
                read_only(own_missing.view(np.uint8)),
                read_only(acceleration.time),
                read_only(own_acceleration),
            )
            friction[j], status[j] = of_joint(self, j, len(equations)).estimate(samples, equation, position[:, j])
        friction, status = np.ascontiguousarray(friction.T), np.ascontiguousarray(status.T)
        late = lost_samples(recording, ("acceleration",), drive.time)
        late_or_lost = drive.missing if late is None else drive.missing | late
        if machine.coupled:
            late_or_lost = for_every_joint(late_or_lost)
        behind = unsettled(drive.time, late_or_lost, _LONGEST_UNSETTLED)
        status[behind & (status == Status.VALID)] = Status.GAP
        return Signal(drive.time, friction, status, self.unit(machine), self.signed)

    def estimate(
        self, samples: Samples, equation: JointEquation, position: FloatArray
    ) -> tuple[FloatArray, StatusArray]:
        """Return friction and status (n,) of one joint; each accelerometer sample is used once, at its own time.

        `position` (n,), NaN where there is no sample: of a planar arm, whose angle is a state.
        """
        friction = np.zeros(len(samples.time))
        status = np.zeros(len(samples.time), dtype=np.uint8)
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
        from cdtool.detectors.friction_ekf_arm_kernel import AngleVariances, Link, run_arm_filter

        link = Link(
            read_only(position),
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
        """Return the poles of the estimator and the predicted variance of d in the steady state at constant speed.

        Parameters
        ----------
        inertia : float
            m, load and reflected motor [kg, kg m2].
        speed : float
            Constant speed, not 0: there the friction is unobservable [m/s, rad/s].
        friction : float
            d [N s/m, N m s/rad].
        period : float
            Uniform sample period [s].

        Returns
        -------
        poles : ndarray of float, shape (3,)
            Magnitudes of the poles [rad/s], the slowest first.
        variance : float
            Predicted variance of d, element P11 [(N s/m)^2].

        Raises
        ------
        ConfigurationError
            A gain has several values; see `of_joint`.

        Notes
        -----
        Discrete algebraic Riccati equation with the Jacobian of thesis 5.6 and constant Q and R.

        Examples
        --------
        At half the speed the slowest pole is less than half as fast.

        >>> fast, _ = FrictionEkf().steady_state(inertia=1154.4, speed=0.2, friction=900.0, period=1e-3)
        >>> slow, _ = FrictionEkf().steady_state(inertia=1154.4, speed=0.1, friction=900.0, period=1e-3)
        >>> print(f"{fast[0]:.1f} rad/s, {slow[0]:.1f} rad/s")
        22.0 rad/s, 8.7 rad/s
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
