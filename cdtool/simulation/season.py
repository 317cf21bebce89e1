"""A season of impact-free gate runs over which a signature ages: friction that drifts, an obstruction that grows."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdtool.errors import UsageError
from cdtool.simulation.changed_machine import ChangedMachine
from cdtool.simulation.gate_model import GateParameters, GateRun, simulate_gate_run
from cdtool.simulation.gate_recordings import gate_bench
from cdtool.simulation.recording_folder import GROUPS, write_folder

# A season's runs have other random numbers than those of `cdtool simulate gate`.
_STREAM = len(GROUPS)


@dataclass(frozen=True)
class Season:
    """The changes from the first run to the last, both linear.

    `friction_change`: by which share the leaf's friction grows (0.3: by 30 %) or falls (below 0) over the season.
    `obstruction_growth` [N per run]: how much more a section of 0.1 m about `obstruction_at` [m] resists in each run.
    """

    runs: int
    friction_change: float = 0.0
    obstruction_growth: float = 0.0
    obstruction_at: float = 0.9

    def __post_init__(self) -> None:
        if self.runs < 1:
            raise UsageError(f"a season of {self.runs} runs", "at least 1")
        if not -1.0 < self.friction_change < math.inf:
            raise UsageError(f"friction change is {self.friction_change:g}", "a share above -1; 0.3: 30 % more")
        if not 0.0 <= self.obstruction_growth < math.inf:
            raise UsageError(f"obstruction growth is {self.obstruction_growth:g}", "N per run, at least 0")
        if not math.isfinite(self.obstruction_at):
            raise UsageError(f"obstruction at {self.obstruction_at:g}", "a location along the travel in m")

    def gate(self, number: int, new: GateParameters) -> GateParameters:
        """The gate in the run `number` (from 1), of one that is `new` in the first."""
        share = (number - 1) / max(self.runs - 1, 1)
        return replace(
            ChangedMachine(friction=1.0 + share * self.friction_change).gate(new),
            obstruction_force=new.obstruction_force + (number - 1) * self.obstruction_growth,
            obstruction_position=self.obstruction_at,
        )

    def run(self, number: int, seed: int, new: GateParameters) -> GateRun:
        """The impact-free run `number`; without change it is the same whatever the season's length is."""
        rng = np.random.default_rng([seed, _STREAM, number])
        return simulate_gate_run(self.gate(number, new), rng, "none")


def write_gate_season(
    folder: Path,
    season: Season,
    seed: int,
    file_format: str = "csv",
    progress: Callable[[int, int], None] | None = None,
    parameters: GateParameters | None = None,
) -> int:
    """Write a season's recordings, free/001 and so on in their order, as `write_gate_recordings` does; how many.

    Same seed, same bytes. The machine file is that of the gate as it is in the first run. Raises UsageError where the
    folder is not empty.
    """
    new = parameters or GateParameters()
    bench = gate_bench(new, lambda _, number: season.run(number, seed, new))
    return write_folder(folder, {"free": season.runs}, file_format, bench, progress)
