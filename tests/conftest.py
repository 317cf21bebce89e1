"""Recordings that many tests share: a simulated axis of known parameters, and the simulated gate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cdtool.machines.linear_axis import LinearAxis
from cdtool.recording import FloatArray, Recording, Series
from cdtool.simulation.gate_model import GateParameters, GateRun, simulate_gate_run
from cdtool.tables import Table

GATE = {
    "motor_inertia": 9.5e-4,
    "load_mass": 620.0,
    "transmission_ratio": 1.333e-3,
    "viscous_friction": 150.0 * 1.333e-3**2,
}


def machine_of(values: dict[str, object]) -> LinearAxis:
    """A linear axis from the keys of its [machine] table."""
    machine = LinearAxis.from_table(Table(values, "machine.toml", "machine."))
    assert isinstance(machine, LinearAxis)
    return machine


def gate_recording(run: GateRun, name: str = "run") -> Recording:
    """A simulated run as it is after reading: every channel on the load side."""
    ratio = GateParameters().transmission_ratio
    values: dict[str, tuple[FloatArray, str]] = {
        "torque": (run.motor_torque / ratio, "N"),
        "speed": (run.motor_speed * ratio, "m/s"),
        "position": (run.motor_position * ratio, "m"),
        "acceleration": (run.acceleration, "m/s2"),
        "reference_speed": (run.reference_speed * ratio, "m/s"),
        "force": (run.load_cell, "N"),
    }
    channels = {channel: Series(run.time, numbers, unit) for channel, (numbers, unit) in values.items()}
    return Recording(name, f"{name}.csv", ("gate",), channels, digest=f"digest of {name}")


@pytest.fixture(scope="session")
def gate() -> LinearAxis:
    return machine_of(GATE)


@pytest.fixture(scope="session")
def simulated() -> Callable[[str, int], Recording]:
    """simulated(kind, seed): a gate run of kind none, stiff or soft; the same arguments give the same object."""
    kept: dict[tuple[str, int], Recording] = {}

    def make(kind: str, seed: int) -> Recording:
        if (kind, seed) not in kept:
            run = simulate_gate_run(GateParameters(), np.random.default_rng([99, seed]), kind)  # type: ignore[arg-type]
            kept[kind, seed] = gate_recording(run, f"{kind}{seed}")
        return kept[kind, seed]

    return make
