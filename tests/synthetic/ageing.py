"""Impact-free runs of the simulated gate, over which its friction changes or an obstruction grows on its track."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.simulate.gate_model import GateParameters, GateRun, simulate_gate_run
from cdtool.commands.simulate.gate_recordings import gate_bench
from cdtool.commands.simulate.recording_folder import GROUPS, write_folder

GATE = GateParameters()
# When the leaf passes 0.9 m, and how long it takes for 0.1 m at 0.2 m/s [s].
_PASSES, _LASTS = 5.5, 0.5


def ageing_run(number: int, seed: int, friction: float = 1.0, obstruction: float = 0.0) -> GateRun:
    """Return a run with that factor of the friction; a section about 0.9 m resists with up to `obstruction` [N]."""

    def resists(time: np.ndarray) -> np.ndarray:
        near = np.abs(time - _PASSES) < 0.5 * _LASTS
        return obstruction * near * np.cos(np.pi * (time - _PASSES) / _LASTS) ** 2

    rng = np.random.default_rng([seed, len(GROUPS), number])
    return simulate_gate_run(ChangedMachine(friction=friction).gate(GATE), rng, "none", added_friction=resists)


def write_ageing_gate(folder: Path, runs: int, seed: int, friction: float = 1.0, obstruction: float = 0.0) -> None:
    """Write runs whose friction grows linearly to the factor `friction`, the obstruction by so many N in each run."""

    def simulate(_: str, number: int) -> GateRun:
        share = (number - 1) / (runs - 1)
        return ageing_run(number, seed, 1.0 + share * (friction - 1.0), (number - 1) * obstruction)

    write_folder(folder, {"free": runs}, "csv", gate_bench(GATE, simulate))
