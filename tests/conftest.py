"""The markers of the tests, and shared recordings: an axis of known parameters, the simulated gate."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import settings

from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.machines.linear_axis import LinearAxis
from cdtool.machines.planar_arm import PlanarArm
from cdtool.recordings.recording import Recording
from tests import markers
from tests.synthetic.gate_as_recording import as_recording
from tests.synthetic.machines import ARM, GATE, arm_of, machine_of

# Tests have no deadline: a busy machine takes longer for an example. Each run tries other examples than the one before,
# so that few of them are enough; for a long search: CDTOOL_EXAMPLES=2000.
settings.register_profile("untimed", deadline=None, max_examples=int(os.environ.get("CDTOOL_EXAMPLES", "50")))
settings.load_profile("untimed")


@pytest.hookimpl(tryfirst=True)  # before -m selects tests
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    markers.mark(items)


@pytest.fixture(scope="session")
def arm() -> PlanarArm:
    return arm_of(ARM)


@pytest.fixture(scope="session")
def gate() -> LinearAxis:
    return machine_of(GATE)


@pytest.fixture(scope="session")
def simulated() -> Callable[[str, int], Recording]:
    """simulated(kind, seed): a gate run of kind none, stiff or soft; equal arguments return the same object."""
    kept: dict[tuple[str, int], Recording] = {}

    def make(kind: str, seed: int) -> Recording:
        if (kind, seed) not in kept:
            run = simulate_gate_run(GateParameters(), np.random.default_rng([99, seed]), kind)  # type: ignore[arg-type]
            recording = machine_of(GATE).referred_to_load(as_recording(run, f"{kind}{seed}", GateParameters()))
            kept[kind, seed] = replace(recording, digest=f"{kind}{seed}", findings=())
        return kept[kind, seed]

    return make
