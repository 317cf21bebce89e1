"""Friction EKF: cdtool's compiled loop compared with a C -O3 loop with the same masks, and with filterpy.

All three must produce the same estimates, otherwise the benchmark stops.
"""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from arrays import PERIOD, Array, Run, awkward, clean, gate, stretch, viscous
from timing import interleaved, main, ratio, table, verdict

from cdtool.detectors import friction_ekf as detector_module
from cdtool.detectors.friction_ekf import FrictionEkf, JointMeasurements
from cdtool.machines.dynamics import JointEquation
from cdtool.machines.linear_axis import LinearAxis

SAMPLES = 1_000_000
FILTERPY_SAMPLES = 4_000
# Section of a stroke at constant speed: filterpy has neither masks nor a minimum speed.
FILTERPY_START = 2_000
ROUNDS = 15
FILTERPY_ROUNDS = 7
AT_LEAST_OF_C = 0.9
AT_LEAST_OF_FILTERPY = 400.0
TOLERANCE_C = 1e-9
TOLERANCE_FILTERPY = 1e-8

Statuses = npt.NDArray[np.uint8]
Estimate = Callable[[], tuple[Array, Statuses]]


def measure() -> bool:
    machine, detector = gate(), FrictionEkf()
    held = True
    rows: list[tuple[object, ...]] = []
    runs = {"clean": clean(SAMPLES, machine), "awkward": awkward(SAMPLES, machine)}
    with tempfile.TemporaryDirectory() as folder:
        library = _compile(Path(folder))
        if library is None:
            print("skip  C -O3: no C compiler (gcc or cc) found")
        for name, run in runs.items():
            if library is None:
                break
            tasks = {"cdtool": _cdtool(detector, run, machine), "C": _c(library, detector, run, machine)}
            _require_equal(f"C, {name}", tasks["C"](), tasks["cdtool"](), TOLERANCE_C)
            seconds = interleaved(tasks, ROUNDS)
            share = ratio(seconds["C"], seconds["cdtool"])
            rows.append((f"C -O3 -march=native, {name} log", *_speeds(seconds, SAMPLES), share))
            held &= verdict(f"cdtool / C, samples/s, {name} log", share, AT_LEAST_OF_C)
    part = stretch(runs["clean"], FILTERPY_START, FILTERPY_SAMPLES)
    held &= _against_filterpy(detector, runs["clean"], part, machine, rows)
    print()
    table(("peer", "cdtool M samples/s", "peer M samples/s", "ratio (low-high)"), rows)
    print(f"clean: {SAMPLES} samples on one clock. awkward: accelerometer on its own jittering clock, NaN, pauses.")
    print(f"estimates agree to {TOLERANCE_C:g} (C) and {TOLERANCE_FILTERPY:g} (filterpy) relative, masks exactly (C)")
    return held


def _against_filterpy(
    detector: FrictionEkf, run: Run, part: Run, machine: LinearAxis, rows: list[tuple[object, ...]]
) -> bool:
    try:
        import filterpy.kalman  # noqa: F401
    except ImportError:
        print("skip  filterpy is not installed: pip install 'cdtool[benchmarks]'")
        return True
    held = True
    own = _cdtool(detector, part, machine)()[0]
    for name, joint in (("filterpy EKF, a then v", False), ("filterpy EKF, (a, v) at once", True)):
        theirs = _filterpy(detector, part, machine, joint)
        _require_equal(name, (theirs(), np.zeros(0)), (own, np.zeros(0)), TOLERANCE_FILTERPY)
        seconds = interleaved({"cdtool": _cdtool(detector, run, machine), name: theirs}, FILTERPY_ROUNDS)
        # Samples/s over samples/s: cdtool runs the whole log, filterpy a section of it.
        per_sample = [s / FILTERPY_SAMPLES for s in seconds[name]]
        times = ratio(per_sample, [s / SAMPLES for s in seconds["cdtool"]])
        rows.append((name, _speed(seconds["cdtool"], SAMPLES), _speed(seconds[name], FILTERPY_SAMPLES), times))
        held &= verdict(f"cdtool / {name}, samples/s", times, AT_LEAST_OF_FILTERPY)
    return held


def _cdtool(detector: FrictionEkf, run: Run, machine: LinearAxis) -> Estimate:
    missing = np.isnan(run.speed).view(np.uint8)
    motion = JointMeasurements(run.time, run.speed, run.speed, missing, run.acceleration_time, run.acceleration)
    equation = JointEquation(machine.nominal_inertia, run.force, viscous(machine))
    return lambda: detector.estimate(motion, equation)


def _compile(folder: Path) -> ctypes.CDLL | None:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        return None
    library = folder / "friction_ekf.so"
    source = Path(__file__).with_name("friction_ekf.c")
    flags = ["-O3", "-march=native", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def _c(library: ctypes.CDLL, detector: FrictionEkf, run: Run, machine: LinearAxis) -> Estimate:
    missing = np.isnan(run.speed).view(np.uint8)
    gains = _gains(detector, float(machine.nominal_inertia[0]), viscous(machine))
    numbers = [ctypes.c_double(value) for value in gains]

    def at(array: npt.NDArray[np.float64] | Statuses) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    def estimate() -> tuple[Array, Statuses]:
        friction = np.zeros(len(run.time))
        status = np.zeros(len(run.time), dtype=np.uint8)
        library.run_filter(
            ctypes.c_int64(len(run.time)),
            at(run.time),
            at(run.force),
            at(run.speed),
            at(missing),
            ctypes.c_int64(len(run.acceleration)),
            at(run.acceleration_time),
            at(run.acceleration),
            *numbers,
            at(friction),
            at(status),
        )
        return friction, status

    return estimate


def _gains(detector: FrictionEkf, inertia: float, viscous: float) -> tuple[float, ...]:
    """The numbers that `FrictionEkf.estimate` uses, in the order of the arguments in friction_ekf.c."""
    return (
        inertia,
        viscous,
        detector.friction_drift**2,
        detector.drift_acceleration**2,
        detector.drift_speed**2,
        detector.sigma_acceleration**2,
        detector.sigma_speed**2,
        detector.friction_drift**2 * detector_module._INITIAL_DRIFT_TIME,
        detector.minimum_speed,
        detector_module._ACCELERATION_HOLD,
        detector_module._GLITCH,
    )


def _filterpy(detector: FrictionEkf, run: Run, machine: LinearAxis, joint: bool) -> Callable[[], Array]:
    """Run the same model with filterpy: predict, then two scalar updates as in cdtool, or one of both values."""
    from filterpy.kalman import ExtendedKalmanFilter

    inertia, known_friction, q_d, q_a, q_v, r_a, r_v, initial, *_ = _gains(
        detector, float(machine.nominal_inertia[0]), viscous(machine)
    )
    see_a, see_v = np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, 0.0, 1.0]])
    see_both = np.vstack((see_a, see_v))

    class Filter(ExtendedKalmanFilter):  # type: ignore[misc]
        def predict_x(self, u: float = 0.0) -> None:
            d, a, v = self.x
            self.x = np.array([d, (u - d * v) / inertia, v + PERIOD * a])

    def step() -> Array:
        kalman = Filter(dim_x=3, dim_z=2 if joint else 1)
        kalman.x = np.array([known_friction, run.acceleration[0], run.speed[0]])
        kalman.P = np.diag([initial, r_a, r_v])
        kalman.Q = np.diag([q_d * PERIOD, q_a, q_v])
        noise = np.diag([r_a, r_v])
        friction = np.empty(len(run.time))
        friction[0] = known_friction
        for k in range(1, len(run.time)):
            d, _, v = kalman.x
            kalman.F = np.array([[1.0, 0.0, 0.0], [-v / inertia, 0.0, -d / inertia], [0.0, PERIOD, 1.0]])
            kalman.predict(run.force[k - 1])
            if joint:
                both = np.array([run.acceleration[k], run.speed[k]])
                kalman.update(both, lambda _: see_both, lambda x: x[1:], R=noise)
            else:
                kalman.update(run.acceleration[k], lambda _: see_a, lambda x: x[1:2], R=r_a)
                kalman.update(run.speed[k], lambda _: see_v, lambda x: x[2:], R=r_v)
            friction[k] = kalman.x[0]
        return friction

    return step


def _require_equal(
    who: str, theirs: tuple[Array, npt.NDArray[np.generic]], own: tuple[Array, npt.NDArray[np.generic]], limit: float
) -> None:
    scale = float(np.max(np.abs(own[0])))
    worst = float(np.max(np.abs(theirs[0] - own[0]))) / scale
    if not (math.isfinite(worst) and worst <= limit):
        sys.exit(f"error: {who}: estimates differ from cdtool's by {worst:.2g} of the largest, allowed {limit:g}")
    if not np.array_equal(theirs[1], own[1]):
        sys.exit(f"error: {who}: masks differ from cdtool's")


def _speed(seconds: list[float], samples: int) -> str:
    return f"{samples / float(np.median(seconds)) * 1e-6:.3g}"


def _speeds(seconds: dict[str, list[float]], samples: int) -> tuple[str, str]:
    return _speed(seconds["cdtool"], samples), _speed(seconds["C"], samples)


if __name__ == "__main__":
    main("friction_ekf against C and filterpy", measure)
