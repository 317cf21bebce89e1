"""Channels that a detector reads on a machine."""

from __future__ import annotations

from cdtool.formats.machine_file import MachineFile


def inputs_of(detector: str, machine_file: MachineFile) -> tuple[str, ...]:
    """Return the channels that a detector reads; a model of coupled joints also needs the pose."""
    return machine_file.derived(("inputs", detector), lambda: _inputs_of(detector, machine_file))


def _inputs_of(detector: str, machine_file: MachineFile) -> tuple[str, ...]:
    needs: tuple[str, ...] = machine_file.detector(detector).needs
    posed = machine_file.machine.coupled and "speed" in needs and "position" not in needs
    return (*needs, "position") if posed else needs
