"""Impact-free runs of the simulated gate as identification sees them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.linear_axis import LinearAxis
from cdtool.recordings.recording import Recording
from tests.synthetic.gate_as_recording import as_recording

GATE = GateParameters()
ON_LOAD_SIDE = LinearAxis.of({"name": "gate", "coordinates": "load", "load_mass": GATE.leaf_mass + GATE.motor_mass})


def on_any_track(gate: GateParameters, seed: int) -> GateParameters:
    """Return the gate on a track whose friction has the same waves with other phases."""
    rng = np.random.default_rng(seed)
    waves = tuple((length, float(rng.uniform(0.0, 2.0 * np.pi)), weight) for length, _, weight in gate.friction_waves)
    return replace(gate, friction_waves=waves)


def without(recording: Recording, *channels: str) -> Recording:
    kept = {name: series for name, series in recording.channels.items() if name not in channels}
    return replace(recording, channels=kept)


def without_references(recording: Recording) -> Recording:
    return without(recording, *(name for name in recording.channels if name.startswith("reference")))


def free_recording(gate: GateParameters, seed: int, number: int, *, references: bool = True) -> Recording:
    run = simulate_gate_run(gate, np.random.default_rng([seed, number]), "none")
    recording = as_recording(run, f"free {number}", gate)
    return recording if references else without_references(recording)


@cache
def free_runs(gate: GateParameters, seed: int, count: int, *, references: bool = True) -> tuple[AxisRun, ...]:
    recordings = (free_recording(gate, seed, number, references=references) for number in range(count))
    return tuple(axis_run(ON_LOAD_SIDE.referred_to_load(recording)) for recording in recordings)
