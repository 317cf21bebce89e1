"""Momentum observer: cdtool's public path and its bare loop against scipy.signal.lfilter with its preparation."""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from arrays import PERIOD, Array, Run, clean, gate, recording, viscous
from timing import Spread, interleaved, main, ratio, table, verdict

from cdtool.detectors.base import _observe, drive_on_speed_clock
from cdtool.detectors.momentum import Momentum
from cdtool.machines.linear_axis import LinearAxis

SAMPLES = 1_000_000
ROUNDS = 25
AT_LEAST = 1.2
TOLERANCE = 1e-9


def measure() -> bool:
    machine, detector = gate(), Momentum()
    run = clean(SAMPLES, machine)
    log = recording(run)
    scipy = _lfilter(run, machine, detector.bandwidth)
    expected = scipy()
    worst = float(np.max(np.abs(detector.signal(log, machine).values[1:, 0] - expected)) / np.max(np.abs(expected)))
    if not worst <= TOLERANCE:
        sys.exit(f"error: residuals differ by {worst:.2g} of the largest, allowed {TOLERANCE:g}")
    public = {"lfilter, prepared": scipy, "public path": lambda: detector.signal(log, machine)}
    core = {
        "lfilter only": _lfilter_only(run, detector.bandwidth),
        "core only": _core(run, machine, detector.bandwidth),
    }
    # Pair after pair: what a task leaves of the heap decides how many page faults the next one pays for.
    seconds = interleaved(public, ROUNDS) | interleaved(core, ROUNDS)
    times = ratio(seconds["lfilter, prepared"], seconds["public path"])
    core_times = ratio(seconds["lfilter only"], seconds["core only"])
    held = verdict("public path / lfilter with its preparation, samples/s", times, AT_LEAST)
    print()
    rows = [
        ("Momentum().signal(recording, machine)", _speed(seconds["public path"]), ""),
        ("lfilter with its preparation", _speed(seconds["lfilter, prepared"]), times),
        ("core: the compiled loop", _speed(seconds["core only"]), ""),
        ("lfilter alone, its input prepared", _speed(seconds["lfilter only"]), core_times),
    ]
    table(("task", "M samples/s", "cdtool / this (low-high)"), rows)
    print(
        f"{SAMPLES} samples, uniform {1 / PERIOD:g} Hz; residuals agree to {TOLERANCE:g} relative. cdtool's loop also"
    )
    print("forms mean force, difference of the momentum and status; lfilter alone gets that done already.")
    return held


def _lfilter(run: Run, machine: LinearAxis, bandwidth: float) -> Callable[[], Array]:
    """res_k = a res_{k-1} + (1 - a) (mean net force - (p_k - p_{k-1}) / T)."""
    from scipy.signal import lfilter

    inertia, friction = float(machine.nominal_inertia[0]), viscous(machine)
    a = np.exp(-bandwidth * PERIOD)

    def residual() -> Array:
        p = inertia * run.speed
        u = run.force - friction * run.speed
        mean = 0.5 * (u[1:] + u[:-1])
        x = mean - np.diff(p) / PERIOD
        filtered: Array = lfilter([1.0 - a], [1.0, -a], x)
        return filtered

    return residual


def _lfilter_only(run: Run, bandwidth: float) -> Callable[[], Array]:
    from scipy.signal import lfilter

    a = np.exp(-bandwidth * PERIOD)
    x = run.force.copy()
    return lambda: lfilter([1.0 - a], [1.0, -a], x)


def _core(run: Run, machine: LinearAxis, bandwidth: float) -> Callable[[], object]:
    drive = drive_on_speed_clock(recording(run), machine)
    net, momenta = machine.momentum_balance(drive.torque, drive.position, drive.speed, drive.speed)
    net_force, momentum = net[:, 0], momenta[:, 0]
    missing = drive.missing[:, 0]

    def residual() -> Array:
        values, status = np.empty(len(run.time)), np.empty(len(run.time), dtype=np.uint8)
        _observe(drive.time, net_force, momentum, missing, missing, drive.coupled, bandwidth, -np.inf, values, status)
        return values

    return residual


def _speed(seconds: list[float]) -> str:
    return f"{SAMPLES / Spread.of(seconds).median * 1e-6:.3g}"


if __name__ == "__main__":
    main("momentum against scipy.signal.lfilter", measure)
