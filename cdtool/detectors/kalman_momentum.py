"""Kalman filter on the momentum: the contact torque is a state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.base import (
    BRIDGED,
    drive_of,
    gain,
    per_joint,
    require_positive,
    single,
)
from cdtool.detectors.detection import Signal, Status, StatusArray
from cdtool.detectors.look import NAVY, Look
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.clock.recent_steps import usual_steps
from cdtool.recordings.recording import Recording

# The filter starts with the uncertainty of the contact torque that its drift gathers in this time [s].
_INITIAL_DRIFT_TIME = 1.0
# A step longer than this many usual steps is a gap.
_USUAL = 1.5
# After a longer gap the old state is useless [s].
_LONGEST_GAP = 1.0


@dataclass(frozen=True)
class KalmanMomentum:
    """Kalman estimate of tau_c per joint: dp/dt = tau - beta - tau_c, tau_c a random walk, p = M(q) v measured.

    Parameters
    ----------
    sigma_speed : float or tuple of float
        Standard deviation of the noise of the speed [m/s]; that of the measured momentum is the nominal inertia times
        it.
    sigma_torque : float or tuple of float
        Standard deviation of the error of torque and model, white from sample to sample [N].
    contact_drift : float or tuple of float
        How fast the contact torque may change [N per sqrt(s)].

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Not in the thesis; after Wahrburg, Boes, Listmann, Dai, Matthias and Ding, "Motor-current-based estimation of
    cartesian contact forces and torques for robotic manipulators and its application to force control", IEEE Trans.
    Automation Science and Engineering 15(2), 2018, 879-886, here for each joint separately. beta is that of `Momentum`.
    Approximate bandwidth [rad/s]: the smaller of (q_c / R)^(1/4) and (q_c / S)^(1/2), where q_c = contact_drift^2, and
    R and S are the variances of momentum and torque times the step. `steady_state` computes the poles.

    * Needs: torque, speed; position if joints are coupled.
    * Unit: N or N m, positive if the contact opposes positive travel.
    * Start-up: until the integral of the bandwidth over time reaches 3.
    * Fails: like the momentum observer, and if the noise differs from the gains.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> time = np.arange(2001) * 1e-3
    >>> torque, speed = Series(time, np.where(time < 1.0, 0.0, 30.0), "N"), Series(time, np.full(2001, 0.2), "m/s")
    >>> run = Recording("run", "", ("axis",), {"torque": torque, "speed": speed})
    >>> KalmanMomentum().signal(run, axis).values[[999, 2000], 0].round(1).tolist()
    [0.0, 30.0]
    """

    sigma_speed: Gain = gain(3.5e-3, "m/s", "noise of the speed (standard deviation)", searched=False)
    sigma_torque: Gain = gain(
        20.0, "N", "noise of torque and model, white from sample to sample (standard deviation)", searched=False
    )
    contact_drift: Gain = gain(13.0, "N per sqrt(s)", "how fast the contact torque may change")

    name: ClassVar[str] = "kalman_momentum"
    short_name: ClassVar[str] = "kmo"
    title: ClassVar[str] = "Kalman filter on the momentum"
    needs: ClassVar[tuple[str, ...]] = ("torque", "speed")
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = True
    look: ClassVar[Look] = Look(NAVY, ">")

    def __post_init__(self) -> None:
        require_positive(self, "sigma_speed", "sigma_torque", "contact_drift")

    def unit(self, machine: Machine) -> str:
        """Return "N" or "N m"."""
        return machine.force_unit

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the contact torque (n, J) on the speed's clock; see `Detector.signal`."""
        drive = drive_of(self, recording, machine)
        net_force, momentum = machine.momentum_balance(drive.torque, drive.position, drive.speed, drive.speed)
        estimate = np.empty(momentum.shape)
        status = np.empty(momentum.shape, dtype=np.uint8)
        drift, torque, speed = (
            per_joint(value, len(machine.joints)) ** 2
            for value in (self.contact_drift, self.sigma_torque, self.sigma_speed)
        )
        usual = usual_steps(drive.time)
        for j, inertia in enumerate(machine.nominal_inertia):
            _filter(
                drive.time,
                usual,
                np.ascontiguousarray(net_force[:, j]),
                np.ascontiguousarray(momentum[:, j]),
                np.ascontiguousarray(drive.missing[:, j]),
                np.ascontiguousarray(drive.torque_missing[:, j]),
                machine.coupled,
                drift[j],
                torque[j],
                float(inertia) ** 2 * speed[j],
                estimate[:, j],
                status[:, j],
            )
        return Signal(drive.time, estimate, status, self.unit(machine), self.signed)

    def steady_state(self, inertia: float, period: float) -> FloatArray:
        """Return the poles of the estimator in the steady state, from the discrete algebraic Riccati equation.

        Parameters
        ----------
        inertia : float
            Inertia on the load side [kg, kg m2].
        period : float
            Uniform sample period [s].

        Returns
        -------
        ndarray of float, shape (2,)
            Magnitudes of the poles [rad/s], the slowest first.

        Raises
        ------
        ConfigurationError
            A gain has several values; see `of_joint`.

        Examples
        --------
        >>> import numpy as np
        >>> slow, fast = KalmanMomentum().steady_state(inertia=600.0, period=1e-3)
        >>> slower, _ = KalmanMomentum(contact_drift=5.0).steady_state(inertia=600.0, period=1e-3)
        >>> bool(slower < slow <= fast)
        True
        """
        from scipy.linalg import solve_discrete_are

        transition = np.array([[1.0, -period], [0.0, 1.0]])
        observation = np.array([[1.0, 0.0]])
        process = _process_noise(single(self.contact_drift) ** 2, single(self.sigma_torque) ** 2, period)
        noise = np.array([[(inertia * single(self.sigma_speed)) ** 2]])
        covariance = solve_discrete_are(transition.T, observation.T, process, noise)
        kalman_gain = covariance @ observation.T / (covariance[0, 0] + noise[0, 0])
        eigenvalues = np.linalg.eigvals((np.eye(2) - kalman_gain @ observation) @ transition)
        poles: FloatArray = np.sort(np.abs(np.log(eigenvalues + 0j)) / period)
        return poles


def _process_noise(drift: float, torque: float, step: float) -> FloatArray:
    cross = -drift * step**2 / 2.0
    return np.array([[drift * step**3 / 3.0 + torque * step**2, cross], [cross, drift * step]])


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, float64[::1], float64[::1], b1[::1], b1[::1], b1, float64, float64, "
    "float64, float64[:], uint8[:])"
)
def _filter(  # noqa: PLR0913  a kernel takes arrays and scalars one by one
    time: FloatArray,
    usual: FloatArray,
    net_force: FloatArray,
    momentum: FloatArray,
    missing: BoolArray,
    torque_missing: BoolArray,
    coupled: bool,
    drift: float,
    torque_noise: float,
    momentum_noise: float,
    estimate: FloatArray,
    status: StatusArray,
) -> None:
    """Predict p + (mean force - tau_c) T over each step, exactly; correct with the measured p, in Joseph form.

    A gap of at most 0.15 s is crossed in steps of the `usual` length (n,), with the momentum on a straight line and the
    mean force: the estimate is then where it would have been, and continues with the same gain. A single large step
    would have another gain, and the estimate would wander after the gap as it never does otherwise.

    Over `missing` samples, the force is interpolated by a straight line if the torque is missing, or any input of
    `coupled` joints.
    """
    started = False
    bridged = False
    impulse = 0.0
    force_before = 0.0
    momentum_before = 0.0
    p = 0.0
    contact = 0.0
    pp = pc = cc = 0.0
    settled = 0.0
    last = 0.0
    for k in range(len(time)):
        if started and time[k] - last > _LONGEST_GAP:
            started = False
        if started:
            impulse += 0.5 * (net_force[k] + net_force[k - 1]) * (time[k] - time[k - 1])
        if missing[k]:
            bridged = bridged or coupled or torque_missing[k]
            estimate[k] = contact
            status[k] = Status.GAP
            continue
        if not started:
            started = True
            p = momentum[k]
            contact = 0.0
            pp, pc, cc = momentum_noise, 0.0, drift * _INITIAL_DRIFT_TIME
            settled = 0.0
        else:
            span = time[k] - last
            if bridged:
                impulse = 0.5 * (net_force[k] + force_before) * span
            pieces = round(span / usual[k]) if _USUAL * usual[k] < span <= BRIDGED else 1
            step = span / pieces
            for piece in range(1, pieces + 1):
                p += impulse / pieces - contact * step
                pp += step * (step * cc - 2.0 * pc) + drift * step**3 / 3.0 + torque_noise * step * step
                pc += -step * cc - 0.5 * drift * step * step
                cc += drift * step
                innovation = pp + momentum_noise
                k_p, k_c = pp / innovation, pc / innovation
                measured = momentum_before + (momentum[k] - momentum_before) * (piece / pieces)
                surprise = measured - p
                p += k_p * surprise
                contact += k_c * surprise
                cc += k_c * (k_c * innovation - 2.0 * pc)
                pc = (1.0 - k_p) * (pc - k_c * pp) + momentum_noise * k_p * k_c
                pp = (1.0 - k_p) * (1.0 - k_p) * pp + momentum_noise * k_p * k_p
            fast = math.sqrt(math.sqrt(drift / (momentum_noise * span)))
            settled += min(fast, math.sqrt(drift / (torque_noise * span))) * span
        bridged = False
        impulse = 0.0
        force_before = net_force[k]
        momentum_before = momentum[k]
        last = time[k]
        estimate[k] = contact
        status[k] = Status.START_UP if settled < 3.0 else Status.VALID
