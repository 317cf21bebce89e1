"""The keys of `cdtool simulate --set`: what is logged, and what has changed since the machine file was written."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Literal

from msgspec import Meta

from cdtool.base.settings import setting
from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.simulate.recording_folder import GROUPS

#: More numbered files in one folder become unwieldy.
Runs = Annotated[int, Meta(ge=0, le=100_000)]


@dataclass(frozen=True)
class SimulationTable(ChangedMachine):
    """The changes of the machine, how many runs are logged, and how."""

    free: Annotated[Runs, setting("impact-free runs to learn from")] = 14
    holdout: Annotated[Runs, setting("impact-free runs for scoring only")] = 40
    stiff: Annotated[Runs, setting("impacts on the bare load cell")] = 30
    soft: Annotated[Runs, setting("impacts with a rubber bumper")] = 30
    format: Annotated[
        Literal["csv", "mcap", "mixed"], setting("format of the logs; mixed: two logs per group as MCAP")
    ] = "csv"
    reference: Annotated[bool, setting("also log the references: speed, and torque or position")] = True

    @property
    def counts(self) -> dict[str, int]:
        """Return how many runs of each group are logged."""
        return {group: getattr(self, group) for group in GROUPS}

    @property
    def changed(self) -> ChangedMachine:
        """Return the changes alone."""
        return ChangedMachine(**{item.name: getattr(self, item.name) for item in fields(ChangedMachine)})
