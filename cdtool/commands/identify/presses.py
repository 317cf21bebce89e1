"""Slow presses of an axis on a load cell: the scale of its torque, and what depends on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.base.errors import CdtoolError, ConfigurationError, RecordingError, UsageError
from cdtool.commands.identify.axis.torque_constant import TorqueScale
from cdtool.commands.identify.estimate import Estimate, Method
from cdtool.commands.identify.identifying_robot import torque_table
from cdtool.commands.judging.runs import find_logs, unread
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.results import Skipped
from cdtool.truth.onset import find_contacts
from cdtool.truth.onset_rule import OnsetRule

# Channels in the unit of the torque.
_TORQUES = ("torque", "reference_torque")


@dataclass(frozen=True)
class PressLogs:
    """Logs of an axis that presses a load cell slowly and releases it.

    `lever_arm` [m]: of a rotary axis, from its axis to the load cell.
    """

    logs: tuple[str, ...]
    lever_arm: float | None = None


@dataclass(frozen=True, eq=False)
class Presses:
    """The recordings on the load side with their first contact, and the logs that were left out."""

    recordings: Sequence[tuple[Recording, Contact]] = ()
    skipped: Sequence[Skipped] = ()
    lever_arm: float = 1.0


def read_presses(logs: PressLogs, machine_file: MachineFile) -> Presses:
    """Read logs with presses; one that cannot be read or in which the load cell shows no contact is left out.

    Raises UsageError for a rotary axis without a lever arm.
    """
    machine: Any = machine_file.machine
    is_rotary = machine.force_unit != "N"
    if is_rotary and logs.lever_arm is None:
        raise UsageError("a rotary axis needs the lever arm of its load cell", "give it in m")
    recordings, skipped = [], []
    for path in find_logs(logs.logs, Path()):
        try:
            recordings.append(_with_contact(path, machine_file))
        except CdtoolError as fault:
            skipped.append(unread(path, Path(), fault))
    return Presses(recordings, skipped, logs.lever_arm if is_rotary and logs.lever_arm is not None else 1.0)


def _with_contact(path: Path, machine_file: MachineFile) -> tuple[Recording, Contact]:
    recording = replace(read_as_logged(path, machine_file).on_load_side(machine_file.machine), name=str(path))
    contacts = find_contacts(recording, OnsetRule())
    if not contacts:
        raise RecordingError(f"{path}: the load cell shows no contact", "give logs of contacts with a load cell")
    return recording, contacts[0]


def scaled(recording: Recording, factor: float) -> Recording:
    """Return the recording of an axis with its torque and torque reference multiplied by a factor."""
    channels = dict(recording.channels)
    for name in _TORQUES:
        if name in channels:
            channels[name] = channels[name].with_values(channels[name].values * factor, channels[name].unit)
    return replace(recording, channels=channels, digest="")


def scale_estimates(found: TorqueScale, given: Mapping[str, Any]) -> list[Estimate]:
    """Return the new scales of torque and torque reference as estimates of their tables in the machine file.

    Raises ConfigurationError where the torque is mapped for several formats: which of them has the wrong scale is not
    known.
    """
    section = torque_table(given).rpartition(".")[0]
    channels: Any = given
    for name in section.split("."):
        channels = channels[name]
    estimates = []
    for name in _TORQUES:
        table = channels.get(name)
        if isinstance(table, dict):
            present = table.get("scale", 1.0)
            value = float(present[0] if isinstance(present, list) else present)
            error = abs(value) * found.standard_error
            estimates.append(Estimate(f"{section}.{name}", "scale", value * found.factor, error, "", Method.PRESSES))
        elif name == "torque":
            raise ConfigurationError(
                "torque is mapped by a name alone", 'write torque = { column = "...", unit = "..." }, which has a scale'
            )
    return estimates
