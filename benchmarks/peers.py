"""What detectors and dynamics cost compared with the library that a user would take instead; all from Python.

* The momentum observer, and `scipy.signal.lfilter` with the preparation that gives the same residual.
* The friction EKF, and filterpy's `ExtendedKalmanFilter`, stepped in a loop.
* p = M v, C'v and g of a 7-joint arm, and a loop that calls pinocchio for each sample.
* Samples/s of every detector on the gate.

The other package's values are compared with cdtool's before anything is timed; if they differ, the benchmark stops.

python benchmarks/peers.py
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from timing import Spread, interleaved, main, ratio, table, verdict

from cdtool.base.kernels import read_only
from cdtool.detectors import DETECTORS
from cdtool.detectors.friction_ekf import _INITIAL_DRIFT_TIME as INITIAL_DRIFT_TIME
from cdtool.detectors.friction_ekf import FrictionEkf
from cdtool.detectors.friction_ekf_kernel import Samples
from cdtool.detectors.momentum import Momentum
from cdtool.machines.dynamics import JointEquation
from cdtool.machines.linear_axis import LinearAxis
from cdtool.machines.urdf_reader import read_urdf
from cdtool.recordings.recording import Recording, Series

Array = npt.NDArray[np.float64]

PERIOD = 1e-3  # of the log [s]
# Back and forth at 0.2 m/s with ramps of 1 s and rests of 0.5 s: time [s] and speed [m/s] of one cycle.
STROKES = ((0.0, 0.5, 1.5, 6.5, 7.5, 8.0, 9.0, 14.0, 15.0), (0.0, 0.0, 0.2, 0.2, 0.0, 0.0, -0.2, -0.2, 0.0))
SAMPLES = 1_000_000
# A section at constant speed: filterpy has neither masks nor a minimum speed.
MOVING = slice(2_000, 6_000)
JOINTS, ARM_SAMPLES, PINOCCHIO_SAMPLES = 7, 200_000, 20_000
ROUNDS = 7
AT_LEAST_OF_LFILTER, AT_LEAST_OF_FILTERPY, AT_LEAST_OF_PINOCCHIO = 1.2, 400.0, 20.0
# Of the largest value.
TOLERANCE = 1e-8
# What is run, and over how many samples.
Task = tuple[Callable[[], Array], int]


def measure() -> bool:
    axis = LinearAxis.of(
        {"load_mass": 620.0, "motor_inertia": 9.5e-4, "transmission_ratio": 1.333e-3, "viscous_friction": 2.67e-4}
    )
    log = strokes(axis)
    held = [_momentum(axis, log), _friction_ekf(axis, log), _arm_dynamics()]
    _every_detector(axis, log)
    return all(held)


def viscous(axis: LinearAxis) -> float:
    """Viscous friction on the load side [N s/m]."""
    return float(axis.viscous_friction[0] / axis.transmission_ratio[0] ** 2)


def strokes(axis: LinearAxis) -> Recording:
    """A gate that moves back and forth, on the load side: uniform 1 kHz, nothing missing."""
    rng = np.random.default_rng(2)
    time = np.arange(SAMPLES) * PERIOD
    speed = np.interp(time, *STROKES, period=STROKES[0][-1])
    position, acceleration = np.cumsum(speed) * PERIOD, np.gradient(speed, PERIOD)
    force = axis.nominal_inertia[0] * acceleration + viscous(axis) * speed
    channels = {
        "torque": (force + rng.normal(0.0, 20.0, SAMPLES), "N"),
        "speed": (speed + rng.normal(0.0, 1e-3, SAMPLES), "m/s"),
        "acceleration": (acceleration + rng.normal(0.0, 0.1, SAMPLES), "m/s2"),
        "position": (position, "m"),
        "reference_position": (position, "m"),
        "reference_speed": (speed, "m/s"),
        "reference_torque": (force, "N"),
    }
    series = {name: Series(time, values, unit) for name, (values, unit) in channels.items()}
    return Recording("strokes", "benchmark", axis.joints, series)


def _momentum(axis: LinearAxis, log: Recording) -> bool:
    """lfilter's side forms momentum, net force and their difference; without masks, with one period."""
    from scipy.signal import lfilter

    detector = Momentum()
    force, speed = log["torque"].values[:, 0], log["speed"].values[:, 0]
    inertia, friction, decay = axis.nominal_inertia[0], viscous(axis), np.exp(-detector.bandwidth * PERIOD)

    def ours() -> Array:
        return detector.signal(log, axis).values[1:, 0]

    def theirs() -> Array:
        net = force - friction * speed
        change = 0.5 * (net[1:] + net[:-1]) - np.diff(inertia * speed) / PERIOD
        return np.asarray(lfilter([1.0 - decay], [1.0, -decay], change))

    _require_equal("lfilter", ours(), theirs())
    return _compared("momentum / lfilter with its preparation", (ours, SAMPLES), (theirs, SAMPLES), AT_LEAST_OF_LFILTER)


def _friction_ekf(axis: LinearAxis, log: Recording) -> bool:
    """filterpy gets acceleration and speed as one value of two, which is the faster way to use it."""
    try:
        from filterpy.kalman import ExtendedKalmanFilter
    except ImportError:
        print("skip  filterpy is not installed: pip install 'cdtool[benchmarks]'")
        return True
    detector = FrictionEkf()
    inertia, damping = float(axis.nominal_inertia[0]), viscous(axis)
    columns = [log[name].values[:, 0] for name in ("torque", "speed", "acceleration")]

    class Filter(ExtendedKalmanFilter):  # type: ignore[misc]
        def predict_x(self, u: float = 0.0) -> None:
            d, a, v = self.x
            self.x = np.array([d, (u - d * v) / inertia, v + PERIOD * a])

    def estimate(section: slice) -> Array:
        time, force, speed, acceleration = (values[section] for values in (log["torque"].time, *columns))
        measured = (time, force, speed, np.zeros(len(time), np.uint8), time, acceleration)
        equation = JointEquation(axis.nominal_inertia, force, damping)
        return detector.estimate(Samples(*map(read_only, measured)), equation, np.empty(0))[0]

    def theirs() -> Array:
        force, speed, acceleration = (values[MOVING] for values in columns)
        of_a, of_v = detector.sigma_acceleration**2, detector.sigma_speed**2
        drift = detector.friction_drift**2
        kalman = Filter(dim_x=3, dim_z=2)
        kalman.x = np.array([damping, acceleration[0], speed[0]])
        kalman.P = np.diag([drift * INITIAL_DRIFT_TIME, of_a, of_v])
        kalman.Q = np.diag([drift * PERIOD, detector.drift_acceleration**2, detector.drift_speed**2])
        noise, seen = np.diag([of_a, of_v]), np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        friction = [damping]
        for driven, *values in zip(force, acceleration[1:], speed[1:], strict=False):
            d, _, v = kalman.x
            kalman.F = np.array([[1.0, 0.0, 0.0], [-v / inertia, 0.0, -d / inertia], [0.0, PERIOD, 1.0]])
            kalman.predict(driven)
            kalman.update(np.array(values), lambda _: seen, lambda x: x[1:], R=noise)
            friction.append(kalman.x[0])
        return np.array(friction)

    _require_equal("filterpy", estimate(MOVING), theirs())
    whole = (lambda: estimate(slice(None)), SAMPLES)
    return _compared("friction EKF / filterpy", whole, (theirs, MOVING.stop - MOVING.start), AT_LEAST_OF_FILTERPY)


def _arm_dynamics() -> bool:
    try:
        import pinocchio
    except ImportError:
        print("skip  pinocchio is not installed: pip install 'cdtool[urdf]'")
        return True
    rng = np.random.default_rng(1)
    position, speed = rng.uniform(-3.0, 3.0, (ARM_SAMPLES, JOINTS)), rng.uniform(-2.0, 2.0, (ARM_SAMPLES, JOINTS))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(_arm(rng), encoding="utf-8")
        tree = read_urdf(path, [f"joint{k}" for k in range(JOINTS)], {})
        model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()

    def ours() -> Array:
        return np.array(tree.momentum_terms(position, speed))

    def theirs() -> Array:
        terms = np.empty((3, PINOCCHIO_SAMPLES, JOINTS))
        for k in range(PINOCCHIO_SAMPLES):
            q, v = position[k], speed[k]
            terms[0, k] = pinocchio.crba(model, data, q) @ v
            terms[1, k] = pinocchio.computeCoriolisMatrix(model, data, q, v).T @ v
            terms[2, k] = pinocchio.computeGeneralizedGravity(model, data, q)
        return terms

    _require_equal("pinocchio", ours()[:, :PINOCCHIO_SAMPLES], theirs())
    both = (ours, ARM_SAMPLES), (theirs, PINOCCHIO_SAMPLES)
    return _compared("dynamics of 7 joints / a loop over pinocchio", *both, AT_LEAST_OF_PINOCCHIO)


def _arm(rng: np.random.Generator) -> str:
    """A URDF: links of 0.3 m and 5 kg down to 1 kg, each turned and placed a little askew on the one before."""
    parts = ['<link name="link0"/>']
    for k in range(JOINTS):
        turn = rng.choice([-1.5708, 0.0, 1.5708], 3) + rng.uniform(-0.1, 0.1, 3)
        place, centre = rng.uniform(-0.05, 0.05, (2, 3)) + np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.12]])
        mass = 5.0 - 4.0 * k / (JOINTS - 1)
        ixx, iyy, izz = mass * np.array([0.012, 0.011, 0.004])
        parts.append(
            f'<link name="link{k + 1}"><inertial><mass value="{mass}"/><origin xyz="{_text(centre)}"/>'
            f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="{0.05 * izz}" ixz="{-0.03 * izz}" iyz="{0.02 * izz}"/>'
            "</inertial></link>"
            f'<joint name="joint{k}" type="revolute"><parent link="link{k}"/><child link="link{k + 1}"/>'
            f'<origin xyz="{_text(place)}" rpy="{_text(turn)}"/><axis xyz="0 0 1"/>'
            '<limit lower="-6" upper="6" effort="100" velocity="3"/></joint>'
        )
    return f'<robot name="arm">{"".join(parts)}</robot>'


def _text(values: Array) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def _every_detector(axis: LinearAxis, log: Recording) -> None:
    detectors = {name: DETECTORS.load(name)() for name in DETECTORS.names()}
    tasks = {name: partial(each.signal, log, axis) for name, each in detectors.items()}
    seconds = interleaved(tasks, ROUNDS)
    print()
    table(
        ("detector, one joint on one clock", "M samples/s (low-high)"),
        [(name, Spread.of([1e-6 * SAMPLES / each for each in seconds[name]])) for name in tasks],
    )


def _require_equal(name: str, ours: Array, theirs: Array) -> None:
    worst = float(np.max(np.abs(ours - theirs)) / np.max(np.abs(theirs)))
    if not worst <= TOLERANCE:
        sys.exit(f"error: {name} differs from cdtool by {worst:.2g} of the largest value, allowed {TOLERANCE:g}")


def _compared(name: str, ours: Task, theirs: Task, at_least: float) -> bool:
    """Speeds are compared per sample: a loop in Python runs over fewer of them."""
    tasks = {"cdtool": ours, "peer": theirs}
    seconds = interleaved({key: run for key, (run, _) in tasks.items()}, ROUNDS)
    each = {key: [second / samples for second in seconds[key]] for key, (_, samples) in tasks.items()}
    speeds = {key: Spread.of([1e-6 / second for second in each[key]]) for key in tasks}
    held = verdict(f"{name}, samples/s", ratio(each["peer"], each["cdtool"]), at_least)
    print(f"      M samples/s: cdtool {speeds['cdtool']}, peer {speeds['peer']}")
    return held


if __name__ == "__main__":
    main("detectors and dynamics compared with libraries", measure)
