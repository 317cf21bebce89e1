"""The keys of `cdtool simulate --set`: what is logged, and what has changed since the machine file was written."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Literal

from cdtool.base.settings import setting
from cdtool.commands.simulate.changed_machine import ChangedMachine


@dataclass(frozen=True)
class SimulationTable(ChangedMachine):
    """The changes of the machine, and how its runs are logged."""

    format: Annotated[
        Literal["csv", "mcap", "mixed"], setting("format of the logs; mixed: two logs per group as MCAP")
    ] = "csv"
    reference: Annotated[bool, setting("also log the references: speed, and torque or position")] = True

    @property
    def changed(self) -> ChangedMachine:
        """Return the changes alone."""
        return ChangedMachine(**{item.name: getattr(self, item.name) for item in fields(ChangedMachine)})
