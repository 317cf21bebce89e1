"""Recordings that many tests share: a simulated axis of known parameters, and the simulated gate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import settings

from cdtool.machines.linear_axis import LinearAxis
from cdtool.machines.planar_arm import PlanarArm
from cdtool.recording import Recording
from cdtool.simulation.gate_model import GateParameters, simulate_gate_run
from cdtool.simulation.gate_recordings import as_recording
from cdtool.tables import Table

# No test is timed: a busy machine needs longer for an example.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

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


ARM = {
    "coordinates": "motor",
    "link_mass": [1.3, 1.6],
    "link_length": 0.30,
    "centre_of_mass": [0.14, 0.18],
    "link_inertia": [0.012, 0.018],
    "motor_inertia": 1.5e-5,
    "transmission_ratio": 1.0 / 60.0,
    "viscous_friction": 0.4 / 60.0**2,
    "imu_position": [0.22, 0.20],
}


def arm_of(values: dict[str, object]) -> PlanarArm:
    """A planar arm from the keys of its [machine] table."""
    return PlanarArm.from_table(Table(values, "machine.toml", "machine."))


@pytest.fixture(scope="session")
def arm() -> PlanarArm:
    return arm_of(ARM)


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
            recording = machine_of(GATE).referred_to_load(as_recording(run, f"{kind}{seed}", GateParameters()))
            kept[kind, seed] = replace(recording, digest=f"{kind}{seed}", findings=())
        return kept[kind, seed]

    return make
