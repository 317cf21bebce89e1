"""Recordings that many tests share: a simulated axis of known parameters, and the simulated gate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cdtool.machines.linear_axis import LinearAxis
from cdtool.recording import Recording
from cdtool.simulation.gate_model import GateParameters, simulate_gate_run
from cdtool.simulation.gate_recordings import as_recording
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
            kept[kind, seed] = replace(as_recording(run, f"{kind}{seed}", GateParameters()), digest=f"{kind}{seed}")
        return kept[kind, seed]

    return make
